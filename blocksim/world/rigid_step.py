"""The time step of the non-smooth scheme: by how far a block moves while its contacts stay as they were found.

Contacts are found once a step, and what a block turns and moves meanwhile is the error of a step, first order in its
length. So the automatic step is the usual one unless the fastest point could move farther than a tenth of the smallest
side in it. That speed is a bound, a fall of the highest corner to the lowest ground, or sliding down to the end of
time; walls do not fall that fast. A step given by hand is therefore refused only where blocks go farther from the
start, or in one substep at that bound.
"""

from blocksim.scenario import Scenario
from blocksim.scenario.models.stepping import Nonsmooth
from blocksim.world.bounds import Bounds
from blocksim.world.interactions import Interactions
from blocksim.world.speeds import greatest_speed
from blocksim.world.step import MOST_STEPS, StepError, UncountableStepsError

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


def choose_rigid_step(scenario: Scenario, bounds: Bounds, table: Interactions) -> float:
    """Return the step (s) the run will take; raises StepError."""
    asked, end = scenario.time.step, scenario.time.end
    speed = greatest_speed(scenario, bounds, table)
    step = min(_automatic_step(speed, bounds), end) if asked == "auto" else asked
    limit = _longest_step(scenario, speed, bounds)
    if not step > 0.0 or end / step > MOST_STEPS:
        raise UncountableStepsError(end, step)
    if step > limit and not scenario.time.force_step:
        raise StepTooLongError(step, limit, bounds.smallest)
    return step


def longest_step(scenario: Scenario, bounds: Bounds, table: Interactions) -> float:
    """Return the longest step (s) that may be given by hand."""
    return _longest_step(scenario, greatest_speed(scenario, bounds, table), bounds)


def _automatic_step(speed: float, bounds: Bounds) -> float:
    return min(USUAL_STEP, SHARE * bounds.smallest / speed) if speed > 0.0 else USUAL_STEP


def _longest_step(scenario: Scenario, speed: float, bounds: Bounds) -> float:
    substeps = scenario.time.substeps if isinstance(scenario.time, Nonsmooth) else 1
    rate = max(bounds.speed, speed / substeps)
    return SHARE * bounds.smallest / rate if rate > 0.0 else scenario.time.end
