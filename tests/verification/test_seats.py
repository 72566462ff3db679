"""V25: landings on several seats."""

from __future__ import annotations

import pytest

from blocksim.verification.case import Setting
from blocksim.verification.impacts import OVERHANG, SEATS, land, seats


def test_block_leaves_several_seats_with_the_requested_restitution_and_without_spin() -> None:
    rows = list(seats(Setting()))
    assert len(rows) == 2 * len(SEATS) + 2
    assert [row.quantity for row in rows if not row.is_inside] == []


@pytest.mark.parametrize("restitution", [0.2, 0.8])
def test_hertzian_landings_on_seats_are_as_exact(restitution: float) -> None:
    for ends in SEATS.values():
        speed, spin = land(Setting(law="hertz-mindlin"), ends, restitution)
        assert speed == pytest.approx(restitution, abs=1e-3)
        assert spin == pytest.approx(0.0, abs=1e-3)
    assert OVERHANG < 1e-3
