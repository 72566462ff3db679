"""Manifolds of four pairs of polygons at a time, as of rectangles (manifold.py), but for what is looked at alone."""

from blocksim.kernels.common import jit, shapes
from blocksim.kernels.common.arrays import ALL, OUTLINE, Record, Records
from blocksim.kernels.common.simd import WIDTH, fields_8, four, is_all, select, split
from blocksim.kernels.nonsmooth import arrays, faces, manifold, polygons, slip


@jit.kernel
def is_of_polygons(constraint: Record, bodies: Records) -> bool:
    """Return True if a pair is of blocks, at least one of them a polygon."""
    if constraint.b == bodies.size - 1:
        return False
    one, two = bodies[constraint.a].faces, bodies[constraint.b].faces
    return min(one, two) >= ALL and max(one, two) == OUTLINE


@jit.kernel
def is_left_to_fours(constraint: Record, bodies: Records, corners: Records | None) -> bool:
    """Return True if a pair is found with others of polygons; where there are no corners none is."""
    if corners is None:
        return False
    return is_of_polygons(constraint, bodies)


@jit.kernel
def find_manifolds_of_polygons(
    contacts: arrays.Contacts, bodies: Records, begin: int, end: int, ahead: float, corners: Records | None
) -> None:
    """Find the manifolds of those of some constraints that are of polygons; where there are no corners none is."""
    if corners is None:
        return
    one, two, three, count = 0, 0, 0, 0
    for r in range(begin, end):
        if is_of_polygons(contacts.constraints[r], bodies):
            if count == WIDTH - 1:
                collide_four_polygons(contacts, bodies, (one, two, three, r), ahead, corners)
                count = 0
            else:
                one, two, three = two, three, r
                count += 1
    if count > 2:
        collide_one(contacts, bodies, one, ahead, corners)
    if count > 1:
        collide_one(contacts, bodies, two, ahead, corners)
    if count > 0:
        collide_one(contacts, bodies, three, ahead, corners)


@jit.kernel
def hulls_of(one: shapes.Hull, two: shapes.Hull, three: shapes.Hull, last: shapes.Hull) -> polygons.Hulls:
    """Return the corners of four bodies."""
    return polygons.Hulls(
        one.table,
        (one.first, two.first, three.first, last.first),
        max(one.size, two.size, three.size, last.size),
        four(None, 1.0 * one.first, 1.0 * two.first, 1.0 * three.first, 1.0 * last.first),
        four(None, 1.0 * one.size, 1.0 * two.size, 1.0 * three.size, 1.0 * last.size),
        four(None, one.inner, two.inner, three.inner, last.inner),
    )


@jit.kernel
def hulls_at(bodies: Records, places: tuple[int, int, int, int], corners: Records) -> polygons.Hulls:
    """Return the corners of the bodies at four places."""
    one, two, three, last = places
    return hulls_of(
        shapes.hull_of(bodies[one], corners),
        shapes.hull_of(bodies[two], corners),
        shapes.hull_of(bodies[three], corners),
        shapes.hull_of(bodies[last], corners),
    )


@jit.kernel
def collide_four_polygons(
    contacts: arrays.Contacts, bodies: Records, places: tuple[int, int, int, int], ahead: float, corners: Records
) -> None:
    """Find the manifolds of four pairs of polygons, constraints at any places; those that press a time `ahead` (s)."""
    constraints = contacts.constraints
    stepping = contacts.stepping[0]
    one, two, three, last = (
        constraints[places[0]],
        constraints[places[1]],
        constraints[places[2]],
        constraints[places[3]],
    )
    places_a = (one.a, two.a, three.a, last.a)
    places_b = (one.b, two.b, three.b, last.b)
    inverse_mass = manifold.inverse_masses_at(contacts.states, places_a, places_b)
    _, normal_one, normal_two, _ = fields_8(None, constraints, places)
    are_pressed = slip.presses(normal_one + normal_two, inverse_mass, stepping)
    times = select(are_pressed, ahead, 0.0)
    half = select(are_pressed, 0.5 * stepping.substep, 0.0)
    a, vx_a, vy_a, spin_a = manifold.blocks_at(bodies, contacts.states, places_a, times)
    b, vx_b, vy_b, spin_b = manifold.blocks_at(bodies, contacts.states, places_b, times)
    hulls_a = hulls_at(bodies, places_a, corners)
    hulls_b = hulls_at(bodies, places_b, corners)
    found, _, _ = polygons.points_of_polygons(a, hulls_a, b, hulls_b, stepping.margin, None)
    if is_all(select(found.is_odd, 1.0, 0.0) + 0.0 * half <= 0.0):
        follow_four(constraints, places, found)
        motion = slip.Motion(vx_a - vx_b, vy_a - vy_b, spin_a, spin_b, times, half)
        manifold.write_four(contacts, places, faces.at_start(found.points, motion), motion, found.is_near, inverse_mass)
    else:
        for r in places:
            collide_one(contacts, bodies, r, ahead, corners)


@jit.kernel
def follow_four(constraints: Records, places: tuple[int, int, int, int], found: polygons.Found) -> None:
    """Have impulses of four pairs go with their corners where there is a manifold."""
    are_near = split(select(found.is_near, 1.0, 0.0))
    ones = split(found.one)
    twos = split(found.two)
    for lane in range(WIDTH):
        if are_near[lane] > 0.0:
            polygons.follow_corners(constraints[places[lane]], int(ones[lane]), int(twos[lane]))


@jit.rare_kernel
def collide_one(contacts: arrays.Contacts, bodies: Records, r: int, ahead: float, corners: Records) -> None:
    """Find the manifold of one pair of polygons."""
    stepping = contacts.stepping[0]
    states = contacts.states
    constraint = contacts.constraints[r]
    a, b = constraint.a, constraint.b
    place = manifold.Place(stepping.margin, ahead, 0.5 * stepping.substep, False, stepping)
    manifold.collide(constraint, bodies[a], bodies[b], states[a], states[b], place, corners)
