"""What particles and bodies do to one another: a disc of half a spacing against the exact shape.

A spring along the normal that does not pull, a dashpot, and a shear spring with history within the Coulomb cone, as
blocks have them. Relative displacements are those of the drift, with the lever arm of the particle's centre: so soil
and block keep their common angular momentum, as a particle does not turn. Losses are the work over the drift less what
the springs have gained, by the trapezoid rule, which is exactly the work that the kicks do.

Which particles are near which bodies: a sorted list of touches that carries the history of contacts along.

Made when the lists of neighbours are, by one thread, as few particles are near a body.

A piece of ground or a wall is its upper face, with the ends that can be touched; what lies beyond an end is its
neighbour's affair. The half-plane, the last of all bodies, is what lies below its height.
"""

import math

from blocksim.kernels.common import arrays, jit, neighbours, supports, systems, tolerances
from blocksim.kernels.common.barrier import barrier
from blocksim.kernels.explicit import sides
from blocksim.kernels.explicit.laws import clip_to_cone, draw_same_spring
from blocksim.kernels.soil.arrays import GROUP, Soils
from blocksim.kernels.soil.neighbours import grid_of

UPPER_RIGHT, UPPER_LEFT = 4, 8  # bits of corners that can be touched


@jit.kernel
def from_piece(body: arrays.Record, u: float, v: float, radius: float) -> tuple[float, float, float]:
    """Return the same of the upper face of a piece of ground or wall; infinite where it is not concerned.

    A centre that is more than half a radius below the face has come around its end, or through it.
    """
    across = v - body.half_y
    if across < -0.5 * radius:
        return math.inf, 0.0, 1.0
    along = abs(u) - body.half_x
    if along <= 0.0:
        return across, 0.0, 1.0
    if not body.corners & (UPPER_RIGHT if u > 0.0 else UPPER_LEFT):
        return math.inf, 0.0, 1.0
    distance = math.sqrt(along * along + across * across)
    return distance, math.copysign(along / distance, u), across / distance


@jit.kernel
def from_body(world: arrays.World, b: int, x: float, y: float, radius: float) -> tuple[float, float, float]:
    """Return the distance (m) of a place from body b and the outward normal there; a disc of that radius is meant."""
    body = world.bodies[b]
    if b == world.bodies.size - 1:
        return y - body.y, 0.0, 1.0
    u, v = sides.into_frame(body, x - body.x, y - body.y)
    if sides.is_piece(body):
        distance, nu, nv = from_piece(body, u, v, radius)
    else:
        distance, nu, nv = sides.distance_from(body, world.corners, u, v)
    nx, ny = sides.into_world(body, nu, nv)
    return distance, nx, ny


@jit.kernel
def is_near(world: arrays.World, b: int, x: float, y: float, reach: float) -> bool:
    """Return True if a place (m) is within reach (m) of body b, or inside."""
    body = world.bodies[b]
    if b == world.bodies.size - 1:
        return bool(y - body.y < reach)
    u, v = sides.into_frame(body, x - body.x, y - body.y)
    return bool(sides.is_within(body, world.corners, u, v, reach))


@jit.kernel
def dashpot_of(ratio: float, stiffness: float, mass: float, body: arrays.Record) -> float:
    """Return the coefficient (N s/m) of a dashpot of this ratio between a particle of that mass (kg) and a body."""
    return 2.0 * ratio * math.sqrt(stiffness * mass / (1.0 + mass * body.inverse_mass))


@jit.kernel
def rates(point: arrays.Record, body: arrays.Record, is_ground: bool, nx: float, ny: float) -> tuple[float, float]:
    """Return how fast (m/s) a particle comes nearer to a body along the normal, and slips along the tangent."""
    ux, uy = point.vx - body.vx, point.vy - body.vy
    if not is_ground:
        ux += body.spin * (point.y - body.y)
        uy -= body.spin * (point.x - body.x)
    return -(ux * nx + uy * ny), uy * nx - ux * ny


@jit.rare_kernel
def press(soils: Soils, world: arrays.World, touch: arrays.Record, step: float) -> None:
    """Evaluate one touch: forces on its particle, losses of the last drift."""
    body, is_ground = world.bodies[touch.body], touch.body == world.bodies.size - 1
    point, state = soils.points[touch.particle], soils.states[touch.particle]
    radius = soils.controls[0].radius
    distance, nx, ny = from_body(world, touch.body, point.x, point.y, radius)
    depth = radius - distance
    if depth <= 0.0 and touch.depth == 0.0:
        return
    values = soils.interactions[state.kind, body.contact_class]
    rate, slipping = rates(point, body, is_ground, nx, ny)
    if depth <= 0.0:  # the contact ends: what its springs hold and did not give back is lost
        drift = 0.0 if math.isinf(distance) else step  # a face has ended, and with it its directions
        book_touch(soils, touch, values, drift * rate, drift * slipping, 0.0, 0.0, 0.0, 0.0)
        touch.fx = touch.fy = 0.0
        return
    mass, stiffness = soils.kinds[state.kind].mass, values.normal_stiffness
    shear = values.shear_ratio * stiffness
    normal = max(stiffness * depth + dashpot_of(values.normal_damping, stiffness, mass, body) * rate, 0.0)
    spring, limit, slides, _ = draw_same_spring(values, shear, touch.spring, step * slipping, normal, slipping)
    resistance = shear * spring
    if not slides:
        resistance += dashpot_of(values.shear_damping, shear, mass, body) * slipping
        resistance = clip_to_cone(values, resistance, limit, normal, slipping)
    book_touch(soils, touch, values, step * rate, step * slipping, normal, resistance, depth, spring)
    touch.fx = normal * nx + resistance * ny
    touch.fy = normal * ny - resistance * nx
    state.fx += touch.fx
    state.fy += touch.fy


@jit.rare_kernel
def book_touch(
    soils: Soils,
    touch: arrays.Record,
    values: arrays.Record,
    closing: float,
    slip: float,
    normal: float,
    resistance: float,
    depth: float,
    spring: float,
) -> None:
    """Tally the losses (J) of a drift of these displacements (m), and keep forces (N) and springs (m) for the next."""
    tally = soils.tallies[touch.particle // GROUP]
    stiffness = values.normal_stiffness
    gained = 0.5 * stiffness * (depth - touch.depth) * (depth + touch.depth)
    tally.dashpot += 0.5 * (touch.normal_force + normal) * closing - gained
    gained = 0.5 * values.shear_ratio * stiffness * (spring - touch.spring) * (spring + touch.spring)
    tally.friction += 0.5 * (touch.shear_force + resistance) * slip - gained
    touch.normal_force = normal
    touch.shear_force = resistance
    touch.depth = depth
    touch.spring = spring


@jit.rare_kernel
def press_all(soils: Soils, world: arrays.World, k: int, step: float, of_blocks: bool) -> None:
    """Evaluate the touches of the particles of thread k with blocks, or with supports."""
    first, last = particles_of_thread(soils, world, k)
    if first >= last:
        return
    blocks = soils.controls[0].blocks
    end = soils.states[last - 1]
    for e in range(soils.states[first].first, end.first + end.count):
        touch = soils.touches[e]
        if (touch.body < blocks) == of_blocks:
            press(soils, world, touch, step)


@jit.kernel
def particles_of_thread(soils: Soils, world: arrays.World, k: int) -> tuple[int, int]:
    """Return where the particles of thread k begin and end: whole groups."""
    first, last = systems.part_of_thread(soils.tallies.size, world, k)
    return min(GROUP * first, soils.points.size), min(GROUP * last, soils.points.size)


@jit.rare_kernel
def load_bodies(soils: Soils, world: arrays.World, first: int, last: int) -> None:
    """Add to bodies what their particles do, in the order of the list."""
    for b in range(first, last):
        body = world.bodies[b]
        if body.counts:
            total_x, total_y, torque, touches = 0.0, 0.0, 0.0, 0
            for m in range(soils.begins[b], soils.begins[b + 1]):
                touch = soils.touches[soils.by_body[m]]
                if touch.normal_force > 0.0:
                    point = soils.points[touch.particle]
                    total_x -= touch.fx
                    total_y -= touch.fy
                    torque -= (point.x - body.x) * touch.fy - (point.y - body.y) * touch.fx
                    touches = 1
            body.fx += total_x
            body.fy += total_y
            body.torque += torque
            body.pairs_now += touches


@jit.rare_kernel
def touch_blocks(soils: Soils, _: arrays.World, world: arrays.World, k: int, step: float) -> None:
    """Let soils and blocks act on one another."""
    press_all(soils, world, k, step, True)
    barrier(world.team)
    first, last = systems.part_of_thread(soils.controls[0].blocks, world, k)
    load_bodies(soils, world, first, last)


@jit.rare_kernel
def touch_supports(soils: Soils, _: arrays.World, world: arrays.World, k: int, step: float) -> None:
    """Let soils and supports act on one another; what supports get matters where they move."""
    press_all(soils, world, k, step, False)
    if supports.has_motion(world.controls[0]):
        barrier(world.team)
        if k == 0:
            load_bodies(soils, world, soils.controls[0].blocks, world.bodies.size)


@jit.rare_kernel
def find_near(soils: Soils, world: arrays.World, b: int, count: int) -> int:
    """Append the particles near body b to `by_body`, as far as there is room; return the count needed.

    Those beyond the grid are in its outermost cells, where bodies beyond it look for them.
    """
    grid = grid_of(soils)
    controls = soils.controls[0]
    body = world.bodies[b]
    is_ground = b == world.bodies.size - 1
    reach = controls.radius + controls.skin
    left, right, bottom, top = -math.inf, math.inf, -math.inf, body.y + reach  # of what is within reach
    if not is_ground:
        wide = abs(body.cos) * body.half_x + abs(body.sin) * body.half_y + reach
        high = abs(body.sin) * body.half_x + abs(body.cos) * body.half_y + reach
        left, right, bottom, top = body.x - wide, body.x + wide, body.y - high, body.y + high
    if right < controls.least_x or left > controls.most_x or top < controls.least_y or bottom > controls.most_y:
        return count
    first, last = neighbours.column_of(grid, left), neighbours.column_of(grid, right)
    for row in range(neighbours.row_of(grid, bottom), neighbours.row_of(grid, top) + 1):
        for i in range(soils.starts[row * grid.columns + first], soils.starts[row * grid.columns + last + 1]):
            if is_near(world, b, soils.points[i].x, soils.points[i].y, reach):
                if count < soils.by_body.size:
                    soils.by_body[count] = i
                count += 1
    return count


@jit.rare_kernel
def find_all(soils: Soils, world: arrays.World) -> int:
    """Find the particles near all bodies, body after body; return how many touches there are."""
    count = 0
    for b in range(world.bodies.size):
        soils.begins[b] = count
        count = find_near(soils, world, b, count)
        if count > soils.by_body.size:
            soils.controls[0].is_full = 1
            count = soils.by_body.size
    soils.begins[world.bodies.size] = count
    return count


@jit.rare_kernel
def count_touches(soils: Soils, count: int) -> None:
    """Say where the touches of each particle are to begin; `lengths` and `order` are work space.

    The counts and beginnings of before stay in the states.
    """
    for i in range(soils.points.size):
        soils.lengths[i] = 0
    for m in range(count):
        soils.lengths[soils.by_body[m]] += 1
    total = 0
    for i in range(soils.points.size):
        soils.order[i] = total
        total += soils.lengths[i]


@jit.kernel
def keep(new: arrays.Record, old: arrays.Record) -> None:
    """Give a touch or history what another one has of a contact with the same body."""
    new.body = old.body
    new.spring = old.spring
    new.depth = old.depth
    new.normal_force = old.normal_force
    new.shear_force = old.shear_force


@jit.rare_kernel
def make_touches(soils: Soils, world: arrays.World) -> None:
    """List all touches anew, particles being in their new order; those of a particle are in the order of bodies."""
    controls = soils.controls[0]
    for e in range(controls.touch_count):
        keep(soils.kept[e], soils.touches[e])
    count = find_all(soils, world)
    count_touches(soils, count)
    for b in range(world.bodies.size):
        for m in range(soils.begins[b], soils.begins[b + 1]):
            i = int(soils.by_body[m])
            e = int(soils.order[i])
            soils.order[i] += 1
            touch = soils.touches[e]
            touch.particle = i
            touch.body = b
            touch.spring = touch.depth = touch.normal_force = touch.shear_force = touch.fx = touch.fy = 0.0
            for before in range(soils.states[i].first, soils.states[i].first + soils.states[i].count):
                if soils.kept[before].body == b:
                    keep(touch, soils.kept[before])
            soils.by_body[m] = e
    for i in range(soils.points.size):
        state = soils.states[i]
        state.count = soils.lengths[i]
        state.first = soils.order[i] - soils.lengths[i]
    controls.touch_count = count


@jit.rare_kernel
def preload(soils: Soils, world: arrays.World) -> None:
    """Press particles that touch a body at the start against it, as their stress wants it.

    Otherwise every contact would begin without a force: the shock of the soil that drops on its supports, a few
    micrometres deep, makes it flow, and the stresses that it leaves are not those of the start. What carries soil also
    carries the half of the particle below its centre.
    """
    radius = soils.controls[0].radius
    gravity_x, gravity_y = world.controls[0].gravity_x, world.controls[0].gravity_y
    for e in range(soils.controls[0].touch_count):
        touch = soils.touches[e]
        point, state = soils.points[touch.particle], soils.states[touch.particle]
        body = world.bodies[touch.body]
        distance, nx, ny = from_body(world, touch.body, point.x, point.y, radius)
        pressure = -(state.sxx * nx * nx + 2.0 * state.sxy * nx * ny + state.syy * ny * ny)
        pressure -= radius * soils.kinds[state.kind].density * min(gravity_x * nx + gravity_y * ny, 0.0)
        if abs(distance - radius) < tolerances.AT_TOUCH * radius and state.syy < 0.0 and pressure > 0.0:
            stiffness = soils.interactions[state.kind, body.contact_class].normal_stiffness
            kind = soils.kinds[state.kind]
            touch.normal_force = pressure * kind.volume / (abs(nx) * kind.pitch_x + abs(ny) * kind.pitch_y)
            touch.depth = touch.normal_force / stiffness
            point.x -= (touch.depth - radius + distance) * nx
            point.y -= (touch.depth - radius + distance) * ny
