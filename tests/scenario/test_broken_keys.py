"""Misspelt, missing and misplaced keys. Every message in full."""

from collections.abc import Callable

import pytest

WIDTH = 'width = "40 mm"'

CASES = {
    "typo at the top": (
        'name = "case"',
        'nmae = "case"',
        """
bad.toml:2: nmae: unknown key, did you mean 'name'?
    2 | nmae = "case"
      | ^^^^
""",
    ),
    "typo in a table name": (
        "[materials.steel]",
        "[material.steel]",
        """
bad.toml:4: material: unknown key, did you mean 'materials'?
    4 | [material.steel]
      |  ^^^^^^^^^^^^^^
""",
    ),
    "typo in a material": (
        "poisson_ratio = 0.3",
        "poison_ratio = 0.3",
        """
bad.toml:7: materials.steel.poison_ratio: unknown key, did you mean 'poisson_ratio'?
    7 | poison_ratio = 0.3
      | ^^^^^^^^^^^^
""",
    ),
    "typo in a block": (
        WIDTH,
        'widht = "40 mm"',
        """
bad.toml:10: blocks.brick.widht: unknown key, did you mean 'width'?
   10 | widht = "40 mm"
      | ^^^^^
""",
    ),
    "typo in a structure": (
        "count = 3",
        "cuont = 3",
        """
bad.toml:18: structures.0.cuont: unknown key, did you mean 'count'?
   18 | cuont = 3
      | ^^^^^
""",
    ),
    "beginning of a key": (
        None,
        "\n[contact]\nstiffness = 0.1\n",
        """
bad.toml:21: contact.stiffness: unknown key, did you mean 'stiffness_scale'?
   21 | stiffness = 0.1
      | ^^^^^^^^^
""",
    ),
    "typo in friction": (
        None,
        "\n[friction]\nblock_blok = 0.3\n",
        """
bad.toml:21: friction.block_blok: unknown key, did you mean 'block_block'?
   21 | block_blok = 0.3
      | ^^^^^^^^^^
""",
    ),
    "typo in a friction pair": (
        None,
        "\n[friction]\nblock_block = { static = 0.3, kinetik = 0.2 }\n",
        """
bad.toml:21: friction.block_block.kinetik: unknown key, did you mean 'kinetic'?
   21 | block_block = { static = 0.3, kinetik = 0.2 }
      |                               ^^^^^^^
""",
    ),
    "typo in a dotted key": (
        None,
        "\n[contact]\nrestitution.block_grund = 0.2\n",
        """
bad.toml:21: contact.restitution.block_grund: unknown key, did you mean 'block_ground'?
   21 | restitution.block_grund = 0.2
      | ^^^^^^^^^^^^^^^^^^^^^^^
""",
    ),
    "typo in time": (
        None,
        "\n[time]\nend = 1\nsafty = 0.1\n",
        """
bad.toml:22: time.safty: unknown key, did you mean 'safety'?
   22 | safty = 0.1
      | ^^^^^
""",
    ),
    "key of another kind of structure": (
        "count = 3",
        'count = 3\noverlap = "10 mm"',
        """
bad.toml:19: structures.0.overlap: unknown key, allowed are: block, left, bottom, \
velocity, shear_velocity, kind, count, offset
   19 | overlap = "10 mm"
      | ^^^^^^^
""",
    ),
    "key like no other": (
        None,
        '\n[ground]\ncolour = "green"\n',
        """
bad.toml:21: ground.colour: unknown key, allowed are: tilt, material, profile
   21 | colour = "green"
      | ^^^^^^
""",
    ),
    "quoted key": (
        None,
        '\n[output]\n"every frame" = true\n',
        """
bad.toml:21: output."every frame": unknown key, did you mean 'every'?
   21 | "every frame" = true
      | ^^^^^^^^^^^^^
""",
    ),
    "missing key of a block": (
        WIDTH,
        "# no width",
        """
bad.toml:9: blocks.brick.width: this key is missing: width of the block; a length above 0 such as "32 mm" is needed
    9 | [blocks.brick]
      |  ^^^^^^^^^^^^
""",
    ),
    "missing key of a structure": (
        "count = 3\n",
        "",
        """
bad.toml:15: structures.0.count: this key is missing: number of blocks
   15 | [[structures]]
      |   ^^^^^^^^^^
""",
    ),
    "missing kind of a structure": (
        'kind = "stack"',
        "# no kind",
        """
bad.toml:15: structures.0.kind: this key is missing: \
"staircase", "stack", "wall", "pyramid", "dominoes" or "grid" is needed
   15 | [[structures]]
      |   ^^^^^^^^^^
""",
    ),
    "missing schema": (
        "schema = 1",
        "# no schema",
        """
bad.toml:1: schema: this key is missing: version of the file format; 1 is needed
    1 | # no schema
      | ^^^^^^^^^^^
""",
    ),
    "no body": (
        '[[structures]]\nkind = "stack"\nblock = "brick"\ncount = 3\n',
        "",
        """
bad.toml:1: nothing to simulate: add a [[structures]] or a [[bodies]] table
    1 | schema = 1
      | ^^^^^^^^^^
""",
    ),
    "no density": (
        "density = 7850\n",
        "",
        """
bad.toml:4: materials.steel: the density is missing: give density (such as "2700 kg/m^3") or unit_weight
    4 | [materials.steel]
      |  ^^^^^^^^^^^^^^^
""",
    ),
    "a single table for a list": (
        "[[structures]]",
        "[structures]",
        """
bad.toml:15: structures: a table is not a list; write [[structures]] with double brackets
   15 | [structures]
      |  ^^^^^^^^^^
""",
    ),
    "a list for a single table": (
        None,
        "\n[[time]]\nend = 1\n",
        """
bad.toml:20: time: a list is not a table; write [time] with single brackets
   20 | [[time]]
      |   ^^^^
""",
    ),
    "a value for a table": (
        "[materials.steel]",
        "ground = 3\n[materials.steel]",
        """
bad.toml:4: ground: 3 is not a table
    4 | ground = 3
      |          ^
""",
    ),
    "several mistakes, by line": (
        'name = "case"\n\n[materials.steel]\ndensity = 7850',
        '[time]\nend = "1 m"\n\n[materials.steel]\ndensity = -1\ncolor = 3',
        """
bad.toml:1: name: this key is missing: name of the scenario and of its results folder
    1 | schema = 1
      | ^^^^^^^^^^
bad.toml:3: time.end: "1 m" is a length; a time above 0 such as "2 s" is needed
    3 | end = "1 m"
      |       ^^^^^
bad.toml:6: materials.steel.density: -1 is too small; a density above 0 such as "2700 kg/m^3" is needed
    6 | density = -1
      |           ^^
bad.toml:7: materials.steel.color: unknown key, allowed are: density, unit_weight, young_modulus, poisson_ratio
    7 | color = 3
      | ^^^^^
""",
    ),
}


@pytest.mark.parametrize(("old", "new", "message"), CASES.values(), ids=CASES)
def test_keys(
    refusal_of_edit: Callable[[str | None, str], tuple[int, str]], old: str | None, new: str, message: str
) -> None:
    assert refusal_of_edit(old, new) == (65, message.strip("\n"))
