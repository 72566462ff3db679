"""Ground profiles, walls, and blocks inside them. Every message in full."""

# ruff: noqa: E501 - messages and scenario lines stand as they are

from collections.abc import Callable

import pytest

CASES = {
    "one point": (
        "\n[ground]\nprofile = [[0, 0]]\n",
        """
bad.toml:21: ground.profile: a profile needs at least two points [x, y]
   21 | profile = [[0, 0]]
      |           ^^^^^^^^
""",
    ),
    "no list": (
        '\n[ground]\nprofile = "flat"\n',
        """
bad.toml:21: ground.profile: "flat" is not a list
   21 | profile = "flat"
      |           ^^^^^^
""",
    ),
    "table for a list": (
        "\n[ground]\nprofile = { x = 1 }\n",
        """
bad.toml:21: ground.profile: a table is not a list
   21 | profile = { x = 1 }
      |           ^^^^^^^^^
""",
    ),
    "numbers for points": (
        "\n[ground]\nprofile = [0, 1]\n",
        """
bad.toml:21: ground.profile.0: 0 is not a list
   21 | profile = [0, 1]
      |            ^
bad.toml:21: ground.profile.1: 1 is not a list
   21 | profile = [0, 1]
      |               ^
""",
    ),
    "point without y": (
        "\n[ground]\nprofile = [[0, 0], [1]]\n",
        """
bad.toml:21: ground.profile.1: this list is too short; two values are needed, one along x and one along y
   21 | profile = [[0, 0], [1]]
      |                    ^^^
""",
    ),
    "point with three numbers": (
        "\n[ground]\nprofile = [[0, 0], [1, 0, 2]]\n",
        """
bad.toml:21: ground.profile.1: this list is too long; two values are needed, one along x and one along y
   21 | profile = [[0, 0], [1, 0, 2]]
      |                    ^^^^^^^^^
""",
    ),
    "time for a height": (
        '\n[ground]\nprofile = [[0, 0], [1, "1 s"]]\n',
        """
bad.toml:21: ground.profile.1.1: "1 s" is a time; a length such as "32 mm" is needed
   21 | profile = [[0, 0], [1, "1 s"]]
      |                        ^^^^^
""",
    ),
    "not a number": (
        "\n[ground]\nprofile = [[0, nan], [1, 0]]\n",
        """
bad.toml:21: ground.profile.0.1: nan is not a finite number; a length such as "32 mm" is needed
   21 | profile = [[0, nan], [1, 0]]
      |                ^^^
""",
    ),
    "x goes back": (
        "\n[ground]\nprofile = [\n    [0, 0],\n    [1, 0],\n    [0.5, 1],\n]\n",
        """
bad.toml:24: ground.profile.2: x goes back from 1 m to 0.5 m; a profile runs towards +x
   24 |     [0.5, 1],
      |     ^^^^^^^^
""",
    ),
    "a point twice": (
        "\n[ground]\nprofile = [[0, 0], [1, 0], [1, 0], [2, 0]]\n",
        """
bad.toml:21: ground.profile.2: the same point as the one before
   21 | profile = [[0, 0], [1, 0], [1, 0], [2, 0]]
      |                            ^^^^^^
""",
    ),
    "back down its own riser": (
        "\n[ground]\nprofile = [[1, 0], [1, 0.5], [1, 0.2]]\n",
        """
bad.toml:21: ground.profile.2: the profile goes back over its own vertical segment
   21 | profile = [[1, 0], [1, 0.5], [1, 0.2]]
      |                              ^^^^^^^^
""",
    ),
    "too short a piece": (
        '\n[ground]\nprofile = [[1, 0], [2, -1], ["2.0001 m", -1]]\n',
        """
bad.toml:21: ground.profile.2: this segment is only 0.1 mm long; at least 0.2 mm is needed, 1 % of the smallest side of a block
   21 | profile = [[1, 0], [2, -1], ["2.0001 m", -1]]
      |                             ^^^^^^^^^^^^^^^^
""",
    ),
    "block in the profile": (
        '\n[ground]\nprofile = [[0, "5 mm"], [1, "5 mm"]]\n',
        """
bad.toml:15: structures.0: body 1 reaches 5 mm into the ground's profile
   15 | [[structures]]
      |   ^^^^^^^^^^
""",
    ),
    "block on the tip of the profile": (
        '\n[ground]\nprofile = [[-1, 0], ["20 mm", "1 mm"], [1, 0]]\n',
        """
bad.toml:15: structures.0: body 1 reaches 1 mm into the ground's profile
   15 | [[structures]]
      |   ^^^^^^^^^^
""",
    ),
    "blocks across a riser": (
        '\n[ground]\nprofile = [["39 mm", 0], ["39 mm", "30 mm"]]\n',
        """
bad.toml:15: structures.0: body 1 reaches 1 mm into the ground's profile
   15 | [[structures]]
      |   ^^^^^^^^^^
bad.toml:15: structures.0: body 2 reaches 1 mm into the ground's profile
   15 | [[structures]]
      |   ^^^^^^^^^^
""",
    ),
    "blocks below the profile": (
        "\n[ground]\nprofile = [[0, 1], [1, 1]]\n",
        """
bad.toml:15: structures.0: body 1 lies below the ground's profile
   15 | [[structures]]
      |   ^^^^^^^^^^
bad.toml:15: structures.0: body 2 lies below the ground's profile
   15 | [[structures]]
      |   ^^^^^^^^^^
bad.toml:15: structures.0: body 3 lies below the ground's profile
   15 | [[structures]]
      |   ^^^^^^^^^^
""",
    ),
    "wall without an end": (
        "\n[[walls]]\nfrom = [0.1, 0]\n",
        """
bad.toml:20: walls.0.to: this key is missing: [x, y] of its end
   20 | [[walls]]
      |   ^^^^^
""",
    ),
    "wall of no length": (
        "\n[[walls]]\nfrom = [0.1, 0]\nto = [0.1, 0]\n",
        """
bad.toml:22: walls.0.to: start and end of a wall must differ
   22 | to = [0.1, 0]
      |      ^^^^^^^^
""",
    ),
    "wall of an unknown material": (
        '\n[[walls]]\nfrom = [0.1, 0]\nto = [0.1, 1]\nmaterial = "stele"\n',
        """
bad.toml:23: walls.0.material: unknown material "stele", did you mean 'steel'?
   23 | material = "stele"
      |            ^^^^^^^
""",
    ),
    "too short a wall": (
        '\n[[walls]]\nfrom = [0.1, 0]\nto = [0.1, "0.1 mm"]\n',
        """
bad.toml:20: walls.0: this segment is only 0.1 mm long; at least 0.2 mm is needed, 1 % of the smallest side of a block
   20 | [[walls]]
      |   ^^^^^
""",
    ),
    "typo in a wall": (
        "\n[[walls]]\nfrm = [0.1, 0]\nto = [0.1, 1]\n",
        """
bad.toml:21: walls.0.frm: unknown key, did you mean 'from'?
   21 | frm = [0.1, 0]
      | ^^^
""",
    ),
    "single table of walls": (
        "\n[walls]\nfrom = [0.1, 0]\nto = [0.1, 1]\n",
        """
bad.toml:20: walls: a table is not a list; write [[walls]] with double brackets
   20 | [walls]
      |  ^^^^^
""",
    ),
    "blocks in a wall": (
        '\n[[walls]]\nfrom = ["39 mm", "-1 m"]\nto = ["39 mm", "30 mm"]\n',
        """
bad.toml:15: structures.0: body 1 and walls.0 overlap by 1 mm; they may only touch
   15 | [[structures]]
      |   ^^^^^^^^^^
bad.toml:15: structures.0: body 2 and walls.0 overlap by 1 mm; they may only touch
   15 | [[structures]]
      |   ^^^^^^^^^^
""",
    ),
    "tip of a wall in a block": (
        '\n[[walls]]\nfrom = ["20 mm", "0 mm"]\nto = ["20 mm", "0.5 mm"]\n',
        """
bad.toml:15: structures.0: body 1 and walls.0 overlap by 0.5 mm; they may only touch
   15 | [[structures]]
      |   ^^^^^^^^^^
""",
    ),
}


@pytest.mark.parametrize(("new", "message"), CASES.values(), ids=CASES)
def test_boundary(refusal_of_edit: Callable[[str | None, str], tuple[int, str]], new: str, message: str) -> None:
    assert refusal_of_edit(None, new) == (65, message.strip("\n"))
