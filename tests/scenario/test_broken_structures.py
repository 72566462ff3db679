"""Structures that cannot be built. Every message in full."""

from collections.abc import Callable

import pytest

WALL = 'kind = "wall"\nblock = "brick"\nrows = 5\ncolumns = 4\n'
GRID = 'kind = "grid"\nblock = "brick"\nrows = 2\ncolumns = 3\ngap_x = "3 mm"\ngap_y = "4 mm"\n'
DOMINOES = 'kind = "dominoes"\nblock = "brick"\ncount = 3\n'
PYRAMID = 'kind = "pyramid"\nblock = "brick"\n'

CASES = {
    "no courses": (
        WALL.replace("rows = 5", "rows = 0"),
        """
bad.toml:18: structures.0.rows: 0 is not a whole number from 1 to 100000
   18 | rows = 0
      |        ^
""",
    ),
    "no columns": (
        'kind = "wall"\nblock = "brick"\nrows = 5\n',
        """
bad.toml:15: structures.0.columns: this key is missing: number of blocks in a course
   15 | [[structures]]
      |   ^^^^^^^^^^
""",
    ),
    "too many blocks in one structure": (
        WALL.replace("5", "1001").replace("4", "1000"),
        """
bad.toml:18: structures.0.rows: 1001000 blocks are too many; a structure has at most 1000000
   18 | rows = 1001
      |        ^^^^
""",
    ),
    "pyramid of too many courses": (
        PYRAMID + "rows = 100_000\n",
        """
bad.toml:18: structures.0.rows: 5000050000 blocks are too many; a structure has at most 1000000
   18 | rows = 100_000
      |        ^^^^^^^
""",
    ),
    "unknown bond": (
        WALL + 'bond = "runing"\n',
        """
bad.toml:20: structures.0.bond: "runing" is unknown, did you mean "running"?
   20 | bond = "runing"
      |        ^^^^^^^^
""",
    ),
    "negative gap": (
        WALL + 'gap = "-1 mm"\n',
        """
bad.toml:20: structures.0.gap: "-1 mm" is too small; a length of at least 0 such as "32 mm" is needed
   20 | gap = "-1 mm"
      |       ^^^^^^^
""",
    ),
    "hole above the wall": (
        WALL + "holes = [[5, 4], [6, 1]]\n",
        """
bad.toml:20: structures.0.holes.1: [6, 1] is outside a wall of 5 rows and 4 columns
   20 | holes = [[5, 4], [6, 1]]
      |                  ^^^^^^
""",
    ),
    "hole beside the wall": (
        WALL + "holes = [[4, 5]]\n",
        """
bad.toml:20: structures.0.holes.0: [4, 5] is outside a wall of 5 rows and 4 columns
   20 | holes = [[4, 5]]
      |          ^^^^^^
""",
    ),
    "hole counted from 0": (
        WALL + "holes = [[0, 1]]\n",
        """
bad.toml:20: structures.0.holes.0.0: 0 is not a whole number from 1 to 100000
   20 | holes = [[0, 1]]
      |           ^
""",
    ),
    "hole without a column": (
        WALL + "holes = [[1]]\n",
        """
bad.toml:20: structures.0.holes.0: a list is not a hole; write [row, column], counted from 1 at the lower left
   20 | holes = [[1]]
      |          ^^^
""",
    ),
    "one hole without its list": (
        WALL + "holes = [1, 2]\n",
        """
bad.toml:20: structures.0.holes.0: 1 is not a hole; write [row, column], counted from 1 at the lower left
   20 | holes = [1, 2]
      |          ^
bad.toml:20: structures.0.holes.1: 2 is not a hole; write [row, column], counted from 1 at the lower left
   20 | holes = [1, 2]
      |             ^
""",
    ),
    "the same hole twice": (
        WALL + "holes = [[1, 1], [2, 1], [1, 1]]\n",
        """
bad.toml:20: structures.0.holes.2: [1, 1] is left out twice
   20 | holes = [[1, 1], [2, 1], [1, 1]]
      |                          ^^^^^^
""",
    ),
    "nothing but holes": (
        'kind = "wall"\nblock = "brick"\nrows = 1\ncolumns = 2\nholes = [[1, 1], [1, 2]]\n',
        """
bad.toml:20: structures.0.holes: this wall has no block left
   20 | holes = [[1, 1], [1, 2]]
      |         ^^^^^^^^^^^^^^^^
""",
    ),
    "everything missing": (
        WALL + "missing = 0.99\n",
        """
bad.toml:20: structures.0.missing: this wall has no block left
   20 | missing = 0.99
      |           ^^^^
""",
    ),
    "share above one": (
        WALL + "missing = 5\n",
        """
bad.toml:20: structures.0.missing: 5 is too large; a plain number of at least 0 and at most 1 is needed
   20 | missing = 5
      |           ^
""",
    ),
    "shifts that make neighbours overlap": (
        WALL + 'gap = "1 mm"\noffset = "0.6 mm"\n',
        """
bad.toml:21: structures.0.offset: two neighbours shifted by 0.6 mm could overlap; \
at most half of the gap, 0.5 mm, is allowed
   21 | offset = "0.6 mm"
      |          ^^^^^^^^
""",
    ),
    "seed that is negative": (
        WALL + "seed = -1\n",
        """
bad.toml:20: structures.0.seed: -1 is not a whole number from 0 to 4294967295
   20 | seed = -1
      |        ^^
""",
    ),
    "dominoes that touch": (
        DOMINOES + "spacing = 0\n",
        """
bad.toml:19: structures.0.spacing: 0 is too small; a length above 0 such as "32 mm" is needed
   19 | spacing = 0
      |           ^
""",
    ),
    "push that is a length": (
        DOMINOES + 'spacing = "9 mm"\npush = "-1 mm"\n',
        """
bad.toml:20: structures.0.push: "-1 mm" is a length; a speed such as "5 mm/s" is needed
   20 | push = "-1 mm"
      |        ^^^^^^^
""",
    ),
    "grid too narrow for its random shifts": (
        GRID + 'offset = "1.6 mm"\n',
        """
bad.toml:20: structures.0.gap_x: 3 mm is too small for such random shifts and angles; at least 3.2 mm is needed
   20 | gap_x = "3 mm"
      |         ^^^^^^
""",
    ),
    "grid too low for its random angles": (
        GRID.replace('"3 mm"', '"30 mm"') + 'turn = "90 deg"\n',
        """
bad.toml:21: structures.0.gap_y: 4 mm is too small for such random shifts and angles; at least 24.7214 mm is needed
   21 | gap_y = "4 mm"
      |         ^^^^^^
""",
    ),
    "more than half a turn": (
        GRID + 'turn = "200 deg"\n',
        """
bad.toml:22: structures.0.turn: "200 deg" is too large; an angle of at least 0 and at most 180 deg such as "20 deg" \
is needed
   22 | turn = "200 deg"
      |        ^^^^^^^^^
""",
    ),
    "one velocity for two directions": (
        WALL + "velocity = [1]\n",
        """
bad.toml:20: structures.0.velocity: this list is too short; two values are needed, one along x and one along y
   20 | velocity = [1]
      |            ^^^
""",
    ),
    "places beyond all numbers": (
        WALL + "gap = 1e308\n",
        """
bad.toml:20: structures.0.gap: 1e+308 is too large to compute with; at most 1e+30 (SI) is allowed
   20 | gap = 1e308
      |       ^^^^^
""",
    ),
    "velocity beyond all numbers": (
        WALL + "velocity = [1e308, 0]\nshear_velocity = 1e308\n",
        """
bad.toml:20: structures.0.velocity.0: 1e+308 is too large to compute with; at most 1e+30 (SI) is allowed
   20 | velocity = [1e308, 0]
      |             ^^^^^
bad.toml:21: structures.0.shear_velocity: 1e+308 is too large to compute with; at most 1e+30 (SI) is allowed
   21 | shear_velocity = 1e308
      |                  ^^^^^
""",
    ),
    "random shifts into the ground": (
        'kind = "grid"\nblock = "brick"\nrows = 1\ncolumns = 1\ngap_x = 1\ngap_y = 1\noffset = "1 mm"\n',
        """
bad.toml:15: structures.0: body 1 reaches 0.460427 mm below the ground (y = 0)
   15 | [[structures]]
      |   ^^^^^^^^^^
""",
    ),
}


@pytest.mark.parametrize(("structure", "message"), CASES.values(), ids=CASES)
def test_impossible_structures(
    refusal_of_edit: Callable[[str | None, str], tuple[int, str]], structure: str, message: str
) -> None:
    assert refusal_of_edit('kind = "stack"\nblock = "brick"\ncount = 3\n', structure) == (65, message.strip("\n"))
