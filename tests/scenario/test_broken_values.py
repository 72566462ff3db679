"""Values of the wrong type or outside their range. Every message in full."""

# ruff: noqa: E501 - messages and scenario lines stand as they are

from collections.abc import Callable

import pytest

CASES = {
    "text for a plain number": (
        "poisson_ratio = 0.3",
        'poisson_ratio = "0.3"',
        """
bad.toml:7: materials.steel.poisson_ratio: "0.3" is not a plain number: write a number without quotes
    7 | poisson_ratio = "0.3"
      |                 ^^^^^
""",
    ),
    "length for a plain number": (
        "poisson_ratio = 0.3",
        'poisson_ratio = "3 mm"',
        """
bad.toml:7: materials.steel.poisson_ratio: "3 mm" is a length; a plain number above -1 and below 0.5 is needed
    7 | poisson_ratio = "3 mm"
      |                 ^^^^^^
""",
    ),
    "Poisson's ratio of a liquid": (
        "poisson_ratio = 0.3",
        "poisson_ratio = 0.5",
        """
bad.toml:7: materials.steel.poisson_ratio: 0.5 is too large; a plain number above -1 and below 0.5 is needed
    7 | poisson_ratio = 0.5
      |                 ^^^
""",
    ),
    "bare angle": (
        None,
        "\n[ground]\ntilt = 30\n",
        """
bad.toml:21: ground.tilt: 30 has no unit; write "30 deg" (or "30 rad")
   21 | tilt = 30
      |        ^^
""",
    ),
    "vertical ground": (
        None,
        '\n[ground]\ntilt = "90 deg"\n',
        """
bad.toml:21: ground.tilt: "90 deg" is too large; an angle above -90 deg and below 90 deg such as "20 deg" is needed
   21 | tilt = "90 deg"
      |        ^^^^^^^^
""",
    ),
    "no substeps": (
        None,
        '\n[time]\nscheme = "nonsmooth"\nsubsteps = 0\n',
        """
bad.toml:22: time.substeps: 0 is not a whole number from 1 to 1000
   22 | substeps = 0
      |            ^
""",
    ),
    "absurd substeps": (
        None,
        '\n[time]\nscheme = "nonsmooth"\nsubsteps = 1001\n',
        """
bad.toml:22: time.substeps: 1001 is not a whole number from 1 to 1000
   22 | substeps = 1001
      |            ^^^^
""",
    ),
    "half a sweep": (
        None,
        '\n[time]\nscheme = "nonsmooth"\nvelocity_sweeps = 0.5\n',
        """
bad.toml:22: time.velocity_sweeps: 0.5 is not a whole number from 1 to 1000000
   22 | velocity_sweeps = 0.5
      |                   ^^^
""",
    ),
    "tolerance below round-off": (
        None,
        '\n[time]\nscheme = "nonsmooth"\nvelocity_tolerance = 1e-15\n',
        """
bad.toml:22: time.velocity_tolerance: 1e-15 is too small; a speed of at least 1e-12 m/s such as "5 mm/s" is needed
   22 | velocity_tolerance = 1e-15
      |                      ^^^^^
""",
    ),
    "restitution that creates energy": (
        None,
        '\n[contact]\nrestitution = 1.1\n[time]\nscheme = "nonsmooth"\n',
        """
bad.toml:21: contact.restitution: 1.1 is too large; a plain number of at least 0 and at most 1 is needed
   21 | restitution = 1.1
      |               ^^^
""",
    ),
    "friction angle of 90 degrees": (
        None,
        '\n[friction]\nblock_ground = "90 deg"\n',
        """
bad.toml:21: friction.block_ground: "90 deg" is too large; an angle of at least 0 and below 90 deg such as "20 deg" is needed
   21 | block_ground = "90 deg"
      |                ^^^^^^^^
""",
    ),
    "negative friction": (
        None,
        "\n[friction]\nblock_ground = -0.1\n",
        """
bad.toml:21: friction.block_ground: -0.1 is too small; a plain number of at least 0 is needed
   21 | block_ground = -0.1
      |                ^^^^
""",
    ),
    "boolean for friction": (
        None,
        "\n[friction]\nblock_ground = true\n",
        """
bad.toml:21: friction.block_ground: true is not a friction coefficient; write a number, an angle, or { static, kinetic }
   21 | block_ground = true
      |                ^^^^
""",
    ),
    "restitution above 1": (
        None,
        "\n[contact]\nrestitution = 1.5\n",
        """
bad.toml:21: contact.restitution: 1.5 is too large; a plain number of at least 0 and at most 1 is needed
   21 | restitution = 1.5
      |               ^^^
""",
    ),
    "restitution as a text": (
        None,
        '\n[contact]\nrestitution = "high"\n',
        """
bad.toml:21: contact.restitution: "high" is not a restitution; write a number or { block_block, block_ground }
   21 | restitution = "high"
      |               ^^^^^^
""",
    ),
    "number of blocks that is not whole": (
        "count = 3",
        "count = 3.5",
        """
bad.toml:18: structures.0.count: 3.5 is not a whole number from 1 to 100000
   18 | count = 3.5
      |         ^^^
""",
    ),
    "no blocks": (
        "count = 3",
        "count = 0",
        """
bad.toml:18: structures.0.count: 0 is not a whole number from 1 to 100000
   18 | count = 0
      |         ^
""",
    ),
    "boolean for a count": (
        "count = 3",
        "count = true",
        """
bad.toml:18: structures.0.count: true is not a whole number from 1 to 100000
   18 | count = true
      |         ^^^^
""",
    ),
    "number for a boolean": (
        None,
        "\n[time]\nstop_at_rest = 1\n",
        """
bad.toml:21: time.stop_at_rest: 1 is neither true nor false
   21 | stop_at_rest = 1
      |                ^
""",
    ),
    "word for a time step": (
        None,
        '\n[time]\nstep = "fast"\n',
        """
bad.toml:21: time.step: "fast" is not a time step; use "auto" or a time above 0 such as "2 s"
   21 | step = "fast"
      |        ^^^^^^
""",
    ),
    "time step of zero": (
        None,
        '\n[time]\nstep = "0 s"\n',
        """
bad.toml:21: time.step: "0 s" is too small; a time above 0 such as "2 s" is needed
   21 | step = "0 s"
      |        ^^^^^
""",
    ),
    "safety above 0.1": (
        None,
        "\n[time]\nsafety = 2\n",
        """
bad.toml:21: time.safety: 2 is too large; a plain number above 0 and at most 0.1 is needed
   21 | safety = 2
      |          ^
""",
    ),
    "velocity with one part": (
        None,
        '\n[[bodies]]\nblock = "brick"\nx = 1\ny = 1\nvelocity = ["1 m/s"]\n',
        """
bad.toml:24: bodies.0.velocity: this list is too short; two values are needed, one along x and one along y
   24 | velocity = ["1 m/s"]
      |            ^^^^^^^^^
""",
    ),
    "velocity with three parts": (
        None,
        '\n[[bodies]]\nblock = "brick"\nx = 1\ny = 1\nvelocity = [0, 0, 0]\n',
        """
bad.toml:24: bodies.0.velocity: this list is too long; two values are needed, one along x and one along y
   24 | velocity = [0, 0, 0]
      |            ^^^^^^^^^
""",
    ),
    "unit in one part of a velocity": (
        None,
        '\n[[bodies]]\nblock = "brick"\nx = 1\ny = 1\nvelocity = [\n    0,\n    "1 m",\n]\n',
        """
bad.toml:26: bodies.0.velocity.1: "1 m" is a length; a speed such as "5 mm/s" is needed
   26 |     "1 m",
      |     ^^^^^
""",
    ),
    "wrong schema version": (
        "schema = 1",
        "schema = 2",
        """
bad.toml:1: schema: 2 is unknown, use 1
    1 | schema = 2
      |          ^
""",
    ),
    "boolean for the schema version": (
        "schema = 1",
        "schema = true",
        """
bad.toml:1: schema: true is unknown, use 1
    1 | schema = true
      |          ^^^^
""",
    ),
    "name with a slash": (
        'name = "case"',
        'name = "../case"',
        """
bad.toml:2: name: "../case" is not a name; 1 to 100 of a-z A-Z 0-9 . _ - are allowed, no . or - first
    2 | name = "../case"
      |        ^^^^^^^^^
""",
    ),
    "number for a name": (
        'name = "case"',
        "name = 7",
        """
bad.toml:2: name: 7 is not a string in quotes
    2 | name = 7
      |        ^
""",
    ),
    "empty name": (
        'name = "case"',
        'name = ""',
        """
bad.toml:2: name: "" is not a name; 1 to 100 of a-z A-Z 0-9 . _ - are allowed, no . or - first
    2 | name = ""
      |        ^^
""",
    ),
}


@pytest.mark.parametrize(("old", "new", "message"), CASES.values(), ids=CASES)
def test_values(
    refusal_of_edit: Callable[[str | None, str], tuple[int, str]], old: str | None, new: str, message: str
) -> None:
    assert refusal_of_edit(old, new) == (65, message.strip("\n"))
