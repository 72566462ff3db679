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
"""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario import PlacedBody, geometry, motion
from blocksim.world import excitation
from blocksim.world.bodies import Layout
from blocksim.world.joints import Assembly, Floats, applied_forces
from blocksim.world.sag import CRUSHED_SHARE, UNLIKE, WARNING_SHARE, scene_sag, soft_contact
from blocksim.world.step import Bounds, Speeds, StepError, Stride, choose_skin, refuse_uncountable, speeds_of

USUAL_STEP = 1e-3  # s
SHARE = 0.1  # of the smallest side
FEW = 13  # free blocks: fewer take shorter steps
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
LOOSE = 1e6  # over the overlap of one point that carries everything: only mechanisms move farther
FALLS = 50.0  # over displacements with all points closed: only mechanisms move farther
FEW_UPRIGHT = 3  # rectangles along the axes, of which a stack cannot lean far
STIFFEST = 0.5  # frequency of an actuator with its body alone, times the longest substep; see excitation.STIFF
COURSED = 0.5  # calibrated: limits of columns and walls are off by half as much as those of arches, or less
PARALLEL = 1e-3  # sine of the angle between normals of one direction


class _Frame(NamedTuple):
    """The points of all joints as springs between blocks, for w = 1/s."""

    assembly: Assembly
    across: Floats  # (p, 3 n + 3): opening for displacements of the blocks, and of supports
    along: Floats  # (p, 3 n + 3): slip
    stiffness: Floats  # (p,) N/m

    @property
    def is_coursed(self) -> bool:
        """Whether normals are parallel or at right angles, as in columns and walls."""
        normals = self.assembly.normals
        x, y = normals[0]
        sines, cosines = normals[:, 0] * y - normals[:, 1] * x, normals @ normals[0]
        return bool((np.abs(sines * cosines) < PARALLEL).all())


def thrust_shift(layout: Layout) -> float:
    """Return the measure times w^2 (1/s2); zero where blocks carry vertical forces alone, and for walls that fall."""
    scenario, placed = layout.scenario, layout.placed
    free = {i for i, body in enumerate(placed) if not body.fixed or body.freed}
    is_level = scenario.ground.profile is None
    is_upright = is_level and all(not body.angle and geometry.is_upright(body.corners) for body in placed)
    is_vertical = scenario.ground.tilt == 0.0 and not scenario.loads and not scenario.actuators
    if not free or (is_upright and (len(free) <= FEW_UPRIGHT or is_vertical)):
        return 0.0
    assembly = Assembly.of(layout, free)
    if assembly is None:
        return 0.0
    frame = _frame(placed, assembly)
    forces = applied_forces(layout, assembly.blocks)
    if not np.square(forces).max() > 0.0:  # none, or so small that their squares vanish
        return 0.0
    rest = _at_rest(frame, forces)
    return 0.0 if rest is None else _greatest_shift(frame, *rest) * (COURSED if frame.is_coursed else 1.0)


def _frame(placed: Sequence[PlacedBody], assembly: Assembly) -> _Frame:
    count, points = len(assembly.blocks), np.arange(len(assembly.joint))
    bodies = [placed[i] for i in assembly.blocks]
    masses = np.array([*((1.0 / body.mass, 1.0 / body.inertia) for body in bodies), (0.0, 0.0)])
    rows: list[Floats] = []
    compliance = np.zeros(len(points))
    for rates in (assembly.across, assembly.along):
        row = np.zeros((len(points), count + 1, 3))
        for side in (0, 1):
            row[points, assembly.places[:, side]] = rates[:, side]
        rows.append(row.reshape(len(points), -1))
    for side in (0, 1):
        inverse = masses[assembly.places[:, side]]
        compliance += inverse[:, 0] + assembly.across[:, side, 2] ** 2 * inverse[:, 1]
    return _Frame(assembly, rows[0], rows[1], 1.0 / compliance)


def _at_rest(frame: _Frame, forces: Floats) -> tuple[Floats, Floats, Floats] | None:
    """Return the equilibrium without tension; of what falls that of closed joints, or none where it is a wall.

    It is given by the displacements of blocks (m, m, rad; (n + 1, 3), supports last), and by the forces (N, (p,)) that
    points carry across their joints and along them.
    """
    closed = np.ones(frame.stiffness.size, bool)
    matrix = _stiffness(frame, closed)
    matrix[np.diag_indices_from(matrix)] *= 1.0 + 1e-12  # of its stiffness: what holds a block that joints do not
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
    return np.append(np.linalg.solve(matrix, forces.ravel()), [0.0, 0.0, 0.0])


def _greatest_shift(frame: _Frame, moved: Floats, pressed: Floats, sheared: Floats) -> float:
    """Return the measure: across the force, over the width, times the share in the greatest force."""
    joints, _, joint, arms, places, normals, *_ = frame.assembly
    turned = np.column_stack([-normals[:, 1], normals[:, 0]])
    point_forces = pressed[:, None] * normals + sheared[:, None] * turned
    count = len(joints)
    forces = np.column_stack([np.bincount(joint, point_forces[:, axis], count) for axis in (0, 1)])
    moves = moved[places]  # of both bodies at every point
    x = (moves[:, :, 0] - moves[:, :, 2] * arms[:, :, 1]).mean(axis=1)
    y = (moves[:, :, 1] + moves[:, :, 2] * arms[:, :, 0]).mean(axis=1)
    aside = pressed * (x * forces[joint, 1] - y * forces[joint, 0])
    total = np.bincount(joint, pressed, count)
    widths = np.array([math.dist(one.points[0], one.points[-1]) for one in joints])  # m, zero of a point
    most = _greatest_forces(frame, np.hypot(forces[:, 0], forces[:, 1]))
    carries = (total > 0.0) & (widths > 0.0) & (most > 0.0)
    shift = np.abs(np.bincount(joint, aside, count)[carries]) / (total * widths * most)[carries]
    return float(shift.max(initial=0.0))


def _greatest_forces(frame: _Frame, forces: Floats) -> Floats:
    """Return the greatest force (N) in the structure of each joint.

    Structures are free blocks that touch. Joints with supports count in columns and walls; those below heavy abutments
    carry more than the arch between them, and count only where there are no others.
    """
    joints = frame.assembly.joints
    structure = {body: body for body in frame.assembly.blocks}
    inner = [joint.one in structure and joint.other in structure for joint in joints]
    for joint, is_inner in zip(joints, inner, strict=True):
        if is_inner:
            old, new = structure[joint.one], structure[joint.other]
            structure = {body: new if label == old else label for body, label in structure.items()}
    labels = [structure[joint.one if joint.one in structure else joint.other] for joint in joints]
    most = np.zeros(len(joints))
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
    frequency = excitation.greatest_frequency(layout.model)
    if frequency > 0.0:
        why = "the stiffest actuator swings with its body alone at {:.3g} Hz"
        reasons.append(Reason(excitation.STIFF * scenario.time.parts / frequency, why, (frequency / (2.0 * math.pi),)))
    if bounds.free and scenario.gravity.size > 0.0:
        share = 0.02 * bounds.free / FEW  # of sqrt(L/g): the step of so many
        why = "{:.2g} √(L/g) for so few blocks, L = {:.4g} mm the smallest side"
        parts = max(1, round(USUAL_STEP / (share * math.sqrt(bounds.smallest / scenario.gravity.size))))
        reasons.append(Reason(USUAL_STEP / parts, why, (share, MILLI * bounds.smallest)))
        if bounds.free < CROWD:  # which takes the usual step anyway
            reasons += _reasons_of_sag(layout, bounds)
            reasons += _reasons_of_thrust(layout)
    return min(reasons, key=lambda reason: reason.step)


def _reasons_of_sag(layout: Layout, bounds: Bounds) -> Iterator[Reason]:
    """Yield the step in which no contact at rest gives way too far, where light blocks carry heavy ones.

    Most scenes are far from it, which is known from the weight of all.
    """
    gravity, substep = layout.scenario.gravity.size, USUAL_STEP / layout.scenario.time.parts
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
    if (frequency := excitation.greatest_frequency(layout.model)) > 0.0:
        longest = min(longest, STIFFEST * time.parts / frequency)
    return min(longest, PERIOD_SHARE * motion.shortest_cycle(layout.scenario))
