"""Contact parameters of every pair of contact classes: stiffness from elasticity, damping from restitution.

Damping. Contacts cannot pull: the force of spring and dashpot is clipped at zero, and the contact ends when the force,
not the overlap, returns to zero. For a linear spring the closed form is that of T. Schwager and T. Poeschel,
"Coefficient of restitution and linear-dashpot model revisited", Granular Matter 9 (2007) 465-469. The textbook formula
without clipping gives 0.40 where 0.30 is wanted.

The damping ratio of other laws is that of the linear one times `Law.damping_share`.
"""

import functools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from blocksim.kernels.common.arrays import INTERACTION, Records, zeros
from blocksim.scenario import GROUND, Model, Scenario, derived, laws, resolution, resolve_pair
from blocksim.scenario.placement import GEOMETRY

# e = 0 would need infinite damping; this rebound counts as none (the promise is at most 1 % of the impact speed)
SMALLEST_RESTITUTION = 0.009
BISECTIONS = 200  # at most; neighbouring numbers are reached after some sixty


def restitution_of(damping_ratio: float) -> float:
    """Return the coefficient of restitution (-) of a clipped linear spring-dashpot contact, `damping_ratio` >= 0."""
    zeta = damping_ratio
    if abs(zeta - 1.0) < 1e-9:
        return math.exp(-2.0)  # common limit of both branches
    root = math.sqrt(abs(1.0 - zeta * zeta))
    if zeta < 1.0:
        return math.exp(-zeta / root * (math.pi - math.atan2(2.0 * zeta * root, 1.0 - 2.0 * zeta * zeta)))
    return math.exp(-zeta / root * math.log((zeta + root) / (zeta - root)))


@functools.lru_cache(10_000)  # ratios that are kept: a sweep may have a restitution of its own in every case
def damping_ratio(restitution: float, law: str = laws.LINEAR.name) -> float:
    """Return the damping ratio (-) for a coefficient of restitution in [0, 1]; the inverse of `restitution_of`.

    Where the law is not linear it refers to the slope of the force at each overlap. Raises ValueError outside [0, 1].
    """
    if not 0.0 <= restitution <= 1.0:
        raise ValueError(f"a coefficient of restitution lies between 0 and 1, not {restitution}")
    if restitution == 1.0:
        return 0.0
    target = max(restitution, SMALLEST_RESTITUTION)
    low, high = 0.0, 100.0
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        low, high = (middle, high) if restitution_of(middle) > target else (low, middle)
    return 0.5 * (low + high) * laws.LAWS[law].damping_share


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


@derived(*GEOMETRY)
def contact_classes(model: Model) -> tuple[ContactClass, ...]:
    """Return the classes in use: the ground, blocks in order of appearance, then walls of a material of their own."""
    scenario = model.scenario
    ground = ContactClass(scenario.ground.material, math.inf)
    blocks = dict.fromkeys((body.material, body.depth) for body in model.bodies)
    walls = dict.fromkeys(wall.material for wall in scenario.walls if wall.material)
    return (
        ground,
        *(ContactClass(*block) for block in blocks),
        *(ContactClass(material, math.inf, is_wall=True) for material in walls),
    )


def pair_of(scenario: Scenario, a: ContactClass, b: ContactClass) -> resolution.ResolvedPair:
    """Return the scenario's contact parameters of two classes, at least one of them blocks."""
    block, other = (b, a) if a.is_ground else (a, b)
    partner = other.material if other.is_wall or not other.is_ground else GROUND
    return resolve_pair(scenario, str(block.material), str(partner), ground=other.is_ground)


def interaction(scenario: Scenario, a: ContactClass, b: ContactClass) -> Interaction:
    """Return the parameters of one pair of classes, at least one of them blocks; those of a corner contact.

    Compliance 1/E* = sum (1 - nu^2)/E (1/Pa): K. L. Johnson, Contact Mechanics (1985), eq. 4.24. Stiffness: the scale
    times that of the law, or times what the scenario gives instead (linear). Shear over normal stiffness (-): as given,
    else Mindlin's 4 G*/E*, 1/G* = 2 sum (2 - nu)(1 + nu)/E; for two equal materials this is 2 (1 - nu)/(2 - nu). R. D.
    Mindlin, J. Appl. Mech. 16 (1949) 259-268.
    """
    contact, pair = scenario.contact, pair_of(scenario, a, b)
    both = [scenario.materials[str(name)] for name in (a.material or b.material, b.material or a.material)]
    compliance = sum((1.0 - m.poisson_ratio**2) / m.young_modulus for m in both)
    if pair.normal_stiffness is not None:
        stiffness = contact.stiffness_scale * pair.normal_stiffness
    else:
        size = laws.LAWS[contact.law].size(min(a.depth, b.depth), contact.contact_radius)
        stiffness = contact.stiffness_scale * size / compliance
    shear_ratio = pair.shear_stiffness_ratio
    if shear_ratio is None:
        shear = sum(2.0 * (2.0 - m.poisson_ratio) * (1.0 + m.poisson_ratio) / m.young_modulus for m in both)
        shear_ratio = 4.0 * compliance / shear
    ratio = damping_ratio(pair.restitution, contact.law)
    return Interaction(
        normal_stiffness=stiffness,
        shear_ratio=shear_ratio,
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
