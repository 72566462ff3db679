"""Where two bodies touch or will: the ends of the overlap of two faces, with their gaps.

Of all faces the reference is the one beyond which the other body reaches least (separating axes). This is about
rectangles, four pairs at a time; polygons: polygons.py.

Contacts that press are sought where the bodies will be half a step ahead: normals and arms are then those of the
middle of the step for which they are kept, so that turning about an edge and sliding along a slope are right to second
order in the step. Their gaps are those at the start, along the same normal and arms. Contacts to come are taken as they
are: bodies that meet half a step too deep would be taken for neighbours side by side.
"""

from typing import NamedTuple

from blocksim.kernels.common import jit, shapes
from blocksim.kernels.common.arrays import ALL, OUTLINE, Record, Records
from blocksim.kernels.common.simd import (
    WIDTH,
    Lanes,
    Mask,
    fields_0,
    fields_4,
    fields_8,
    fields_16,
    greater,
    is_all,
    lesser,
    select,
    split,
    write_fields_0,
    write_fields_4,
    write_fields_8,
)
from blocksim.kernels.nonsmooth import arrays, faces, pieces, polygons, slip

TIE = 1e-7  # m: by so much a face of body a has to be better than one of body b
EDGE = 0.01  # of the smaller half side: two faces that face each other over less are passed by
LEVEL = 0.1  # sine of the angle between two blocks up to which that is so
NOT_THERE = 0.5 * arrays.FAR  # m: what is FAR changes a little as bodies move
TURNED = 0.906307787036650  # cosine of 25 degrees


class Place(NamedTuple):
    """Where and when contacts of a pair are sought."""

    margin: float  # m
    ahead: float  # s: those that press
    half: float  # s: half a substep
    is_ground: bool
    stepping: Record


@jit.kernel
def write_points(constraint: Record, points: faces.Points, motion: slip.Motion) -> None:
    """Write a manifold into a constraint. Impulses along another normal are forgotten.

    One of a point that is not there any more goes to the other: where a block rolls over a corner, what was the right
    end of its one face is the left end of the next.
    """
    found = points.constraint
    if found.nx * constraint.nx + found.ny * constraint.ny < TURNED:
        constraint.normal_one = constraint.normal_two = constraint.shear = 0.0
    normal = constraint.normal_one + constraint.normal_two
    if points.gap_one > NOT_THERE:
        constraint.normal_one, constraint.normal_two = 0.0, normal
    elif points.gap_two > NOT_THERE:
        constraint.normal_one, constraint.normal_two = normal, 0.0
    constraint.nx = found.nx
    constraint.ny = found.ny
    constraint.arm_a = found.arm_a
    constraint.arm_b = found.arm_b
    constraint.width = found.width
    constraint.shear_arm_a = found.shear_arm_a
    constraint.shear_arm_b = found.shear_arm_b
    constraint.gap_one = points.gap_one
    constraint.gap_two = points.gap_two
    bend = faces.bend_of(found, motion, points.is_of_b, constraint.normal_two > constraint.normal_one)
    constraint.bend = bend.normal
    constraint.shear_bend = bend.shear


@jit.kernel
def passes_edge(best: Lanes, other: Lanes, a: faces.Block, b: faces.Block) -> Mask:
    """Return True if two faces at a distance `best` (m) overlap so little that the blocks meet at other faces.

    `other` is the distance (m) along the other axis, which is negative by what they overlap. A block that slides over
    the flush joint of two others would else be stopped by the side of the second, as it sinks in by a little.
    """
    least = lesser(lesser(a.half_x, a.half_y), lesser(b.half_x, b.half_y))
    return (-EDGE * least < other) & (other < best)


@jit.kernel
def chosen(is_one: Mask, one: faces.Block, two: faces.Block) -> faces.Block:
    """Return one block or the other."""
    return faces.Block(
        select(is_one, one.x, two.x),
        select(is_one, one.y, two.y),
        select(is_one, one.cos, two.cos),
        select(is_one, one.sin, two.sin),
        select(is_one, one.half_x, two.half_x),
        select(is_one, one.half_y, two.half_y),
    )


@jit.kernel
def nothing(zero: Lanes, is_of_b: Mask) -> faces.Points:
    """Return a manifold without points."""
    return faces.Points(
        slip.Constraints(zero, zero, zero, zero, zero, zero, zero), zero + arrays.FAR, zero + arrays.FAR, is_of_b
    )


@jit.kernel
def points_of_blocks(a: faces.Block, b: faces.Block, margin: float) -> tuple[faces.Points, Mask]:
    """Return the contact manifold of two blocks within the margin (m), and whether there is one.

    No processor can predict which faces meet, so the code has no branches but one, for pairs that are not near.
    """
    dx = a.x - b.x
    dy = a.y - b.y
    c_abs = abs(a.cos * b.cos + a.sin * b.sin)
    s_abs = abs(a.sin * b.cos - a.cos * b.sin)
    bx = b.cos * dx + b.sin * dy
    by = b.cos * dy - b.sin * dx
    ax = a.cos * dx + a.sin * dy
    ay = a.cos * dy - a.sin * dx
    gap_bx = abs(bx) - b.half_x - c_abs * a.half_x - s_abs * a.half_y
    gap_by = abs(by) - b.half_y - s_abs * a.half_x - c_abs * a.half_y
    gap_ax = abs(ax) - a.half_x - c_abs * b.half_x - s_abs * b.half_y
    gap_ay = abs(ay) - a.half_y - s_abs * b.half_x - c_abs * b.half_y
    best_b = greater(gap_bx, gap_by)
    best_a = greater(gap_ax, gap_ay)
    farthest = greater(best_a, best_b)
    is_of_b = best_b + TIE >= best_a
    if is_all(farthest > margin):
        return nothing(0.0 * farthest, is_of_b), farthest <= margin
    of_x = select(is_of_b, gap_bx, gap_ax)
    of_y = select(is_of_b, gap_by, gap_ay)
    is_level = lesser(c_abs, s_abs) < LEVEL
    along_x = (of_x > of_y) ^ (is_level & passes_edge(greater(of_x, of_y), lesser(of_x, of_y), a, b))
    face = faces.face_towards(chosen(is_of_b, b, a), select(is_of_b, bx, -ax), select(is_of_b, by, -ay), along_x)
    edge = faces.clip(faces.opposite_edge(face, chosen(is_of_b, a, b)), face)
    points = faces.points_of(face, edge, a, b, is_of_b, margin)
    is_near = (farthest <= margin) & (edge.right > edge.left)
    return points, is_near & faces.has_point(points)


@jit.kernel
def reach_of(constraint: Record, inverse_mass: float, stepping: Record) -> int:
    """Return TOUCHING if a constraint within the margin has a point that touches or pressed in the last substep.

    `inverse_mass` (1/kg) is that of both bodies together.
    """
    gap = min(constraint.gap_one, constraint.gap_two)
    is_pressed = slip.presses(constraint.normal_one + constraint.normal_two, inverse_mass, stepping)
    return arrays.TOUCHING if gap <= stepping.touch_gap or is_pressed else arrays.OPEN


@jit.kernel
def inverse_masses_at(states: Records, a: tuple[int, int, int, int], b: tuple[int, int, int, int]) -> Lanes:
    """Return the inverse masses (1/kg) of the bodies of four pairs, both together."""
    _, _, _, of_a = fields_0(None, states, a)
    _, _, _, of_b = fields_0(None, states, b)
    return of_a + of_b


@jit.kernel
def blocks_at(
    bodies: Records, states: Records, places: tuple[int, int, int, int], ahead: Lanes
) -> tuple[faces.Block, Lanes, Lanes, Lanes]:
    """Return four blocks as they will be a time `ahead` (s), and their velocities (m/s, m/s, rad/s)."""
    x, y, _, cos = fields_0(None, bodies, places)
    sin, _, _, _ = fields_4(None, bodies, places)
    _, _, half_x, half_y = fields_16(None, bodies, places)
    vx, vy, spin, _ = fields_0(None, states, places)
    return faces.block_ahead(faces.Block(x, y, cos, sin, half_x, half_y), vx, vy, spin, ahead), vx, vy, spin


@jit.kernel
def collide_four(contacts: arrays.Contacts, bodies: Records, first: int, ahead: float) -> None:
    """Find the manifolds of four pairs of blocks from constraint `first` on; those that press a time `ahead` (s)."""
    constraints = contacts.constraints
    stepping = contacts.stepping[0]
    places = (first, first + 1, first + 2, first + 3)
    one, two, three, four = constraints[first], constraints[first + 1], constraints[first + 2], constraints[first + 3]
    places_a = (one.a, two.a, three.a, four.a)
    places_b = (one.b, two.b, three.b, four.b)
    inverse_mass = inverse_masses_at(contacts.states, places_a, places_b)
    _, normal_one, normal_two, _ = fields_8(None, constraints, places)
    are_pressed = slip.presses(normal_one + normal_two, inverse_mass, stepping)
    times = select(are_pressed, ahead, 0.0)
    half = select(are_pressed, 0.5 * stepping.substep, 0.0)
    a, vx_a, vy_a, spin_a = blocks_at(bodies, contacts.states, places_a, times)
    b, vx_b, vy_b, spin_b = blocks_at(bodies, contacts.states, places_b, times)
    points, is_near = points_of_blocks(a, b, stepping.margin)
    motion = slip.Motion(vx_a - vx_b, vy_a - vy_b, spin_a, spin_b, times, half)
    write_four(contacts, places, faces.at_start(points, motion), motion, is_near, inverse_mass)


@jit.kernel
def write_four(
    contacts: arrays.Contacts,
    places: tuple[int, int, int, int],
    points: faces.Points,
    motion: slip.Motion,
    is_near: Mask,
    inverse_mass: Lanes,
) -> None:
    """Write the manifolds of four constraints; without one the impulses are forgotten."""
    constraints = contacts.constraints
    stepping = contacts.stepping[0]
    found = points.constraint
    nx, ny, _, _ = fields_0(None, constraints, places)
    _, normal_one, normal_two, shear = fields_8(None, constraints, places)
    are_kept = is_near & (found.nx * nx + found.ny * ny >= TURNED)
    normal = select(are_kept, normal_one + normal_two, 0.0)
    normal_one = select(are_kept, normal_one, 0.0)
    normal_two = select(are_kept, normal_two, 0.0)
    is_only_one = points.gap_two > NOT_THERE
    is_only_two = points.gap_one > NOT_THERE
    normal_one = select(is_only_one, normal, select(is_only_two, 0.0, normal_one))
    normal_two = select(is_only_two, normal, select(is_only_one, 0.0, normal_two))
    shear = select(are_kept, shear, 0.0)
    are_all = abs(found.width) >= 0.0
    write_fields_0(None, constraints, places, are_all, (found.nx, found.ny, found.arm_a, found.arm_b))
    columns = (found.width, found.shear_arm_a, found.shear_arm_b, points.gap_one)
    write_fields_4(None, constraints, places, are_all, columns)
    write_fields_8(None, constraints, places, are_all, (points.gap_two, normal_one, normal_two, shear))
    bend = faces.bend_of(found, motion, points.is_of_b, normal_two > normal_one)
    is_pressed = slip.presses(normal_one + normal_two, inverse_mass, stepping)
    is_touching = (lesser(points.gap_one, points.gap_two) <= stepping.touch_gap) | is_pressed
    reach = select(is_near, select(is_touching, 1.0 * arrays.TOUCHING, 1.0 * arrays.OPEN), 1.0 * arrays.AWAY)
    one, two, three, four = (
        constraints[places[0]],
        constraints[places[1]],
        constraints[places[2]],
        constraints[places[3]],
    )
    one.bend, two.bend, three.bend, four.bend = split(bend.normal)
    one.shear_bend, two.shear_bend, three.shear_bend, four.shear_bend = split(bend.shear)
    one.reach, two.reach, three.reach, four.reach = split(reach)


@jit.kernel
def are_four_of_blocks(constraints: Records, first: int, bodies: Records) -> bool:
    """Return True if four pairs, from constraint `first` on, are of blocks only, none of ground."""
    for r in range(first, first + WIDTH):
        constraint = constraints[r]
        if constraint.b == bodies.size - 1 or bodies[constraint.a].faces != ALL or bodies[constraint.b].faces != ALL:
            return False
    return True


@jit.rare_kernel
def collide(
    constraint: Record, a: Record, b: Record, line_a: Record, line_b: Record, place: Place, corners: Records | None
) -> None:
    """Find the contact manifold of a pair; without one its impulses are forgotten.

    `corners` are those of all polygons; where there are none, the compiler leaves them out altogether.
    """
    inverse_mass = line_a.inverse_mass + line_b.inverse_mass
    is_pressed = slip.presses(constraint.normal_one + constraint.normal_two, inverse_mass, place.stepping)
    ahead = place.ahead if is_pressed else 0.0
    one = faces.block_ahead(faces.block_of(a), line_a.vx, line_a.vy, line_a.spin, ahead)
    two = faces.block_ahead(faces.block_of(b), line_b.vx, line_b.vy, line_b.spin, ahead)
    points, is_near = points_of_pair(constraint, a, one, b, two, place, corners)
    if is_near:
        half = place.half if is_pressed else 0.0
        motion = slip.Motion(line_a.vx - line_b.vx, line_a.vy - line_b.vy, line_a.spin, line_b.spin, ahead, half)
        write_points(constraint, faces.at_start(points, motion), motion)
        constraint.reach = reach_of(constraint, inverse_mass, place.stepping)
    else:
        constraint.normal_one = constraint.normal_two = constraint.shear = 0.0
        constraint.reach = arrays.AWAY


@jit.kernel
def points_of_pair(
    constraint: Record, a: Record, one: faces.Block, b: Record, two: faces.Block, place: Place, corners: Records | None
) -> tuple[faces.Points, bool]:
    """Return the contact manifold of two bodies, that are in `one` and `two`, and whether there is one."""
    if corners is None:
        return points_of_rectangles(a, one, b, two, place)
    if a.faces == OUTLINE or b.faces == OUTLINE:
        return points_with_polygon(constraint, a, one, b, two, place, corners)
    return points_of_rectangles(a, one, b, two, place)


@jit.kernel
def points_of_rectangles(
    a: Record, one: faces.Block, b: Record, two: faces.Block, place: Place
) -> tuple[faces.Points, bool]:
    """Return the contact manifold of a rectangle and another or the ground, and whether there is one."""
    if place.is_ground:
        return pieces.points_on_level(one, two, place.margin)
    if a.faces != ALL:
        return pieces.points_on_piece(two, None, one, a.corners, False, place.margin)
    if b.faces != ALL:
        return pieces.points_on_piece(one, None, two, b.corners, True, place.margin)
    return points_of_blocks(one, two, place.margin)


@jit.kernel
def points_with_polygon(
    constraint: Record, a: Record, one: faces.Block, b: Record, two: faces.Block, place: Place, corners: Records
) -> tuple[faces.Points, bool]:
    """Return the contact manifold of a polygon and another, a rectangle or the ground, and whether there is one."""
    hull_a = shapes.hull_of(a, corners)
    hull_b = shapes.hull_of(b, corners)
    is_first = a.faces >= ALL
    if is_first and b.faces >= ALL and not place.is_ground:
        found = polygons.points_of_two(
            one, polygons.hulls_of_one(hull_a), two, polygons.hulls_of_one(hull_b), place.margin
        )
        if found.is_near:
            polygons.follow_corners(constraint, int(found.one), int(found.two))
        return found.points, found.is_near
    if place.is_ground:
        points, is_near = pieces.points_on_ground(one, hull_a, two, place.margin)
    elif is_first:
        points, is_near = pieces.points_on_piece(one, hull_a, two, b.corners, True, place.margin)
    else:
        points, is_near = pieces.points_on_piece(two, hull_b, one, a.corners, False, place.margin)
    if is_near:
        first, second = polygons.corners_on_ground(
            points, one if is_first else two, hull_a if is_first else hull_b, is_first
        )
        polygons.follow_corners(constraint, first, second)
    return points, is_near
