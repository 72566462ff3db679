"""Misspelt, missing and misplaced keys, and keys that do not go together."""

import pytest

from tests.scenario.conftest import Edit, Refused

WIDTH = 'width = "40 mm"'

KEYS = {
    "typo at the top": ('name = "case"', 'nmae = "case"'),
    "typo in a table name": ("[materials.steel]", "[material.steel]"),
    "typo in a material": ("poisson_ratio = 0.3", "poison_ratio = 0.3"),
    "typo in a block": (WIDTH, 'widht = "40 mm"'),
    "typo in a structure": ("count = 3", "cuont = 3"),
    "beginning of a key": "[contact]\nstiffness = 0.1",
    "typo in friction": "[friction]\nblock_blok = 0.3",
    "typo in a friction pair": "[friction]\nblock_block = { static = 0.3, kinetik = 0.2 }",
    "typo in a dotted key": "[contact]\nrestitution.block_grund = 0.2",
    "typo in time": "[time]\nend = 1\nsafty = 0.1",
    "key of another kind of structure": ("count = 3", 'count = 3\noverlap = "10 mm"'),
    "key like no other": '[ground]\ncolour = "green"',
    "quoted key": '[output]\n"every frame" = true',
    "missing key of a block": (WIDTH, "# no width"),
    "missing key of a structure": ("count = 3\n", ""),
    "missing kind of a structure": ('kind = "stack"', "# no kind"),
    "missing schema": ("schema = 1", "# no schema"),
    "no body": ('[[structures]]\nkind = "stack"\nblock = "brick"\ncount = 3\n', ""),
    "no density": ("density = 7850\n", ""),
    "a single table for a list": ("[[structures]]", "[structures]"),
    "a list for a single table": "[[time]]\nend = 1",
    "a value for a table": ("[materials.steel]", "ground = 3\n[materials.steel]"),
    "several mistakes, by line": (
        'name = "case"\n\n[materials.steel]\ndensity = 7850',
        '[time]\nend = "1 m"\n\n[materials.steel]\ndensity = -1\ncolor = 3',
    ),
}


@pytest.mark.parametrize("edit", KEYS.values(), ids=KEYS)
def test_keys(refused: Refused, edit: Edit) -> None:
    refused(edit)


RELATIONS = {
    "density and unit weight": ("density = 7850", 'density = 7850\nunit_weight = "77 kN/m^3"'),
    "upright and along the same": ('material = "steel"', 'material = "steel"\nupright = "length"\nalong = "length"'),
    "unknown side": ('material = "steel"', 'material = "steel"\nupright = "hight"'),
    "kinetic above static": "[friction.block_block]\nstatic = 0.2\nkinetic = 0.3",
    "unknown material": ('material = "steel"', 'material = "steal"'),
    "unknown material of the ground": '[ground]\nmaterial = "granite"',
    "unknown block": ('block = "brick"', 'block = "stone"'),
    "unknown kind of structure": ('kind = "stack"', 'kind = "cathedral"'),
    "misspelt kind of structure": ('kind = "stack"', 'kind = "stak"'),
    "unknown contact law": '[contact]\nlaw = "lineal"',
    "key of the other scheme": '[time]\nscheme = "nonsmooth"\nsafety = 0.1',
    "key of the other scheme, which is the usual one": "[time]\nsubsteps = 4",
    "no scheme": '[time]\nscheme = "nonsmoth"',
    "misspelt scheme, whose keys are judged as those that are meant": (
        '[time]\nscheme = "non-smooth"\nsubstep = 4\nvelocity_tolerance = "1 mm/s"\nsafety = 0.1'
    ),
    "model of springs with rigid contacts": '[contact]\nmodel = "particles"\n[time]\nscheme = "nonsmooth"',
    "law of springs with rigid contacts": '[contact]\nlaw = "hertz-mindlin"\n[time]\nscheme = "nonsmooth"',
    "overlap longer than the block": (
        'kind = "stack"\nblock = "brick"\ncount = 3',
        'kind = "staircase"\nblock = "brick"\ncount = 3\noverlap = "41 mm"',
    ),
    "body inside a stack": '[[bodies]]\nblock = "brick"\nx = "45 mm"\ny = "15 mm"',
    "tilted body overlapping": '[[bodies]]\nblock = "brick"\nx = "60 mm"\ny = "40 mm"\nangle = "45 deg"',
    "body below the ground": '[[bodies]]\nblock = "brick"\nx = "1 m"\ny = "9 mm"',
    "corner below the ground": '[[bodies]]\nblock = "brick"\nx = "1 m"\ny = "10 mm"\nangle = "1 deg"',
    "two structures in one place": '[[structures]]\nkind = "stack"\nblock = "brick"\ncount = 1\nleft = "30 mm"',
    "body named like another's number": '[[bodies]]\nblock = "brick"\nx = "1 m"\ny = "1 m"\nname = "2"',
    "fixed body that moves": '[[bodies]]\nblock = "brick"\nx = "1 m"\ny = "1 m"\nspin = "1 rad/s"\nfixed = true',
    "too many bodies": (
        "count = 3",
        'count = 1\n[[structures]]\nkind = "wall"\nblock = "brick"\nrows = 1000\ncolumns = 1000',
    ),
    "mass beyond all numbers": (WIDTH, "width = 1e308"),
}


@pytest.mark.parametrize("edit", RELATIONS.values(), ids=RELATIONS)
def test_relations(refused: Refused, edit: Edit) -> None:
    refused(edit)
