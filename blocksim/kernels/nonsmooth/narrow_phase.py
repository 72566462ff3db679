"""The contact manifolds of all listed pairs, four pairs of blocks at a time, and what constraints keep of them.

Contacts that press are sought where the bodies will be half a step ahead: normals and arms are then those of the
middle of the step for which they are kept, so that turning about an edge and sliding along a slope are right to second
order in the step. Their gaps are those at the start, along the same normal and arms. Contacts to come are taken as they
are: bodies that meet half a step too deep would be taken for neighbours side by side.
"""

from typing import Any, NamedTuple

from blocksim.kernels.common import jit, simd, tolerances
from blocksim.kernels.common.arrays import ALL, OUTLINE, Record, Records
from blocksim.kernels.common.simd import Lane, Lanes, Mask
from blocksim.kernels.nonsmooth import arrays, faces, manifold, references, slip

NOT_THERE = 0.5 * arrays.FAR  # m: what is FAR changes a little as bodies move
OF_B = 32  # added to the number of a corner of body b, which counts from 1

Places = tuple[int, int, int, int]


class Lists(NamedTuple):
    """What manifolds are found from and written to, and no more: each array is passed as several numbers."""

    constraints: Records
    states: Records
    bodies: Records
    stepping: Record


class Pairs(NamedTuple):
    """The bodies of four pairs, or of one, where contacts are sought, and how they move."""

    a: faces.Block
    b: faces.Block
    hulls_a: faces.AnyHulls
    hulls_b: faces.AnyHulls
    motion: slip.Motion
    inverse_mass: Lanes  # 1/kg: of both bodies together


@jit.kernel
def pairs_at(lists: Lists, places: Places, ahead: float, corners: Any, lane: Lane) -> Pairs:
    """Return the pairs of four constraints; those that press as they will be a time `ahead` (s)."""
    constraints, states, bodies, stepping = lists
    one, two, three, last = (
        constraints[places[0]],
        constraints[places[1]],
        constraints[places[2]],
        constraints[places[3]],
    )
    at_a = (one.a, two.a, three.a, last.a)
    at_b = (one.b, two.b, three.b, last.b)
    vx_a, vy_a, spin_a, inverse_a = simd.fields_0(lane, states, at_a)
    vx_b, vy_b, spin_b, inverse_b = simd.fields_0(lane, states, at_b)
    inverse_mass = inverse_a + inverse_b
    _, normal_one, normal_two, _ = simd.fields_8(lane, constraints, places)
    are_pressed = slip.presses(normal_one + normal_two, inverse_mass, stepping)
    times = simd.select(are_pressed, ahead, 0.0)
    half = simd.select(are_pressed, 0.5 * stepping.substep, 0.0)
    return Pairs(
        block_at(bodies, at_a, vx_a, vy_a, spin_a, times, lane),
        block_at(bodies, at_b, vx_b, vy_b, spin_b, times, lane),
        faces.hulls_at(bodies, at_a, corners, lane),
        faces.hulls_at(bodies, at_b, corners, lane),
        slip.Motion(vx_a - vx_b, vy_a - vy_b, spin_a, spin_b, times, half),
        inverse_mass,
    )


@jit.kernel
def block_at(
    bodies: Records, places: Places, vx: Lanes, vy: Lanes, spin: Lanes, ahead: Lanes, lane: Lane
) -> faces.Block:
    """Return blocks as they will be a time `ahead` (s)."""
    x, y, _, cos = simd.fields_0(lane, bodies, places)
    sin, _, _, _ = simd.fields_4(lane, bodies, places)
    _, _, half_x, half_y = simd.fields_16(lane, bodies, places)
    return faces.block_ahead(faces.Block(x, y, cos, sin, half_x, half_y), vx, vy, spin, ahead)


@jit.kernel
def follow_corners(
    constraints: Records,
    places: Places,
    found: manifold.Manifold,
    is_decided: Mask,
    hulls_a: Any,
    hulls_b: Any,
    lane: Lane,
) -> None:
    """Have impulses of the last step go with the corners of polygons; where none has changed places they stay.

    Where a polygon rolls over a corner, what carried its one face at the right carries the next one at the left.
    Corners count from 1, those of body b from OF_B + 1.
    """
    if hulls_a is None:
        return
    is_of_b, best = found.is_of_b, found.best
    next_number = best.number + 1.0
    next_against = best.against + 1.0
    next_number = simd.select(next_number < simd.select(is_of_b, hulls_b.count, hulls_a.count), next_number, 0.0)
    next_against = simd.select(next_against < simd.select(is_of_b, hulls_a.count, hulls_b.count), next_against, 0.0)
    own = simd.select(is_of_b, 1.0 * OF_B, 0.0)  # of the body with the face
    others = 1.0 * OF_B - own
    left = simd.select(found.is_left, others + best.against, own + next_number)
    right = simd.select(found.is_right, others + next_against, own + best.number)
    ones = simd.split(1.0 + simd.select(is_of_b, right, left))
    twos = simd.split(1.0 + simd.select(is_of_b, left, right))
    are_near = simd.split(simd.select(found.is_near & is_decided, 1.0, 0.0))
    for k in range(simd.WIDTH if lane is None else 1):
        if are_near[k] > 0.0:
            constraint = constraints[places[k]]
            one, two = int(ones[k]), int(twos[k])
            normal_one = constraint.normal_one
            normal_two = constraint.normal_two
            total = normal_one + normal_two
            if total > 0.0 and (one == constraint.corner_two or two == constraint.corner_one):
                constraint.normal_one = normal_two if one == constraint.corner_two else 0.0
                constraint.normal_two = normal_one if two == constraint.corner_one else 0.0
                constraint.shear *= (constraint.normal_one + constraint.normal_two) / total
            constraint.corner_one = one
            constraint.corner_two = two


@jit.kernel
def write(lists: Lists, places: Places, found: manifold.Manifold, is_decided: Mask, pairs: Pairs, lane: Lane) -> None:
    """Write manifolds into constraints. Impulses along another normal are forgotten, and those without a manifold.

    One of a point that is not there any more goes to the other: where a block rolls over a corner, what was the right
    end of its one face is the left end of the next. What is not decided keeps what it has, and is marked UNDECIDED.
    """
    constraints, stepping = lists.constraints, lists.stepping
    follow_corners(constraints, places, found, is_decided, pairs.hulls_a, pairs.hulls_b, lane)
    points, motion = found.points, pairs.motion
    its = points.constraint
    # gaps as they are now, along the normal and arms of the manifold
    rates = slip.slip_of(its, motion.vx, motion.vy, motion.spin_a, motion.spin_b)
    gap_one = points.gap_one - motion.ahead * rates.one
    gap_two = points.gap_two - motion.ahead * rates.two
    nx, ny, _, _ = simd.fields_0(lane, constraints, places)
    _, normal_one, normal_two, shear = simd.fields_8(lane, constraints, places)
    are_kept = found.is_near & (its.nx * nx + its.ny * ny >= tolerances.TURNED)
    normal = simd.select(are_kept, normal_one + normal_two, 0.0)
    normal_one = simd.select(are_kept, normal_one, 0.0)
    normal_two = simd.select(are_kept, normal_two, 0.0)
    is_only_one = gap_two > NOT_THERE
    is_only_two = gap_one > NOT_THERE
    normal_one = simd.select(is_only_one, normal, simd.select(is_only_two, 0.0, normal_one))
    normal_two = simd.select(is_only_two, normal, simd.select(is_only_one, 0.0, normal_two))
    shear = simd.select(are_kept, shear, 0.0)
    simd.write_fields_0(lane, constraints, places, is_decided, (its.nx, its.ny, its.arm_a, its.arm_b))
    simd.write_fields_4(lane, constraints, places, is_decided, (its.width, its.shear_arm_a, its.shear_arm_b, gap_one))
    simd.write_fields_8(lane, constraints, places, is_decided, (gap_two, normal_one, normal_two, shear))
    bend = slip.bend_of(its, motion, points.is_of_b, normal_two > normal_one)
    is_pressed = slip.presses(normal_one + normal_two, pairs.inverse_mass, stepping)
    is_touching = (simd.lesser(gap_one, gap_two) <= stepping.touch_gap) | is_pressed
    reach = simd.select(
        found.is_near, simd.select(is_touching, 1.0 * arrays.TOUCHING, 1.0 * arrays.OPEN), 1.0 * arrays.AWAY
    )
    reach = simd.select(is_decided, reach, 1.0 * arrays.UNDECIDED)
    one, two, three, last = (
        constraints[places[0]],
        constraints[places[1]],
        constraints[places[2]],
        constraints[places[3]],
    )
    one.bend, two.bend, three.bend, last.bend = simd.split(bend.normal)
    one.shear_bend, two.shear_bend, three.shear_bend, last.shear_bend = simd.split(bend.shear)
    one.reach, two.reach, three.reach, last.reach = simd.split(reach)


@jit.kernel
def write_none(constraints: Records, places: Places) -> None:
    """Write that there are no manifolds; impulses are forgotten."""
    for r in places:
        constraint = constraints[r]
        constraint.normal_one = constraint.normal_two = constraint.shear = 0.0
        constraint.reach = arrays.AWAY


@jit.kernel
def collide_four(lists: Lists, places: Places, ahead: float, corners: Any) -> int:
    """Find the manifolds of four pairs of blocks; those that press a time `ahead` (s). Without `corners`: rectangles.

    Where any pair of polygons meets beside its reference face, all four are looked at alone. Returns how many are left
    UNDECIDED.
    """
    margin = lists.stepping.margin
    pairs = pairs_at(lists, places, ahead, corners, None)
    a, hulls_a, b, hulls_b = pairs.a, pairs.hulls_a, pairs.b, pairs.hulls_b
    reference = references.reference_of(a, hulls_a, b, hulls_b, margin, None)
    if simd.is_all(reference.best.gap > margin):
        write_none(lists.constraints, places)
        return 0
    found = manifold.manifold_on(reference, a, b, margin, faces.least_inner(a, hulls_a, b, hulls_b))
    if manifold.is_any_without_point(found, hulls_a, margin):
        count = 0
        for r in places:
            count += collide_one(lists, r, ahead, corners)
        return count
    write(lists, places, found, (found.points.gap_one >= -arrays.FAR) ^ found.are_corners, pairs, None)
    one, two, three, last = simd.split(simd.select(found.are_corners, 1.0, 0.0))
    return int(one + two + three + last)


@jit.kernel
def manifold_of(pair: Pairs, margin: float) -> manifold.Manifold:
    """Return the manifold of two blocks within the margin (m) where they overlap least."""
    reference = references.reference_of(pair.a, pair.hulls_a, pair.b, pair.hulls_b, margin, 0)
    return manifold.manifold_of_one(reference, pair.a, pair.hulls_a, pair.b, pair.hulls_b, margin)


@jit.kernel
def collide_one(lists: Lists, r: int, ahead: float, corners: Any) -> int:
    """Find the manifold of one pair, of blocks or with ground; one that presses a time `ahead` (s).

    Returns 1 where it is left UNDECIDED, else 0.
    """
    margin = lists.stepping.margin
    places = (r, r, r, r)
    pair = pairs_at(lists, places, ahead, corners, 0)
    a, hulls_a, b, hulls_b = pair.a, pair.hulls_a, pair.b, pair.hulls_b
    constraint = lists.constraints[r]
    one, two = lists.bodies[constraint.a], lists.bodies[constraint.b]
    if constraint.b == lists.bodies.size - 1:
        found = manifold.manifold_on_level(a, hulls_a, b, margin)
    elif one.faces < ALL:
        found = manifold.manifold_on_segment(b, hulls_b, a, one.corners, False, margin)
    elif two.faces < ALL:
        found = manifold.manifold_on_segment(a, hulls_a, b, two.corners, True, margin)
    else:
        found = manifold_of(pair, margin)
    if found.are_corners:
        constraint.reach = arrays.UNDECIDED
        return 1
    if found.is_near:
        write(lists, places, found, True, pair, 0)
    else:
        write_none(lists.constraints, places)
    return 0


@jit.kernel
def has_polygon(bodies: Records, constraint: Record) -> bool:
    """Return True if one of the bodies of a constraint is a polygon."""
    return bodies[constraint.a].faces == OUTLINE or bodies[constraint.b].faces == OUTLINE


@jit.kernel
def find_some(lists: Lists, begin: int, end: int, ahead: float, corners: Any) -> int:
    """Find the manifolds of those of some constraints that have a polygon, or of those that have none.

    Returns how many are left UNDECIDED.
    """
    are_polygons = corners is not None
    undecided = 0
    one, two, three, count = 0, 0, 0, 0  # places of blocks that wait for a fourth pair
    for r in range(begin, end + simd.WIDTH - 1):
        place = r
        if r < end:
            constraint = lists.constraints[r]
            if has_polygon(lists.bodies, constraint) != are_polygons:
                continue
            are_whole = lists.bodies[constraint.a].faces >= ALL and lists.bodies[constraint.b].faces >= ALL
            if constraint.b != lists.bodies.size - 1 and are_whole:
                if count == simd.WIDTH - 1:
                    undecided += collide_four(lists, (one, two, three, r), ahead, corners)
                    count = 0
                else:
                    one, two, three = two, three, r
                    count += 1
                continue
        elif count > 0:
            place, two, three = three, one, two
            count -= 1
        else:
            break
        undecided += collide_one(lists, place, ahead, corners)
    return undecided


@jit.kernel
def find_with_polygons(lists: Lists, begin: int, end: int, ahead: float, corners: Any) -> int:
    """Find the manifolds of those of some constraints that have a polygon, in scenes with any."""
    return 0 if corners is None else find_some(lists, begin, end, ahead, corners)


@jit.kernel
def find_manifolds(scene: arrays.Nonsmooth, begin: int, end: int) -> int:
    """Find the manifolds of some constraints; return how many are left UNDECIDED, for flush_joints.py."""
    contacts = scene.contacts
    stepping = contacts.stepping[0]
    ahead = 0.5 * (stepping.length - stepping.substep)
    lists = Lists(contacts.constraints, contacts.states, scene.world.bodies, stepping)
    undecided = find_some(lists, begin, end, ahead, None)
    return undecided + find_with_polygons(lists, begin, end, ahead, scene.world.corners)
