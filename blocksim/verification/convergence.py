"""V20: order of errors in the step, and effect of the particle spacing on the run-out."""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

from blocksim.verification import closed_forms as forms
from blocksim.verification.case import Row, Setting, absolute, at_least
from blocksim.verification.collapse import LONGEST, collapse
from blocksim.verification.resting import CONTACT_RADIUS, resting_overlap
from blocksim.verification.scene import HEIGHT
from blocksim.verification.throws import Throw, Thrower

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from blocksim.kernels.common.arrays import World

ORDER = 1.8
REFINEMENTS = (1, 2, 4)
COARSEST = 0.1  # frequency times step
PERIODS, SAMPLES = 3, 24  # of the oscillation
PHASES = 32  # of a step, at which an impact begins
SAFETIES = (0.1, 0.05, 0.025)
RESTITUTION = 0.5
RUN_OUT_BOUND = 1.0  # mm
SOFT = 0.01  # stiffness scale of the run-out


def convergence(setting: Setting) -> Iterator[Row]:
    """Order in dt of an oscillation and of the restitution; change of the run-out when the spacing is halved."""
    coarse, middle, fine = (oscillation(setting, refinement) for refinement in REFINEMENTS)
    yield at_least("oscillation, order in dt", "", ORDER, np.log2(rms(coarse - middle) / rms(middle - fine)))
    errors = [rms(restitution_errors(setting, safety)) for safety in SAFETIES]
    order = np.log2(errors[0] / errors[-1]) / np.log2(SAFETIES[0] / SAFETIES[-1])
    yield at_least("restitution, order in dt", "", ORDER, order)
    one, half = (collapse(setting, 0.2, spacing, SOFT).to_time(LONGEST).bodies.x for spacing in (1e-3, 5e-4))
    yield absolute("run-out, spacing halved", "mm", 0.0, 1e3 * float(np.abs(one - half).max()), RUN_OUT_BOUND)


def rms(values: NDArray[np.float64]) -> float:
    """Return the root of the mean square."""
    return float(np.sqrt(np.mean(values**2)))


def oscillation(setting: Setting, refinement: int) -> NDArray[np.float64]:
    """Return heights (m) at fixed times of an undamped block that starts half of its overlap too high: no lift-off."""
    overlap = resting_overlap(setting)
    frequency = sqrt((1.5 if setting.hertzian else 1.0) * forms.GRAVITY / overlap)  # slope of d^1.5: 1.5 force/overlap
    step = COARSEST / frequency / refinement

    def press(world: World) -> None:
        world.bodies[0].y -= 0.5 * overlap

    contact = {"contact_radius": CONTACT_RADIUS} if setting.hertzian else {}
    time = {"step": step, "force_step": True}
    scene = setting.start([{"y": HEIGHT / 2}], press, restitution=1.0, contact=contact, time=time)
    every = refinement * round(2.0 * np.pi / COARSEST * PERIODS / SAMPLES)
    return np.array([scene.to_step(every * k).bodies[0].y for k in range(1, SAMPLES + 1)])


def restitution_errors(setting: Setting, safety: float) -> NDArray[np.float64]:
    """Return the errors of the restitution of flat impacts that begin at different phases of a step."""
    thrower = Thrower(setting, RESTITUTION, time={"safety": safety})
    throws = [thrower.throw(Throw(phase=(k + 0.5) / PHASES)).vy for k in range(PHASES)]
    return np.array(throws) - RESTITUTION
