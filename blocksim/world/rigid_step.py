"""The time step of the non-smooth scheme: by how far a block moves while its contacts stay as they were found.

Contacts are found once a step, and what a block turns and moves meanwhile is the error of a step, first order in its
length. So the automatic step is the usual one unless the fastest point could move farther than a tenth of the smallest
side in it. That speed is a bound, a fall of the highest corner to the lowest ground, or sliding down to the end of
time; walls do not fall that fast. A manual step is therefore refused only where blocks go farther from the
start, or in one substep at that bound.

A block that meets something in a substep h stays there until it ends, and has not yet moved with its new velocity: it
is behind by what the impact adds to velocity and spin times h/2 on average, and gravity changes its speed by g h
meanwhile. Every impact passes that on to the next. Against speeds of free falls over sides L, sqrt(g L), that is h /
sqrt(L/g). A few blocks can afford to have it small: a step is at most a share of sqrt(L/g) that grows with their
number, so that costs are about the same, and that of a crowd is the usual one. The usual step is divided by whole
numbers, so that outputs fall on the ends of steps. So with the way in a step at the speed of an impact. Supports that
move count as bodies that are driven do: they come no farther towards a block in a step than blocks may move, and a step
is a twentieth of their shortest period at most. Where few blocks rebound strongly that is not enough, as hops multiply
errors a hundredfold: their steps are cut at impacts, see blocksim.kernels.nonsmooth.cuts.

Contacts give way at rest as if they were springs, in proportion to the step squared. The step of few blocks is so short
that this leaves their strength as it is: heavy blocks on light ones sink no farther than sag.py allows, and the thrust
of arches and leaning columns stays where it is. A contact point at rest is a spring of w^2 / A (sag.py); friction holds
along the joint. So the displacements of a small scene follow from one linear system with three unknowns per free block.
Points in tension open: the worst are taken out, until none is left. Blocks that sink along the load path stay as strong
as they were. What harms is displacement across it: the load above comes down elsewhere in the joints below. Its measure
is how far a joint moves across its force, over its width, times that force over the greatest of the structure, and half
of it in columns and walls. Limits of `ground.tilt` are too low by some 5 to 10 times this measure.

Joints are found from the corners of bodies as they are placed. Outlines are convex, so that two bodies touch along one
interval or at one point. The ends of an interval are corners of one of the two that lie on an edge of the other,
whatever the shape: rectangles, outlines, drawn polygons, voussoirs, pieces of ground and walls, and the half-plane.
"""

import math
from collections import defaultdict
from collections.abc import Collection, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.kernels.common.arrays import LOAD_FIELD, LOAD_FORCE
from blocksim.scenario import PlacedBody, PlacedSegment, geometry, motion, placement
from blocksim.world.bodies import Layout
from blocksim.world.sag import CRUSHED_SHARE, TOUCHING, UNLIKE, WARNING_SHARE, scene_sag, soft_contact
from blocksim.world.step import Bounds, Speeds, StepError, Stride, choose_skin, refuse_uncountable, speeds_of

USUAL_STEP = 1e-3  # s
SHARE = 0.1  # of the smallest side
FEW = 13  # free blocks: fewer take shorter steps
NATURAL = 0.02  # of sqrt(L/g): the step of so many
CROWD = 100  # free blocks, from which on sagging does not shorten a step
CALM = 0.9  # of the overlap or sag that is warned of
SHIFT = 2e-5  # of the width of a joint, calibrated: limits are too low by some 0.02 %
PERIOD_SHARE = 0.05  # of the shortest period of a prescribed motion: its velocity changes by a third in a step
MILLI, PERCENT = 1e3, 1e2
OTHERWISE = 'Use step = "auto", or force_step = true to override'
HOLD = 100.0  # stiffness along a joint over that across it: rigid, and as accurate
PASSES = 20
ROUND_OFF = 1e-9  # of the greatest pressure: tension that is none
WORST = 0.5  # of the greatest tension: points with more open in the same pass
SLACK = 1e-12  # of its stiffness: what holds a block that joints do not
LOOSE = 1e6  # over the overlap of one point that carries everything: only mechanisms move farther
FALLS = 50.0  # over displacements with all points closed: only mechanisms move farther
FEW_UPRIGHT = 3  # rectangles along the axes, of which a stack cannot lean far
COURSED = 0.5  # calibrated: limits of columns and walls are off by half as much as those of arches, or less
PARALLEL = 1e-3  # sine of the angle between normals of one direction
Floats = NDArray[np.float64]
Point = tuple[float, float]


class ContactJoint(NamedTuple):
    """Where two bodies touch; pieces of ground and walls are numbered after the blocks, the half-plane comes last."""

    one: int
    other: int
    normal: Point  # from one to the other
    points: tuple[Point, ...]  # m: one, or the two ends


class _Side(NamedTuple):
    """What a body shows to others: faces from corner to corner, with the solid on the left."""

    body: int
    faces: Sequence[tuple[Point, Point]]
    corners: Sequence[Point]


class _Hit(NamedTuple):
    """A corner of one body on a face of another."""

    point: Point
    owner: int  # of the face
    normal: Point  # out of the owner
    is_inside: bool  # not at an end of the face


def joints_of(
    placed: Sequence[PlacedBody], segments: Sequence[PlacedSegment], free: Collection[int], near: float, *, level: bool
) -> list[ContactJoint]:
    """Return the joints of free blocks with each other and with supports; faces up to `near` (m) apart touch.

    `level` says whether the half-plane y < 0 is one of the supports.
    """
    sides = []
    for i, body in enumerate(placed):
        corners = [body.ground_point(x, y) for x, y in body.corners]
        sides.append(_Side(i, list(zip(corners, [*corners[1:], corners[0]], strict=True)), corners))
    low, high = geometry.box_of([corner for side in sides if side.body in free for corner in side.corners])
    (left, bottom), (right, top) = (low[0] - near, low[1] - near), (high[0] + near, high[1] + near)
    for one in segments:  # a piece has its solid on the right; its ends count where they are edges
        start, end = (one.x0, one.y0), (one.x1, one.y1)
        edges = [*([start] if one.touches_start else []), *([end] if one.touches_end else [])]
        sides.append(_Side(len(sides), [(end, start)], edges))
    if level:
        sides.append(_Side(len(sides), [((right, 0.0), (left, 0.0))], []))
    within = [
        side
        for side in sides
        for (x0, y0), (x1, y1) in [geometry.box_of([corner for face in side.faces for corner in face])]
        if x0 <= right and x1 >= left and y0 <= top and y1 >= bottom
    ]
    hits = defaultdict(list)
    for pair, hit in _hits(within, free, near):
        hits[pair].append(hit)
    found = (_joint(pair, some, near) for pair, some in hits.items())
    return [joint for joint in found if joint is not None]


def _hits(sides: Sequence[_Side], free: Collection[int], near: float) -> Iterator[tuple[tuple[int, int], _Hit]]:
    """Yield all corners on faces of other bodies, where one of the two is free."""
    corners = np.array([corner for side in sides for corner in side.corners])
    owners = np.array([side.body for side in sides for _ in side.corners])
    faces = np.array([face for side in sides for face in side.faces])
    bodies = np.array([side.body for side in sides for _ in side.faces])
    way = faces[:, 1] - faces[:, 0]
    length = np.hypot(way[:, 0], way[:, 1])
    way /= length[:, None]
    x, y = (corners[:, None, axis] - faces[None, :, 0, axis] for axis in (0, 1))
    along = way[:, 0] * x + way[:, 1] * y
    away = np.abs(way[:, 0] * y - way[:, 1] * x)
    touches = (away <= near) & (np.abs(along - 0.5 * length) <= 0.5 * length + near) & (owners[:, None] != bodies)
    for corner, face in np.argwhere(touches).tolist():
        i, j = int(owners[corner]), int(bodies[face])
        if i in free or j in free:
            x0, y0 = corners[corner].tolist()
            dx, dy = way[face].tolist()
            is_inside = near < along[corner, face] < length[face] - near
            yield (min(i, j), max(i, j)), _Hit((x0, y0), j, (dy, -dx), bool(is_inside))


def _joint(pair: tuple[int, int], hits: Sequence[_Hit], near: float) -> ContactJoint | None:
    """Return the joint of two bodies; None where only corners touch."""
    first = hits[0].point
    one = max((hit.point for hit in hits), key=lambda point: math.dist(point, first))
    other = max((hit.point for hit in hits), key=lambda point: math.dist(point, one))
    width = math.dist(one, other)
    if width > 2.0 * near:
        across = (other[1] - one[1]) / width, (one[0] - other[0]) / width
        along = [hit.normal[0] * across[0] + hit.normal[1] * across[1] for hit in hits]
        best = max(range(len(hits)), key=lambda k: abs(along[k]))
        way = math.copysign(1.0, along[best]) * (1.0 if hits[best].owner == pair[0] else -1.0)
        return ContactJoint(*pair, (way * across[0], way * across[1]), (one, other))
    inside = next((hit for hit in hits if hit.is_inside), None)
    if inside is None:
        return None
    way = 1.0 if inside.owner == pair[0] else -1.0
    return ContactJoint(*pair, (way * inside.normal[0], way * inside.normal[1]), (inside.point,))


class _Frame(NamedTuple):
    """Contact points of all joints as springs between blocks, for w = 1/s."""

    joints: Sequence[ContactJoint]
    blocks: Sequence[int]  # n
    joint: NDArray[np.int64]  # (p,) that a point is of
    arms: Floats  # (p, 2, 2) m: from the centroids of both bodies to the point
    places: NDArray[np.int64]  # (p, 2): of both bodies among the blocks; n for supports
    normals: Floats  # (p, 2)
    across: Floats  # (p, 3 n + 3): opening for displacements of the blocks, and of supports
    along: Floats  # (p, 3 n + 3): slip
    stiffness: Floats  # (p,) N/m

    @property
    def is_coursed(self) -> bool:
        """Whether normals are parallel or at right angles, as in columns and walls."""
        x, y = self.normals[0]
        sines, cosines = self.normals[:, 0] * y - self.normals[:, 1] * x, self.normals @ self.normals[0]
        return bool((np.abs(sines * cosines) < PARALLEL).all())


def thrust_shift(layout: Layout) -> float:
    """Return the measure times w^2 (1/s2); zero where blocks carry vertical forces alone, and for walls that fall."""
    scenario, placed = layout.scenario, layout.placed
    free = {i for i, body in enumerate(placed) if not body.fixed or body.freed}
    is_level = scenario.ground.profile is None
    is_upright = is_level and all(not body.angle and geometry.is_upright(body.corners) for body in placed)
    is_vertical = scenario.ground.tilt == 0.0 and not scenario.loads
    if not free or (is_upright and (len(free) <= FEW_UPRIGHT or is_vertical)):
        return 0.0
    joints = joints_of(placed, layout.segments, free, TOUCHING * placement.smallest_width(placed), level=is_level)
    joints, blocks = _carried(joints, free)
    if not joints:
        return 0.0
    frame = _frame(placed, joints, blocks)
    rest = _at_rest(frame, _forces(layout, blocks))
    return 0.0 if rest is None else _greatest_shift(frame, *rest) * (COURSED if frame.is_coursed else 1.0)


def _carried(joints: Sequence[ContactJoint], free: set[int]) -> tuple[list[ContactJoint], list[int]]:
    """Return the joints of blocks that stand on supports, by way of others or not, and these blocks."""
    held: set[int] = set()
    sides = [side for joint in joints for side in ((joint.one, joint.other), (joint.other, joint.one))]
    while more := {i for i, other in sides if i in free - held and (other not in free or other in held)}:
        held |= more
    return [joint for joint in joints if joint.one in held or joint.other in held], sorted(held)


def _frame(placed: Sequence[PlacedBody], joints: Sequence[ContactJoint], blocks: Sequence[int]) -> _Frame:
    place, count = {body: k for k, body in enumerate(blocks)}, len(blocks)
    points = np.array([point for joint in joints for point in joint.points])
    joint = np.repeat(np.arange(len(joints)), [len(one.points) for one in joints])
    normals = np.array([one.normal for one in joints])[joint]
    places = np.array([[place.get(one.one, count), place.get(one.other, count)] for one in joints])[joint]
    bodies = [placed[i] for i in blocks]
    centres = np.array([*((body.x, body.y) for body in bodies), (0.0, 0.0)])
    masses = np.array([*((1.0 / body.mass, 1.0 / body.inertia) for body in bodies), (0.0, 0.0)])
    arms = points[:, None] - centres[places]
    rows: list[Floats] = []
    compliance = np.zeros(len(points))
    for ways in (normals, np.column_stack([-normals[:, 1], normals[:, 0]])):
        row = np.zeros((len(points), count + 1, 3))
        for side, sign in ((0, -1.0), (1, 1.0)):
            lever = arms[:, side, 0] * ways[:, 1] - arms[:, side, 1] * ways[:, 0]
            row[np.arange(len(points)), places[:, side]] = sign * np.column_stack([ways, lever])
            if not rows:
                inverse = masses[places[:, side]]
                compliance += inverse[:, 0] + lever**2 * inverse[:, 1]
        rows.append(row.reshape(len(points), -1))
    return _Frame(joints, blocks, joint, arms, places, normals, rows[0], rows[1], 1.0 / compliance)


def _forces(layout: Layout, blocks: Sequence[int]) -> Floats:
    """Return forces (N) and moments (N m) on blocks (n + 1, 3): weight, and loads as they are at the start.

    Water is left out.
    """
    tilt, gravity = layout.scenario.ground.tilt, layout.scenario.gravity
    forces = np.zeros((len(blocks) + 1, 3))
    masses = np.array([layout.placed[i].mass for i in blocks])
    pull = np.array([-gravity * math.sin(tilt), -gravity * math.cos(tilt)])
    place = {body: k for k, body in enumerate(blocks)}
    for load in layout.applied.loads:
        value = float(layout.applied.pieces["value"][load.first_piece])
        if load.kind == LOAD_FIELD:
            pull += value * np.array([load.fx, load.fy])
        elif load.kind == LOAD_FORCE and load.body in place:
            angle = layout.placed[load.body].angle  # the point turns with the body
            c, s = math.cos(angle), math.sin(angle)
            x, y = c * load.x - s * load.y, s * load.x + c * load.y
            fx, fy = (c * load.fx - s * load.fy, s * load.fx + c * load.fy) if load.turns else (load.fx, load.fy)
            forces[place[load.body]] += value * np.array([fx, fy, x * fy - y * fx + load.torque])
    forces[:-1, :2] += masses[:, None] * pull
    return forces


def _at_rest(frame: _Frame, forces: Floats) -> tuple[Floats, Floats, Floats] | None:
    """Return the equilibrium without tension; of what falls that of closed joints, or none where it is a wall.

    It is given by the displacements of blocks (m, m, rad; (n + 1, 3), supports last), and by the forces (N, (p,)) that
    points carry across their joints and along them.
    """
    closed = np.ones(frame.stiffness.size, bool)
    matrix = _stiffness(frame, closed)
    matrix[np.diag_indices_from(matrix)] *= 1.0 + SLACK
    first = moved = _moved(matrix, forces)
    if not np.abs(first).max() < LOOSE * float(np.abs(forces[:, :2]).sum() / frame.stiffness.min()):
        return None
    for _ in range(PASSES):
        pressed = -frame.stiffness * (frame.across @ moved)
        least = ROUND_OFF * pressed.max()
        opens = closed & (pressed < -least) & (pressed <= WORST * pressed[closed].min())
        shuts = ~closed & (pressed > least)
        if not (opens | shuts).any():
            break
        closed ^= opens | shuts
        matrix += _stiffness(frame, shuts) - _stiffness(frame, opens)
        moved = _moved(matrix, forces)
        if not np.abs(moved).max() < FALLS * np.abs(first).max():
            if frame.is_coursed:
                return None
            closed[:], moved = True, first
            break
    pressed = np.maximum(0.0, -frame.stiffness * (frame.across @ moved)) * closed
    return moved.reshape(-1, 3), pressed, -HOLD * frame.stiffness * (frame.along @ moved) * (pressed > 0.0)


def _stiffness(frame: _Frame, chosen: NDArray[np.bool_]) -> Floats:
    """Return the stiffness (3 n, 3 n) of some of the points."""
    across, along = frame.across[chosen, :-3], frame.along[chosen, :-3]
    stiffness = frame.stiffness[chosen, None]
    matrix: Floats = across.T @ (stiffness * across) + along.T @ (HOLD * stiffness * along)
    return matrix


def _moved(matrix: Floats, forces: Floats) -> Floats:
    """Return the displacements (3 n + 3,), those of supports last."""
    return np.append(np.linalg.solve(matrix, forces[:-1].ravel()), [0.0, 0.0, 0.0])


def _greatest_shift(frame: _Frame, moved: Floats, pressed: Floats, sheared: Floats) -> float:
    """Return the measure: across the force, over the width, times the share in the greatest force."""
    turned = np.column_stack([-frame.normals[:, 1], frame.normals[:, 0]])
    point_forces = pressed[:, None] * frame.normals + sheared[:, None] * turned
    count = len(frame.joints)
    forces = np.column_stack([np.bincount(frame.joint, point_forces[:, axis], count) for axis in (0, 1)])
    moves = moved[frame.places]  # of both bodies at every point
    x = (moves[:, :, 0] - moves[:, :, 2] * frame.arms[:, :, 1]).mean(axis=1)
    y = (moves[:, :, 1] + moves[:, :, 2] * frame.arms[:, :, 0]).mean(axis=1)
    aside = pressed * (x * forces[frame.joint, 1] - y * forces[frame.joint, 0])
    total = np.bincount(frame.joint, pressed, count)
    widths = np.array([math.dist(joint.points[0], joint.points[-1]) for joint in frame.joints])  # m, zero of a point
    most = _greatest_forces(frame, np.hypot(forces[:, 0], forces[:, 1]))
    carries = (total > 0.0) & (widths > 0.0) & (most > 0.0)
    shift = np.abs(np.bincount(frame.joint, aside, count)[carries]) / (total * widths * most)[carries]
    return float(shift.max(initial=0.0))


def _greatest_forces(frame: _Frame, forces: Floats) -> Floats:
    """Return the greatest force (N) in the structure of each joint.

    Structures are free blocks that touch. Joints with supports count in columns and walls; those below heavy abutments
    carry more than the arch between them, and count only where there are no others.
    """
    structure = {body: body for body in frame.blocks}
    inner = [joint.one in structure and joint.other in structure for joint in frame.joints]
    for joint, is_inner in zip(frame.joints, inner, strict=True):
        if is_inner:
            old, new = structure[joint.one], structure[joint.other]
            structure = {body: new if label == old else label for body, label in structure.items()}
    labels = [structure[joint.one if joint.one in structure else joint.other] for joint in frame.joints]
    most = np.zeros(len(frame.joints))
    for label in set(labels):
        own = np.array([one == label for one in labels])
        chosen = own & (frame.is_coursed | np.array(inner))
        most[own] = forces[chosen if chosen.any() else own].max()
    return most


class Reason(NamedTuple):
    """A step (s) that must not be exceeded, and the reason in a few words, with places for numbers.

    The text is made when somebody asks for it: members of ensembles want the step only.
    """

    step: float
    text: str
    numbers: tuple[float, ...] = ()


def choose_rigid_stride(layout: Layout, bounds: Bounds) -> Stride:
    """Return step and skin of a run of the non-smooth scheme. Raises StepError and SkinTooSmallError."""
    time, speeds = layout.scenario.time, speeds_of(layout, bounds)
    step, limit = reason_of_step(layout, bounds, speeds).step, longest_step(layout, bounds, speeds)
    refuse_uncountable(time.end, step)
    if step > limit and not time.force_step:
        cycle = motion.shortest_cycle(layout.scenario)
        if step > PERIOD_SHARE * cycle:
            limit = PERIOD_SHARE * cycle
            message = f"a motion with a cycle of {cycle:.4g} s: at most a twentieth of it, {limit:.4g} s"
            raise StepError(f"{step:.4g} s is too long for {message}. {OTHERWISE}", limit)
        message = (
            f"{step:.4g} s is too long: blocks could move farther than a tenth of the smallest side "
            f"({MILLI * bounds.smallest:.4g} mm) before contacts are detected again; at most {limit:.4g} s with these "
            f"substeps. {OTHERWISE}"
        )
        raise StepError(message, limit)
    return Stride(step, choose_skin(layout, bounds, speeds, step))


def reason_of_step(layout: Layout, bounds: Bounds, speeds: Speeds) -> Reason:
    """Return the step that a scenario gives or that is chosen for it, admissible or not."""
    scenario = layout.scenario
    if scenario.time.step != "auto":
        return Reason(scenario.time.step, "as given")
    few = min(1.0, bounds.free / FEW) if bounds.free else 1.0
    reasons = [Reason(USUAL_STEP, "the usual step"), Reason(scenario.time.end, "the whole time")]
    for share, speed in ((few, speeds.impact), (1.0, speeds.greatest)):
        if speed > 0.0:
            way = SHARE * share * bounds.smallest
            why = "no point moves farther than {:.3g} mm in it, at most at {:.3g} m/s"
            reasons.append(Reason(way / speed, why, (MILLI * way, speed)))
    speed = speeds.given + speeds.support
    if scenario.motion is not None and speed > 0.0:
        way = SHARE * few * bounds.smallest
        why = "supports move no farther than {:.3g} mm in it, at most at {:.3g} m/s with the blocks"
        reasons.append(Reason(way / speed, why, (MILLI * way, speed)))
    period = motion.shortest_period(scenario)
    if period > 0.0:
        why = "a twentieth of {:.3g} s, the shortest period of a motion"
        reasons.append(Reason(PERIOD_SHARE * period, why, (period,)))
    if bounds.free and scenario.gravity > 0.0:
        share = NATURAL * bounds.free / FEW
        why = "{:.2g} √(L/g) for so few blocks, L = {:.4g} mm the smallest side"
        parts = max(1, round(USUAL_STEP / (share * math.sqrt(bounds.smallest / scenario.gravity))))
        reasons.append(Reason(USUAL_STEP / parts, why, (share, MILLI * bounds.smallest)))
        if bounds.free < CROWD:  # which takes the usual step anyway
            reasons += _reasons_of_sag(layout, bounds)
            reasons += _reasons_of_thrust(layout)
    return min(reasons, key=lambda reason: reason.step)


def _reasons_of_sag(layout: Layout, bounds: Bounds) -> Iterator[Reason]:
    """Yield the step in which no contact at rest gives way too far, where light blocks carry heavy ones.

    Most scenes are far from it, which is known from the weight of all.
    """
    gravity, substep = layout.scenario.gravity, USUAL_STEP / layout.scenario.time.parts
    masses = [1.0 / kind.inverse_mass for kind in bounds.kinds if kind.inverse_mass > 0.0]
    crushed = CALM * CRUSHED_SHARE * bounds.smallest
    allowed = CALM * WARNING_SHARE * bounds.smallest
    least = crushed if max(masses) >= UNLIKE * min(masses) else allowed
    arms = ((kind, max(kind.half_x, kind.half_y)) for kind in bounds.kinds)
    compliance = max(kind.inverse_mass + arm**2 * kind.inverse_inertia for kind, arm in arms)
    if 2.0 * compliance * gravity * bounds.mass > soft_contact(substep).frequency ** 2 * least:
        sag = scene_sag(substep, layout.placed, gravity)
        for found, most in ((sag.crushed, crushed), (sag.overlap, allowed)):
            if found > most:
                why = "no contact gives way by more than {:.3g} mm where light blocks carry heavy ones"
                yield Reason(USUAL_STEP / math.ceil(math.sqrt(found / most)), why, (MILLI * most,))


def _reasons_of_thrust(layout: Layout) -> Iterator[Reason]:
    """Yield the step in which contacts give way so little that their thrust stays where it is."""
    square = soft_contact(USUAL_STEP / layout.scenario.time.parts).frequency ** 2
    parts = math.ceil(math.sqrt(thrust_shift(layout) / square / SHIFT))
    if parts > 1:
        why = "at rest joints move across their thrust by no more than {:.2g} % of their widths"
        why += ", in columns and walls {:.2g} %"
        yield Reason(USUAL_STEP / parts, why, (PERCENT * SHIFT, PERCENT * SHIFT / COURSED))


def longest_step(layout: Layout, bounds: Bounds, speeds: Speeds) -> float:
    """Return the longest manual step (s)."""
    time = layout.scenario.time
    rate = max(speeds.given + speeds.support, speeds.greatest / time.parts)
    longest = SHARE * bounds.smallest / rate if rate > 0.0 else time.end
    return min(longest, PERIOD_SHARE * motion.shortest_cycle(layout.scenario))
