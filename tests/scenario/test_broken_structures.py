"""Structures that cannot be built."""

import pytest

from tests.scenario.conftest import Refused

STACK = 'kind = "stack"\nblock = "brick"\ncount = 3\n'
WALL = 'kind = "wall"\nblock = "brick"\nrows = 5\ncolumns = 4\n'
GRID = 'kind = "grid"\nblock = "brick"\nrows = 2\ncolumns = 3\ngap_x = "3 mm"\ngap_y = "4 mm"\n'
DOMINOES = 'kind = "dominoes"\nblock = "brick"\ncount = 3\n'
PYRAMID = 'kind = "pyramid"\nblock = "brick"\n'

CASES = {
    "no courses": WALL.replace("rows = 5", "rows = 0"),
    "no columns": 'kind = "wall"\nblock = "brick"\nrows = 5\n',
    "too many blocks in one structure": WALL.replace("5", "1001").replace("4", "1000"),
    "pyramid of too many courses": PYRAMID + "rows = 100_000\n",
    "unknown bond": WALL + 'bond = "runing"\n',
    "negative gap": WALL + 'gap = "-1 mm"\n',
    "hole above the wall": WALL + "holes = [[5, 4], [6, 1]]\n",
    "hole beside the wall": WALL + "holes = [[4, 5]]\n",
    "hole counted from 0": WALL + "holes = [[0, 1]]\n",
    "hole without a column": WALL + "holes = [[1]]\n",
    "one hole without its list": WALL + "holes = [1, 2]\n",
    "the same hole twice": WALL + "holes = [[1, 1], [2, 1], [1, 1]]\n",
    "nothing but holes": 'kind = "wall"\nblock = "brick"\nrows = 1\ncolumns = 2\nholes = [[1, 1], [1, 2]]\n',
    "everything missing": WALL + "missing = 0.99\n",
    "share above one": WALL + "missing = 5\n",
    "shifts that make neighbours overlap": WALL + 'gap = "1 mm"\noffset = "0.6 mm"\n',
    "seed that is negative": WALL + "seed = -1\n",
    "dominoes that touch": DOMINOES + "spacing = 0\n",
    "push that is a length": DOMINOES + 'spacing = "9 mm"\npush = "-1 mm"\n',
    "grid too narrow for its random shifts": GRID + 'offset = "1.6 mm"\n',
    "grid too low for its random angles": GRID.replace('"3 mm"', '"30 mm"') + 'turn = "90 deg"\n',
    "more than half a turn": GRID + 'turn = "200 deg"\n',
    "one velocity for two directions": WALL + "velocity = [1]\n",
    "places beyond all numbers": WALL + "gap = 1e308\n",
    "velocity beyond all numbers": WALL + "velocity = [1e308, 0]\nshear_velocity = 1e308\n",
    "random shifts into the ground": (
        'kind = "grid"\nblock = "brick"\nrows = 1\ncolumns = 1\ngap_x = 1\ngap_y = 1\noffset = "1 mm"\n'
    ),
}


@pytest.mark.parametrize("structure", CASES.values(), ids=CASES)
def test_structures(refused: Refused, structure: str) -> None:
    refused((STACK, structure))
