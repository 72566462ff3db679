"""Pictures of accuracy against computing time: errors of zero have a place, small pages are refused early."""

from pathlib import Path

import numpy as np
import pytest

from blocksim.errors import InvalidInputError
from blocksim.view.style import Paper
from tests.bench.peers.work_precision import (
    SMALLEST_SHARE,
    Curve,
    Panel,
    draw_work_precision,
    floor_of,
    refuse_small_page,
)


def test_zero_errors_are_drawn_at_the_floor(tmp_path: Path) -> None:
    exact = Curve("exact", "one", np.array([1.0, 2.0]), np.array([4.0, 0.0]))
    tiny = Curve("tiny", "two", np.array([1.0]), np.array([1e-12]))
    assert floor_of(Panel("", "", (exact,))) == 4.0
    assert floor_of(Panel("", "", (exact, tiny))) == pytest.approx(4.0 * SMALLEST_SHARE)
    none = Panel("", "", (Curve("none", "one", np.ones(1), np.zeros(1)),), 0.2)
    assert floor_of(none) == 0.2
    draw_work_precision([none], tmp_path / "none.png")
    assert (tmp_path / "none.png").stat().st_size > 0


def test_page_without_room_is_refused_before_anything_is_measured() -> None:
    with pytest.raises(InvalidInputError, match="too small for this picture"):
        refuse_small_page(3, Paper((6.0, 2.5)))
