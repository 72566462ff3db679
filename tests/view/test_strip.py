"""Strips of pictures: how many panels of which size, and where measured ranges go."""

import subprocess
import sys
from pathlib import Path

import pytest

from blocksim.view import strip
from blocksim.view.run_data import Extent
from blocksim.view.strip import Lines, arrangement, plan
from blocksim.view.style import OWN


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


def test_tilted_panels_have_room_for_the_numbers_along_the_ground() -> None:
    level, tilted = (plan(OWN, Extent(0, 400, 0, 300, tilt=tilt), 4, 8, Lines(measured_rows=1)) for tilt in (0.0, 0.3))
    below = [one.panel[1] * 72 - (300 - one.extent.lowest) * one.points_per_mm for one in (level, tilted)]
    assert below[1] - below[0] > 12.0


def test_importing_the_room_does_not_load_matplotlib() -> None:
    code = "import sys, blocksim.view; sys.exit('matplotlib' in sys.modules or 'pandas' in sys.modules)"
    root = Path(strip.__file__).parents[2]
    assert subprocess.run([sys.executable, "-c", code], cwd=root, check=False).returncode == 0
