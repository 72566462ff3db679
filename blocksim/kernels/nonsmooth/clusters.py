"""Clusters: the free bodies that touch one another in a substep, supports apart, and the energy of their impacts.

Fixed bodies join no cluster, as no impulse moves them: two blocks on one table are independent.
"""

from blocksim.kernels.common import arrays, jit
from blocksim.kernels.common.tolerances import IMPACT_ROUND_OFF
from blocksim.kernels.nonsmooth.arrays import FAR, Contacts


@jit.rare_kernel
def root_of(bodies: arrays.Records, i: int) -> int:
    """Return the body that stands for the cluster of body i, so far; shortens the way there."""
    while bodies[i].root != i:
        bodies[i].root = bodies[bodies[i].root].root
        i = bodies[i].root
    return i


@jit.rare_kernel
def join(bodies: arrays.Records, i: int, j: int) -> None:
    """Make one cluster of two."""
    i = root_of(bodies, i)
    j = root_of(bodies, j)
    bodies[max(i, j)].root = min(i, j)


@jit.rare_kernel
def of_constraint(contacts: Contacts, group: arrays.Record, lane: int) -> arrays.Record:
    """Return the record of a free body of a constraint."""
    a = group.a[lane]
    return contacts.impacts[a if contacts.states[a].inverse_mass > 0.0 else group.b[lane]]


@jit.rare_kernel
def join_touching(contacts: Contacts, group: arrays.Record) -> None:
    """Join the free bodies of the constraints of a group with a point that counts."""
    states = contacts.states
    for lane in range(group.count):
        a, b = group.a[lane], group.b[lane]
        are_free = states[a].inverse_mass > 0.0 and states[b].inverse_mass > 0.0
        if are_free and max(group.target_one[lane], group.target_two[lane]) > -FAR:
            join(contacts.impacts, a, b)


@jit.rare_kernel
def mark_rebounds(contacts: Contacts, group: arrays.Record) -> None:
    """Mark the clusters of the constraints of a group with a point that rebounds."""
    bodies = contacts.impacts
    for lane in range(group.count):
        if max(group.target_one[lane], group.target_two[lane]) > 0.0:
            bodies[root_of(bodies, of_constraint(contacts, group, lane).root)].is_hit = 1


@jit.rare_kernel
def find_clusters(contacts: Contacts) -> None:
    """Join the bodies of all constraints with a point that counts, and mark the clusters in which anything rebounds."""
    bodies = contacts.impacts
    for i in range(bodies.size):
        bodies[i].root = i
        bodies[i].is_hit = 0
    for m in range(contacts.stepping[0].group_count):
        join_touching(contacts, contacts.groups[m])
    for m in range(contacts.stepping[0].group_count):
        mark_rebounds(contacts, contacts.groups[m])
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
    """Take the work of driven bodies, seen from the supports, out of the energies of clusters after a round.

    What a body that moves differently from the supports brings in is not created by impacts.
    """
    stepping = contacts.stepping[0]
    for m in range(stepping.group_count if stepping.is_driven else 0):
        group = contacts.groups[m]
        for lane in range(group.count if contacts.asides[m].is_hit else 0):
            root = contacts.impacts[of_constraint(contacts, group, lane).root]
            root.now -= work_of(contacts, group, lane)


@jit.rare_kernel
def work_of(contacts: Contacts, group: arrays.Record, lane: int) -> float:
    """Return the work (J) that the impulses of a constraint bring into its free body, seen from the supports."""
    states = contacts.states
    is_b = states[group.a[lane]].inverse_mass > 0.0
    fixed = states[group.b[lane] if is_b else group.a[lane]]
    if fixed.inverse_mass > 0.0:
        return 0.0
    ux = fixed.vx - contacts.stepping[0].support_vx
    uy = fixed.vy - contacts.stepping[0].support_vy
    normal = group.normal_one[lane] + group.normal_two[lane]
    shear = group.shear[lane]
    nx = group.nx[lane]
    ny = group.ny[lane]
    moment = (group.arm_b[lane] if is_b else group.arm_a[lane]) * normal - group.width[lane] * group.normal_two[lane]
    moment += (group.shear_arm_b[lane] if is_b else group.shear_arm_a[lane]) * shear
    work = normal * (nx * ux + ny * uy) + shear * (nx * uy - ny * ux) + fixed.spin * moment
    return work if is_b else -work


@jit.rare_kernel
def has_gain(root: arrays.Record) -> bool:
    """Return True if impacts have created energy in a cluster."""
    return root.now > root.then * (1.0 + IMPACT_ROUND_OFF)


@jit.rare_kernel
def weigh(contacts: Contacts) -> bool:
    """Sum up the energies of all clusters before and after a round; return whether any has gained."""
    states = contacts.states
    bodies = contacts.impacts
    for body in bodies:
        body.then = body.now = 0.0
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
