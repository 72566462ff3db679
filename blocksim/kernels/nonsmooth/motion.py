"""What happens to bodies one by one: kick and warm start, drift, poses."""

from blocksim.kernels.common.arrays import Record, Records
from blocksim.kernels.common.geometry import turn
from blocksim.kernels.common.jit import kernel
from blocksim.kernels.nonsmooth.arrays import Contacts

IN_FLIGHT = 1e-9  # of a kick: bodies whose velocity changes by no more beside it touch nothing


@kernel
def kick(state: Record, before: Record, share: float, hx: float, hy: float) -> None:
    """Begin the first substep of a step: remember the velocity, add a share of that of gravity (m/s)."""
    before.vx = state.vx
    before.vy = state.vy
    before.spin = state.spin
    before.lifted -= state.vx * hx + state.vy * hy
    state.vx += share * hx
    state.vy += share * hy


@kernel
def kick_warm(state: Record, before: Record, last: float, hx: float, hy: float) -> None:
    """Begin another substep: remember the velocity, add that of gravity (m/s) and of the last impulses.

    Manifolds do not change within a step, so that all impulses of the last substep together have changed a velocity by
    what it gained beyond gravity, of which there was a share `last` of a kick.
    """
    vx = state.vx
    vy = state.vy
    spin = state.spin
    before.lifted -= vx * hx + vy * hy
    state.vx += vx - (before.vx - (1.0 - last) * hx)
    state.vy += vy - (before.vy - (1.0 - last) * hy)
    state.spin += spin - before.spin
    before.vx = vx
    before.vy = vy
    before.spin = spin


@kernel
def kick_all(states: Records, before: Records, first: int, last: int, share: float, hx: float, hy: float) -> None:
    """Kick the free bodies from `first` to before `last`."""
    for i in range(first, last):
        if states[i].inverse_mass > 0.0:
            kick(states[i], before[i], share, hx, hy)


@kernel
def kick_all_warm(
    states: Records, before: Records, first: int, last: int, last_share: float, hx: float, hy: float
) -> None:
    """Kick the free bodies from `first` to before `last` and warm-start them."""
    for i in range(first, last):
        if states[i].inverse_mass > 0.0:
            kick_warm(states[i], before[i], last_share, hx, hy)


@kernel
def drift_all(states: Records, first: int, last: int, h: float) -> None:
    """Move the bodies from `first` to before `last` for h (s)."""
    for i in range(first, last):
        state = states[i]
        state.dx += h * state.vx
        state.dy += h * state.vy
        state.turned += h * state.spin


@kernel
def is_in_flight(state: Record, before: Record, kx: float, ky: float) -> bool:
    """Return True if nothing but the last kick (m/s) has changed a velocity in the last substep."""
    off = abs(state.vx - before.vx - kx) + abs(state.vy - before.vy - ky)
    return off <= IN_FLIGHT * (abs(kx) + abs(ky))


@kernel
def place(body: Record, state: Record, before: Record, share: float, h: float, gravity: tuple[float, float]) -> None:
    """End a step: bring the pose of a body up to date, exactly turned, and its velocities too.

    Velocities live half a substep before positions; that of a body in flight is brought up to the positions. That of
    one in touch is left: a support holds against the half kick too. `share` is that of the last kick.
    """
    hx = h * gravity[0]
    hy = h * gravity[1]
    body.vx = state.vx
    body.vy = state.vy
    body.spin = state.spin
    if is_in_flight(state, before, share * hx, share * hy):
        body.vx += 0.5 * hx
        body.vy += 0.5 * hy
    body.x += state.dx
    body.y += state.dy
    body.angle += state.turned
    body.cos, body.sin = turn(body.cos, body.sin, state.turned)
    before.lifted += state.dx * gravity[0] + state.dy * gravity[1]
    state.dx = 0.0
    state.dy = 0.0
    state.turned = 0.0


@kernel
def place_all(
    bodies: Records, contacts: Contacts, first: int, last: int, share: float, gravity: tuple[float, float]
) -> None:
    """End a step of the free bodies from `first` to before `last`."""
    h = contacts.stepping[0].substep
    for i in range(first, last):
        state = contacts.states[i]
        if state.inverse_mass > 0.0:
            place(bodies[i], state, contacts.before[i], share, h, gravity)
