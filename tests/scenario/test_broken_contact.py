"""Contact models, laws, pairs of materials, and their numbers that do not go together."""

import pytest

from tests.scenario.conftest import Edit, Refused

CONTACT = {
    "misspelt contact model": '[contact]\nmodel = "kernels"',
    "unknown kernel function": '[contact]\nkernel = "gauss"',
    "fixed stiffness with Hertz": '[contact]\nlaw = "hertz-mindlin"\nnormal_stiffness = "1 MN/m"',
    "fixed stiffness of a pair with Hertz": (
        '[contact]\nlaw = "hertz-mindlin"\n\n[pairs.steel.ground]\nnormal_stiffness = "1 MN/m"'
    ),
    "contact radius of zero": "[contact]\ncontact_radius = 0",
    "skin of zero": "[contact]\nskin = 0",
    "negative skin": '[contact]\nskin = "-1 mm"',
    "skin that is not a number": "[contact]\nskin = nan",
    "endless skin": "[contact]\nskin = inf",
    "skin that is a time": '[contact]\nskin = "1 ms"',
    "skin that is used up at every step": '[contact]\nskin = "1.9 um"',
    "skin lost in the round-off of positions far away": (
        '[contact]\nskin = "0.01 mm"\n\n[[bodies]]\nblock = "brick"\nx = -1e9\ny = 1'
    ),
    "skin beyond the smallest block": '[contact]\nskin = "20.1 mm"',
    "smoothing length with no neighbours": '[contact]\nmodel = "kernel"\nsmoothing_length = "0.79 mm"',
    "smoothing length through a block": '[contact]\nmodel = "kernel"\nsmoothing_length = "10 mm"',
    "spacing whose kernel reaches through a block": '[contact]\nmodel = "kernel"\nparticle_spacing = "7.7 mm"',
    "kernel of a longer reach": '[contact]\nmodel = "kernel"\nkernel = "quintic-spline"\nparticle_spacing = "6 mm"',
    "particles too far apart": '[contact]\nmodel = "particles"\nparticle_spacing = "10.1 mm"',
}


@pytest.mark.parametrize("edit", CONTACT.values(), ids=CONTACT)
def test_contact(refused: Refused, edit: Edit) -> None:
    refused(edit)


PAIRS = {
    "unknown material": "[pairs.steal.ground]\nfriction = 0.2",
    "unknown other material": "[pairs.steel.grond]\nfriction = 0.2",
    "material like no other": "[pairs.steel.concrete]\nfriction = 0.2",
    "ground with itself": "[pairs.ground.ground]\nfriction = 0.2",
    "both orders": "[pairs.steel.ground]\nfriction = 0.2\n\n[pairs.ground.steel]\nrestitution = 0.3",
    "empty pair": "[pairs.steel.ground]",
    "one material only": "[pairs.steel]",
    "one material with a value": "[pairs.steel]\nfriction = 0.2",
    "value for a pair": "[pairs]\nsteel.ground = 0.2",
    "typo in a pair": "[pairs.steel.ground]\nrestituion = 0.2",
    "kinetic above static": "[pairs.steel.ground]\nfriction = { static = 0.2, kinetic = 0.3 }",
    "no static friction": "[pairs.steel.steel.friction]\nkinetic = 0.3",
    "restitution above 1": "[pairs.steel.ground]\nrestitution = 1.2",
    "material named ground": '[materials.ground]\ndensity = 700\nyoung_modulus = "11 GPa"\npoisson_ratio = 0.3',
    "sweep of an unknown pair": '[sweep]\n"pairs.steel.grund.friction.kinetic" = [0.1, 0.2]',
    "wrong value in a sweep": (
        '[pairs.steel.ground]\nfriction = 0.3\n\n[sweep]\n"pairs.steel.ground.friction.kinetic" = [0.1, -0.2]'
    ),
    "provenance of no pair": '[provenance]\n"pairs.steel.ground.friction" = "measured"',
}


@pytest.mark.parametrize("edit", PAIRS.values(), ids=PAIRS)
def test_pairs(refused: Refused, edit: Edit) -> None:
    refused(edit)


@pytest.mark.parametrize("model", ["particles", "kernel"])
@pytest.mark.parametrize("spacing", ["1e-300 m", "1 nm", "0.5 um"])
def test_particles_finer_than_a_side_can_have_are_refused(refused: Refused, model: str, spacing: str) -> None:
    refused(f'[contact]\nmodel = "{model}"\nparticle_spacing = "{spacing}"')  # they overflowed a field of 16 bits
