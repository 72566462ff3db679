"""The time step of the non-smooth scheme: by how far a block moves while its contacts stay as they were found.

Contacts are found once a step, and what a block turns and moves meanwhile is the error of a step, first order in its
length. So the automatic step is the usual one unless the fastest point could move farther than a tenth of the smallest
side in it. That speed is a bound, a fall of the highest corner to the lowest ground, or sliding down to the end of
time; walls do not fall that fast. A step given by hand is therefore refused only where blocks go farther from the
start, or in one substep at that bound.
"""

import math

import numpy as np

from blocksim.kernels.arrays import Records
from blocksim.scenario import Scenario
from blocksim.scenario.models.stepping import Nonsmooth
from blocksim.world.step import MOST_STEPS, StepError, UncountableStepsError, fastest_fall, fastest_start

USUAL_STEP = 1e-3  # s
SHARE = 0.1  # of the smallest side
MILLI = 1e3


class StepTooLongError(StepError):
    """A block moves too far in a step given by hand that is not forced; `limit` in s."""

    def __init__(self, step: float, limit: float, smallest: float) -> None:
        """Say what is too far."""
        self.limit = limit
        super().__init__(
            f"{step:.4g} s is too long: blocks could move farther than a tenth of the smallest side "
            f"({MILLI * smallest:.4g} mm) before contacts are looked at again; at most {limit:.4g} s with these "
            'substeps. Use step = "auto", or force_step = true to take it all the same'
        )


def choose_rigid_step(scenario: Scenario, bodies: Records, table: Records, smallest: float) -> float:
    """Return the step (s) the run will take, given interactions and the smallest side (m); raises StepError."""
    asked, end = scenario.time.step, scenario.time.end
    step = min(automatic_step(scenario, bodies, table, smallest), end) if asked == "auto" else asked
    limit = longest_step(scenario, bodies, table, smallest)
    if not step > 0.0 or end / step > MOST_STEPS:
        raise UncountableStepsError(end, step)
    if step > limit and not scenario.time.force_step:
        raise StepTooLongError(step, limit, smallest)
    return step


def automatic_step(scenario: Scenario, bodies: Records, table: Records, smallest: float) -> float:
    """Return the step (s) without one given by hand."""
    speed = greatest_speed(scenario, bodies, table)
    return min(USUAL_STEP, SHARE * smallest / speed) if speed > 0.0 else USUAL_STEP


def greatest_speed(scenario: Scenario, bodies: Records, table: Records) -> float:
    """Return the bound (m/s) of the speed of any point of a block."""
    tilt = abs(scenario.ground.tilt)
    pull = scenario.gravity * max(0.0, math.sin(tilt) - least_support_friction(bodies, table) * math.cos(tilt))
    return math.hypot(fastest_start(bodies), fastest_fall(scenario, bodies)) + pull * scenario.time.end


def least_support_friction(bodies: Records, table: Records) -> float:
    """Return the least kinetic friction of free blocks with the ground, its pieces and fixed blocks.

    On one another blocks do not slide farther than they are long.
    """
    is_free = bodies.inverse_mass > 0.0
    free, support = (np.unique(bodies.contact_class[chosen]) for chosen in (is_free, ~is_free))
    if free.size == 0:
        return math.inf
    return float(table[np.ix_(support, free)]["kinetic_friction"].min())


def longest_step(scenario: Scenario, bodies: Records, table: Records, smallest: float) -> float:
    """Return the longest step (s) that may be given by hand."""
    substeps = scenario.time.substeps if isinstance(scenario.time, Nonsmooth) else 1
    rate = max(fastest_start(bodies), greatest_speed(scenario, bodies, table) / substeps)
    return SHARE * smallest / rate if rate > 0.0 else scenario.time.end
