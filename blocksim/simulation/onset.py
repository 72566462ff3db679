"""What springs add to the slip of blocks under a pulse that begins at its peak, while contacts carry none of it yet.

A block on springs follows the support only once they have built up the limiting shear force. With the acceleration a of
the support and w = sqrt(k/m) of the block on its shear springs it is then slower than the support by about a/(2 w),
damping included: 0.42 and 0.47 a/w for slabs of 1.0 x 0.1 and 1.0 x 0.25 m, 0.6 and 0.8 for blocks of 0.2 x 0.1 and
0.5 x 0.45 m, which tilt on their normal springs as well. It keeps that velocity until it sticks, so the error of its
slip goes as 1/sqrt(k). A run that begins with the pulse settles into it (settling.py) and has no such error.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from blocksim.kernels.common.arrays import World
from blocksim.scenario import PlacedBody, Scenario
from blocksim.scenario.models.pulse import Pulse
from blocksim.scenario.motion import displacement_and_velocity, motion_pieces
from blocksim.simulation.settled import Settled

GAINED = 0.5  # a/w
PROMISE = 5e-3  # error of a slip
SAMPLES = 20_000  # of twice the duration of a pulse


def onset_warning(scenario: Scenario, placed: Sequence[PlacedBody], world: World, settled: Settled | None) -> str:
    """Return a warning where springs make a slip under an abrupt pulse too large by more than the promise."""
    pulse = scenario.motion
    if not isinstance(pulse, Pulse) or not pulse.is_abrupt or not scenario.time.has_springs:
        return ""
    if (settled is not None and pulse.start == 0.0) or scenario.ground.tilt != 0.0:
        return ""
    worst, name = max(_errors(scenario, pulse, placed, world), default=(0.0, ""))
    if worst <= PROMISE:
        return ""
    return (
        f"the pulse begins at its peak: springs give way before block {name} slips, and its slip is some {worst:.1%} "
        "too large (as 1/sqrt(contact.stiffness_scale)); begin the pulse at time zero, or raise the scale"
    )


def _errors(
    scenario: Scenario, pulse: Pulse, placed: Sequence[PlacedBody], world: World
) -> Iterator[tuple[float, str]]:
    """Yield the relative error of the slip of every block that slips on the ground, and its name."""
    ground = int(world.bodies[-1]["contact_class"])
    for body, one in zip(world.bodies[:-1], placed, strict=True):
        values = world.interactions[int(body["contact_class"]), ground]
        stiffness = 2.0 * float(values["normal_stiffness"] * values["shear_ratio"])
        limit = float(values["kinetic_friction"]) * scenario.gravity
        if stiffness > 0.0 and limit < pulse.amplitude and not one.fixed:
            gained = GAINED * pulse.amplitude * math.sqrt(one.mass / stiffness)
            yield gained / mean_slip_rate(scenario, pulse, limit), one.name


def mean_slip_rate(scenario: Scenario, pulse: Pulse, limit: float) -> float:
    """Return the mean velocity (m/s) of the first slip of a rigid block whose friction gives it `limit` (m/s2)."""
    times = pulse.start + np.linspace(0.0, 2.0 * pulse.resolved_duration, SAMPLES + 1)
    _, velocity = displacement_and_velocity(motion_pieces(scenario), times)
    most = limit * float(times[1] - times[0])
    block = float(velocity[0])
    slip: list[float] = []
    for support in velocity[1:].tolist():
        ahead = support - block
        if abs(ahead) > most:
            block += math.copysign(most, ahead)
            slip.append(abs(support - block))
        elif slip:
            break
        else:  # it sticks
            block = support
    return float(np.mean(slip)) if slip else math.inf
