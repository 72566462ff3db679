"""No impact may create energy: rebounds of a substep that would are solved again, weaker.

Newton's restitution can: with friction on a single contact (T. R. Kane and D. A. Levinson, Dynamics (1985), section
5.8), without it where a contact that separates is pushed by others. A corner of a rectangle is safe up to 0.8, as
A_nt^2 <= 0.36 A_nn A_tt there (r^2 = 3 I/m) and energy grows only for e^2 > 1 - A_nt^2 / (A_nn A_tt). Impacts without
any rebound never create energy: with lambda_n t = 0 and friction against the slip that is left, the change is at most
-1/2 lambda A lambda.
"""

from blocksim.kernels.jit import rare_kernel
from blocksim.kernels.lanes import load, select, store
from blocksim.kernels.nonsmooth.arrays import Contacts

TRIES = 4  # with half of the rebound each; then there is none
ROUND_OFF = 1e-13  # of the kinetic energy


@rare_kernel
def gains(contacts: Contacts, gx: float, gy: float) -> bool:
    """Tell whether the impulses of this substep have created energy; (gx, gy), m/s, was gravity's part in it."""
    ux = contacts.stepping[0].support_vx  # seen from the supports: those that move may well bring energy in
    uy = contacts.stepping[0].support_vy
    gain = 0.0
    total = 0.0
    for i in range(contacts.lines.size - 1):
        line = contacts.lines[i]
        if line.inverse_mass > 0.0:
            before = contacts.before[i]
            vx = before.vx + gx - ux
            vy = before.vy + gy - uy
            now = ((line.vx - ux) ** 2 + (line.vy - uy) ** 2) / line.inverse_mass + line.spin**2 / line.inverse_inertia
            then = (vx**2 + vy**2) / line.inverse_mass + before.spin**2 / line.inverse_inertia
            gain += now - then
            total += then
    return gain > ROUND_OFF * total


@rare_kernel
def weaken(contacts: Contacts, begin: int, end: int, share: float) -> None:
    """Leave a share of the rebound of the rows of some groups."""
    for m in range(begin, end):
        group = contacts.groups[m]
        for target in (group.target_one, group.target_two):
            least = load(None, target)
            store(None, target, select(least > 0.0, share * least, least))
