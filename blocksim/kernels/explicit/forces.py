"""The force of the contacts of a pair: springs, dashpots, Coulomb's cone, losses and what is kept, for every law.

Forces along the normals come first, those along the tangents need them for Coulomb's limit. What a pair loses is
tallied where its forces are applied, by the trapezoid rule over the drift between two evaluations, which is exactly the
work that the kicks do.

All that one contact does by itself is written once (`grip_of`, `shear_of`, `wrench_of`, `keep`). Only dashpots couple
the contacts of a pair. With one or two (`forces_of`) they are an operator that lasts for some steps, so that all stays
in registers; with more, as between particles, they follow from the three relative coordinates of two bodies
(`forces_of_many`), and points and what is in between are kept in work space.
"""

from typing import NamedTuple

from blocksim.kernels.common.arrays import NORMAL, SHEAR, Corners, Record, Records, World
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.common.tolerances import OPERATOR_LIFE, STEADY, STEADY_STEPS
from blocksim.kernels.explicit import bearing, damping, history, inertia, kinematics, laws


class Effect(NamedTuple):
    """What a pair does in one step."""

    fx: float  # N, on body a
    fy: float
    torque_a: float  # N m, on body a
    torque_b: float  # against body b
    dashpot: float  # J, lost to dashpots
    friction: float  # J, lost to friction


NOTHING = Effect(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class Touch(NamedTuple):
    """The records of a pair with one or two contacts; of one `second` means nothing."""

    pair: Record
    a: Record
    b: Record
    values: Record
    first: Record
    second: Record
    normals: Record  # operators
    tangents: Record


class Grip(NamedTuple):
    """How a contact pushes, and how it holds along the tangent before dashpots do."""

    normal: float  # N, never less than zero: contacts do not pull
    drawn: float  # m, shear spring
    stiffness: float  # N/m, of that spring
    last: float  # N/m, the same in the step before
    elastic: float  # N, its force
    limit: float  # N, Coulomb's, or any bound between that and the force of the spring
    slides: bool
    friction: float  # J, lost


@kernel
def grip_of(
    contact: Record,
    point: kinematics.Point,
    values: Record,
    force: float,
    spring: laws.Spring,
    old: laws.Spring,
    lasts: bool,
) -> Grip:
    """Return how a contact holds, given spring and dashpot force (N) along its normal; `contact` is what it was.

    `spring` and `old` are that along its normal now and in the step before; `lasts` says that the slope is the same.
    """
    normal = max(force, 0.0)
    stiffness, last = values.shear_ratio * spring.slope, values.shear_ratio * old.slope
    drawn, limit, slides, rubbed = laws.draw_lasting_spring(
        values, stiffness, last, contact.spring, point.slip, point.drawn, normal, point.slip_rate, lasts
    )
    return Grip(normal, drawn, stiffness, last, stiffness * drawn, limit, slides, rubbed)


@kernel
def shear_of(point: kinematics.Point, values: Record, grip: Grip, force: float) -> float:
    """Return the shear force (N) of a contact, given that of spring and dashpot.

    One that slides has its spring at the limit and no dashpot.
    """
    if grip.slides:
        return grip.elastic
    return laws.clip_to_cone(values, force, grip.limit, grip.normal, point.slip_rate)


@kernel
def keep(
    contact: Record, point: kinematics.Point, grip: Grip, shear: float, spring: laws.Spring, old: laws.Spring
) -> float:
    """Write what a contact remembers; return what dashpots, cone and not pulling took in the last drift (2 J)."""
    normal = contact.normal_force - old.force + (grip.normal - spring.force)
    along = contact.shear_force - grip.last * contact.spring + (shear - grip.elastic)
    contact.spring = grip.drawn
    contact.depth = point.depth
    contact.normal_force = grip.normal
    contact.shear_force = shear
    return normal * point.closing + along * point.slip


@kernel
def wrench_of(
    pair: Record, point: kinematics.Point, normal: float, shear: float, exponent: float, grown: float
) -> tuple[float, float, float]:
    """Return the force (N) of a contact on body a and its torque (N m) about the centre of b.

    `shear` (N) is the resistance to slip of a ahead of b, along the tangent (-ny, nx). To it comes what a change of the
    stiffness by sliding does (bearing.py); what one by turning does is a couple, which is not in here. `grown` is the
    growth (m^(n-1)) of the spring.
    """
    along = shear + laws.energy_of(exponent, pair.slide, point.depth, grown)
    fx = point.nx * normal + point.ny * along
    fy = point.ny * normal - point.nx * along
    return fx, fy, point.x * fy - point.y * fx


@rare_kernel
def inverse_masses(
    touch: Touch, one: kinematics.Point, two: kinematics.Point, is_two: bool, direction: int
) -> tuple[float, float, float]:
    """Return the inverse masses (1/kg) that one or two contacts see along normals or tangents: A_11, A_12, A_22.

    They are those of the pieces of both bodies that belong to the pair (inertia.py). Of one that slides: damping.py.
    """
    pair, a, b = touch.pair, touch.a, touch.b
    dx = a.x - b.x
    dy = a.y - b.y
    normal_one_a, normal_one_b = kinematics.arms(one, dx, dy, NORMAL)
    normal_two_a, normal_two_b = kinematics.arms(two, dx, dy, NORMAL)
    stiffness = 2.0 * pair.stiffness if is_two else pair.stiffness
    of_a = inertia.piece_of(a, stiffness, one.nx, one.ny, 0.5 * (normal_one_a + normal_two_a), direction)
    of_b = inertia.piece_of(b, stiffness, one.nx, one.ny, 0.5 * (normal_one_b + normal_two_b), direction)
    one_a, one_b = kinematics.arms(one, dx, dy, direction)
    two_a, two_b = kinematics.arms(two, dx, dy, direction)
    cosine = one.nx * two.nx + one.ny * two.ny
    m_one = inertia.inverse_mass_of(one_a, one_b, one_a, one_b, 1.0, of_a, of_b)
    if not is_two and direction == NORMAL and pair.slides != 0:
        shear_a, shear_b = kinematics.arms(one, dx, dy, SHEAR)
        coupling = (one_a - of_a.arm) * shear_a * of_a.inverse_inertia
        coupling += (one_b - of_b.arm) * shear_b * of_b.inverse_inertia
        m_one = damping.sliding_mass(m_one, coupling, touch.values.kinetic_friction, pair.slides)
    if not is_two:
        return m_one, m_one, m_one
    m_two = inertia.inverse_mass_of(two_a, two_b, two_a, two_b, 1.0, of_a, of_b)
    return m_one, inertia.inverse_mass_of(one_a, one_b, two_a, two_b, cosine, of_a, of_b), m_two


@kernel
def renew_operator(
    touch: Touch,
    one: kinematics.Point,
    two: kinematics.Point,
    is_two: bool,
    direction: int,
    pattern: int,
    k_one: float,
    k_two: float,
    step: float,
    exponent: float,
    is_steady: bool,
) -> None:
    """Rebuild the operator of one or two contacts, of which those with a bit in `pattern` have a dashpot.

    `k_one` and `k_two` (N/m) are the slopes of their forces along the direction. The masses in it last for some steps,
    but not beyond a step with the weight of a contact that begins. So does all of it where contacts are linear; with
    other laws for some steps where overlaps hardly change, as `is_steady` says.
    """
    operator = touch.normals if direction == NORMAL else touch.tangents
    ratio = touch.values.normal_damping if direction == NORMAL else touch.values.shear_damping
    half = 0.5 * step
    left = touch.pair.normal_left if direction == NORMAL else touch.pair.shear_left
    is_due = damping.are_dashpots_due(touch.pair, direction)
    if is_steady and not is_due and (exponent == laws.LINEAR or left % STEADY_STEPS != 0):
        return
    if is_due:
        m_one, m_mixed, m_two = inverse_masses(touch, one, two, is_two, direction)
        damping.keep_masses(operator, half, m_one, m_mixed, m_two)
        is_usual = half > 0.0 and one.weight == 1.0 and two.weight == 1.0
        damping.keep_dashpots(touch.pair, direction, pattern, OPERATOR_LIFE if is_usual else 0)
    else:
        rate = 1.0 / half
        m_one, m_mixed, m_two = operator.h_one * rate, operator.h_mixed * rate, operator.h_two * rate
    w_one = kinematics.weight_of(one, exponent)
    w_two = kinematics.weight_of(two, exponent) if is_two else w_one
    damping.fill_operator(operator, pattern, ratio, half, m_one, m_mixed, m_two, k_one, k_two, w_one, w_two)


@kernel
def is_kept(contact: Record, point: kinematics.Point) -> bool:
    """Return True if an overlap has hardly changed in the last drift."""
    return abs(point.depth - contact.depth) <= STEADY * point.depth


@rare_kernel
def renew_shear(
    touch: Touch,
    one: kinematics.Point,
    two: kinematics.Point,
    is_two: bool,
    sticking: int,
    k_one: float,
    k_two: float,
    step: float,
) -> None:
    """Rebuild the operator along the tangents of linear springs, kept out of the hot path; see renew_operator."""
    renew_operator(touch, one, two, is_two, SHEAR, sticking, k_one, k_two, step, laws.LINEAR, False)


@kernel
def forces_of(
    touch: Touch,
    one: kinematics.Point,
    two: kinematics.Point,
    is_two: bool,
    before: float,
    step: float,
    shared: float,
    exponent: float,
    lasts: bool,
    table: Corners,
    particles: Records | None,
) -> Effect:
    """Return what a pair with one or two contacts does; of one `two` means nothing.

    `before` (N/m^n) is the stiffness of its corner contacts in the step before, `step` (s) the length of the drift that
    led here, and `shared` that which dashpots take for it; see contact.shared_step. Where `lasts` is true they are
    linear springs that are as stiff as they were, and operators along the normals are not due: most pairs at most
    steps. The compiler leaves out the rest there.
    """
    pair, values, first, second = touch.pair, touch.values, touch.first, touch.second
    dx = touch.a.x - touch.b.x
    dy = touch.a.y - touch.b.y
    k_1 = k_2 = old_1 = old_2 = pair.stiffness
    if not lasts:
        k_1 = one.share * history.stiffness_of_pair(pair, values, particles)
        k_2 = two.share * history.stiffness_of_pair(pair, values, particles)
        old_1 = history.stiffness_before(first, before, values, particles)
        old_2 = history.stiffness_before(second, before, values, particles)
    spring_1, was_1 = laws.spring_at(exponent, k_1, one.depth), laws.spring_at(exponent, old_1, first.depth)
    spring_2 = laws.spring_at(exponent, k_2, two.depth) if is_two else spring_1
    was_2 = laws.spring_at(exponent, old_2, second.depth) if is_two else was_1
    force_1, force_2 = spring_1.force, spring_2.force if is_two else 0.0
    is_steady = lasts or exponent == laws.LINEAR or (is_kept(first, one) and (not is_two or is_kept(second, two)))
    if lasts or values.normal_damping > 0.0:
        if lasts:
            pair.normal_left -= 1
        else:
            k_1, k_2, pattern = spring_1.slope, spring_2.slope, damping.BOTH if is_two else 1
            renew_operator(touch, one, two, is_two, NORMAL, pattern, k_1, k_2, shared, exponent, is_steady)
        before_2 = second.normal_force if is_two else 0.0
        force_1, force_2 = damping.damp(
            touch.normals, is_two, force_1, force_2, first.normal_force, before_2, one.closing_rate, two.closing_rate
        )
    grip_1 = grip_of(first, one, values, force_1, spring_1, was_1, lasts)
    grip_2 = grip_of(second, two, values, force_2, spring_2, was_2, lasts) if is_two else grip_1
    sticking = (0 if grip_1.slides else 1) + (2 if is_two and not grip_2.slides else 0)
    free_1, free_2 = grip_1.elastic, grip_2.elastic
    if sticking == 0:
        pair.shear_left = 0
    elif values.shear_damping > 0.0:
        if pair.sticking != sticking:
            pair.shear_left = 0
        g_1, g_2 = grip_1.stiffness, grip_2.stiffness
        if not lasts:
            renew_operator(touch, one, two, is_two, SHEAR, sticking, g_1, g_2, shared, exponent, is_steady)
        elif damping.are_dashpots_due(pair, SHEAR):
            renew_shear(touch, one, two, is_two, sticking, g_1, g_2, shared)
        before_2 = second.shear_force if is_two else 0.0
        free_1, free_2 = damping.damp(
            touch.tangents, is_two, free_1, free_2, first.shear_force, before_2, one.slip_rate, two.slip_rate
        )
    shear_1 = shear_of(one, values, grip_1, free_1)
    fx, fy, torque = wrench_of(pair, one, grip_1.normal, shear_1, exponent, spring_1.growth)
    dashpot, rubbed = 0.0, grip_1.friction
    if is_two:
        shear_2 = shear_of(two, values, grip_2, free_2)
        fx_2, fy_2, torque_2 = wrench_of(pair, two, grip_2.normal, shear_2, exponent, spring_2.growth)
        fx, fy, torque = fx + fx_2, fy + fy_2, torque + torque_2
        dashpot, rubbed = keep(second, two, grip_2, shear_2, spring_2, was_2), rubbed + grip_2.friction
    elif grip_1.normal > 0.0:
        damping.note_slip(pair, grip_1.slides or shear_1 != free_1, shear_1)
    if not (lasts and is_two):  # two that last are ends of parallel faces: no turn changes their stiffness
        torque -= laws.energy_of(exponent, pair.turn, one.depth, spring_1.growth)
        torque -= laws.energy_of(exponent, pair.turn, two.depth, spring_2.growth) if is_two else 0.0
    dashpot += keep(first, one, grip_1, shear_1, spring_1, was_1)
    bearing.measure_soon(pair, one.slip, step * (touch.a.spin - touch.b.spin), exponent, table)
    return Effect(fx, fy, torque - (dx * fy - dy * fx), torque, 0.5 * dashpot, rubbed)


@rare_kernel
def forces_of_many(world: World, p: int, count: int, before: float, step: float, shared: float) -> Effect:
    """Return what a pair with any number of contacts does, whose points are in the work space; see forces_of."""
    pair = world.pairs[p]
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    values = world.interactions[a.contact_class, b.contact_class]
    exponent = world.controls[0].exponent
    particles = world.particles
    k = history.stiffness_of_pair(pair, values, particles)
    for i in range(count):
        place = world.points[i]
        place.force = laws.elastic_force(exponent, place.share * k, place.depth)
        place.stiffness = laws.tangent_stiffness(exponent, place.share * k, place.depth)
        place.before = world.contacts[p, i].normal_force
        place.rate = place.closing_rate
    damping.add_coupled_dashpots(world.points, count, a, b, NORMAL, values.normal_damping, shared, world.matrices)
    for i in range(count):
        place = world.points[i]
        contact = world.contacts[p, i]
        place.push = place.force
        point = kinematics.point_of(place, b)
        spring = laws.spring_at(exponent, place.share * k, place.depth)
        was = laws.spring_at(
            exponent, history.stiffness_before(contact, before, values, world.particles), contact.depth
        )
        grip = grip_of(contact, point, values, place.push, spring, was, False)
        place.force = grip.elastic
        place.stiffness = 0.0 if grip.slides else grip.stiffness
        place.before = contact.shear_force
        place.rate = place.slip_rate
    damping.add_coupled_dashpots(world.points, count, a, b, SHEAR, values.shear_damping, shared, world.matrices)
    fx = fy = torque = dashpot = rubbed = 0.0
    for i in range(count):
        place = world.points[i]
        contact = world.contacts[p, i]
        point = kinematics.point_of(place, b)
        spring = laws.spring_at(exponent, place.share * k, place.depth)
        was = laws.spring_at(
            exponent, history.stiffness_before(contact, before, values, world.particles), contact.depth
        )
        grip = grip_of(contact, point, values, place.push, spring, was, False)
        shear = shear_of(point, values, grip, place.force)
        more_x, more_y, turn = wrench_of(pair, point, grip.normal, shear, exponent, spring.growth)
        fx, fy, torque = fx + more_x, fy + more_y, torque + turn
        dashpot += keep(contact, point, grip, shear, spring, was)
        rubbed += grip.friction
    torque_a = torque - ((a.x - b.x) * fy - (a.y - b.y) * fx)
    return Effect(fx, fy, torque_a, torque, 0.5 * dashpot, rubbed)
