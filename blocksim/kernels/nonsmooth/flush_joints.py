"""Which faces meet where corners of two bodies meet: those along which the bodies are pressed already.

A block that slides over the flush joint of two others has sunk into the first by what rigid contacts give way. Past the
joint its corner lies in the second, at first nearer to the hidden side than to the top, so that the least overlap
stops the block. A pair alone cannot tell that from a block that meets a low step: a third body can.

So, where a corner of one body is near a corner of the other, every face of both is a candidate beyond which they
overlap by no more than contacts of these bodies do anyhow: `SAG` times the deepest overlap of what presses them, and
`UNEVEN` of the smaller inner radius, as neighbours sink unequally. Deeper overlaps say nothing about neighbours: where
there is but one face that they overlap by less than `NEAR_CORNER`, the pair is decided at once.

    which candidates have a normal that presses one of the bodies, by whichever contact      the pair meets at
    not the least overlap, but another                                                        that other one
    the least overlap and another: that along which they have overlapped longer               the older one
    the same, and they do not approach one another                                            none
    else                                                                                      the least overlap

Normals are the same within 0.01 rad. The age of an overlap is its depth over the approach along its normal. Blocks at
rest corner to corner are held by what presses them and need no contact of their own: else a jammed floor would hold
what starts to slide on it. What presses a fixed body does not count: whatever else lies on it is no neighbour.

A step that is lower than that limit is climbed, as contacts do not resolve it; a higher one stops what meets it.

Threads leave such pairs UNDECIDED; the first thread decides them between two barriers, in the order of the list.
"""

from typing import Any, NamedTuple

import numpy as np

from blocksim.kernels.common import jit
from blocksim.kernels.common.arrays import TEAM_SIZE, Integers, Records
from blocksim.kernels.common.tolerances import PARALLEL_COSINE, SAG, UNEVEN
from blocksim.kernels.nonsmooth import arrays, faces, manifold, narrow_phase, references, slip

NOT_ASKED = -1  # in place of the first constraint of a body


class Candidate(NamedTuple):
    """Faces that may meet, and the normal from body b to body a."""

    reference: references.Reference
    nx: float
    ny: float


class Pressed(NamedTuple):
    """What presses the free bodies of undecided pairs, and no more: each array is passed as several numbers."""

    constraints: Records
    kept: Records  # the next in the lists of both bodies
    firsts: Integers  # the first of each body, from 1


@jit.rare_kernel
def is_pressed_along(pressed: Pressed, r: int, nx: float, ny: float) -> bool:
    """Return True if body a of constraint r is pressed along a normal, or body b against it."""
    constraints, kept = pressed.constraints, pressed.kept
    for is_a in (True, False):
        i = constraints[r].a if is_a else constraints[r].b
        place = pressed.firsts[i]
        while place > 0:
            one = constraints[place - 1]
            cosine = one.nx * nx + one.ny * ny
            if (cosine if (one.a == i) == is_a else -cosine) > -PARALLEL_COSINE:
                return True
            place = np.int64(kept[place - 1].next if one.a == i else kept[place - 1].next_of_b)
    return False


@jit.rare_kernel
def deepest_at(pressed: Pressed, i: int) -> float:
    """Return the deepest overlap (m) of what presses a body; zero where nothing does."""
    deepest = 0.0
    place = pressed.firsts[i]
    while place > 0:
        one = pressed.constraints[place - 1]
        deepest = max(deepest, -min(one.gap_one, one.gap_two))
        place = np.int64(pressed.kept[place - 1].next if one.a == i else pressed.kept[place - 1].next_of_b)
    return deepest


@jit.kernel
def face_of_pair(pair: narrow_phase.Pairs, k: int) -> faces.Face:
    """Return face k of a pair: those of body b, then those of body a."""
    count_b = faces.face_count(pair.hulls_b)
    if k < count_b:
        return faces.face_on(pair.b, faces.side_numbered(pair.b, pair.hulls_b, k))
    return faces.face_on(pair.a, faces.side_numbered(pair.a, pair.hulls_a, k - count_b))


@jit.kernel
def candidate_on(
    number: int, is_of_b: bool, body: faces.Block, hulls: faces.AnyHulls, other: faces.Block, others: faces.AnyHulls
) -> Candidate:
    """Return a face of one body, with that face of the other which looks at it."""
    side = faces.side_numbered(body, hulls, number)
    face = faces.face_on(body, side)
    facing, against = faces.side_opposite(face.nx, face.ny, other, others, 0)
    edge = faces.edge_on(face, other, facing)
    best = references.Best(min(edge.left_gap, edge.right_gap), 1.0 * number, against)
    reference = references.Reference(side, facing, is_of_b, best, best, best, best.gap)
    sign = 1.0 if is_of_b else -1.0
    return Candidate(reference, sign * face.nx, sign * face.ny)


@jit.kernel
def candidate(pair: narrow_phase.Pairs, k: int) -> Candidate:
    """Return face k of a pair as a candidate."""
    count_b = faces.face_count(pair.hulls_b)
    if k < count_b:
        return candidate_on(k, True, pair.b, pair.hulls_b, pair.a, pair.hulls_a)
    return candidate_on(k - count_b, False, pair.a, pair.hulls_a, pair.b, pair.hulls_b)


@jit.rare_kernel
def best_pressed(
    pressed: Pressed, r: int, deepest: float, least: slip.Constraints, pair: narrow_phase.Pairs
) -> tuple[Candidate, bool]:
    """Return the faces with the least overlap, no deeper than `deepest` (m), of all whose normal presses a body.

    Those parallel to that of the constraint `least` are left out. False where there are none.
    """
    best = candidate(pair, 0)
    gap = -deepest
    is_found = False
    for k in range(faces.face_count(pair.hulls_b) + faces.face_count(pair.hulls_a)):
        face = face_of_pair(pair, k)
        if abs(face.nx * least.nx + face.ny * least.ny) < -PARALLEL_COSINE:
            other = candidate(pair, k)
            if other.reference.best.gap > gap and is_pressed_along(pressed, r, other.nx, other.ny):
                best = other
                gap = other.reference.best.gap
                is_found = True
    return best, is_found


@jit.kernel
def overlap_and_approach(points: manifold.Points, motion: slip.Motion) -> tuple[float, float]:
    """Return how deep (m) the deeper point of a manifold is, and how fast (m/s) the bodies approach there."""
    rates = slip.slip_of(points.constraint, motion.vx, motion.vy, motion.spin_a, motion.spin_b)
    if points.gap_one < points.gap_two:
        return -points.gap_one, -rates.one
    return -points.gap_two, -rates.two


@jit.kernel
def decide(lists: narrow_phase.Lists, pressed: Pressed, r: int, corners: Any) -> None:
    """Decide where the pair of constraint r meets."""
    stepping = lists.stepping
    places = (r, r, r, r)
    pair = narrow_phase.pairs_at(lists, places, 0.5 * (stepping.length - stepping.substep), corners, 0)
    found = narrow_phase.manifold_of(pair, stepping.margin)
    constraint = lists.constraints[r]
    inner = faces.least_inner(pair.a, pair.hulls_a, pair.b, pair.hulls_b)
    deepest = SAG * max(deepest_at(pressed, constraint.a), deepest_at(pressed, constraint.b)) + UNEVEN * inner
    least = found.points.constraint
    other, is_found = best_pressed(pressed, r, deepest, least, pair)
    if is_found:
        instead = manifold.manifold_on(other.reference, pair.a, pair.b, stepping.margin, 0.0)
        if is_pressed_along(pressed, r, least.nx, least.ny):
            depth, rate = overlap_and_approach(found.points, pair.motion)
            its_depth, its_rate = overlap_and_approach(instead.points, pair.motion)
            if max(rate, its_rate) <= stepping.tolerance:
                narrow_phase.write_none(lists.constraints, places)
                return
            if its_depth * max(rate, 0.0) > depth * max(its_rate, 0.0):
                found = instead
        else:
            found = instead
    if found.is_near:
        narrow_phase.write(lists, places, found, True, pair, 0)
    else:
        narrow_phase.write_none(lists.constraints, places)


@jit.rare_kernel
def collect(scene: arrays.Nonsmooth) -> int:
    """List what presses each free body of an undecided pair, and the undecided pairs; return how many these are."""
    contacts = scene.contacts
    constraints, states, firsts = contacts.constraints, contacts.states, scene.firsts
    stepping = contacts.stepping[0]
    for i in range(firsts.size):
        firsts[i] = NOT_ASKED
    count = 0
    for r in range(stepping.constraint_count):
        one = constraints[r]
        if one.reach == arrays.UNDECIDED:
            firsts[one.a] = 0 if states[one.a].inverse_mass > 0.0 else NOT_ASKED
            firsts[one.b] = 0 if states[one.b].inverse_mass > 0.0 else NOT_ASKED
            scene.kept[count].undecided = r
            count += 1
    for r in range(stepping.constraint_count):
        one = constraints[r]
        if one.reach >= arrays.TOUCHING and max(firsts[one.a], firsts[one.b]) > NOT_ASKED:
            inverse_mass = states[one.a].inverse_mass + states[one.b].inverse_mass
            if slip.presses(one.normal_one + one.normal_two, inverse_mass, stepping):
                if firsts[one.a] > NOT_ASKED:
                    scene.kept[r].next = firsts[one.a]
                    firsts[one.a] = r + 1
                if firsts[one.b] > NOT_ASKED:
                    scene.kept[r].next_of_b = firsts[one.b]
                    firsts[one.b] = r + 1
    return count


@jit.kernel
def decide_all(scene: arrays.Nonsmooth) -> None:
    """Decide all undecided pairs, of which threads have counted their own."""
    undecided = 0.0
    for k in range(scene.world.team[TEAM_SIZE]):
        undecided += scene.contacts.residuals[0, 8 * k]
    if undecided > 0.0:
        count = collect(scene)
        decide_some(scene, count, None)
        if scene.world.corners is not None:
            decide_some(scene, count, scene.world.corners)


@jit.rare_kernel
def decide_some(scene: arrays.Nonsmooth, count: int, corners: Any) -> None:
    """Decide those of `count` undecided pairs that have a polygon, or those that have none."""
    constraints, bodies = scene.contacts.constraints, scene.world.bodies
    stepping = scene.contacts.stepping[0]
    lists = narrow_phase.Lists(constraints, scene.contacts.states, bodies, stepping)
    pressed = Pressed(constraints, scene.kept, scene.firsts)
    for k in range(count):
        r = np.int64(scene.kept[k].undecided)
        if narrow_phase.has_polygon(bodies, constraints[r]) == (corners is not None):
            decide(lists, pressed, int(r), corners)
