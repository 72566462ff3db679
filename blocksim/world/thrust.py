"""How far the thrust of blocks at rest moves aside where rigid contacts give way like springs.

A contact point at rest is a spring of w^2 / A, A = J M^-1 J^T and w = 2 pi f / h (sag.py); friction holds along the
joint. So the displacements of a small scene at rest follow from one linear system with three unknowns per free block,
and are proportional to h^2. Points in tension open: the worst are taken out, until none is left.

Blocks that sink along the load path stay as strong as they were. What harms is displacement across it: the load above
comes down elsewhere in the joints below. Its measure is how far a joint moves across its force, over its width, times
that force over the greatest of the structure, and half of it in columns and walls. Limits of `ground.tilt` are too low
by some 5 to 10 times this measure, in proportion to h^2.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.kernels.common.arrays import LOAD_FIELD, LOAD_FORCE
from blocksim.scenario import PlacedBody
from blocksim.scenario.placement import smallest_width
from blocksim.world.bodies import Outline
from blocksim.world.joints import Joint, joints_of
from blocksim.world.loads import TOUCHING

HOLD = 100.0  # stiffness along a joint over that across it: rigid, and as accurate
PASSES = 20
ROUND_OFF = 1e-9  # of the greatest pressure: tension that is none
WORST = 0.5  # of the greatest tension: points with more open in the same pass
SLACK = 1e-12  # of its stiffness: what holds a block that joints do not
LOOSE = 1e6  # over the overlap of one point that carries everything: only mechanisms move farther
FALLS = 50.0  # over displacements with all points closed: only mechanisms move farther
FEW = 3  # rectangles along the axes, of which a stack cannot lean far
COURSED = 0.5  # calibrated: limits of columns and walls are off by half as much as those of arches, or less
PARALLEL = 1e-3  # sine of the angle between normals of one direction
Floats = NDArray[np.float64]


class _Frame(NamedTuple):
    """Contact points of all joints as springs between blocks, for w = 1/s."""

    joints: Sequence[Joint]
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


class _Rest(NamedTuple):
    """Displacements of blocks (m, m, rad; supports last), and what points carry (N)."""

    moved: Floats  # (n + 1, 3)
    pressed: Floats  # (p,)
    sheared: Floats  # (p,)


def thrust_shift(outline: Outline) -> float:
    """Return the measure times w^2 (1/s2); zero where blocks carry vertical forces alone, and for walls that fall."""
    scenario, placed = outline.scenario, outline.placed
    free = {i for i, body in enumerate(placed) if not body.fixed or body.freed}
    if not free or _is_simple(outline, len(free)):
        return 0.0
    near = TOUCHING * smallest_width(placed)
    joints = joints_of(placed, outline.segments, free, near, level=scenario.ground.profile is None)
    joints, blocks = _carried(joints, free)
    if not joints:
        return 0.0
    frame = _frame(placed, joints, blocks)
    rest = _at_rest(frame, _forces(outline, blocks))
    return 0.0 if rest is None else _greatest_shift(frame, rest) * (COURSED if frame.is_coursed else 1.0)


def _is_simple(outline: Outline, free: int) -> bool:
    """Return True for rectangles along the axes that are few, or that carry vertical forces alone."""
    scenario = outline.scenario
    if scenario.ground.profile is not None or any(body.angle or body.is_polygon for body in outline.placed):
        return False
    return free <= FEW or (scenario.ground.tilt == 0.0 and not scenario.loads)


def _carried(joints: Sequence[Joint], free: set[int]) -> tuple[list[Joint], list[int]]:
    """Return the joints of blocks that stand on supports, by way of others or not, and these blocks."""
    held: set[int] = set()
    grows = True
    while grows:
        more = {
            i
            for joint in joints
            for i, other in ((joint.one, joint.other), (joint.other, joint.one))
            if i in free and i not in held and (other not in free or other in held)
        }
        held |= more
        grows = bool(more)
    return [joint for joint in joints if joint.one in held or joint.other in held], sorted(held)


def _frame(placed: Sequence[PlacedBody], joints: Sequence[Joint], blocks: Sequence[int]) -> _Frame:
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


def _forces(outline: Outline, blocks: Sequence[int]) -> Floats:
    """Return forces (N) and moments (N m) on blocks (n + 1, 3): weight, and loads as they are at the start.

    Water is left out.
    """
    tilt, gravity = outline.scenario.ground.tilt, outline.scenario.gravity
    forces = np.zeros((len(blocks) + 1, 3))
    masses = np.array([outline.placed[i].mass for i in blocks])
    pull = np.array([-gravity * math.sin(tilt), -gravity * math.cos(tilt)])
    place = {body: k for k, body in enumerate(blocks)}
    for load in outline.applied.loads:
        value = float(outline.applied.pieces["value"][load.first_piece])
        if load.kind == LOAD_FIELD:
            pull += value * np.array([load.fx, load.fy])
        elif load.kind == LOAD_FORCE and load.body in place:
            forces[place[load.body]] += value * _push(load, outline.placed[load.body])
    forces[:-1, :2] += masses[:, None] * pull
    return forces


def _push(load: np.record, body: PlacedBody) -> Floats:
    """Return the force (N) and the moment (N m) of a load of value one, of which the point turns with the body."""
    c, s = math.cos(body.angle), math.sin(body.angle)
    x, y = c * load.x - s * load.y, s * load.x + c * load.y
    fx, fy = (c * load.fx - s * load.fy, s * load.fx + c * load.fy) if load.turns else (load.fx, load.fy)
    return np.array([fx, fy, x * fy - y * fx + load.torque])


def _at_rest(frame: _Frame, forces: Floats) -> _Rest | None:
    """Return the equilibrium without tension; of what falls that of closed joints, or none where it is a wall."""
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
    return _Rest(moved.reshape(-1, 3), pressed, -HOLD * frame.stiffness * (frame.along @ moved) * (pressed > 0.0))


def _stiffness(frame: _Frame, chosen: NDArray[np.bool_]) -> Floats:
    """Return the stiffness (3 n, 3 n) of some of the points."""
    across, along = frame.across[chosen, :-3], frame.along[chosen, :-3]
    stiffness = frame.stiffness[chosen, None]
    matrix: Floats = across.T @ (stiffness * across) + along.T @ (HOLD * stiffness * along)
    return matrix


def _moved(matrix: Floats, forces: Floats) -> Floats:
    """Return the displacements (3 n + 3,), those of supports last."""
    return np.append(np.linalg.solve(matrix, forces[:-1].ravel()), [0.0, 0.0, 0.0])


def _greatest_shift(frame: _Frame, rest: _Rest) -> float:
    """Return the measure: across the force, over the width, times the share in the greatest force."""
    turned = np.column_stack([-frame.normals[:, 1], frame.normals[:, 0]])
    point_forces = rest.pressed[:, None] * frame.normals + rest.sheared[:, None] * turned
    count = len(frame.joints)
    forces = np.column_stack([np.bincount(frame.joint, point_forces[:, axis], count) for axis in (0, 1)])
    moves = rest.moved[frame.places]  # of both bodies at every point
    x = (moves[:, :, 0] - moves[:, :, 2] * frame.arms[:, :, 1]).mean(axis=1)
    y = (moves[:, :, 1] + moves[:, :, 2] * frame.arms[:, :, 0]).mean(axis=1)
    aside = rest.pressed * (x * forces[frame.joint, 1] - y * forces[frame.joint, 0])
    total = np.bincount(frame.joint, rest.pressed, count)
    widths = np.array([joint.width for joint in frame.joints])
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

    def first(body: int) -> int:
        while structure[body] != body:
            body = structure[body]
        return body

    inner = [joint.one in structure and joint.other in structure for joint in frame.joints]
    for joint, is_inner in zip(frame.joints, inner, strict=True):
        if is_inner:
            structure[first(joint.one)] = first(joint.other)
    labels = [first(joint.one if joint.one in structure else joint.other) for joint in frame.joints]
    most = np.zeros(len(frame.joints))
    for label in set(labels):
        own = np.array([one == label for one in labels])
        chosen = own & (frame.is_coursed | np.array(inner))
        most[own] = forces[chosen if chosen.any() else own].max()
    return most
