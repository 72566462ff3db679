"""Which particles are near which bodies: a sorted list of touches that carries the history of contacts along.

Made when the lists of neighbours are, by one thread, as few particles are near a body.
"""

import math

from blocksim.kernels.common.arrays import Record, World
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.soil.arrays import Soils
from blocksim.kernels.soil.neighbours import grid_of
from blocksim.kernels.soil.shapes import from_body, is_near
from blocksim.kernels.sph.cells import clipped_cell

AT_TOUCH = 1e-3  # of the radius; what is nearer to touching a body than this at the start is in contact


@rare_kernel
def extent_of(body: Record, is_ground: bool, reach: float) -> tuple[float, float, float, float]:
    """Return left, right, bottom and top (m) of what is within reach of a body."""
    if is_ground:
        return -math.inf, math.inf, -math.inf, body.y + reach
    wide = abs(body.cos) * body.half_x + abs(body.sin) * body.half_y + reach
    high = abs(body.sin) * body.half_x + abs(body.cos) * body.half_y + reach
    return body.x - wide, body.x + wide, body.y - high, body.y + high


@rare_kernel
def find_near(soils: Soils, world: World, b: int, count: int) -> int:
    """Append the particles near body b to `by_body`, as far as there is room; return the count needed.

    Those beyond the grid are in its outermost cells, where bodies beyond it look for them.
    """
    grid = grid_of(soils)
    controls = soils.controls[0]
    body = world.bodies[b]
    is_ground = b == world.bodies.size - 1
    reach = controls.radius + controls.skin
    left, right, bottom, top = extent_of(body, is_ground, reach)
    if right < controls.least_x or left > controls.most_x or top < controls.least_y or bottom > controls.most_y:
        return count
    first = clipped_cell(left - grid.left, grid.size, grid.columns)
    last = clipped_cell(right - grid.left, grid.size, grid.columns)
    low = clipped_cell(bottom - grid.bottom, grid.size, grid.rows)
    high = clipped_cell(top - grid.bottom, grid.size, grid.rows)
    for row in range(low, high + 1):
        begin = soils.starts[row * grid.columns + first]
        end = soils.starts[row * grid.columns + last + 1]
        for i in range(begin, end):
            if is_near(body, is_ground, soils.points[i].x, soils.points[i].y, reach):
                if count < soils.by_body.size:
                    soils.by_body[count] = i
                count += 1
    return count


@rare_kernel
def find_all(soils: Soils, world: World) -> int:
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


@rare_kernel
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


@kernel
def keep(new: Record, old: Record) -> None:
    """Give a touch or history what another one has of a contact with the same body."""
    new.body = old.body
    new.spring = old.spring
    new.depth = old.depth
    new.normal_force = old.normal_force
    new.shear_force = old.shear_force


@rare_kernel
def carry_over(soils: Soils, state: Record, touch: Record) -> None:
    """Give a touch the history that its particle had with this body, if any."""
    touch.spring = touch.depth = touch.normal_force = touch.shear_force = touch.fx = touch.fy = 0.0
    for e in range(state.first, state.first + state.count):
        if soils.kept[e].body == touch.body:
            keep(touch, soils.kept[e])


@rare_kernel
def make_touches(soils: Soils, world: World) -> None:
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
            carry_over(soils, soils.states[i], touch)
            soils.by_body[m] = e
    for i in range(soils.points.size):
        state = soils.states[i]
        state.count = soils.lengths[i]
        state.first = soils.order[i] - soils.lengths[i]
    controls.touch_count = count


@rare_kernel
def preload(soils: Soils, world: World) -> None:
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
        distance, nx, ny = from_body(body, touch.body == world.bodies.size - 1, point.x, point.y, radius)
        pressure = -(state.sxx * nx * nx + 2.0 * state.sxy * nx * ny + state.syy * ny * ny)
        pressure -= radius * soils.kinds[state.kind].density * min(gravity_x * nx + gravity_y * ny, 0.0)
        if abs(distance - radius) < AT_TOUCH * radius and state.syy < 0.0 and pressure > 0.0:
            stiffness = soils.interactions[state.kind, body.contact_class].normal_stiffness
            touch.normal_force = pressure * soils.kinds[state.kind].volume / (2.0 * radius)
            touch.depth = touch.normal_force / stiffness
            point.x -= (touch.depth - radius + distance) * nx
            point.y -= (touch.depth - radius + distance) * ny
