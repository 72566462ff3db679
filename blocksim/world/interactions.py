"""Contact parameters of every pair of contact classes: stiffness from elasticity, damping from restitution."""

import math
from typing import NamedTuple

from blocksim.kernels.arrays import INTERACTION, Record, Records, zeros
from blocksim.scenario import GROUND, PlacedBody, ResolvedPair, Scenario, place_segments, resolve_pair
from blocksim.world.restitution import damping_ratio


class ContactClass(NamedTuple):
    """Bodies of one class touch alike: same material, same depth. Ground (class 0) and walls have an endless depth."""

    material: str | None  # None: the ground takes the material of its partner
    depth: float  # m
    is_wall: bool = False

    @property
    def is_ground(self) -> bool:
        """Tell whether these are the ground or walls."""
        return math.isinf(self.depth)


def contact_classes(scenario: Scenario, placed: tuple[PlacedBody, ...]) -> tuple[ContactClass, ...]:
    """Return the classes in use: the ground, blocks in order of appearance, then walls of a material of their own."""
    ground = ContactClass(scenario.ground.material, math.inf)
    blocks = dict.fromkeys(ContactClass(body.material, body.depth) for body in placed)
    walls = dict.fromkeys(
        ContactClass(s.material, math.inf, is_wall=True) for s in place_segments(scenario) if s.material
    )
    return (ground, *blocks, *walls)


def pair_of(scenario: Scenario, a: ContactClass, b: ContactClass) -> ResolvedPair:
    """Return what the scenario says of two classes, at least one of them blocks."""
    block, other = (b, a) if a.is_ground else (a, b)
    partner = other.material if other.is_wall or not other.is_ground else GROUND
    return resolve_pair(scenario, str(block.material), str(partner), ground=other.is_ground)


def compliance(scenario: Scenario, a: ContactClass, b: ContactClass) -> float:
    """Return 1/E* = sum (1 - nu^2)/E (1/Pa). K. L. Johnson, Contact Mechanics (1985), eq. 4.24."""
    pair = [scenario.materials[name] for name in _materials(a, b)]
    return sum((1.0 - m.poisson_ratio**2) / m.young_modulus for m in pair)


def normal_stiffness(scenario: Scenario, a: ContactClass, b: ContactClass) -> float:
    """Return the stiffness of one corner contact.

    Linear: scale E* L (N/m), L the shorter depth, or what the scenario gives instead of E* L. Hertz-Mindlin: scale
    4/3 E* R*^(1/2) (N/m^1.5), R* the scenario's `contact_radius`.
    """
    contact = scenario.contact
    if contact.law == "hertz-mindlin":
        return contact.stiffness_scale * 4.0 / 3.0 * math.sqrt(contact.contact_radius) / compliance(scenario, a, b)
    given = pair_of(scenario, a, b).normal_stiffness
    if given is not None:
        return contact.stiffness_scale * given
    return contact.stiffness_scale * min(a.depth, b.depth) / compliance(scenario, a, b)


def shear_stiffness_ratio(scenario: Scenario, a: ContactClass, b: ContactClass) -> float:
    """Return shear over normal stiffness (-): as given, else Mindlin's 4 G*/E*, 1/G* = 2 sum (2 - nu)(1 + nu)/E.

    For two equal materials this is 2 (1 - nu)/(2 - nu). R. D. Mindlin, J. Appl. Mech. 16 (1949) 259-268.
    """
    given = pair_of(scenario, a, b).shear_stiffness_ratio
    if given is not None:
        return given
    pair = [scenario.materials[name] for name in _materials(a, b)]
    shear = sum(2.0 * (2.0 - m.poisson_ratio) * (1.0 + m.poisson_ratio) / m.young_modulus for m in pair)
    return 4.0 * compliance(scenario, a, b) / shear


def fill_interaction(record: Record, scenario: Scenario, a: ContactClass, b: ContactClass) -> None:
    """Fill the parameters of one pair of classes into its record."""
    pair = pair_of(scenario, a, b)
    ratio = damping_ratio(pair.restitution, scenario.contact.law)
    record.normal_stiffness = normal_stiffness(scenario, a, b)
    record.shear_ratio = shear_stiffness_ratio(scenario, a, b)
    record.normal_damping = ratio
    record.shear_damping = ratio if pair.shear_damping_ratio is None else pair.shear_damping_ratio
    record.static_friction = pair.friction.static
    record.kinetic_friction = pair.friction.kinetic
    record.transition_speed = pair.friction.transition_speed
    record.restitution = pair.restitution


def interaction_table(scenario: Scenario, classes: tuple[ContactClass, ...]) -> Records:
    """Return the (c, c) table of all pairs of classes: symmetric; ground and walls do not touch one another."""
    table = zeros((len(classes), len(classes)), INTERACTION)
    for i, a in enumerate(classes):
        for j, b in enumerate(classes[: i + 1]):
            if not (a.is_ground and b.is_ground):
                fill_interaction(table[i, j], scenario, a, b)
                table[j, i] = table[i, j]
    return table


def _materials(a: ContactClass, b: ContactClass) -> tuple[str, str]:
    names = (a.material or b.material, b.material or a.material)
    if names[0] is None or names[1] is None:
        message = "the ground does not touch itself"
        raise ValueError(message)
    return names[0], names[1]
