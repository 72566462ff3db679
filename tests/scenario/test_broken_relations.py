"""Values that are fine by themselves and do not go together. Every message in full."""

from collections.abc import Callable

import pytest

WIDTH = 'width = "40 mm"'

CASES = {
    "density and unit weight": (
        "density = 7850",
        'density = 7850\nunit_weight = "77 kN/m^3"',
        """
bad.toml:6: materials.steel.unit_weight: density and unit_weight are both given; keep one of them
    6 | unit_weight = "77 kN/m^3"
      |               ^^^^^^^^^^^
""",
    ),
    "upright and along the same": (
        'material = "steel"',
        'material = "steel"\nupright = "length"\nalong = "length"',
        """
bad.toml:15: blocks.brick.along: "length" already stands upright; "width" or "height" can lie along x
   15 | along = "length"
      |         ^^^^^^^^
""",
    ),
    "unknown side": (
        'material = "steel"',
        'material = "steel"\nupright = "hight"',
        """
bad.toml:14: blocks.brick.upright: "hight" is unknown, did you mean "height"?
   14 | upright = "hight"
      |           ^^^^^^^
""",
    ),
    "kinetic above static": (
        None,
        "\n[friction.block_block]\nstatic = 0.2\nkinetic = 0.3\n",
        """
bad.toml:22: friction.block_block.kinetic: kinetic friction 0.3 is above static friction 0.2
   22 | kinetic = 0.3
      |           ^^^
""",
    ),
    "unknown material": (
        'material = "steel"',
        'material = "steal"',
        """
bad.toml:13: blocks.brick.material: unknown material "steal", did you mean 'steel'?
   13 | material = "steal"
      |            ^^^^^^^
""",
    ),
    "unknown material of the ground": (
        None,
        '\n[ground]\nmaterial = "granite"\n',
        """
bad.toml:21: ground.material: unknown material "granite", known: steel
   21 | material = "granite"
      |            ^^^^^^^^^
""",
    ),
    "unknown block": (
        'block = "brick"',
        'block = "stone"',
        """
bad.toml:17: structures.0.block: unknown block "stone", known: brick
   17 | block = "stone"
      |         ^^^^^^^
""",
    ),
    "unknown kind of structure": (
        'kind = "stack"',
        'kind = "cathedral"',
        """
bad.toml:16: structures.0.kind: unknown structure kind "cathedral"; choose \
"staircase", "stack", "wall", "pyramid", "dominoes" or "grid"
   16 | kind = "cathedral"
      |        ^^^^^^^^^^^
""",
    ),
    "misspelt kind of structure": (
        'kind = "stack"',
        'kind = "stak"',
        """
bad.toml:16: structures.0.kind: unknown structure kind "stak"; did you mean 'stack'?
   16 | kind = "stak"
      |        ^^^^^^
""",
    ),
    "unknown contact law": (
        None,
        '\n[contact]\nlaw = "lineal"\n',
        """
bad.toml:21: contact.law: "lineal" is unknown, did you mean "linear"?
   21 | law = "lineal"
      |       ^^^^^^^^
""",
    ),
    "key of the other scheme": (
        None,
        '\n[time]\nscheme = "nonsmooth"\nsafety = 0.1\n',
        """
bad.toml:22: time.safety: this key belongs to scheme "explicit"; the scheme here is "nonsmooth"
   22 | safety = 0.1
      | ^^^^^^
""",
    ),
    "key of the other scheme, which is the usual one": (
        None,
        "\n[time]\nsubsteps = 4\n",
        """
bad.toml:21: time.substeps: this key belongs to scheme "nonsmooth"; the scheme here is "explicit"
   21 | substeps = 4
      | ^^^^^^^^
""",
    ),
    "no scheme": (
        None,
        '\n[time]\nscheme = "nonsmoth"\n',
        """
bad.toml:21: time.scheme: "nonsmoth" is unknown, did you mean "nonsmooth"?
   21 | scheme = "nonsmoth"
      |          ^^^^^^^^^^
""",
    ),
    "misspelt scheme, whose keys are judged as those that are meant": (
        None,
        '\n[time]\nscheme = "non-smooth"\nsubstep = 4\nvelocity_tolerance = "1 mm/s"\nsafety = 0.1\n',
        """
bad.toml:21: time.scheme: "non-smooth" is unknown, did you mean "nonsmooth"?
   21 | scheme = "non-smooth"
      |          ^^^^^^^^^^^^
bad.toml:22: time.substep: unknown key, did you mean 'substeps'?
   22 | substep = 4
      | ^^^^^^^
bad.toml:24: time.safety: this key belongs to scheme "explicit"; the scheme here is "nonsmooth"
   24 | safety = 0.1
      | ^^^^^^
""",
    ),
    "model of springs with rigid contacts": (
        None,
        '\n[contact]\nmodel = "particles"\n[time]\nscheme = "nonsmooth"\n',
        """
bad.toml:21: contact.model: "particles" needs springs, time.scheme = "explicit"; here contacts are rigid
   21 | model = "particles"
      |         ^^^^^^^^^^^
""",
    ),
    "law of springs with rigid contacts": (
        None,
        '\n[contact]\nlaw = "hertz-mindlin"\n[time]\nscheme = "nonsmooth"\n',
        """
bad.toml:21: contact.law: "hertz-mindlin" needs springs, time.scheme = "explicit"; here contacts are rigid
   21 | law = "hertz-mindlin"
      |       ^^^^^^^^^^^^^^^
""",
    ),
    "overlap longer than the block": (
        'kind = "stack"\nblock = "brick"\ncount = 3',
        'kind = "staircase"\nblock = "brick"\ncount = 3\noverlap = "41 mm"',
        """
bad.toml:19: structures.0.overlap: 41 mm is more than the block's 40 mm along x
   19 | overlap = "41 mm"
      |           ^^^^^^^
""",
    ),
    "body inside a stack": (
        None,
        '\n[[bodies]]\nblock = "brick"\nx = "45 mm"\ny = "15 mm"\n',
        """
bad.toml:20: bodies.0: bodies 1 and 4 overlap by 15 mm; they may only touch
   20 | [[bodies]]
      |   ^^^^^^
bad.toml:20: bodies.0: bodies 2 and 4 overlap by 5 mm; they may only touch
   20 | [[bodies]]
      |   ^^^^^^
""",
    ),
    "tilted body overlapping": (
        None,
        '\n[[bodies]]\nblock = "brick"\nx = "60 mm"\ny = "40 mm"\nangle = "45 deg"\n',
        """
bad.toml:20: bodies.0: bodies 2 and 4 overlap by 1.2132 mm; they may only touch
   20 | [[bodies]]
      |   ^^^^^^
""",
    ),
    "body below the ground": (
        None,
        '\n[[bodies]]\nblock = "brick"\nx = "1 m"\ny = "9 mm"\n',
        """
bad.toml:20: bodies.0: body 4 reaches 1 mm below the ground (y = 0)
   20 | [[bodies]]
      |   ^^^^^^
""",
    ),
    "corner below the ground": (
        None,
        '\n[[bodies]]\nblock = "brick"\nx = "1 m"\ny = "10 mm"\nangle = "1 deg"\n',
        """
bad.toml:20: bodies.0: body 4 reaches 0.347525 mm below the ground (y = 0)
   20 | [[bodies]]
      |   ^^^^^^
""",
    ),
    "two structures in one place": (
        None,
        '\n[[structures]]\nkind = "stack"\nblock = "brick"\ncount = 1\nleft = "30 mm"\n',
        """
bad.toml:20: structures.1: bodies 1 and 4 overlap by 10 mm; they may only touch
   20 | [[structures]]
      |   ^^^^^^^^^^
""",
    ),
    "body named like another's number": (
        None,
        '\n[[bodies]]\nblock = "brick"\nx = "1 m"\ny = "1 m"\nname = "2"\n',
        """
bad.toml:24: bodies.0.name: two bodies are named "2"; a body without a name is called by its number
   24 | name = "2"
      |        ^^^
""",
    ),
    "fixed body that moves": (
        None,
        '\n[[bodies]]\nblock = "brick"\nx = "1 m"\ny = "1 m"\nspin = "1 rad/s"\nfixed = true\n',
        """
bad.toml:25: bodies.0.fixed: a fixed body cannot have a velocity or a spin
   25 | fixed = true
      |         ^^^^
""",
    ),
    "too many bodies": (
        "count = 3",
        'count = 1\n[[structures]]\nkind = "wall"\nblock = "brick"\nrows = 1000\ncolumns = 1000',
        """
bad.toml:15: structures: 1000001 bodies are too many; at most 1000000 are allowed
   15 | [[structures]]
      |   ^^^^^^^^^^
""",
    ),
    "mass beyond all numbers": (
        WIDTH,
        "width = 1e308",
        """
bad.toml:10: blocks.brick.width: 1e+308 is too large to compute with; at most 1e+30 (SI) is allowed
   10 | width = 1e308
      |         ^^^^^
""",
    ),
}


@pytest.mark.parametrize(("old", "new", "message"), CASES.values(), ids=CASES)
def test_relations(
    refusal_of_edit: Callable[[str | None, str], tuple[int, str]], old: str | None, new: str, message: str
) -> None:
    assert refusal_of_edit(old, new) == (65, message.strip("\n"))
