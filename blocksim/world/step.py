"""How large, high and fast the blocks of a scene are at the start, and how fast they may become.

Time steps and skins are chosen by these bounds, known before anything moves.

The largest time step that a scene admits, from its stiffest contact state. One function, used everywhere.

Undamped limit. Two bodies in face contact: two springs K (normal) and k (shear) at the ends of the face. The fastest
mode of one body on a rigid plane has the squared frequency w2 = largest eigenvalue of

    [ 2k/m      2k d/m               ]      d: distance of the centre from the face
    [ 2k d/I    (2K b^2 + 2k d^2)/I  ]      b: half of the face's length

or 2K/m; the inverse masses of both bodies add, so for a pair w2 = w2_a + w2_b. The central difference scheme is stable
for w dt < 2. Faces that overlap by next to nothing, with both points at one end, are up to 10 % faster at Mindlin's
k/K = 0.82 and 29 % as k/K goes to 0; a safety of 0.05 leaves room for that.

Stiffness by tributary length (kernels/explicit/bearing.py) only lowers that of a corner: the bound holds, and a body
on several others is in all as stiff as on one.

Damping. The dashpot of a pair is implicit in the pair's own force and takes the forces of other pairs from the step
before. Alone, a pair is then stable for w dt < 2 at any damping ratio z. Where p pairs bear a body, each stands for a
piece of it (kernels/explicit/inertia.py) and sees p times the inverse mass. So pairs that act alike are one pair p
times as stiff, and stable as that at any z. Where they act against one another, the own force counts for more than it
does; the recurrence of position, velocity and lagged force is then stable for p (w dt)^2 < 2, at any z as well: a test
scans it. A thin plank on narrow seats at its ends rocks with three times the inverse mass of its pieces; and in the
models with particles pairs have the whole body each and count their own force q = max(1, p/2) times
(kernels/explicit/contact.py). Where the own force counts q times of p, the recurrence is stable up to

    z w dt = (1 - p (w dt)^2 / 4) / (2 (p - q))   (for small w dt and p = 2, 3, 4, 6: 0.5, 0.33, 0.25, 0.17)

So well beyond critical damping the step shrinks with 1/z:

    dt = safety * (2 / w) / max(1, z/2)

With safety = 0.05 impacts are resolved with w dt <= 0.1, some thirty steps, and z w dt <= 0.2. The frequency of p pairs
on one body in the mode that they share, translation, is about half of the bound w. For a dashpot that lags a step with
its own force as well, the factor would be sqrt(1 + z^2) - z: a quarter at z = 5.

Hertz. The slope of the force grows with the overlap; the deepest one expected decides. An impact at speed v of a mass m
goes to d = (5 m v^2/(4 K))^(2/5) (from m v^2/2 = 2/5 K d^(5/2)), a weight W to (W/K)^(2/3). As the step goes with
v^(-1/5), a speed that is wrong by a factor of ten changes it by 1.6 only.

Particles. The models with boundary particles spread the stiffness of a face over it; its two corners hold all of it in
the `surface` model, which is stiffer in rocking, so that its bound serves them too.

Time step and skin of the explicit scheme: as the scenario asks, or chosen.

The step stays within what the stiffest contact state (step.py) and the speeds of a scene admit.

Contacts are found by the corners that lie in another block at the end of a step. So in one step no block may come far
into another, let alone through it: at the greatest speed expected it moves by at most a twentieth of the smallest side,
and by a fifth of the skin of the list of neighbours, which is thinner with particles. Blocks whose impacts stay below
the usual limit of overlap, a twentieth of that side as well, move by a tenth of that in a step, as an impact takes some
thirty of them; what this bound shortens are the steps of scenes whose blocks are too fast for their springs. They end
with exit code 76 where such blocks meet, instead of passing through one another.

Bodies no farther apart than the skin are listed as neighbours, and only listed ones are examined for contacts. The list
is made again before two that are not in it can meet, so that a skin decides how long the list is and how often it is
made, and never what moves where. Particles need nothing on top: those of the `particles` model lie inside the block's
edge, and those of the `kernel` model touch nothing before they are inside the other block, however far the kernel
reaches.
"""

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import combinations_with_replacement
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.errors import InvalidInputError
from blocksim.kernels.common.arrays import OUTLINE, Records
from blocksim.kernels.explicit.inertia import APPROACH_STEPS
from blocksim.scenario import Scenario
from blocksim.scenario.models.stepping import Explicit
from blocksim.scenario.motion import greatest_rate, motion_pieces
from blocksim.scenario.placement import length_beside
from blocksim.world.bodies import Shapes
from blocksim.world.forcing import driven_speed, greatest_push, highest_rise, steepest_tilt
from blocksim.world.interactions import Interactions
from blocksim.world.systems import largest_step


class Kind(NamedTuple):
    """Blocks that are alike."""

    half_x: float  # m
    half_y: float  # m
    inverse_mass: float  # 1/kg
    inverse_inertia: float  # 1/(kg m2)
    contact_class: int


class Bounds(NamedTuple):
    """Of the blocks of one scene, without the ground and its pieces."""

    smallest: float  # m, smallest side; infinite where there are no blocks
    top: float  # m, no corner is higher
    speed: float  # m/s, no point is faster
    mass: float  # kg, of all free ones
    free: int  # blocks that are not fixed
    kinds: frozenset[Kind]
    grounds: frozenset[int]  # contact classes of the half-plane and its pieces
    standing: frozenset[Kind]  # blocks on each of their faces, as `standing_of` has them


def bounds_of(bodies: NDArray[np.record], blocks: int, shapes: Sequence[Shapes | None]) -> list[Bounds]:
    """Return the bounds of scenes, given their bodies (m, n + 1), of which so many are blocks, and shapes of blocks."""
    all_blocks = bodies[:, :blocks]
    columns = {name: np.ascontiguousarray(all_blocks[name]) for name in ("radius", "half_x", "half_y", "mass")}
    sides = 2.0 * np.minimum(columns["half_x"], columns["half_y"])
    if any(shape is not None for shape in shapes):
        sides = np.where(all_blocks["faces"] == OUTLINE, all_blocks["least_width"], sides)
    smallest = sides.min(axis=1, initial=math.inf)
    top = np.max(all_blocks["y"] + columns["radius"], axis=1, initial=-math.inf)
    speed = np.max(
        np.hypot(all_blocks["vx"], all_blocks["vy"]) + columns["radius"] * np.abs(all_blocks["spin"]),
        axis=1,
        initial=0.0,
    )
    # one by one: the order of a sum must not depend on which other scenes there are
    masses = [float(np.sum(mass[mass > 0.0])) for mass in columns["mass"]]
    free = np.count_nonzero(columns["mass"] > 0.0, axis=1).tolist()
    columns_of_kinds = zip(*(all_blocks[name].tolist() for name in Kind._fields), strict=True)
    kinds = [frozenset(map(Kind, *one)) for one in columns_of_kinds]
    standing = [
        one if shape is None else standing_kinds(bodies, shape)
        for one, bodies, shape in zip(kinds, all_blocks, shapes, strict=True)
    ]
    grounds = bodies["contact_class"][:, blocks:].tolist()
    rows = zip(smallest.tolist(), top.tolist(), speed.tolist(), masses, free, kinds, grounds, standing, strict=True)
    return [
        Bounds(side, height, pace, mass, count, kind, frozenset(ground), faces)
        for side, height, pace, mass, count, kind, ground, faces in rows
    ]


def standing_kinds(blocks: NDArray[np.record], shapes: Shapes) -> frozenset[Kind]:
    """Return the blocks of a scene as they stand, a polygon on each of its faces.

    In place of `half_x` is how far along the face a corner is from the foot of the centroid, at most, and in place of
    `half_y` the distance of the face: what half sides are to a rectangle.
    """
    kinds: set[Kind] = set()
    for block, first, size in zip(blocks, shapes.firsts, shapes.sizes, strict=False):
        kind = Kind(*(block[name].item() for name in Kind._fields))
        if block["faces"] == OUTLINE:
            faces = _faces_of(shapes.table[first : first + size].view(np.recarray))
            kinds.update(kind._replace(half_x=reach, half_y=distance) for reach, distance in faces)
        else:
            kinds.add(kind)
    return frozenset(kinds)


def _faces_of(corners: Records) -> Iterator[tuple[float, float]]:
    """Yield how far (m) the corners of each face are from the foot of the centroid, and its distance (m)."""
    tangents = np.stack([-corners["ny"], corners["nx"]])
    places = np.stack([corners["x"], corners["y"]])
    ends = np.abs(np.stack([(tangents * places).sum(axis=0), (tangents * np.roll(places, -1, axis=1)).sum(axis=0)]))
    yield from zip(ends.max(axis=0).tolist(), corners["distance"].tolist(), strict=True)


def fastest_fall(scenario: Scenario, bounds: Bounds) -> float:
    """Return the speed (m/s) at which the highest corner would reach the lowest ground, from rest."""
    lowest = min((y for _, y in scenario.ground.profile or ()), default=0.0)
    height = max(0.0, bounds.top + highest_rise(scenario) - lowest)
    return math.sqrt(2.0 * scenario.gravity * math.cos(scenario.ground.tilt) * height)


def impact_speed(scenario: Scenario, bounds: Bounds) -> float:
    """Return the bound (m/s) of the speed of any point of a block that does not slide downhill."""
    return math.hypot(given_speed(scenario, bounds), fastest_fall(scenario, bounds))


def given_speed(scenario: Scenario, bounds: Bounds) -> float:
    """Return the greatest speed (m/s) of any point of a block that the scenario itself gives."""
    new = (event.velocity for event in scenario.events)
    sizes = [math.hypot(block.size_x, block.size_y) for block in scenario.blocks.values()]
    given = (
        math.hypot(one.vx or 0.0, one.vy or 0.0) + 0.5 * max(sizes, default=0.0) * abs(one.spin or 0.0)
        for one in new
        if one is not None
    )
    return max(bounds.speed, driven_speed(scenario), *given)


def greatest_speed(scenario: Scenario, bounds: Bounds, table: Interactions) -> float:
    """Return the bound (m/s) of the speed of any point of a block."""
    tilt = steepest_tilt(scenario)
    held = least_support_friction(bounds, table) * math.cos(tilt)
    pull = max(0.0, scenario.gravity * (math.sin(tilt) - held) + greatest_push(scenario))
    return impact_speed(scenario, bounds) + pull * scenario.time.end


def least_support_friction(bounds: Bounds, table: Interactions) -> float:
    """Return the least kinetic friction of free blocks with the ground, its pieces and fixed blocks.

    On one another blocks do not slide farther than they are long.
    """
    free = {kind.contact_class for kind in bounds.kinds if kind.inverse_mass > 0.0}
    fixed = {kind.contact_class for kind in bounds.kinds if not kind.inverse_mass > 0.0}
    pairs = itertools.product({*fixed, *bounds.grounds}, free)
    return min((table[i][j].kinetic_friction for i, j in pairs), default=math.inf)


def support_speed(scenario: Scenario) -> float:
    """Return the greatest speed (m/s) of the support, zero where it does not move."""
    if scenario.motion is None:
        return 0.0
    return greatest_rate(motion_pieces(scenario))


STABILITY_LIMIT = 2.0


class ContactBody(NamedTuple):
    """Contribution of one body to the stiffest contact state; inverse masses are zero for fixed bodies."""

    size_x: float  # m
    size_y: float  # m
    inverse_mass: float  # 1/kg
    inverse_inertia: float  # 1/(kg m2)


class ContactStiffness(NamedTuple):
    """Springs and damping ratios of one pair of contact classes."""

    normal: float  # N/m
    shear: float  # N/m
    damping_ratio: float  # -, the larger of the normal and the shear one


class Load(NamedTuple):
    """Loads on the contacts of a scene, for laws whose stiffness grows with the overlap."""

    speed: float  # m/s, of the fastest impact expected
    weight: float  # N, of all free bodies


def max_tangent_stiffness(law: str, stiffness: float, inverse_mass: float, load: Load) -> float:
    """Return the greatest slope (N/m) of the normal force that a contact of two bodies is expected to reach.

    `stiffness` as in the interaction table; `inverse_mass` (1/kg) of both bodies together.
    """
    if law == "linear" or inverse_mass == 0.0:
        return stiffness
    impact = (1.25 * load.speed**2 / (inverse_mass * stiffness)) ** 0.4
    static = (load.weight / stiffness) ** (2.0 / 3.0)
    return 1.5 * stiffness * math.sqrt(max(impact, static))


def _face_frequency_squared(half: float, distance: float, body: ContactBody, normal: float, shear: float) -> float:
    slide = 2.0 * shear * body.inverse_mass
    coupling = 2.0 * shear * distance
    rock = (2.0 * normal * half**2 + 2.0 * shear * distance**2) * body.inverse_inertia
    mixed = coupling**2 * body.inverse_mass * body.inverse_inertia
    rocking_mode = 0.5 * (slide + rock) + math.sqrt(0.25 * (slide - rock) ** 2 + mixed)
    return max(2.0 * normal * body.inverse_mass, rocking_mode)


def frequency_squared(body: ContactBody, normal: float, shear: float) -> float:
    """Return w2 (1/s2), the stiffest mode of a body that stands with one of its faces on a rigid plane."""
    half_x, half_y = 0.5 * body.size_x, 0.5 * body.size_y
    return max(
        _face_frequency_squared(half_x, half_y, body, normal, shear),
        _face_frequency_squared(half_y, half_x, body, normal, shear),
    )


def stable_step(pairs: Iterable[tuple[ContactBody, ContactBody | None, ContactStiffness]], safety: float) -> float:
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
    """The time step of a scenario cannot be taken."""


class StepTooLargeError(StepError):
    """A manual step exceeds the admissible one and is not forced; `limit` in s."""

    def __init__(self, step: float, limit: float) -> None:
        """Report both."""
        self.limit = limit
        super().__init__(
            f"{step:.4g} s is above the largest safe step {limit:.4g} s; "
            'use step = "auto", or force_step = true to override'
        )


class UncountableStepsError(StepError):
    """Step and end are incompatible: more steps than can be counted, or steps of length zero."""

    def __init__(self, end: float, step: float) -> None:
        """Report both."""
        super().__init__(f"{end:.4g} s cannot be divided into steps of {step:.4g} s")


class SkinTooSmallError(InvalidInputError):
    """Two blocks at `speed` (m/s) come too near in a `step` (s) for the skin (m) given by hand; `least` in m."""

    def __init__(self, skin: float, least: float, speed: float, step: float) -> None:
        """Say by how much, and the least skin."""
        self.least = least
        super().__init__(
            f"{MILLI * skin:.4g} mm is too small for this time step: two blocks that meet at {speed:.4g} m/s each come "
            f"{MILLI * nearer_in_a_step(speed, step):.4g} mm closer in {step:.4g} s, and the contact could be missed; "
            f"at least {MILLI * ROUND_UP * least:.4g} mm is needed. Leave skin out for the default"
        )


def admissible_step(bounds: Bounds, table: Interactions, safety: float, law: str, load: Load) -> float:
    """Return the largest safe step (s) of blocks within these bounds with these contact parameters."""
    kinds = [
        (
            ContactBody(2.0 * kind.half_x, 2.0 * kind.half_y, kind.inverse_mass, kind.inverse_inertia),
            kind.contact_class,
        )
        for kind in bounds.standing
    ]

    def stiffness(i: int, j: int, inverse_mass: float) -> ContactStiffness:
        row = table[i][j]
        normal = max_tangent_stiffness(law, row.normal_stiffness, inverse_mass, load)
        return ContactStiffness(normal, normal * row.shear_ratio, max(row.normal_damping, row.shear_damping))

    grounded = [
        (body, None, stiffness(c, ground, body.inverse_mass)) for body, c in kinds for ground in {0, *bounds.grounds}
    ]
    if law == "linear":  # stiffness goes with the classes only: of hundreds of kinds in a class the stiffest decides
        classes = combinations_with_replacement(dict.fromkeys(c for _, c in kinds), 2)
        springs = [(ca, cb, stiffness(ca, cb, 0.0)) for ca, cb in classes]
        paired = [(_stiffest(kinds, ca, one), _stiffest(kinds, cb, one), one) for ca, cb, one in springs]
    else:
        paired = [
            (a, b, stiffness(ca, cb, a.inverse_mass + b.inverse_mass))
            for (a, ca), (b, cb) in combinations_with_replacement(kinds, 2)
        ]
    return stable_step([*grounded, *paired], safety)


def _stiffest(kinds: Sequence[tuple[ContactBody, int]], of_class: int, springs: ContactStiffness) -> ContactBody:
    """Return the body of a class with the stiffest mode on given springs."""
    bodies = (body for body, one in kinds if one == of_class)
    return max(bodies, key=lambda body: frequency_squared(body, springs.normal, springs.shear))


def expected_load(scenario: Scenario, bounds: Bounds) -> Load:
    """Return the speed that the fastest point may reach by falling, or by sliding all the time, and the weight."""
    push = greatest_push(scenario)
    along = scenario.gravity * math.sin(steepest_tilt(scenario)) + push
    speed = given_speed(scenario, bounds) + fastest_fall(scenario, bounds) + along * scenario.time.end
    return Load(speed, (scenario.gravity + push) * bounds.mass)


def step_of_contacts(scenario: Scenario, bounds: Bounds, table: Interactions, safety: float) -> float:
    """Return the largest safe step (s) of the contacts of a scenario's blocks."""
    return admissible_step(bounds, table, safety, scenario.contact.law, expected_load(scenario, bounds))


def safety_of(scenario: Scenario) -> float:
    """Return the automatic step as a share of the stability limit. Raises ValueError without springs."""
    if not isinstance(scenario.time, Explicit):
        message = f"scenario {scenario.name} does not use the explicit scheme"
        raise ValueError(message)  # noqa: TRY004 - the scenario is of the right type
    return scenario.time.safety


def choose_step(scenario: Scenario, bounds: Bounds, table: Interactions) -> float:
    """Return the step (s) the run will take; raises StepTooLargeError."""
    safety = safety_of(scenario)
    with np.errstate(all="ignore"):  # absurd sizes and stiffnesses end in a step of zero, which is refused below
        try:
            of_contacts = step_of_contacts(scenario, bounds, table, safety)
            speed = greatest_speed(scenario, bounds, table) + support_speed(scenario)
            share = TRAVEL_SHARE if scenario.contact.model == "surface" else TRAVEL_SHARE_OF_PARTICLES
            of_travel = share * bounds.smallest / speed if speed > 0.0 else math.inf
            limit = min(of_contacts, of_travel, largest_step(scenario))
        except ArithmeticError:  # Python's own powers do not end in infinity
            limit = 0.0
    limit = min(limit, scenario.time.end)
    asked = scenario.time.step
    step = limit if asked == "auto" else asked
    if not 0.0 < step < math.inf or scenario.time.end / step > MOST_STEPS:
        raise UncountableStepsError(scenario.time.end, step)
    if step > limit and not scenario.time.force_step:
        raise StepTooLargeError(step, limit)
    return step


def nearer_in_a_step(speed: float, step: float) -> float:
    """Return how much nearer (m) two bodies come in a step (s) that meet at this speed (m/s) each."""
    return 2.0 * speed * step


def choose_skin(scenario: Scenario, bounds: Bounds, table: Interactions, step: float) -> float:
    """Return the skin (m) the run will have, given the step (s).

    Raises SkinTooSmallError. Only for a skin given by hand: in a step by the rules two blocks come nearer by at most
    0.4 of the default. With springs a block that outruns the list ends the run, so that there is a reserve. Rigid
    contacts are found late then, and all blocks look ahead as far as they move in a step: that is enough.
    """
    given = scenario.contact.skin
    if given is None:
        share = SKIN_SHARE_OF_PARTICLES if _has_particles(scenario) else SKIN_SHARE
        return length_beside(bounds.smallest) * share
    speed = greatest_speed(scenario, bounds, table) + support_speed(scenario)
    reserve = RESERVE if scenario.time.has_springs else 1.0
    # a list holds for one step at least, even where it is updated at every one
    least = reserve * nearer_in_a_step(speed, step)
    if given < least:
        raise SkinTooSmallError(given, least, speed, step)
    return given


def choose_approach(scenario: Scenario, bounds: Bounds, table: Interactions, step: float) -> float:
    """Return the gap (m) below which bodies are listed whatever the skin: what they are seen to approach in.

    As far as the fastest comes while approaches are looked for, within shares of the default skin. Models with
    particles look for none.
    """
    if _has_particles(scenario):
        return 0.0
    default = length_beside(bounds.smallest) * SKIN_SHARE
    way = APPROACH_STEPS * step * greatest_speed(scenario, bounds, table)
    return min(max(way, LEAST_APPROACH * default), MOST_APPROACH * default)


def _has_particles(scenario: Scenario) -> bool:
    return scenario.contact.model != "surface" and scenario.time.has_springs
