"""Numbers as text: what comes back, and how far it is off."""

import numpy as np
import pytest

from blocksim.view.report import player
from blocksim.view.report.player import pack
from tests.view.report.folders import numbers


@pytest.mark.parametrize(("most", "kind"), [(1000, "f4"), (10, "u2")])
def test_told_error_is_the_largest_one(monkeypatch: pytest.MonkeyPatch, most: int, kind: str) -> None:
    values = np.random.default_rng(1).normal(0.0, 100.0, (50, 7))
    monkeypatch.setattr(player, "EXACT_VALUES", most)
    part, error = pack(values)
    assert part["type"] == kind
    assert np.abs(numbers(part) - values.ravel()).max() == pytest.approx(error)
    assert error <= 0.5 * np.ptp(values) / 65_535 * (1.0 + 1e-9)


def test_equal_values_can_be_rounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(player, "EXACT_VALUES", 0)
    part, error = pack(np.full((3, 2), 4.5))
    assert numbers(part).tolist() == [4.5] * 6
    assert error == 0.0
