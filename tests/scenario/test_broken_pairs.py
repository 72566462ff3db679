"""Pairs of materials. Every message in full."""

# ruff: noqa: E501 - messages and scenario lines stand as they are

from collections.abc import Callable

import pytest

CASES = {
    "unknown material": (
        "\n[pairs.steal.ground]\nfriction = 0.2\n",
        """
bad.toml:20: pairs.steal: unknown material "steal", did you mean 'steel'?
   20 | [pairs.steal.ground]
      |  ^^^^^^^^^^^^^^^^^^
""",
    ),
    "unknown other material": (
        "\n[pairs.steel.grond]\nfriction = 0.2\n",
        """
bad.toml:20: pairs.steel.grond: unknown material "grond", did you mean 'ground'?
   20 | [pairs.steel.grond]
      |  ^^^^^^^^^^^^^^^^^
""",
    ),
    "material like no other": (
        "\n[pairs.steel.concrete]\nfriction = 0.2\n",
        """
bad.toml:20: pairs.steel.concrete: unknown material "concrete", known: steel, ground
   20 | [pairs.steel.concrete]
      |  ^^^^^^^^^^^^^^^^^^^^
""",
    ),
    "ground with itself": (
        "\n[pairs.ground.ground]\nfriction = 0.2\n",
        """
bad.toml:20: pairs.ground.ground: the ground is not in contact with itself
   20 | [pairs.ground.ground]
      |  ^^^^^^^^^^^^^^^^^^^
""",
    ),
    "both orders": (
        "\n[pairs.steel.ground]\nfriction = 0.2\n\n[pairs.ground.steel]\nrestitution = 0.3\n",
        """
bad.toml:23: pairs.ground.steel: the same pair is given as pairs.steel.ground; keep one of the two
   23 | [pairs.ground.steel]
      |  ^^^^^^^^^^^^^^^^^^
""",
    ),
    "empty pair": (
        "\n[pairs.steel.ground]\n",
        """
bad.toml:20: pairs.steel.ground: this pair is empty; give friction, restitution, a stiffness or a damping ratio
   20 | [pairs.steel.ground]
      |  ^^^^^^^^^^^^^^^^^^
""",
    ),
    "one material only": (
        "\n[pairs.steel]\n",
        """
bad.toml:20: pairs.steel: name the other material too, as in [pairs.steel.ground]
   20 | [pairs.steel]
      |  ^^^^^^^^^^^
""",
    ),
    "one material with a value": (
        "\n[pairs.steel]\nfriction = 0.2\n",
        """
bad.toml:21: pairs.steel.friction: name the other material too, as in [pairs.steel.ground]
   21 | friction = 0.2
      | ^^^^^^^^
bad.toml:21: pairs.steel.friction: 0.2 is not a table
   21 | friction = 0.2
      |            ^^^
""",
    ),
    "value for a pair": (
        "\n[pairs]\nsteel.ground = 0.2\n",
        """
bad.toml:21: pairs.steel.ground: 0.2 is not a table
   21 | steel.ground = 0.2
      |                ^^^
""",
    ),
    "typo in a pair": (
        "\n[pairs.steel.ground]\nrestituion = 0.2\n",
        """
bad.toml:21: pairs.steel.ground.restituion: unknown key, did you mean 'restitution'?
   21 | restituion = 0.2
      | ^^^^^^^^^^
""",
    ),
    "kinetic above static": (
        "\n[pairs.steel.ground]\nfriction = { static = 0.2, kinetic = 0.3 }\n",
        """
bad.toml:21: pairs.steel.ground.friction.kinetic: kinetic friction 0.3 is above static friction 0.2
   21 | friction = { static = 0.2, kinetic = 0.3 }
      |                                      ^^^
""",
    ),
    "no static friction": (
        "\n[pairs.steel.steel.friction]\nkinetic = 0.3\n",
        """
bad.toml:20: pairs.steel.steel.friction.static: this key is missing: friction coefficient at rest; a number of at least 0 such as 0.31, or a friction angle below 90 deg such as "21 deg", is needed
   20 | [pairs.steel.steel.friction]
      |  ^^^^^^^^^^^^^^^^^^^^^^^^^^
""",
    ),
    "restitution above 1": (
        "\n[pairs.steel.ground]\nrestitution = 1.2\n",
        """
bad.toml:21: pairs.steel.ground.restitution: 1.2 is too large; a plain number of at least 0 and at most 1 is needed
   21 | restitution = 1.2
      |               ^^^
""",
    ),
    "material named ground": (
        '\n[materials.ground]\ndensity = 700\nyoung_modulus = "11 GPa"\npoisson_ratio = 0.3\n',
        """
bad.toml:20: materials.ground: "ground" means the ground in [pairs]; give this material another name
   20 | [materials.ground]
      |  ^^^^^^^^^^^^^^^^
""",
    ),
    "sweep of an unknown pair": (
        '\n[sweep]\n"pairs.steel.grund.friction.kinetic" = [0.1, 0.2]\n',
        """
bad.toml:21: sweep."pairs.steel.grund.friction.kinetic": unknown material "grund", did you mean 'ground'?
   21 | "pairs.steel.grund.friction.kinetic" = [0.1, 0.2]
      | ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^
""",
    ),
    "wrong value in a sweep": (
        '\n[pairs.steel.ground]\nfriction = 0.3\n\n[sweep]\n"pairs.steel.ground.friction.kinetic" = [0.1, -0.2]\n',
        """
bad.toml:24: sweep."pairs.steel.ground.friction.kinetic".1: -0.2 is too small; a plain number of at least 0 is needed
   24 | "pairs.steel.ground.friction.kinetic" = [0.1, -0.2]
      |                                               ^^^^
""",
    ),
    "provenance of no pair": (
        '\n[provenance]\n"pairs.steel.ground.friction" = "measured"\n',
        """
bad.toml:21: provenance."pairs.steel.ground.friction": "pairs.steel.ground.friction" is not a key of this scenario
   21 | "pairs.steel.ground.friction" = "measured"
      | ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^
""",
    ),
}


@pytest.mark.parametrize(("new", "message"), CASES.values(), ids=CASES)
def test_pairs(refusal_of_edit: Callable[[str | None, str], tuple[int, str]], new: str, message: str) -> None:
    assert refusal_of_edit(None, new) == (65, message.strip("\n"))
