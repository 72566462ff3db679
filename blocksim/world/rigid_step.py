"""The time step of the non-smooth scheme: by how far a block moves while its contacts stay as they were found.

Contacts are found once a step, and what a block turns and moves meanwhile is the error of a step, first order in its
length. So the automatic step is the usual one unless the fastest point could move farther than a tenth of the smallest
side in it. That speed is a bound, a fall of the highest corner to the lowest ground, or sliding down to the end of
time; walls do not fall that fast. A manual step is therefore refused only where blocks go farther from the
start, or in one substep at that bound.

Contacts give way at rest as if they were springs, in proportion to the step squared. The step of few blocks is so short
that this leaves their strength as it is: see thrust.py for arches and leaning columns, sag.py for heavy blocks on
light ones.

A block that meets something in a substep h stays there until it ends, and has not yet moved with its new velocity: it
is behind by what the impact adds to velocity and spin times h/2 on average, and gravity changes its speed by g h
meanwhile. Every impact passes that on to the next. Against speeds of free falls over sides L, sqrt(g L), that is h /
sqrt(L/g). A few blocks can afford to have it small: a step is at most a share of sqrt(L/g) that grows with their
number, so that costs are about the same, and that of a crowd is the usual one. The usual step is divided by whole
numbers, so that outputs fall on the ends of steps. So with the way in a step at the speed of an impact. Supports
that move count as bodies that are driven do: they come no farther towards a block in a step than blocks may move, and a
step is a twentieth of their shortest period at most. Where few blocks rebound strongly that is not enough, as hops
multiply errors a hundredfold: their steps are cut at impacts, see blocksim.kernels.nonsmooth.parts.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

from blocksim.scenario import Scenario
from blocksim.scenario.motion_peaks import shortest_cycle, shortest_period
from blocksim.world.bodies import Outline
from blocksim.world.bounds import Bounds, given_speed, greatest_speed, impact_speed, support_speed
from blocksim.world.sag import CRUSHED_SHARE, UNLIKE, WARNING_SHARE, scene_sag, soft_contact
from blocksim.world.step import MOST_STEPS, StepError, UncountableStepsError
from blocksim.world.thrust import COURSED, thrust_shift

USUAL_STEP = 1e-3  # s
SHARE = 0.1  # of the smallest side
FEW = 13  # free blocks: fewer take shorter steps
NATURAL = 0.02  # of sqrt(L/g): the step of so many
CROWD = 100  # free blocks, from which on sagging does not shorten a step
CALM = 0.9  # of the overlap or sag that is warned of
SHIFT = 2e-5  # of the width of a joint, calibrated: limits are too low by some 0.02 %, see thrust.py
PERIOD_SHARE = 0.05  # of the shortest period of a prescribed motion: its velocity changes by a third in a step
MILLI, PERCENT = 1e3, 1e2


class StepTooLongError(StepError):
    """A block moves too far in a manual step that is not forced; `limit` in s."""

    def __init__(self, step: float, limit: float, smallest: float) -> None:
        """Report the limits."""
        self.limit = limit
        super().__init__(
            f"{step:.4g} s is too long: blocks could move farther than a tenth of the smallest side "
            f"({MILLI * smallest:.4g} mm) before contacts are detected again; at most {limit:.4g} s with these "
            'substeps. Use step = "auto", or force_step = true to override'
        )


class CoarseStepError(StepError):
    """A manual step that is not forced is too long for a harmonic motion or a pulse; `limit` in s."""

    def __init__(self, step: float, cycle: float) -> None:
        """Report both."""
        self.limit = PERIOD_SHARE * cycle
        super().__init__(
            f"{step:.4g} s is too long for a motion with a cycle of {cycle:.4g} s: at most a twentieth of it, "
            f'{self.limit:.4g} s. Use step = "auto", or force_step = true to override'
        )


class Reason(NamedTuple):
    """A step (s) that must not be exceeded, and the reason in a few words, with places for numbers.

    The text is made when somebody asks for it: members of ensembles want the step only.
    """

    step: float
    text: str
    numbers: tuple[float, ...] = ()

    @property
    def why(self) -> str:
        """The reason, with its numbers."""
        return self.text.format(*self.numbers)


def choose_rigid_step(outline: Outline, bounds: Bounds) -> float:
    """Return the step (s) the run will take; raises StepError."""
    scenario = outline.scenario
    step, end = reason_of_step(outline, bounds).step, scenario.time.end
    limit = longest_step(outline, bounds)
    if not step > 0.0 or end / step > MOST_STEPS:
        raise UncountableStepsError(end, step)
    if step > limit and not scenario.time.force_step:
        cycle = shortest_cycle(scenario)
        if step > PERIOD_SHARE * cycle:
            raise CoarseStepError(step, cycle)
        raise StepTooLongError(step, limit, bounds.smallest)
    return step


def reason_of_step(outline: Outline, bounds: Bounds) -> Reason:
    """Return the step that a scenario gives or that is chosen for it, admissible or not."""
    scenario = outline.scenario
    if scenario.time.step != "auto":
        return Reason(scenario.time.step, "as given")
    few = min(1.0, bounds.free / FEW) if bounds.free else 1.0
    reasons = [Reason(USUAL_STEP, "the usual step"), Reason(scenario.time.end, "the whole time")]
    speeds = ((few, impact_speed(scenario, bounds)), (1.0, greatest_speed(scenario, bounds, outline.interactions)))
    for share, speed in speeds:
        if speed > 0.0:
            way = SHARE * share * bounds.smallest
            why = "no point moves farther than {:.3g} mm in it, at most at {:.3g} m/s"
            reasons.append(Reason(way / speed, why, (MILLI * way, speed)))
    reasons += _reasons_of_motion(scenario, bounds, few)
    if bounds.free and scenario.gravity > 0.0:
        share = NATURAL * bounds.free / FEW
        why = "{:.2g} √(L/g) for so few blocks, L = {:.4g} mm the smallest side"
        parts = max(1, round(USUAL_STEP / (share * math.sqrt(bounds.smallest / scenario.gravity))))
        reasons.append(Reason(USUAL_STEP / parts, why, (share, MILLI * bounds.smallest)))
        reasons += _reasons_of_sag(outline, bounds)
        reasons += _reasons_of_thrust(outline, bounds)
    return min(reasons, key=lambda reason: reason.step)


def _reasons_of_motion(scenario: Scenario, bounds: Bounds, few: float) -> Iterator[Reason]:
    """Yield the steps that supports in motion admit: by their way towards a block, and by their shortest period."""
    if scenario.motion is not None:
        way = SHARE * few * bounds.smallest
        speed = given_speed(scenario, bounds) + support_speed(scenario)
        if speed > 0.0:
            why = "supports move no farther than {:.3g} mm in it, at most at {:.3g} m/s with the blocks"
            yield Reason(way / speed, why, (MILLI * way, speed))
    period = shortest_period(scenario)
    if period > 0.0:
        yield Reason(PERIOD_SHARE * period, "a twentieth of {:.3g} s, the shortest period of a motion", (period,))


def _reasons_of_sag(outline: Outline, bounds: Bounds) -> Iterator[Reason]:
    """Yield the step in which no contact at rest gives way too far, where light blocks carry heavy ones.

    Most scenes are far from it, which is known from the weight of all; crowds take the usual step anyway.
    """
    scenario = outline.scenario
    masses = [1.0 / kind.inverse_mass for kind in bounds.kinds if kind.inverse_mass > 0.0]
    crushed = CALM * CRUSHED_SHARE * bounds.smallest
    allowed = CALM * WARNING_SHARE * bounds.smallest
    least = crushed if max(masses) >= UNLIKE * min(masses) else allowed
    substeps = _substeps(scenario)
    compliance = max(
        kind.inverse_mass + max(kind.half_x, kind.half_y) ** 2 * kind.inverse_inertia for kind in bounds.kinds
    )
    square = soft_contact(USUAL_STEP / substeps).frequency ** 2
    if bounds.free >= CROWD or not 2.0 * compliance * scenario.gravity * bounds.mass > square * least:
        return
    sag = scene_sag(USUAL_STEP / substeps, outline.placed, scenario.gravity)
    for found, most in ((sag.crushed, crushed), (sag.overlap, allowed)):
        if found > most:
            why = "no contact gives way by more than {:.3g} mm where light blocks carry heavy ones"
            yield Reason(USUAL_STEP / math.ceil(math.sqrt(found / most)), why, (MILLI * most,))


def _reasons_of_thrust(outline: Outline, bounds: Bounds) -> Iterator[Reason]:
    """Yield the step in which contacts of few blocks give way so little that their thrust stays where it is."""
    if bounds.free < CROWD:
        square = soft_contact(USUAL_STEP / _substeps(outline.scenario)).frequency ** 2
        parts = math.ceil(math.sqrt(thrust_shift(outline) / square / SHIFT))
        if parts > 1:
            why = (
                "at rest joints move across their thrust by no more than {:.2g} % of their widths, "
                "in columns and walls {:.2g} %"
            )
            yield Reason(USUAL_STEP / parts, why, (PERCENT * SHIFT, PERCENT * SHIFT / COURSED))


def _substeps(scenario: Scenario) -> int:
    return scenario.time.parts


def longest_step(outline: Outline, bounds: Bounds) -> float:
    """Return the longest manual step (s)."""
    scenario = outline.scenario
    speed = greatest_speed(scenario, bounds, outline.interactions)
    rate = max(given_speed(scenario, bounds) + support_speed(scenario), speed / _substeps(scenario))
    longest = SHARE * bounds.smallest / rate if rate > 0.0 else scenario.time.end
    return min(longest, PERIOD_SHARE * shortest_cycle(scenario))
