"""Contact parameters of every pair of contact classes: stiffness from elasticity, damping from restitution."""

import math
from typing import NamedTuple

from blocksim.kernels.arrays import INTERACTION, Record, Records, zeros
from blocksim.scenario import PlacedBody, Scenario
from blocksim.world.restitution import damping_ratio


class ContactClass(NamedTuple):
    """Bodies of one class touch alike: same material, same depth. The ground is class 0, with an endless depth."""

    material: str | None  # None: the ground takes the material of its partner
    depth: float  # m


def contact_classes(scenario: Scenario, placed: tuple[PlacedBody, ...]) -> tuple[ContactClass, ...]:
    """Return the classes in use, the ground first, the others in order of appearance."""
    ground = ContactClass(scenario.ground.material, float("inf"))
    return (ground, *dict.fromkeys(ContactClass(body.material, body.depth) for body in placed))


def normal_stiffness(scenario: Scenario, a: ContactClass, b: ContactClass) -> float:
    """Return the stiffness of one corner contact, with 1/E* = sum (1 - nu^2)/E.

    Linear: scale E* L (N/m), L the shorter depth. Hertz-Mindlin: scale 4/3 E* R*^(1/2) (N/m^1.5), R* `contact_radius`.
    """
    contact = scenario.contact
    if contact.normal_stiffness is not None:
        return contact.stiffness_scale * contact.normal_stiffness
    modulus = effective_modulus(scenario, a, b)
    if contact.law == "hertz-mindlin":
        return contact.stiffness_scale * 4.0 / 3.0 * modulus * math.sqrt(contact.contact_radius)
    return contact.stiffness_scale * modulus * min(a.depth, b.depth)


def effective_modulus(scenario: Scenario, a: ContactClass, b: ContactClass) -> float:
    """Return E* (Pa): 1/E* = sum (1 - nu^2)/E. K. L. Johnson, Contact Mechanics (1985), eq. 4.24."""
    pair = [scenario.materials[name] for name in _materials(a, b)]
    return 1.0 / sum((1.0 - m.poisson_ratio**2) / m.young_modulus for m in pair)


def shear_stiffness_ratio(scenario: Scenario, a: ContactClass, b: ContactClass) -> float:
    """Return shear over normal stiffness (-): as given, else Mindlin's 4 G*/E*, 1/G* = 2 sum (2 - nu)(1 + nu)/E.

    For two equal materials this is 2 (1 - nu)/(2 - nu). R. D. Mindlin, J. Appl. Mech. 16 (1949) 259-268.
    """
    if scenario.contact.shear_stiffness_ratio is not None:
        return scenario.contact.shear_stiffness_ratio
    pair = [scenario.materials[name] for name in _materials(a, b)]
    normal = sum((1.0 - m.poisson_ratio**2) / m.young_modulus for m in pair)
    shear = sum(2.0 * (2.0 - m.poisson_ratio) * (1.0 + m.poisson_ratio) / m.young_modulus for m in pair)
    return 4.0 * normal / shear


def fill_interaction(record: Record, scenario: Scenario, a: ContactClass, b: ContactClass, *, ground: bool) -> None:
    """Fill the parameters of one pair of classes into its record."""
    friction = scenario.friction.block_ground if ground else scenario.friction.block_block
    restitution = scenario.contact.restitution
    shear_damping = scenario.contact.shear_damping_ratio
    ratio = damping_ratio(restitution.block_ground if ground else restitution.block_block, scenario.contact.law)
    record.normal_stiffness = normal_stiffness(scenario, a, b)
    record.shear_ratio = shear_stiffness_ratio(scenario, a, b)
    record.normal_damping = ratio
    record.shear_damping = ratio if shear_damping is None else shear_damping
    record.static_friction = friction.static
    record.kinetic_friction = friction.kinetic
    record.transition_speed = friction.transition_speed


def interaction_table(scenario: Scenario, classes: tuple[ContactClass, ...]) -> Records:
    """Return the (c, c) table of all pairs of classes: symmetric; row and column 0 belong to the ground."""
    table = zeros((len(classes), len(classes)), INTERACTION)
    for i, a in enumerate(classes[1:], start=1):
        for j, b in enumerate(classes[: i + 1]):
            fill_interaction(table[i, j], scenario, a, b, ground=j == 0)
            table[j, i] = table[i, j]
    return table


def _materials(a: ContactClass, b: ContactClass) -> tuple[str, str]:
    names = (a.material or b.material, b.material or a.material)
    if names[0] is None or names[1] is None:
        message = "the ground does not touch itself"
        raise ValueError(message)
    return names[0], names[1]
