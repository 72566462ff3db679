"""How fast the blocks of a scene may become, and the time step and the skin that follow, before anything moves.

Undamped limit. Two bodies in face contact: two springs K (normal) and k (shear) at the ends of the face. The fastest
mode of one body on a rigid plane has the squared frequency w2 = largest eigenvalue of

    [ 2k/m      2k d/m               ]      d: distance of the centre from the face
    [ 2k d/I    (2K b^2 + 2k d^2)/I  ]      b: half of the face's length

or 2K/m; the inverse masses of both bodies add, so for a pair w2 = w2_a + w2_b. The central difference scheme is stable
for w dt < 2. Faces that overlap by next to nothing, with both points at one end, are up to 10 % faster at Mindlin's
k/K = 0.82 and 29 % as k/K goes to 0; a safety of 0.05 leaves room for that. Stiffness by tributary length
(kernels/explicit/bearing.py) only lowers that of a corner: the bound holds, and a body on several others is in all as
stiff as on one. Models with particles spread the stiffness of a face over it, which is softer in rocking.

Damping. Pairs that act against one another count their own, implicit force for more than it does (world/README.md), so
that well beyond critical damping the step shrinks with 1/z, z being the damping ratio:

    dt = safety * (2 / w) / max(1, z/2)

With safety = 0.05 impacts are resolved with w dt <= 0.1, some thirty steps, and z w dt <= 0.2.

Laws that are not linear. The slope of the force grows with the overlap; the deepest one expected decides
(scenario/laws.py). As the step of Hertz goes with v^(-1/5), a speed that is wrong by a factor of ten changes it by 1.6
only.

Speed. Contacts are found by the corners that lie in another block at the end of a step, so that in one step no block
may come far into another: at the greatest speed expected it moves by at most a twentieth of the smallest side, and by a
fifth of the skin. That shortens the steps of scenes whose blocks are too fast for their springs, which end with exit
code 76 where such blocks meet, instead of passing through one another.

Loads. What they push gets no faster than in the time of the run, and than on the way across the scene: beyond it there
is nothing that it could meet.

Skin. Bodies no farther apart are listed as neighbours, and only listed ones are examined for contacts. The list is made
again before two that are not in it can meet, so that a skin decides how long the list is and how often it is made, and
never what moves where. Particles need nothing on top: they touch nothing before they are inside the other block.
"""

import math
from collections.abc import Iterable, Sequence
from contextlib import suppress
from itertools import combinations_with_replacement, product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.errors import InvalidInputError
from blocksim.kernels.explicit.inertia import APPROACH_STEPS
from blocksim.scenario import Scenario, geometry, laws, motion, placement
from blocksim.scenario.models.timeline import Explicit
from blocksim.world import excitation, systems
from blocksim.world.bodies import Layout, Shapes
from blocksim.world.interactions import Interactions

STABILITY_LIMIT = 2.0
MOST_STEPS = 2**53  # beyond that a step number is no exact float
TRAVEL_SHARE, TRAVEL_SHARE_OF_PARTICLES = 0.05, 0.01  # of the smallest side, that a block may move in a step
# Shares of the smallest side, measured: in the surface model a body has eight corners to examine, so that a long list
# costs less than making it again; with particles a long list holds hundreds of them a pair.
SKIN_SHARE, SKIN_SHARE_OF_PARTICLES = 0.25, 0.05
LEAST_APPROACH, MOST_APPROACH = 0.1, 0.5  # of the default skin
RESERVE = 2.5  # times the speed expected: blocks that are struck are faster; the automatic step leaves as much
ROUND_UP = 1.0005  # so that four digits of a number are not less than it
MILLI = 1e3


class StepError(InvalidInputError):
    """The time step of a scenario cannot be taken; the longest one that can is `limit` (s), where there is any."""

    def __init__(self, message: str, limit: float = 0.0) -> None:
        """Say why, and keep the limit."""
        self.limit = limit
        super().__init__(message)


class SkinTooSmallError(InvalidInputError):
    """Blocks come too near in a step for the skin given by hand; `least` (m) is enough."""

    def __init__(self, message: str, least: float) -> None:
        """Say why, and keep the least one."""
        self.least = least
        super().__init__(message)


class Stride(NamedTuple):
    """Values chosen for one scene."""

    step: float  # s
    skin: float  # m
    approach: float = 0.0  # m, up to which bodies are always listed


class BlockKind(NamedTuple):
    """Blocks that are alike."""

    half_x: float  # m
    half_y: float  # m
    inverse_mass: float  # 1/kg, zero where they are fixed
    inverse_inertia: float  # 1/(kg m2)
    contact_class: int


class Bounds(NamedTuple):
    """Of the blocks of one scene, without the ground and its pieces."""

    smallest: float  # m, smallest side; infinite where there are no blocks
    top: float  # m, no corner is higher
    speed: float  # m/s, no point is faster
    mass: float  # kg, of all free ones
    free: int  # blocks that are not fixed
    kinds: frozenset[BlockKind]
    grounds: frozenset[int]  # contact classes of the half-plane and its pieces
    standing: frozenset[BlockKind]  # blocks on each of their faces, as `standing_kinds` has them


def bounds_of(layouts: Sequence[Layout], bodies: NDArray[np.record]) -> list[Bounds]:
    """Return the bounds of scenes, given their bodies (m, n + 1); a body that an event frees has its mass."""
    count = len(layouts[0].placed)
    places = [(m, i) for m, one in enumerate(layouts) for i, body in enumerate(one.placed) if body.freed]
    if places:
        bodies = bodies.copy()
    for m, i in places:
        body = layouts[m].placed[i]
        bodies["mass"][m, i], bodies["inertia"][m, i] = body.mass, body.inertia
        bodies["inverse_mass"][m, i], bodies["inverse_inertia"][m, i] = 1.0 / body.mass, 1.0 / body.inertia
    blocks = bodies[:, :count]
    columns = {name: np.ascontiguousarray(blocks[name]) for name in ("radius", "mass")}
    speeds = np.hypot(blocks["vx"], blocks["vy"]) + columns["radius"] * np.abs(blocks["spin"])
    columns_of_kinds = zip(*(blocks[name].tolist() for name in BlockKind._fields), strict=True)
    kinds = [frozenset(map(BlockKind, *one)) for one in columns_of_kinds]
    of_scenes = zip(
        blocks["least_width"].min(axis=1, initial=math.inf).tolist(),
        np.max(blocks["y"] + columns["radius"], axis=1, initial=-math.inf).tolist(),
        np.max(speeds, axis=1, initial=0.0).tolist(),
        # one by one: the order of a sum must not depend on which other scenes there are
        [float(np.sum(mass[mass > 0.0])) for mass in columns["mass"]],
        np.count_nonzero(columns["mass"] > 0.0, axis=1).tolist(),
        kinds,
        map(frozenset, bodies["contact_class"][:, count:].tolist()),
        [
            standing_kinds(own, layout.shapes) if layout.shapes.has_polygons else one
            for one, own, layout in zip(kinds, blocks, layouts, strict=True)
        ],
        strict=True,
    )
    return [Bounds(*one) for one in of_scenes]


def standing_kinds(blocks: NDArray[np.record], shapes: Shapes) -> frozenset[BlockKind]:
    """Return the blocks of a scene as they stand on each of their faces.

    In place of half sides are how far along the face a corner is from the foot of the centroid, at most, and the
    distance of the face, the smaller one first: what half sides are to a rectangle.
    """
    kinds: set[BlockKind] = set()
    columns = (blocks[name].tolist() for name in BlockKind._fields)
    for *own, first, size in set(zip(*columns, shapes.firsts, shapes.sizes, strict=False)):
        kind, corners = BlockKind(*own), shapes.table[first : first + size]
        places = [*zip(corners["x"].tolist(), corners["y"].tolist(), strict=True)]
        faces = zip(
            places,
            (*places[1:], places[0]),
            *(corners[name].tolist() for name in ("nx", "ny", "distance")),
            strict=True,
        )
        for begin, end, nx, ny, distance in faces:
            reach = max(abs(nx * y - ny * x) for x, y in (begin, end))
            kinds.add(kind._replace(half_x=min(reach, distance), half_y=max(reach, distance)))
    return frozenset(kinds)


class Speeds(NamedTuple):
    """Bounds (m/s) of how fast blocks and supports of a scene become."""

    given: float  # of any point of a block, by the scenario itself
    fall: float  # of the highest corner at the lowest ground, from rest
    impact: float  # of any point of a block that does not slide downhill
    greatest: float  # of any point of a block
    support: float  # zero where it does not move


def speeds_of(layout: Layout, bounds: Bounds) -> Speeds:
    """Return the bounds of the speeds of a scene."""
    scenario, tilt = layout.scenario, excitation.steepest_tilt(layout.scenario)
    driven, rise = excitation.drive_bounds(layout.model)
    given = max(bounds.speed, driven, excitation.greatest_head_speed(scenario))
    for one in [event.velocity for event in scenario.events if event.velocity is not None]:
        size = max((math.hypot(block.size_x, block.size_y) for block in scenario.blocks.values()), default=0.0)
        given = max(given, math.hypot(one.vx or 0.0, one.vy or 0.0) + 0.5 * size * abs(one.spin or 0.0))
    lowest = min((y for _, y in scenario.ground.profile or ()), default=0.0)
    height = max(0.0, bounds.top + rise - lowest)
    gravity, horizontal, vertical = (value for _, value in scenario.gravity)
    fall = math.sqrt(2.0 * gravity * max(0.0, math.cos(scenario.ground.tilt) - vertical) * height)
    # least friction of free blocks on supports and fixed ones: on one another they slide no farther than their length
    free = {kind.contact_class for kind in bounds.kinds if kind.inverse_mass > 0.0}
    fixed = {kind.contact_class for kind in bounds.kinds if not kind.inverse_mass > 0.0}
    pairs = product({*fixed, *bounds.grounds}, free)
    friction = min((layout.interactions[i][j].kinetic_friction for i, j in pairs), default=math.inf)
    held = friction * max(0.0, math.cos(tilt) - vertical)
    slope, push = gravity * (math.sin(tilt) + abs(horizontal) - held), layout.applied.push
    slide = max(0.0, slope + push) * scenario.time.end
    if push > 0.0 and scenario.time.has_springs:  # rigid contacts sink in under loads, with the square of the step
        slide = min(slide, max(0.0, slope) * scenario.time.end + math.sqrt(2.0 * push * _extent_of(layout)))
    support = 0.0 if scenario.motion is None else motion.greatest_rate(layout.model.motion)
    impact = math.hypot(given, fall)
    return Speeds(given, fall, impact, impact + slide, support)


def _extent_of(layout: Layout) -> float:
    """Return the diagonal (m) of the box around blocks, ground and walls: farther on a load pushes into nothing."""
    points = [(body.x + way * body.radius, body.y + way * body.radius) for body in layout.placed for way in (-1.0, 1.0)]
    points += layout.scenario.ground.profile or ()
    walls = placement.wall_segments(layout.scenario)
    points += [end for wall in walls for end in ((wall.x0, wall.y0), (wall.x1, wall.y1))]
    low, high = geometry.box_of([*points, (points[0][0], 0.0)])
    return math.dist(low, high)


class ContactStiffness(NamedTuple):
    """Springs and damping ratios of one pair of contact classes."""

    normal: float  # N/m
    shear: float  # N/m
    damping_ratio: float  # -, the larger of the normal and the shear one


class ContactLoad(NamedTuple):
    """Loads on the contacts of a scene, for laws whose stiffness grows with the overlap."""

    speed: float  # m/s, of the fastest impact expected
    weight: float  # N, of all free bodies


def frequency_squared(body: BlockKind, normal: float, shear: float) -> float:
    """Return w2 (1/s2), the stiffest mode of a body that stands with one of its faces on a rigid plane."""
    greatest = 2.0 * normal * body.inverse_mass
    for half, distance in ((body.half_x, body.half_y), (body.half_y, body.half_x)):
        slide = 2.0 * shear * body.inverse_mass
        coupling = 2.0 * shear * distance
        rock = (2.0 * normal * half**2 + 2.0 * shear * distance**2) * body.inverse_inertia
        mixed = coupling**2 * body.inverse_mass * body.inverse_inertia
        greatest = max(greatest, 0.5 * (slide + rock) + math.sqrt(0.25 * (slide - rock) ** 2 + mixed))
    return greatest


def stable_step(pairs: Iterable[tuple[BlockKind, BlockKind | None, ContactStiffness]], safety: float) -> float:
    """Return the admissible step (s) of a scene; `pairs` lists every kind of contact (None: the ground).

    `safety` (-) is the share of the undamped stability limit. Returns infinity when nothing can touch anything.
    """
    step = math.inf
    for a, b, stiffness in pairs:
        squared = frequency_squared(a, stiffness.normal, stiffness.shear)
        if b is not None:
            squared += frequency_squared(b, stiffness.normal, stiffness.shear)
        if squared > 0.0:
            limit = safety * STABILITY_LIMIT / math.sqrt(squared) / max(1.0, 0.5 * stiffness.damping_ratio)
            step = min(step, limit)
    return step


def admissible_step(bounds: Bounds, table: Interactions, safety: float, law: laws.Law, load: ContactLoad) -> float:
    """Return the largest safe step (s) of blocks within these bounds with these contact parameters."""
    kinds = bounds.standing

    def stiffness(i: int, j: int, inverse_mass: float) -> ContactStiffness:
        row = table[i][j]
        normal = law.greatest_slope(row.normal_stiffness, inverse_mass, *load)
        return ContactStiffness(normal, normal * row.shear_ratio, max(row.normal_damping, row.shear_damping))

    def stiffest(number: int, springs: ContactStiffness) -> BlockKind:
        """Return the body of a class with the stiffest mode on given springs."""
        bodies = (kind for kind in kinds if kind.contact_class == number)
        return max(bodies, key=lambda kind: frequency_squared(kind, springs.normal, springs.shear))

    grounded = [
        (kind, None, stiffness(kind.contact_class, ground, kind.inverse_mass))
        for kind in kinds
        for ground in {0, *bounds.grounds}
    ]
    if law.is_linear:  # stiffness goes with the classes only: of hundreds of kinds in a class the stiffest decides
        classes = combinations_with_replacement({kind.contact_class for kind in kinds}, 2)
        springs = [(i, j, stiffness(i, j, 0.0)) for i, j in classes]
        paired = [(stiffest(i, one), stiffest(j, one), one) for i, j, one in springs]
    else:
        paired = [
            (a, b, stiffness(a.contact_class, b.contact_class, a.inverse_mass + b.inverse_mass))
            for a, b in combinations_with_replacement(kinds, 2)
        ]
    return stable_step([*grounded, *paired], safety)


def expected_load(layout: Layout, bounds: Bounds, speeds: Speeds) -> ContactLoad:
    """Return the speed that the fastest point may reach by falling, or by sliding all the time, and the weight."""
    scenario, push = layout.scenario, layout.applied.push
    gravity = scenario.gravity
    along = gravity.magnitude * (math.sin(excitation.steepest_tilt(scenario)) + abs(gravity.horizontal)) + push
    speed = speeds.given + speeds.fall + along * scenario.time.end
    return ContactLoad(speed, (gravity.size + push) * bounds.mass)


def step_of_contacts(layout: Layout, bounds: Bounds, speeds: Speeds) -> float:
    """Return the largest safe step (s) of the contacts of a scenario's blocks. Raises ValueError without springs."""
    load, law = expected_load(layout, bounds, speeds), laws.LAWS[layout.scenario.contact.law]
    return admissible_step(bounds, layout.interactions, safety_of(layout.scenario), law, load)


def safety_of(scenario: Scenario) -> float:
    """Return the automatic step as a share of the stability limit. Raises ValueError without springs."""
    if isinstance(scenario.time, Explicit):
        return scenario.time.safety
    raise ValueError(f"scenario {scenario.name} does not use the explicit scheme")


def choose_stride(layout: Layout, bounds: Bounds) -> Stride:
    """Return step, skin and approach of a run of the explicit scheme: as the scenario asks, or chosen.

    Below the gap of the approach bodies are listed whatever the skin: what they are seen to approach in. It is as far
    as the fastest comes while approaches are looked for, within shares of the default skin. Models with particles look
    for none. Raises StepError and SkinTooSmallError.
    """
    scenario, time, has_particles = layout.scenario, layout.scenario.time, layout.scenario.contact.model != "surface"
    limit, speeds = 0.0, Speeds(*[math.inf] * len(Speeds._fields))
    # absurd sizes and stiffnesses end in a step of zero, which is refused; Python's own powers do not end in infinity
    with np.errstate(all="ignore"), suppress(ArithmeticError):
        speeds = speeds_of(layout, bounds)
        speed = speeds.greatest + speeds.support
        share = TRAVEL_SHARE_OF_PARTICLES if has_particles else TRAVEL_SHARE
        of_travel = share * bounds.smallest / speed if speed > 0.0 else math.inf
        limit = min(step_of_contacts(layout, bounds, speeds), of_travel, systems.largest_step(layout.model))
        if (frequency := excitation.greatest_frequency(layout.model)) > 0.0:
            limit = min(limit, safety_of(scenario) * STABILITY_LIMIT / frequency)
    limit = min(limit, time.end)
    step = limit if time.step == "auto" else time.step
    refuse_uncountable(time.end, step)
    if step > limit and not time.force_step:
        message = f"{step:.4g} s is above the largest safe step {limit:.4g} s"
        raise StepError(f'{message}; use step = "auto", or force_step = true to override', limit)
    approach = 0.0
    if not has_particles:
        default = placement.reference_length(bounds.smallest) * SKIN_SHARE
        way = APPROACH_STEPS * step * speeds.greatest
        approach = min(max(way, LEAST_APPROACH * default), MOST_APPROACH * default)
    return Stride(step, choose_skin(layout, bounds, speeds, step), approach)


def refuse_uncountable(end: float, step: float) -> None:
    """Raise StepError for more steps until the end (s) than can be counted, and for steps of no length."""
    if not 0.0 < step < math.inf or end / step > MOST_STEPS:
        raise StepError(f"{end:.4g} s cannot be divided into steps of {step:.4g} s")


def choose_skin(layout: Layout, bounds: Bounds, speeds: Speeds, step: float) -> float:
    """Return the skin (m) the run will have, given the step (s).

    Raises SkinTooSmallError. Only for a skin given by hand: in a step by the rules two blocks come nearer by at most
    0.4 of the default. With springs a block that outruns the list ends the run, so that there is a reserve. Rigid
    contacts are found late then, and all blocks look ahead as far as they move in a step: that is enough.
    """
    contact, has_springs = layout.scenario.contact, layout.scenario.time.has_springs
    skin = contact.skin
    if skin is None:
        share = SKIN_SHARE_OF_PARTICLES if contact.model != "surface" and has_springs else SKIN_SHARE
        return placement.reference_length(bounds.smallest) * share
    speed = speeds.greatest + speeds.support
    nearer = 2.0 * speed * step  # a list holds for one step at least, even where it is updated at every one
    least = (RESERVE if has_springs else 1.0) * nearer
    if skin < least:
        message = (
            f"{MILLI * skin:.4g} mm is too small for this time step: two blocks that meet at {speed:.4g} m/s each come "
            f"{MILLI * nearer:.4g} mm closer in {step:.4g} s, and the contact could be missed; "
            f"at least {MILLI * ROUND_UP * least:.4g} mm is needed. Leave skin out for the default"
        )
        raise SkinTooSmallError(message, least)
    return skin
