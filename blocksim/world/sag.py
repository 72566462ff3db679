"""Loads of blocks at rest, and how far rigid contacts give way under them.

Every block passes its weight, and that of the blocks on it, to its supports: to blocks whose upper faces are as high as
its lower one, or else to the ground. Blocks are taken from above downwards, so that all loads on a block are known
before it passes its own on. Of more than one support the two outermost share the load by the lever; each touches along
an interval whose two ends share its part by the lever too. Turned blocks count as their bounding boxes.

The position pass holds blocks apart like springs, stiffer for small steps: at rest s = -F A / w^2 for a contact point
that carries F, A = J M^-1 J^T, w = 2 pi f / h (blocksim.kernels.nonsmooth), a spring of w^2 / A, proportional to 1 /
h^2. Of two blocks in face contact A = sum of 1/m + r^2/I over both, with half a side as the lever arm r, as far as the
point is from the middle.
"""

import math
from bisect import bisect_left
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from blocksim.kernels.common.arrays import World
from blocksim.kernels.nonsmooth.arrays import AWAY, NOT_STRUCK, Nonsmooth
from blocksim.scenario import PlacedBody, Scenario, geometry, placement
from blocksim.scenario.laws import LAWS

TOUCHING = 1e-3  # of the smallest side: faces that near to each other touch
FREQUENCY = 0.125  # of the soft contact, per substep: w h = 2 pi / 8. Above 0.15 walls spread like a fluid
DAMPING = 10.0  # damping ratio of the soft contact
WARNING_SHARE = 0.01  # of the smallest side: overlap of any contact
SOFT_SHARE = 0.001  # of the smallest side: overlap under the weight above, beside soil
CRUSHED_SHARE = 0.001  # of the smallest side: sag of what light blocks carry that is heavier by at least UNLIKE
UNLIKE = 10.0  # ratio of masses; walls and stacks of alike blocks are far from it
DRIFT = 25.0  # substeps: time constant of the soft contact, 2 zeta / w
STILL = 0.1  # of an overlap, that it may change by in that time at rest
UPRIGHT = 0.1  # cosine of the angle between a normal and the vertical, from which on one body lies on the other
MILLI, PERCENT = 1e3, 1e2
Courses = dict[int, list[tuple[float, int]]]  # right ends (m) and numbers of blocks by the heights of their upper faces


class Box(NamedTuple):
    """A block from outside (m)."""

    left: float
    right: float
    bottom: float
    top: float


class EndLoad(NamedTuple):
    """Load of one end of an interval of contact: `lower` is None for the ground."""

    upper: int
    lower: int | None
    x: float  # m
    force: float  # N


def box_of(body: PlacedBody) -> Box:
    """Return the bounding box of a block."""
    c, s = math.cos(body.angle), math.sin(body.angle)
    (left, bottom), (right, top) = geometry.box_of([(c * x - s * y, s * x + c * y) for x, y in body.corners])
    return Box(body.x + left, body.x + right, body.y + bottom, body.y + top)


def loads_at_rest(placed: Sequence[PlacedBody], gravity: float) -> list[EndLoad]:
    """Return what the ends of all contacts below free blocks carry, from above downwards."""
    boxes = [box_of(body) for body in placed]
    near = TOUCHING * placement.smallest_width(placed)
    courses: Courses = defaultdict(list)
    for i, box in enumerate(boxes):
        courses[math.floor(box.top / near)].append((box.right, i))
    for course in courses.values():
        course.sort()
    forces = [body.mass * gravity for body in placed]  # N, that have come down upon a block, its own weight first
    moments = [force * body.x for force, body in zip(forces, placed, strict=True)]  # N m, about x = 0
    loads: list[EndLoad] = []
    for upper in sorted(range(len(placed)), key=lambda i: -boxes[i].bottom):
        if placed[upper].fixed:
            continue
        box, force = boxes[upper], forces[upper]
        x = moments[upper] / force if force > 0.0 else 0.0
        below = _supports(box, boxes, courses, near)
        found = sorted((max(box.left, boxes[i].left), min(box.right, boxes[i].right), i) for i in below)
        spans: list[tuple[float, float, int | None]] = [*found] or [(box.left, box.right, None)]
        parts = [(spans[0], force, x)]
        if len(spans) > 1:
            one, two = (0.5 * (left + right) for left, right, _ in (spans[0], spans[-1]))
            share = _lever(one, two, x)
            parts = [(spans[0], (1.0 - share) * force, one), (spans[-1], share * force, two)]
        for (left, right, lower), part, place in parts:
            share = _lever(left, right, place)
            for end, own in ((left, (1.0 - share) * part), (right, share * part)):
                loads.append(EndLoad(upper, lower, end, own))
                if lower is not None:
                    forces[lower] += own
                    moments[lower] += own * end
    return loads


def _supports(box: Box, boxes: Sequence[Box], courses: Courses, near: float) -> Iterator[int]:
    """Yield the blocks that reach under a box; a course is sorted by right ends, and does not overlap."""
    level = math.floor(box.bottom / near)
    for course in (courses.get(level + k, []) for k in (-1, 0, 1)):
        for right, i in course[bisect_left(course, (box.left + near, -1)) :]:
            if boxes[i].left >= box.right - near:
                break
            if abs(boxes[i].top - box.bottom) <= near and right > box.left:
                yield i


def _lever(one: float, two: float, x: float) -> float:
    """Return the share of a load at x that comes upon `two`; half of it where both are one place to the last digit."""
    if one == two:
        return 0.5
    return min(1.0, max(0.0, (x - one) / (two - one)))


class SoftBase(NamedTuple):
    """The contact on springs that gives way most under the weight above it."""

    block: str  # above the contact
    overlap: float  # m
    share: float  # of the smallest side
    scale: float  # contact.stiffness_scale with which that would be SOFT_SHARE

    @property
    def warning(self) -> str:
        """What to say where soil would move with it; empty where it is stiff enough."""
        if self.share <= SOFT_SHARE:
            return ""
        return (
            f"block {self.block} sinks {MILLI * self.overlap:.2g} mm into its springs under the weight above, "
            f"{self.share:.1%} of the smallest side, and walls lean the more beside soil: "
            f"contact.stiffness_scale = {self.scale:.1g} keeps it to {SOFT_SHARE:.1%}"
        )


def soft_base(scenario: Scenario, placed: Sequence[PlacedBody], world: World) -> SoftBase | None:
    """Return the contact of blocks at rest that gives way most; None where springs are not linear, or none is loaded.

    `world` has the stiffnesses of contact points, of which a face has two.
    """
    classes, values = world.bodies["contact_class"], world.interactions["normal_stiffness"]
    if not scenario.time.has_springs or not LAWS[scenario.contact.law].is_linear:
        return None
    found = [
        (load.force / float(values[classes[load.upper], classes[-1 if load.lower is None else load.lower]]), load)
        for load in loads_at_rest(placed, scenario.gravity.size)
    ]
    overlap, load = max(found, key=lambda one: one[0], default=(0.0, None))
    if load is None or not overlap > 0.0:
        return None
    share = overlap / placement.smallest_width(placed)
    scale = scenario.contact.stiffness_scale * share / SOFT_SHARE
    return SoftBase(placed[load.upper].name, overlap, share, rounded_up(scale))


def rounded_up(scale: float) -> float:
    """Return the next number above with one digit."""
    power = 10.0 ** math.floor(math.log10(scale))
    return math.ceil(scale / power - 1e-9) * power


class SoftContact(NamedTuple):
    """Feedback of the position pass; see blocksim.kernels.nonsmooth."""

    bias: float  # 1/s: b
    softness: float  # -: gamma / A
    frequency: float  # 1/s: w, so that the stiffness at rest is w^2 / A


def soft_contact(substep: float) -> SoftContact:
    """Return the feedback for a substep (s)."""
    turn = 2.0 * math.pi * FREQUENCY  # w h
    return SoftContact(turn / substep / (turn + 2.0 * DAMPING), 1.0 / (turn * (turn + 2.0 * DAMPING)), turn / substep)


def inverse_mass(body: PlacedBody, arm: float) -> float:
    """Return A (1/kg) of one block for a force with this lever arm (m); zero where it is fixed."""
    return 0.0 if body.fixed else 1.0 / body.mass + arm**2 / body.inertia


def point_stiffness(substep: float, blocks: Iterable[PlacedBody]) -> float:
    """Return the stiffness (N/m) of one contact point of one block with the ground, or of two with each other.

    The point is at the end of their faces, as long as the lower one of a block that is not turned.
    """
    total = sum(inverse_mass(body, 0.5 * body.size_x) for body in blocks)
    return soft_contact(substep).frequency ** 2 / total if total > 0.0 else math.inf


class Sag(NamedTuple):
    """Sag of blocks in the initial arrangement (m): the one that sinks most, and the contact that overlaps most."""

    sag: float
    block: str
    overlap: float
    crushed: float  # of the corner that sinks most into light blocks that carry heavy ones


def scene_sag(substep: float, placed: Sequence[PlacedBody], gravity: float) -> Sag:
    """Return the sag of the blocks of a scene at rest on one another.

    The stiffness w^2 / A of a contact goes with the smaller mass of its pair, not with what it carries. So a heavy
    block on a light one sinks by their ratio further than equal blocks.
    """
    square = soft_contact(substep).frequency ** 2
    sunk, crushed = [0.0] * len(placed), [0.0] * len(placed)
    most = 0.0
    loads = loads_at_rest(placed, gravity)
    total: defaultdict[int, float] = defaultdict(float)
    for load in loads:
        total[load.upper] += load.force
    masses = [0.0 if body.fixed else body.mass for body in placed]
    burdened = _burdened(((load.upper, load.lower) for load in loads if load.force > 0.0), masses)
    for load in reversed(loads):  # from below upwards
        if load.force > 0.0:
            pair = [placed[i] for i in (load.upper, load.lower) if i is not None]
            overlap = load.force * sum(inverse_mass(body, load.x - body.x) for body in pair) / square
            below = 0.0 if load.lower is None else sunk[load.lower]
            sunk[load.upper] += load.force / total[load.upper] * (overlap + below)
            most = max(most, overlap)
            _crush(crushed, (load.upper, load.lower), overlap, burdened)
    deepest = max(range(len(placed)), key=sunk.__getitem__)
    return Sag(sunk[deepest], placed[deepest].name, most, max(crushed))


def _burdened(pairs: Iterable[tuple[int, int | None]], masses: Sequence[float]) -> frozenset[int]:
    """Return the free bodies below one that is UNLIKE times as heavy, directly or not.

    `pairs` are upper and lower bodies from above downwards, `masses` (kg) are zero for fixed ones.
    """
    heaviest = [0.0] * len(masses)  # kg, of what is above
    for upper, lower in pairs:
        if lower is not None:
            heaviest[lower] = max(heaviest[lower], heaviest[upper], masses[upper])
    return frozenset(i for i, mass in enumerate(masses) if mass > 0.0 and heaviest[i] >= UNLIKE * mass)


def _crush(crushed: list[float], pair: tuple[int, int | None], overlap: float, burdened: frozenset[int]) -> None:
    """Add an overlap (m) to what the upper body of a pair sinks into light ones; pairs come from below upwards."""
    upper, lower = pair
    below = 0.0 if lower is None else crushed[lower]
    own = overlap if upper in burdened or lower in burdened else 0.0
    crushed[upper] = max(crushed[upper], below + own)


def current_crush_depth(scene: Nonsmooth) -> float:
    """Return how far (m) a corner has sunk into light blocks that carry heavy ones, where contacts are at rest.

    The same as `Sag.crushed`, measured: also where blocks have come to lie on others.
    """
    bodies, controls, stepping = scene.world.bodies, scene.world.controls[0], scene.contacts.stepping[0]
    gravity = math.hypot(controls.gravity_x, controls.gravity_y)
    inverse = bodies["inverse_mass"]
    free = inverse[inverse > 0.0]
    if not gravity > 0.0 or free.size == 0 or free.max() < UNLIKE * free.min():
        return 0.0
    found = scene.contacts.constraints[: stepping.constraint_count].view(np.recarray)
    down = (found["nx"] * controls.gravity_x + found["ny"] * controls.gravity_y) / gravity
    # of constraints that press, not of impacts and of bodies that still move
    one, two = (np.where(found[f"normal_{name}"] > 0.0, -found[f"gap_{name}"], 0.0) for name in ("one", "two"))
    overlap = np.where((found["reach"] == AWAY) | (found["is_struck"] != NOT_STRUCK), 0.0, np.maximum(one, two))
    a, b = bodies[found["a"]], bodies[found["b"]]
    rate = np.hypot(a["vx"] - b["vx"], a["vy"] - b["vy"]) + np.abs(a["radius"] * a["spin"])
    rate += np.abs(b["radius"] * b["spin"])
    overlap = np.where(DRIFT * stepping.substep * rate < STILL * overlap, overlap, 0.0)
    heights = -(bodies["x"] * controls.gravity_x + bodies["y"] * controls.gravity_y) / gravity
    upper = np.where(down < 0.0, found["a"], found["b"]).astype(np.int64)
    lower = np.where(down < 0.0, found["b"], found["a"]).astype(np.int64)
    chosen = np.flatnonzero((overlap > 0.0) & (np.abs(down) > UPRIGHT))
    chosen = chosen[np.argsort(-heights[upper[chosen]], kind="stable")]
    pairs = list(zip(upper[chosen].tolist(), lower[chosen].tolist(), strict=True))
    burdened = _burdened(pairs, np.where(inverse > 0.0, bodies["mass"], 0.0).tolist())
    crushed = [0.0] * len(bodies)
    for pair, depth in zip(reversed(pairs), overlap[chosen[::-1]].tolist(), strict=True):
        _crush(crushed, pair, depth, burdened)
    return max(crushed)


def overlap_warning(overlap: float, crushed: float, smallest: float) -> str:
    """Return a warning of overlaps at rest, given the smallest side; nothing where they are small.

    All in m: of any contact, and `crushed` as in Sag.
    """
    if crushed > CRUSHED_SHARE * smallest:
        found, share = f"rigid contacts give way by {MILLI * crushed:.3g} mm at rest", CRUSHED_SHARE
    elif overlap > WARNING_SHARE * smallest:
        found, share = f"rigid contacts overlap by {MILLI * overlap:.3g} mm at rest", WARNING_SHARE
    else:
        return ""
    return (
        f"{found}, above {PERCENT * share:g}% of the smallest side ({MILLI * smallest:.4g} mm): "
        "a light block carries a heavy one; overlaps grow with time.step squared"
    )
