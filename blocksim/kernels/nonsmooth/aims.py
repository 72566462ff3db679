"""What the velocity pass has to reach at the points of constraints: rebounds, and no approach elsewhere."""

from blocksim.kernels.common.arrays import Record
from blocksim.kernels.common.jit import kernel
from blocksim.kernels.common.simd import (
    Lane,
    Lanes,
    branch,
    fields_0,
    greater,
    is_all,
    lesser,
    load,
    root,
    select,
    store,
)
from blocksim.kernels.nonsmooth.arrays import FAR, Contacts
from blocksim.kernels.nonsmooth.groups import Bodies
from blocksim.kernels.nonsmooth.slip import Constraints, Slip, presses, slip_of


@kernel
def gaps(
    group: Record, lane: Lane, constraint: Constraints, a: Bodies, b: Bodies, bend_time: float
) -> tuple[Lanes, Lanes]:
    """Return both gaps (m) as they are now; `bend_time` (s) is that of gap_curvature.py now."""
    slip = slip_of(constraint, a.dx - b.dx, a.dy - b.dy, a.turned, b.turned)
    bent = bend_time * load(lane, group.bend)
    return load(lane, group.gap_one) + slip.one + bent, load(lane, group.gap_two) + slip.two + bent


@kernel
def pulls(constraint: Constraints, a: Bodies, b: Bodies, stepping: Record) -> Lanes:
    """Return by how much gravity changes J v of constraints in a substep (m/s) as long as nothing touches.

    So do loads that act on all bodies. Those on single ones are left out: a rebound is off by their share of a kick.
    """
    free = select(a.inverse_mass > 0.0, 1.0, 0.0) - select(b.inverse_mass > 0.0, 1.0, 0.0)
    return free * (constraint.nx * stepping.pull_x + constraint.ny * stepping.pull_y)


@kernel
def rebound(approach: Lanes, start: Lanes, pull: Lanes, restitution: Lanes, stepping: Record) -> Lanes:
    """Return J v (m/s) that leaves a share e^2 of the energy with which a point meets.

    Positions are half a substep ahead of velocities, so that J v is short of half a `pull` both before and after (not
    at the start of a run: what it lacks there is `lag`). From a gap `start` (m) the point falls on, and the position
    pass leaves it where it touches:

        t + pull / 2 = e sqrt((u + pull / 2)^2 - 2 (pull / h) start)

    With t = -e u an impact at speed u lost 3 g h / u of its energy, on average, however elastic the blocks.
    """
    now = approach + stepping.lag * pull
    square = now * now - 2.0 * stepping.open_bias * pull * greater(start, 0.0)
    return restitution * root(greater(square, 0.0)) - 0.5 * pull


@kernel
def target(impulse: Lanes, inverse_mass: Lanes, gap: Lanes, least: Lanes, stepping: Record) -> Lanes:
    """Return what J v of a point has to be at least (m/s) after the velocity pass; -FAR where it does not count.

    A gap that is still open must not slow an approach down: it would take a part of it in the substep before the
    impact, and restitution would vanish for small substeps.
    """
    return branch(presses(impulse, inverse_mass, stepping) | (gap <= stepping.touch_gap), least, -FAR)


@kernel
def aim(
    contacts: Contacts, group: Record, lane: Lane, constraint: Constraints, a: Bodies, b: Bodies
) -> tuple[Lanes, Lanes]:
    """Set what the velocity pass has to reach at the points of constraints."""
    stepping = contacts.stepping[0]
    gap_one, gap_two = gaps(group, lane, constraint, a, b, stepping.next_bend_time)
    normal_one = load(lane, group.normal_one)
    normal_two = load(lane, group.normal_two)
    if is_all((lesser(gap_one, gap_two) > stepping.touch_gap) & (greater(normal_one, normal_two) <= 0.0)):
        none = 0.0 * gap_one - FAR
        store(lane, group.target_one, none)
        store(lane, group.target_two, none)
        return none, none
    vx_a, vy_a, spin_a, _ = fields_0(lane, contacts.before, group.a)
    vx_b, vy_b, spin_b, _ = fields_0(lane, contacts.before, group.b)
    u = slip_of(constraint, vx_a - vx_b, vy_a - vy_b, spin_a, spin_b)
    inverse_mass = a.inverse_mass + b.inverse_mass
    least_one = -branch(gap_one > 0.0, gap_one, 0.0) * stepping.open_bias
    least_two = -branch(gap_two > 0.0, gap_two, 0.0) * stepping.open_bias
    t_one = target(normal_one, inverse_mass, gap_one, least_one, stepping)
    t_two = target(normal_two, inverse_mass, gap_two, least_two, stepping)
    if not is_all((lesser(u.one, u.two) >= -stepping.threshold) | (greater(t_one, t_two) <= -FAR)):
        t_one, t_two = with_rebounds(contacts, group, lane, constraint, a, b, u, t_one, t_two)
    store(lane, group.target_one, t_one)
    store(lane, group.target_two, t_two)
    return t_one, t_two


@kernel
def with_rebounds(
    contacts: Contacts,
    group: Record,
    lane: Lane,
    constraint: Constraints,
    a: Bodies,
    b: Bodies,
    u: Slip,
    t_one: Lanes,
    t_two: Lanes,
) -> tuple[Lanes, Lanes]:
    """Return the targets (m/s) of constraints with those of points that rebound, which approach with u."""
    stepping = contacts.stepping[0]
    restitution = load(lane, group.restitution)
    pull = pulls(constraint, a, b, stepping)
    after_one = rebound(u.one, load(lane, group.start_one), pull, restitution, stepping)
    after_two = rebound(u.two, load(lane, group.start_two), pull, restitution, stepping)
    rebounds = restitution > (-1.0 if stepping.is_divided else 0.0)  # then it is an impact without any rebound too
    t_one = select(rebounds & (u.one < -stepping.threshold) & (t_one > -FAR), after_one, t_one)
    t_two = select(rebounds & (u.two < -stepping.threshold) & (t_two > -FAR), after_two, t_two)
    if stepping.is_guarded and not is_all(greater(t_one, t_two) <= 0.0):
        stepping.has_rebounds = 1
    return t_one, t_two
