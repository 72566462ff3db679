"""What the record of a contact says about the step before: stiffness then, and forces that were not spring forces.

Contact history when contacts begin, end, or pass from one corner to another.

A contact record keeps what a contact remembers from step to step. A contact ends when its corner leaves, or touches
another face; what its springs hold is then lost and tallied. Where two corners pass one another (blocks that become
exactly aligned), the contact itself continues under another corner, and its history goes with it.
"""

from blocksim.kernels.common.arrays import Record, Records, World
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.common.tolerances import SAME_FACE
from blocksim.kernels.explicit import broad_phase, damping, kinematics, laws
from blocksim.kernels.explicit.models import SURFACE, place_of, surface


@kernel
def stiffness_before(contact: Record, of_corners: float, values: Record, particles: Records | None) -> float:
    """Return the stiffness that a contact had, in units of `normal_stiffness`; `of_corners` is that of its pair."""
    if particles is None:
        return of_corners
    return values.normal_stiffness * contact.share


@kernel
def stiffness_of_pair(pair: Record, values: Record, particles: Records | None) -> float:
    """Return the stiffness of a contact of a pair with the share one, in units of `normal_stiffness`."""
    if particles is None:
        return pair.stiffness
    return values.normal_stiffness


@kernel
def shear_stiffness_before(contact: Record, stiffness: float, values: Record, exponent: float) -> float:
    """Return the stiffness (N/m) that the shear spring of a contact had; `stiffness` as above."""
    return values.shear_ratio * laws.tangent_stiffness(exponent, stiffness, contact.depth)


TAKEN = 0xFFFFFFFF  # slot of an old contact that has found its successor; no corner or particle has this number


@rare_kernel
def carry_on(world: World, p: int, i: int, count: int) -> None:
    """Give point i the history of the same corner on the same face, if there is one among `count`."""
    point = world.points[i]
    for j in range(count):
        old = world.before[j]
        if old.slot == point.slot and old.face == point.face:
            world.contacts[p, i] = old
            old.slot = TAKEN
            return
    contact = world.contacts[p, i]
    contact.spring = contact.depth = contact.normal_force = contact.shear_force = 0.0
    contact.slot = point.slot
    contact.face = point.face


@rare_kernel
def take_over(world: World, p: int, i: int, count: int) -> None:
    """Let the corner of point i, new and deeper than it closed, take the place of one of `count` that has ended.

    Their normals must agree: then the contact continues under another corner.
    """
    pair = world.pairs[p]
    point = world.points[i]
    if kinematics.has_just_begun(point) or surface.was_touching(point.slot, world.before, count):
        return
    for j in range(count):
        old = world.before[j]
        if old.slot != TAKEN:
            nx, ny = surface.slot_normal(world, pair, old.slot, old.face)
            if nx * point.nx + ny * point.ny > SAME_FACE:
                contact = world.contacts[p, i]
                world.contacts[p, i] = old
                contact.slot = point.slot
                contact.face = point.face
                old.slot = TAKEN
                return


@rare_kernel
def release(world: World, p: int, old: Record, step: float, tally: Record) -> None:
    """End a contact: tally its last half step and what its springs still hold.

    The last kick was half of a trapezoid whose other half is empty: its work over the last drift is half the force
    times the relative displacement, along the normal and the tangent as they were.
    """
    pair = world.pairs[p]
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    values = world.interactions[a.contact_class, b.contact_class]
    exponent = world.controls[0].exponent
    point = world.points[world.points.size - 1]
    place_of(world, p, old, point, world.particles)
    kinematics.resolve_point(point, a, b, step)
    of_spring = stiffness_before(old, pair.stiffness, values, world.particles)
    stiffness = shear_stiffness_before(old, of_spring, values, exponent)
    lost = (old.normal_force - laws.elastic_force(exponent, of_spring, old.depth)) * point.closing
    tally.dashpot += 0.5 * (lost + (old.shear_force - stiffness * old.spring) * point.slipping)
    tally.broken += 0.5 * stiffness * old.spring * (old.spring + point.slipping)


@rare_kernel
def change_contacts(world: World, p: int, count: int, step: float, tally: Record) -> None:
    """Adopt a changed set of contacts: pass on, release, weigh first steps, rebuild the operators."""
    pair = world.pairs[p]
    before = pair.active
    for j in range(before):
        world.before[j] = world.contacts[p, j]
    for i in range(count):
        carry_on(world, p, i, before)
    for i in range(count):
        contact = world.contacts[p, i]
        if contact.depth == 0.0 and world.controls[0].model == SURFACE:
            take_over(world, p, i, before)
        if contact.depth == 0.0:  # it is new
            kinematics.weigh_first_step(world.points[i], world.controls[0].exponent)
    for j in range(before):
        if world.before[j].slot != TAKEN:
            release(world, p, world.before[j], step, tally)
    damping.renew_dashpots(pair)
    pair.active = count
    pair.idle = broad_phase.idle_candidates(pair)


@kernel
def keep_places(world: World, p: int, count: int, particles: Records | None) -> None:
    """Note what only the models with particles keep: that a contact has ended shows when its particle is gone.

    Corners (no particles) are found again.
    """
    if particles is not None:
        for i in range(count):
            point = world.points[i]
            contact = world.contacts[p, i]
            contact.share = point.share
            contact.x = point.x
            contact.y = point.y
            contact.nx = point.nx
            contact.ny = point.ny
