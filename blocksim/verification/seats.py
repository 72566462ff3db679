"""V25: a block that lands flat on several others leaves with the requested restitution and without spin.

On two loose blocks, without losses, it is a mass m on a spring k on a mass 2 m on a spring 2 k. With k = m = 1 the
modes have the frequencies 1/2^(1/2) and 2^(1/2), one twice the other. The upper spring is free again after a third of
the longer period, when the upper mass leaves with half of its speed and the lower one is at rest.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

from blocksim.verification.case import Row, Setting, absolute, farthest
from blocksim.verification.scene import HEIGHT, WIDTH

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from blocksim.verification.scene import Simulation

FAR = 0.05  # m, where the outermost seats end, beyond the block
OVERHANG = 1e-4  # m, that lies on the second seat, or beyond both ends of one
SEATS = {
    "one seat": (-FAR, FAR),
    "overhanging": (OVERHANG - 0.5 * WIDTH, 0.5 * WIDTH - OVERHANG),
    "joint in the middle": (-FAR, 0.0, FAR),
    "joint 6 mm off": (-FAR, 6e-3, FAR),
    "0.1 mm on the second": (-FAR, 0.5 * WIDTH - OVERHANG, FAR),
    "three seats": (-FAR, -4e-3, 3e-3, FAR),
}  # m: ends of the seats from the centre of the block
LOOSE = (-WIDTH, 0.0, WIDTH)  # m, as wide as the block
ASKED = (0.0, 0.2, 0.5, 0.8, 1.0)
GAP_STEPS = 100.37  # of flight, so that a contact begins within a step
POLL, MOST_STEPS = 10, 4000


def seats(setting: Setting) -> Iterator[Row]:
    """Drop a block on seats of several lengths for five restitutions; the farthest off counts."""
    for name, ends in SEATS.items():
        landings = [(asked, land(setting, ends, asked)) for asked in ASKED]
        rebounds = [vy - asked for asked, (vy, _) in landings]
        yield absolute(f"{name}, e off by", "", 0.0, farthest(0.0, rebounds), 0.01)
        yield absolute(f"{name}, spin", "rad/s", 0.0, farthest(0.0, [spin for _, (_, spin) in landings]), 0.05)
    if setting.law == "linear":
        vy, spin = land(setting, LOOSE, 1.0, fixed=False)
        yield absolute("two loose blocks, elastic, speed", "m/s", 0.5, vy, 0.01)
        yield absolute("two loose blocks, elastic, spin", "rad/s", 0.0, spin, 0.05)


def land(setting: Setting, ends: Sequence[float], restitution: float, *, fixed: bool = True) -> tuple[float, float]:
    """Return the speed (m/s) and spin (rad/s) with which a block leaves that has come down flat at 1 m/s."""
    under = [
        {"x": 0.5 * (left + right), "width": right - left, "y": 0.5 * HEIGHT, "fixed": fixed}
        for left, right in pairwise(ends)
    ]

    def start(height: float) -> Simulation:
        block = {"y": 1.5 * HEIGHT + height, "velocity": [0.0, -1.0]}
        return setting.start([*under, block], restitution=restitution, gravity=0.0)

    scene = start(GAP_STEPS * start(0.5 * HEIGHT).step)
    body = scene.world.bodies[len(under)]
    for steps in range(POLL, MOST_STEPS, POLL):
        scene.to_step(steps)
        if body.pairs_before == 0 and body.vy >= 0.0:
            break
    return float(body.vy), float(body.spin)
