"""What follows from the record of a contact: its stiffness in the step before."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from blocksim.kernels.common.arrays import CONTACT, INTERACTION, PARTICLE, PARTICLE_CONTACT, zeros
from blocksim.kernels.explicit.history import shear_stiffness_before, stiffness_before
from blocksim.kernels.explicit.laws import HERTZ_MINDLIN, LINEAR

if TYPE_CHECKING:
    from blocksim.kernels.common.arrays import Record

DEPTH, SHARE = 4e-6, 0.25


def values() -> Record:
    record = zeros(1, INTERACTION)[0]
    record.normal_stiffness, record.shear_ratio = 1e6, 0.8
    return record


def corner() -> Record:
    contact = zeros(1, CONTACT)[0]
    contact.spring, contact.depth, contact.normal_force, contact.shear_force = 1e-6, DEPTH, 7.0, 1.0
    return contact


def particle() -> Record:
    contact = zeros(1, PARTICLE_CONTACT)[0]
    for name in ("spring", "depth", "normal_force", "shear_force"):
        contact[name] = corner()[name]
    contact.share = SHARE
    return contact


@pytest.mark.parametrize(("law", "stiffness"), [(LINEAR, 8e5), (HERTZ_MINDLIN, 2.4e3)])
def test_stiffness_before_is_that_of_the_pair_or_of_the_particle(law: float, stiffness: float) -> None:
    for contact, particles, share in ((corner(), None, 0.5), (particle(), zeros(1, PARTICLE), SHARE)):
        of_spring = stiffness_before(contact, 0.5e6, values(), particles)
        assert of_spring == share * 1e6
        assert shear_stiffness_before(contact, of_spring, values(), law) == pytest.approx(share * stiffness)
