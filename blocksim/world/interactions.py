"""Contact parameters of every pair of contact classes: stiffness from elasticity, damping from restitution."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from blocksim.kernels.common.arrays import INTERACTION, Records, zeros
from blocksim.scenario import GROUND, PlacedBody, ResolvedPair, Scenario, resolve_pair
from blocksim.world.restitution import damping_ratio


class ContactClass(NamedTuple):
    """Bodies of one material and depth; ground (class 0) and walls have endless depth."""

    material: str | None  # None: the ground takes the material of its partner
    depth: float  # m
    is_wall: bool = False

    @property
    def is_ground(self) -> bool:
        """Return True if these are the ground or walls."""
        return math.isinf(self.depth)


class Interaction(NamedTuple):
    """Parameters of one pair of classes; the fields are those of INTERACTION, in its order."""

    normal_stiffness: float
    shear_ratio: float
    normal_damping: float
    shear_damping: float
    static_friction: float
    kinetic_friction: float
    transition_speed: float
    restitution: float


Interactions = tuple[tuple[Interaction, ...], ...]
"""The parameters of all pairs of classes: symmetric."""
NOTHING = Interaction(*[0.0] * len(Interaction._fields))  # ground and walls do not touch one another


def contact_classes(scenario: Scenario, placed: tuple[PlacedBody, ...]) -> tuple[ContactClass, ...]:
    """Return the classes in use: the ground, blocks in order of appearance, then walls of a material of their own."""
    ground = ContactClass(scenario.ground.material, math.inf)
    blocks = dict.fromkeys((body.material, body.depth) for body in placed)
    walls = dict.fromkeys(wall.material for wall in scenario.walls if wall.material)
    return (
        ground,
        *(ContactClass(*block) for block in blocks),
        *(ContactClass(material, math.inf, is_wall=True) for material in walls),
    )


def pair_of(scenario: Scenario, a: ContactClass, b: ContactClass) -> ResolvedPair:
    """Return the scenario's contact parameters of two classes, at least one of them blocks."""
    block, other = (b, a) if a.is_ground else (a, b)
    partner = other.material if other.is_wall or not other.is_ground else GROUND
    return resolve_pair(scenario, str(block.material), str(partner), ground=other.is_ground)


def compliance(scenario: Scenario, a: ContactClass, b: ContactClass) -> float:
    """Return 1/E* = sum (1 - nu^2)/E (1/Pa). K. L. Johnson, Contact Mechanics (1985), eq. 4.24."""
    pair = [scenario.materials[name] for name in _materials(a, b)]
    return sum((1.0 - m.poisson_ratio**2) / m.young_modulus for m in pair)


def _normal_stiffness(scenario: Scenario, a: ContactClass, b: ContactClass, pair: ResolvedPair) -> float:
    """Return the stiffness of one corner contact.

    Linear: scale E* L (N/m), L the shorter depth, or what the scenario gives instead of E* L. Hertz-Mindlin: scale
    4/3 E* R*^(1/2) (N/m^1.5), R* the scenario's `contact_radius`.
    """
    contact = scenario.contact
    if contact.law == "hertz-mindlin":
        return contact.stiffness_scale * 4.0 / 3.0 * math.sqrt(contact.contact_radius) / compliance(scenario, a, b)
    if pair.normal_stiffness is not None:
        return contact.stiffness_scale * pair.normal_stiffness
    return contact.stiffness_scale * min(a.depth, b.depth) / compliance(scenario, a, b)


def _shear_stiffness_ratio(scenario: Scenario, a: ContactClass, b: ContactClass, given: ResolvedPair) -> float:
    """Return shear over normal stiffness (-): as given, else Mindlin's 4 G*/E*, 1/G* = 2 sum (2 - nu)(1 + nu)/E.

    For two equal materials this is 2 (1 - nu)/(2 - nu). R. D. Mindlin, J. Appl. Mech. 16 (1949) 259-268.
    """
    if given.shear_stiffness_ratio is not None:
        return given.shear_stiffness_ratio
    pair = [scenario.materials[name] for name in _materials(a, b)]
    shear = sum(2.0 * (2.0 - m.poisson_ratio) * (1.0 + m.poisson_ratio) / m.young_modulus for m in pair)
    return 4.0 * compliance(scenario, a, b) / shear


def interaction(scenario: Scenario, a: ContactClass, b: ContactClass) -> Interaction:
    """Return the parameters of one pair of classes."""
    pair = pair_of(scenario, a, b)
    ratio = damping_ratio(pair.restitution, scenario.contact.law)
    return Interaction(
        normal_stiffness=_normal_stiffness(scenario, a, b, pair),
        shear_ratio=_shear_stiffness_ratio(scenario, a, b, pair),
        normal_damping=ratio,
        shear_damping=ratio if pair.shear_damping_ratio is None else pair.shear_damping_ratio,
        static_friction=pair.friction.static,
        kinetic_friction=pair.friction.kinetic,
        transition_speed=pair.friction.transition_speed,
        restitution=pair.restitution,
    )


def interactions_of(scenario: Scenario, classes: tuple[ContactClass, ...]) -> Interactions:
    """Return the parameters of all pairs of classes."""
    half = [
        [NOTHING if a.is_ground and b.is_ground else interaction(scenario, a, b) for b in classes[: i + 1]]
        for i, a in enumerate(classes)
    ]
    count = range(len(classes))
    return tuple(tuple(half[max(i, j)][min(i, j)] for j in count) for i in count)


def interaction_tables(members: Sequence[Interactions]) -> Records:
    """Return the tables (m, c, c) of scenes with equally many classes."""
    classes = len(members[0])
    tables = zeros((len(members), classes, classes), INTERACTION)
    values = np.array(members)  # (m, c, c, 8)
    for k, name in enumerate(Interaction._fields):
        tables[name] = values[..., k]
    return tables


def _materials(a: ContactClass, b: ContactClass) -> tuple[str, str]:
    one, other = a.material or b.material, b.material or a.material
    if one is None or other is None:
        message = "the ground is not in contact with itself"
        raise ValueError(message)
    return one, other
