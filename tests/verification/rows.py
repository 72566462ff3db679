"""Rows measured now beside the kept ones, for all schemes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from blocksim.verification.case import CaseOutcome, Row

SHARE = 0.2  # of its tolerance by which a measured number may differ from the kept one
ORDER_SHARE = 0.1  # of its bound, for a number with a lower bound only


def missed(outcome: CaseOutcome) -> list[Row]:
    return [row for row in outcome.rows if not row.is_inside]


def same_kind(kept: Row, now: Row) -> bool:
    """Return True if two rows expect the same number to the same tolerance."""
    told = (kept.quantity, kept.unit, kept.relative, kept.at_least)
    numbers = pytest.approx([now.expected, now.tolerance], rel=1e-6)
    return told == (now.quantity, now.unit, now.relative, now.at_least) and [kept.expected, kept.tolerance] == numbers


def allowed(row: Row) -> float:
    """Return by how much the kept number may differ from the one measured now."""
    if row.at_least:
        return ORDER_SHARE * row.expected
    return SHARE * row.tolerance * (abs(row.expected) if row.relative else 1.0)
