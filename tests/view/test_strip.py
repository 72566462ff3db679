"""Strips of pictures: how many panels of which size, and where measured ranges go."""

import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from blocksim.view import final, strip
from blocksim.view.final import ranges_of, widen
from blocksim.view.run_data import Extent
from blocksim.view.strip import Lines, arrangement, plan
from blocksim.view.style import OWN


def table(**ranges: tuple[float, float, float]) -> list[SimpleNamespace]:
    """Return measured centres (mm) of blocks: smallest, mean and largest."""
    rows = [
        SimpleNamespace(block=block[1:], quantity="x", mean=mean, minimum=minimum, maximum=maximum)
        for block, (minimum, mean, maximum) in ranges.items()
    ]
    return [*rows, SimpleNamespace(block="1", quantity="rotation", mean=0.0)]


@pytest.mark.parametrize(
    ("extent", "readable", "expected"),
    [
        (Extent(0, 160, 0, 150), 0.0, (4, 8)),
        (Extent(0, 500, 0, 100), 0.0, (2, 8)),
        (Extent(0, 900, 0, 50), 0.0, (1, 6)),
        (Extent(0, 800, 0, 400), 0.3, (2, 8)),  # names need larger panels
        (Extent(0, 800, 0, 400), 0.1, (4, 8)),  # readable as it is
        (Extent(0, 800, 0, 400), 5.0, (4, 8)),  # not readable either way
        (Extent(0, 400, 0, 400), 0.5, (4, 8)),
    ],
)
def test_long_scenes_and_small_names_get_fewer_columns(
    extent: Extent, readable: float, expected: tuple[int, int]
) -> None:
    assert arrangement(extent, readable=readable) == expected


@pytest.mark.parametrize("extent", [Extent(0, 160, -5, 150), Extent(0, 900, -2, 50), Extent(-200, 300, -5, 2000)])
def test_panels_share_one_scale_and_do_not_overlap(extent: Extent) -> None:
    layout = plan(OWN, extent, *arrangement(extent), Lines(measured_rows=2))
    assert layout.panel[0] * 72 / layout.extent.width == pytest.approx(layout.points_per_mm)
    boxes = [layout.place(index) for index in range(layout.rows * layout.columns)]
    for index, (left, bottom, width, height) in enumerate(boxes):
        assert min(left, bottom) > 0.0
        assert left + width < layout.size[0]
        assert bottom + height < layout.size[1]
        for other_left, other_bottom, *_ in boxes[index + 1 :]:
            assert other_left >= left + width or other_bottom + height <= bottom


def test_tilted_panels_have_room_for_the_numbers_along_the_ground() -> None:
    level, tilted = (plan(OWN, Extent(0, 400, 0, 300, tilt=tilt), 4, 8, Lines(measured_rows=1)) for tilt in (0.0, 0.3))
    below = [one.panel[1] * 72 - (300 - one.extent.lowest) * one.points_per_mm for one in (level, tilted)]
    assert below[1] - below[0] > 12.0


def test_importing_the_room_does_not_load_matplotlib() -> None:
    code = "import sys, blocksim.view; sys.exit('matplotlib' in sys.modules or 'pandas' in sys.modules)"
    root = Path(strip.__file__).parents[2]
    assert subprocess.run([sys.executable, "-c", code], cwd=root, check=False).returncode == 0


def test_overlapping_measured_ranges_get_rows_of_their_own() -> None:
    measured = table(b3=(100.0, 110.0, 120.0), b1=(0.0, 5.0, 10.0), b2=(8.0, 20.0, 30.0), b9=(0.0, 1.0, 2.0))
    ranges = ranges_of(measured, ("1", "2", "3"), width=150.0)
    assert {item.block: item.row for item in ranges} == {"1": 0, "2": 1, "3": 0}


def test_a_scene_is_widened_to_hold_what_was_measured_and_a_tower_s_caption() -> None:
    wide = widen(Extent(0.0, 100.0, 0.0, 100.0), ranges_of(table(b1=(-50.0, 5.0, 400.0)), ("1",), width=100.0))
    assert wide.left < -50.0
    assert wide.right > 400.0
    tower = widen(Extent(0.0, 30.0, 0.0, 1000.0), [])
    assert tower.width == pytest.approx(final.NARROWEST * 1000.0)
