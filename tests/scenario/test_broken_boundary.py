"""Ground profiles, walls, and blocks inside them."""

import pytest

from tests.scenario.conftest import Edit, Refused

CASES = {
    "one point": "[ground]\nprofile = [[0, 0]]",
    "no list": '[ground]\nprofile = "flat"',
    "table for a list": "[ground]\nprofile = { x = 1 }",
    "numbers for points": "[ground]\nprofile = [0, 1]",
    "point without y": "[ground]\nprofile = [[0, 0], [1]]",
    "point with three numbers": "[ground]\nprofile = [[0, 0], [1, 0, 2]]",
    "time for a height": '[ground]\nprofile = [[0, 0], [1, "1 s"]]',
    "not a number": "[ground]\nprofile = [[0, nan], [1, 0]]",
    "x goes back": "[ground]\nprofile = [\n    [0, 0],\n    [1, 0],\n    [0.5, 1],\n]",
    "a point twice": "[ground]\nprofile = [[0, 0], [1, 0], [1, 0], [2, 0]]",
    "back down its own riser": "[ground]\nprofile = [[1, 0], [1, 0.5], [1, 0.2]]",
    "too short a piece": '[ground]\nprofile = [[1, 0], [2, -1], ["2.0001 m", -1]]',
    "block in the profile": '[ground]\nprofile = [[0, "5 mm"], [1, "5 mm"]]',
    "block on the tip of the profile": '[ground]\nprofile = [[-1, 0], ["20 mm", "1 mm"], [1, 0]]',
    "blocks across a riser": '[ground]\nprofile = [["39 mm", 0], ["39 mm", "30 mm"]]',
    "blocks below the profile": "[ground]\nprofile = [[0, 1], [1, 1]]",
    "wall without an end": "[[walls]]\nfrom = [0.1, 0]",
    "wall of no length": "[[walls]]\nfrom = [0.1, 0]\nto = [0.1, 0]",
    "wall of an unknown material": '[[walls]]\nfrom = [0.1, 0]\nto = [0.1, 1]\nmaterial = "stele"',
    "too short a wall": '[[walls]]\nfrom = [0.1, 0]\nto = [0.1, "0.1 mm"]',
    "typo in a wall": "[[walls]]\nfrm = [0.1, 0]\nto = [0.1, 1]",
    "single table of walls": "[walls]\nfrom = [0.1, 0]\nto = [0.1, 1]",
    "blocks in a wall": '[[walls]]\nfrom = ["39 mm", "-1 m"]\nto = ["39 mm", "30 mm"]',
    "tip of a wall in a block": '[[walls]]\nfrom = ["20 mm", "0 mm"]\nto = ["20 mm", "0.5 mm"]',
}


@pytest.mark.parametrize("edit", CASES.values(), ids=CASES)
def test_boundary(refused: Refused, edit: Edit) -> None:
    refused(edit)
