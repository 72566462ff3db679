"""What particles and bodies do to one another: a disc of half a spacing against the exact shape.

A spring along the normal that does not pull, a dashpot, and a shear spring with history within the Coulomb cone, as
blocks have them. Relative displacements are those of the drift, with the lever arm of the particle's centre: so soil
and block keep their common angular momentum, as a particle does not turn. Losses are the work over the drift less what
the springs have gained, by the trapezoid rule, which is exactly the work that the kicks do.
"""

import math

from blocksim.kernels.common.arrays import Record, World
from blocksim.kernels.common.barrier import barrier
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.common.supports import has_motion
from blocksim.kernels.common.systems import part_of_thread
from blocksim.kernels.explicit.friction import clip_to_cone, draw_same_spring
from blocksim.kernels.soil.arrays import GROUP, Soils
from blocksim.kernels.soil.shapes import from_body


@kernel
def dashpot_of(ratio: float, stiffness: float, mass: float, body: Record) -> float:
    """Return the coefficient (N s/m) of a dashpot of this ratio between a particle of that mass (kg) and a body."""
    return 2.0 * ratio * math.sqrt(stiffness * mass / (1.0 + mass * body.inverse_mass))


@kernel
def rates(point: Record, body: Record, is_ground: bool, nx: float, ny: float) -> tuple[float, float]:
    """Return how fast (m/s) a particle comes nearer to a body along the normal, and slips along the tangent."""
    ux, uy = point.vx - body.vx, point.vy - body.vy
    if not is_ground:
        ux += body.spin * (point.y - body.y)
        uy -= body.spin * (point.x - body.x)
    return -(ux * nx + uy * ny), uy * nx - ux * ny


@rare_kernel
def press(soils: Soils, touch: Record, body: Record, is_ground: bool, step: float) -> None:
    """Evaluate one touch: forces on its particle, losses of the last drift."""
    point, state = soils.points[touch.particle], soils.states[touch.particle]
    radius = soils.controls[0].radius
    distance, nx, ny = from_body(body, is_ground, point.x, point.y, radius)
    depth = radius - distance
    if depth <= 0.0 and touch.depth == 0.0:
        return
    values = soils.interactions[state.kind, body.contact_class]
    rate, slipping = rates(point, body, is_ground, nx, ny)
    if depth <= 0.0:
        drift = 0.0 if math.isinf(distance) else step  # a face has ended, and with it its directions
        end_touch(soils, touch, values, drift * rate, drift * slipping)
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


@rare_kernel
def book_touch(
    soils: Soils,
    touch: Record,
    values: Record,
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


@rare_kernel
def end_touch(soils: Soils, touch: Record, values: Record, closing: float, slip: float) -> None:
    """End a contact; what its springs hold and did not give back is lost."""
    book_touch(soils, touch, values, closing, slip, 0.0, 0.0, 0.0, 0.0)
    touch.fx = 0.0
    touch.fy = 0.0


@rare_kernel
def press_all(soils: Soils, world: World, k: int, step: float, of_blocks: bool) -> None:
    """Evaluate the touches of the particles of thread k with blocks, or with supports."""
    first, last = particles_of_thread(soils, world, k)
    if first >= last:
        return
    ground = world.bodies.size - 1
    blocks = soils.controls[0].blocks
    end = soils.states[last - 1]
    for e in range(soils.states[first].first, end.first + end.count):
        touch = soils.touches[e]
        if (touch.body < blocks) == of_blocks:
            press(soils, touch, world.bodies[touch.body], touch.body == ground, step)


@kernel
def particles_of_thread(soils: Soils, world: World, k: int) -> tuple[int, int]:
    """Return where the particles of thread k begin and end: whole groups."""
    first, last = part_of_thread(soils.tallies.size, world, k)
    return min(GROUP * first, soils.points.size), min(GROUP * last, soils.points.size)


@rare_kernel
def load_bodies(soils: Soils, world: World, first: int, last: int) -> None:
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


@rare_kernel
def touch_blocks(soils: Soils, _: World, world: World, k: int, step: float) -> None:
    """Let soils and blocks act on one another."""
    press_all(soils, world, k, step, True)
    barrier(world.team)
    first, last = part_of_thread(soils.controls[0].blocks, world, k)
    load_bodies(soils, world, first, last)


@rare_kernel
def touch_supports(soils: Soils, _: World, world: World, k: int, step: float) -> None:
    """Let soils and supports act on one another; what supports get matters where they move."""
    press_all(soils, world, k, step, False)
    if has_motion(world.controls[0]):
        barrier(world.team)
        if k == 0:
            load_bodies(soils, world, soils.controls[0].blocks, world.bodies.size)
