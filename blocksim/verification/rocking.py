"""V11 the time of free rocking and V12 the loss of spin when the block comes down on its other corner."""

from __future__ import annotations

from math import cos, hypot, sin
from typing import TYPE_CHECKING

from blocksim.verification import closed_forms as forms
from blocksim.verification.case import Row, Setting, relative

if TYPE_CHECKING:
    from collections.abc import Iterator

    from blocksim.verification.scene import Simulation

SLENDER, TALL = 0.010, 0.040  # m
NO_SLIP = 5.0  # friction coefficient
LONGEST = 0.2  # s
SETTLED = 1e-3  # s after the impact


def released(setting: Setting, restitution: float) -> Simulation:
    """Let go of a slender block that stands on its right corner, turned by half the angle of balance."""
    tilt = forms.toppling_slope(SLENDER, TALL) / 2
    # the corner stays at x = SLENDER/2, y = 0; turned clockwise
    body = {
        "x": SLENDER / 2 - cos(tilt) * SLENDER / 2 + sin(tilt) * TALL / 2,
        "y": sin(tilt) * SLENDER / 2 + cos(tilt) * TALL / 2,
        "angle": -tilt,
        "width": SLENDER,
        "height": TALL,
    }
    return setting.start([body], restitution=restitution, ground_friction=NO_SLIP)


def quarter_period(setting: Setting) -> Iterator[Row]:
    """Time the way from release to standing upright."""
    time, _ = until_upright(released(setting, 0.2))
    expected = forms.rocking_quarter_time(SLENDER, TALL, forms.toppling_slope(SLENDER, TALL) / 2)
    yield relative("time to upright", "s", expected, time, 0.005)


def until_upright(scene: Simulation) -> tuple[float, float]:
    """Continue until the angle changes its sign; return time (s) and spin (rad/s) there, by interpolation."""
    block, steps = scene.bodies[0], scene.steps
    angle = float(block.angle)
    while block.angle < 0.0 and scene.time < LONGEST:
        angle, steps = float(block.angle), scene.steps
        scene.to_step(steps + 10)
    share = angle / (angle - float(block.angle))
    return (steps + share * (scene.steps - steps)) * scene.step, float(block.spin)


def housner(setting: Setting) -> Iterator[Row]:
    """Compare the spin about the new corner with that before the impact, both reckoned to the upright position.

    The impact takes a while; until it is over the block has turned a little, and the spin at the upright position
    follows from the energy about the corner, w^2 + (3/2) g (cos(alpha) - cos(alpha - |angle|)) / R.
    """
    scene = released(setting, 0.0)
    time, _ = until_upright(scene)
    block = scene.to_time(time + SETTLED).bodies[0]
    half, alpha = hypot(SLENDER, TALL) / 2, forms.toppling_slope(SLENDER, TALL)
    lifted = 1.5 * 9.81 / half * (cos(alpha - abs(block.angle)) - cos(alpha))
    before = (1.5 * 9.81 / half * (cos(alpha - alpha / 2) - cos(alpha))) ** 0.5  # let go at half of alpha
    after = (block.spin**2 + lifted) ** 0.5
    yield relative("spin ratio", "", forms.housner_ratio(SLENDER, TALL), after / before, 0.05)
