"""Sizes that are no lengths, or impossible ones. Every message in full."""

# ruff: noqa: E501 - messages and scenario lines stand as they are

from collections.abc import Callable

import pytest

WIDTH = 'width = "40 mm"'

CASES = {
    "misspelt unit": (
        WIDTH,
        'width = "40 mn"',
        """
bad.toml:10: blocks.brick.width: "40 mn" is not a length: unknown unit 'mn', did you mean 'mm'?
   10 | width = "40 mn"
      |         ^^^^^^^
""",
    ),
    "misspelt unit in a quotient": (
        "density = 7850",
        'density = "7850 kg/n^3"',
        """
bad.toml:5: materials.steel.density: "7850 kg/n^3" is not a density: unknown unit 'n', did you mean 'm'?
    5 | density = "7850 kg/n^3"
      |           ^^^^^^^^^^^^^
""",
    ),
    "unit like no other": (
        WIDTH,
        'width = "40 parsecs"',
        """
bad.toml:10: blocks.brick.width: "40 parsecs" is not a length: unknown unit 'parsecs', write it as in "32 mm"
   10 | width = "40 parsecs"
      |         ^^^^^^^^^^^^
""",
    ),
    "unit missing in a text": (
        WIDTH,
        'width = "40"',
        """
bad.toml:10: blocks.brick.width: "40" is not a length: the unit is missing, write it as in "32 mm"
   10 | width = "40"
      |         ^^^^
""",
    ),
    "no number in a text": (
        WIDTH,
        'width = "wide"',
        """
bad.toml:10: blocks.brick.width: "wide" is not a length: write a number and a unit, such as "32 mm"
   10 | width = "wide"
      |         ^^^^^^
""",
    ),
    "wrong dimension": (
        WIDTH,
        'width = "40 s"',
        """
bad.toml:10: blocks.brick.width: "40 s" is a time; a length above 0 such as "32 mm" is needed
   10 | width = "40 s"
      |         ^^^^^^
""",
    ),
    "density for a unit weight": (
        "density = 7850",
        'unit_weight = "7850 kg/m^3"',
        """
bad.toml:5: materials.steel.unit_weight: "7850 kg/m^3" is a density; a unit weight above 0 such as "26.7 kN/m^3" is needed
    5 | unit_weight = "7850 kg/m^3"
      |               ^^^^^^^^^^^^^
""",
    ),
    "dimension without a name": (
        WIDTH,
        'width = "40 kg*m"',
        """
bad.toml:10: blocks.brick.width: "40 kg*m" is not a length; a length above 0 such as "32 mm" is needed
   10 | width = "40 kg*m"
      |         ^^^^^^^^^
""",
    ),
    "expression instead of a number": (
        WIDTH,
        'width = "9**9**9 m"',
        """
bad.toml:10: blocks.brick.width: "9**9**9 m" is not a length: '**9**9 m' is not a unit
   10 | width = "9**9**9 m"
      |         ^^^^^^^^^^^
""",
    ),
    "huge exponent in a unit": (
        WIDTH,
        'width = "9 m^999999999"',
        """
bad.toml:10: blocks.brick.width: "9 m^999999999" is not a length: 'm^999999999' is not a unit
   10 | width = "9 m^999999999"
      |         ^^^^^^^^^^^^^^^
""",
    ),
    "huge exponent in a number": (
        WIDTH,
        'width = "1e999999999 m"',
        """
bad.toml:10: blocks.brick.width: "1e999999999 m" is not a finite number; a length above 0 such as "32 mm" is needed
   10 | width = "1e999999999 m"
      |         ^^^^^^^^^^^^^^^
""",
    ),
    "too large for a float": (
        WIDTH,
        'width = "1e999 m"',
        """
bad.toml:10: blocks.brick.width: "1e999 m" is not a finite number; a length above 0 such as "32 mm" is needed
   10 | width = "1e999 m"
      |         ^^^^^^^^^
""",
    ),
    "overlong text": (
        WIDTH,
        'width = "' + "4" * 200 + ' mm"',
        """
bad.toml:10: blocks.brick.width: "4444444444444444444444444444444444444444…" is not a length: write a number and a unit, such as "32 mm"
   10 | width = "44444444444444444444444444444444444444444444444444444444444444444444444444444444444444444444444444444…
      |         ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^
""",
    ),
    "call in a unit": (
        WIDTH,
        "width = \"1 __import__('os')\"",
        """
bad.toml:10: blocks.brick.width: "1 __import__('os')" is not a length: "__import__('os')" is not a unit
   10 | width = "1 __import__('os')"
      |         ^^^^^^^^^^^^^^^^^^^^
""",
    ),
    "negative size": (
        WIDTH,
        'width = "-40 mm"',
        """
bad.toml:10: blocks.brick.width: "-40 mm" is too small; a length above 0 such as "32 mm" is needed
   10 | width = "-40 mm"
      |         ^^^^^^^^
""",
    ),
    "zero size": (
        WIDTH,
        "width = 0",
        """
bad.toml:10: blocks.brick.width: 0 is too small; a length above 0 such as "32 mm" is needed
   10 | width = 0
      |         ^
""",
    ),
    "size that is not finite": (
        WIDTH,
        "width = inf",
        """
bad.toml:10: blocks.brick.width: inf is not a finite number; a length above 0 such as "32 mm" is needed
   10 | width = inf
      |         ^^^
""",
    ),
    "size that is no number": (
        WIDTH,
        "width = nan",
        """
bad.toml:10: blocks.brick.width: nan is not a finite number; a length above 0 such as "32 mm" is needed
   10 | width = nan
      |         ^^^
""",
    ),
    "boolean for a number": (
        WIDTH,
        "width = true",
        """
bad.toml:10: blocks.brick.width: true is not a number; a length above 0 such as "32 mm" is needed
   10 | width = true
      |         ^^^^
""",
    ),
    "list for a number": (
        WIDTH,
        "width = [40]",
        """
bad.toml:10: blocks.brick.width: a list is not a number; a length above 0 such as "32 mm" is needed
   10 | width = [40]
      |         ^^^^
""",
    ),
    "date for a number": (
        WIDTH,
        "width = 2020-10-14",
        """
bad.toml:10: blocks.brick.width: 2020-10-14 is not a number; a length above 0 such as "32 mm" is needed
   10 | width = 2020-10-14
      |         ^^^^^^^^^^
""",
    ),
}


@pytest.mark.parametrize(("old", "new", "message"), CASES.values(), ids=CASES)
def test_quantities(
    refusal_of_edit: Callable[[str | None, str], tuple[int, str]], old: str | None, new: str, message: str
) -> None:
    assert refusal_of_edit(old, new) == (65, message.strip("\n"))
