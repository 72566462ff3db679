"""Contact groups: the free bodies that touch one another in a substep, supports apart, and the energy of their impacts.

Fixed bodies join no group, as no impulse moves them: two blocks on one table are independent.
"""

from blocksim.kernels.common import arrays, jit
from blocksim.kernels.common.tolerances import IMPACT_ROUND_OFF
from blocksim.kernels.nonsmooth.arrays import FAR, HIGH, Contacts


@jit.rare_kernel
def root_of(bodies: arrays.Records, i: int) -> int:
    """Return the body that stands for the group of body i, so far; shortens the way there."""
    while bodies[i].root != i:
        bodies[i].root = bodies[bodies[i].root].root
        i = bodies[i].root
    return i


@jit.rare_kernel
def of_constraint(contacts: Contacts, pack: arrays.Record, lane: int) -> arrays.Record:
    """Return the record of a free body of a constraint."""
    a = pack.a[lane]
    return contacts.impacts[a if contacts.states[a].inverse_mass > 0.0 else pack.b[lane]]


@jit.rare_kernel
def find_contact_groups(contacts: Contacts) -> None:
    """Join the bodies of all constraints with a point that counts, and mark the groups in which anything rebounds."""
    states, bodies = contacts.states, contacts.impacts
    count = contacts.stepping[0].pack_count
    for i in range(bodies.size):
        bodies[i].root = i
        bodies[i].is_hit = 0
    for m in range(count):
        pack = contacts.packs[m]
        for lane in range(pack.count):
            a, b = pack.a[lane], pack.b[lane]
            are_free = states[a].inverse_mass > 0.0 and states[b].inverse_mass > 0.0
            if are_free and max(pack.target_one[lane], pack.target_two[lane]) > -FAR:
                one, other = root_of(bodies, a), root_of(bodies, b)
                bodies[max(one, other)].root = min(one, other)
    for m in range(count):
        pack = contacts.packs[m]
        for lane in range(pack.count):
            if max(pack.target_one[lane], pack.target_two[lane]) > 0.0:
                bodies[root_of(bodies, of_constraint(contacts, pack, lane).root)].is_hit = 1
    for i in range(bodies.size):
        bodies[i].root = root_of(bodies, i)
        bodies[i].is_hit = bodies[bodies[i].root].is_hit


@jit.rare_kernel
def energy(contacts: Contacts, state: arrays.Record, vx: float, vy: float, spin: float) -> float:
    """Return the kinetic energy (J) of a body, seen from the supports: those that move may well bring energy in."""
    ux = vx - contacts.stepping[0].support_vx
    uy = vy - contacts.stepping[0].support_vy
    return 0.5 * ((ux * ux + uy * uy) / state.inverse_mass + spin * spin / state.inverse_inertia)


@jit.rare_kernel
def count_work(contacts: Contacts) -> None:
    """Take the work of driven bodies, seen from the supports, out of the energies of groups after a round.

    What a body that moves differently from the supports brings in is not created by impacts.
    """
    stepping = contacts.stepping[0]
    for m in range(stepping.pack_count if stepping.is_driven else 0):
        pack = contacts.packs[m]
        for lane in range(pack.count if contacts.impact_lanes[m].is_hit else 0):
            root = contacts.impacts[of_constraint(contacts, pack, lane).root]
            root.now -= work_of(contacts, pack, lane)


@jit.rare_kernel
def work_of(contacts: Contacts, pack: arrays.Record, lane: int) -> float:
    """Return the work (J) that the impulses of a constraint bring into its free body, seen from the supports."""
    states = contacts.states
    is_b = states[pack.a[lane]].inverse_mass > 0.0
    fixed = states[pack.b[lane] if is_b else pack.a[lane]]
    if fixed.inverse_mass > 0.0:
        return 0.0
    ux = fixed.vx - contacts.stepping[0].support_vx
    uy = fixed.vy - contacts.stepping[0].support_vy
    normal = pack.normal_one[lane] + pack.normal_two[lane]
    shear = pack.shear[lane]
    nx = pack.nx[lane]
    ny = pack.ny[lane]
    moment = (pack.arm_b[lane] if is_b else pack.arm_a[lane]) * normal - pack.width[lane] * pack.normal_two[lane]
    moment += (pack.shear_arm_b[lane] if is_b else pack.shear_arm_a[lane]) * shear
    work = normal * (nx * ux + ny * uy) + shear * (nx * uy - ny * ux) + fixed.spin * moment
    return work if is_b else -work


@jit.rare_kernel
def has_gain(root: arrays.Record) -> bool:
    """Return True if impacts have created energy in a group."""
    return root.now > root.then * (1.0 + IMPACT_ROUND_OFF)


@jit.rare_kernel
def weigh(contacts: Contacts) -> bool:
    """Sum up the energies of all groups before and after a round; return whether any has gained."""
    states = contacts.states
    bodies = contacts.impacts
    for body in bodies:
        body.then = body.now = 0.0
        body.side = HIGH
    for i in range(bodies.size):
        body = bodies[i]
        if body.is_hit and states[i].inverse_mass > 0.0:
            root = bodies[body.root]
            root.then += energy(contacts, states[i], body.vx, body.vy, body.spin)
            root.now += energy(contacts, states[i], states[i].vx, states[i].vy, states[i].spin)
    count_work(contacts)
    gains = False
    for body in bodies:
        gains = gains or has_gain(body)
    return gains
