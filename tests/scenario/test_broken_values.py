"""Values of the wrong type, unit or size."""

import pytest

from tests.scenario.conftest import Edit, Refused

WIDTH = 'width = "40 mm"'

VALUES = {
    "text for a plain number": ("poisson_ratio = 0.3", 'poisson_ratio = "0.3"'),
    "length for a plain number": ("poisson_ratio = 0.3", 'poisson_ratio = "3 mm"'),
    "Poisson's ratio of a liquid": ("poisson_ratio = 0.3", "poisson_ratio = 0.5"),
    "bare angle": "[ground]\ntilt = 30",
    "vertical ground": '[ground]\ntilt = "90 deg"',
    "no substeps": '[time]\nscheme = "nonsmooth"\nsubsteps = 0',
    "absurd substeps": '[time]\nscheme = "nonsmooth"\nsubsteps = 1001',
    "half a sweep": '[time]\nscheme = "nonsmooth"\nvelocity_sweeps = 0.5',
    "tolerance below round-off": '[time]\nscheme = "nonsmooth"\nvelocity_tolerance = 1e-15',
    "restitution that creates energy": '[contact]\nrestitution = 1.1\n[time]\nscheme = "nonsmooth"',
    "friction angle of 90 degrees": '[friction]\nblock_ground = "90 deg"',
    "negative friction": "[friction]\nblock_ground = -0.1",
    "boolean for friction": "[friction]\nblock_ground = true",
    "restitution above 1": "[contact]\nrestitution = 1.5",
    "restitution as a text": '[contact]\nrestitution = "high"',
    "number of blocks that is not whole": ("count = 3", "count = 3.5"),
    "no blocks": ("count = 3", "count = 0"),
    "boolean for a count": ("count = 3", "count = true"),
    "number for a boolean": "[time]\nstop_at_rest = 1",
    "word for a time step": '[time]\nstep = "fast"',
    "time step of zero": '[time]\nstep = "0 s"',
    "safety above 0.1": "[time]\nsafety = 2",
    "velocity with one part": '[[bodies]]\nblock = "brick"\nx = 1\ny = 1\nvelocity = ["1 m/s"]',
    "velocity with three parts": '[[bodies]]\nblock = "brick"\nx = 1\ny = 1\nvelocity = [0, 0, 0]',
    "unit in one part of a velocity": '[[bodies]]\nblock = "brick"\nx = 1\ny = 1\nvelocity = [\n    0,\n    "1 m",\n]',
    "wrong schema version": ("schema = 1", "schema = 2"),
    "boolean for the schema version": ("schema = 1", "schema = true"),
    "name with a slash": ('name = "case"', 'name = "../case"'),
    "number for a name": ('name = "case"', "name = 7"),
    "empty name": ('name = "case"', 'name = ""'),
}


@pytest.mark.parametrize("edit", VALUES.values(), ids=VALUES)
def test_values(refused: Refused, edit: Edit) -> None:
    refused(edit)


QUANTITIES = {
    "misspelt unit": (WIDTH, 'width = "40 mn"'),
    "misspelt unit in a quotient": ("density = 7850", 'density = "7850 kg/n^3"'),
    "unit like no other": (WIDTH, 'width = "40 parsecs"'),
    "unit missing in a text": (WIDTH, 'width = "40"'),
    "no number in a text": (WIDTH, 'width = "wide"'),
    "wrong dimension": (WIDTH, 'width = "40 s"'),
    "density for a unit weight": ("density = 7850", 'unit_weight = "7850 kg/m^3"'),
    "dimension without a name": (WIDTH, 'width = "40 kg*m"'),
    "expression instead of a number": (WIDTH, 'width = "9**9**9 m"'),
    "huge exponent in a unit": (WIDTH, 'width = "9 m^999999999"'),
    "huge exponent in a number": (WIDTH, 'width = "1e999999999 m"'),
    "too large for a float": (WIDTH, 'width = "1e999 m"'),
    "overlong text": (WIDTH, 'width = "' + "4" * 200 + ' mm"'),
    "call in a unit": (WIDTH, "width = \"1 __import__('os')\""),
    "negative size": (WIDTH, 'width = "-40 mm"'),
    "zero size": (WIDTH, "width = 0"),
    "size that is not finite": (WIDTH, "width = inf"),
    "size that is no number": (WIDTH, "width = nan"),
    "boolean for a number": (WIDTH, "width = true"),
    "list for a number": (WIDTH, "width = [40]"),
    "date for a number": (WIDTH, "width = 2020-10-14"),
}


@pytest.mark.parametrize("edit", QUANTITIES.values(), ids=QUANTITIES)
def test_quantities(refused: Refused, edit: Edit) -> None:
    refused(edit)
