"""The limit of stiff contacts, from those of springs of two stiffnesses.

What stands on springs gives way by F/k under its weight F: seats turn, friction is carried late. All that is linear in
1/k where it is small, and so is what it takes away from a limit: L(k) = L - a/k. Of two stiffnesses, one r times the
other, L = (r L(r k) - L(k))/(r - 1). With the law of Hertz a contact gives way as k^(-2/3), so that r is 10^(2/3) for
a ratio of 10. What is left out is of second order: for L(k) = L (1 - s - c s^2) it is c s^2/r of L, and c is about one
for a block that topples about its toe. That much is added to both sides of the bracket.

Where gravity comes at once, a scene falls on its springs by F/k, and with the velocity that it has then, which goes as
1/k^(1/2), it rocks. Without a start at rest the answer is therefore a bracket that holds the extrapolations of both
powers.
"""

import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from blocksim.errors import InvalidInputError
from blocksim.scenario import Scenario
from blocksim.scenario.models.stepping import SCHEMES, SPRINGS
from blocksim.study.limit_plan import LimitPlan
from blocksim.study.limit_search import Change

RATIO = 10.0  # of stiffness between a search and the next one
FAR = 0.08  # of a limit: two of them that are no farther apart are extrapolated
MOST = 4  # stiffnesses
HERTZ_POWER = 2.0 / 3.0
MARGIN = 0.07  # of the way to the next limit, by which that may be elsewhere
SHARPER = 0.8  # of the tolerance: what is extrapolated from two brackets is wider than the narrower one
STIFFNESS = "contact.stiffness_scale"
STEP = "time.step"
OF_STIFFNESS = ("stiffness", "young_modulus", "poisson_ratio", "contact_radius", "time.")
NO_SPRINGS = f"rigid contacts have no stiffness: --stiffer is for springs (time.scheme {SPRINGS})"


class Level(NamedTuple):
    """The bracket of a limit at one stiffness scale."""

    scale: float
    low: float
    high: float

    @property
    def middle(self) -> float:
        """The middle of the bracket."""
        return 0.5 * (self.low + self.high)


@dataclass(frozen=True)
class Levels:
    """One limit at the stiffness given, then at RATIO times the one before; why there are no more, if some lack."""

    found: tuple[Level, ...]
    ratio: float  # by which springs of the next stiffness give way less
    is_at_rest: bool = True  # at the start
    problem: str = ""

    @property
    def is_far(self) -> bool:
        """True where the last two are too far apart to be extrapolated, or there is only one."""
        if len(self.found) == 1:
            return True
        before, last = (level.middle for level in self.found[-2:])
        return abs(last - before) > FAR * abs(last)

    @property
    def stiff(self) -> tuple[float, float] | None:
        """The bracket of stiff contacts, from the last two; None where there is only one."""
        if len(self.found) == 1:
            return None
        before, last = self.found[-2:]
        ratios = (self.ratio,) if self.is_at_rest else (self.ratio, math.sqrt(self.ratio))
        low = min(extrapolated(before.high, last.low, ratio) for ratio in ratios)
        high = max(extrapolated(before.low, last.high, ratio) for ratio in ratios)
        middle = extrapolated(before.middle, last.middle, self.ratio)
        unknown = (middle - before.middle) ** 2 / self.ratio / abs(middle) if middle else 0.0
        return low - unknown, high + unknown

    def aim(self, share: float, tolerance: float) -> tuple[float, float]:
        """Return between which values to look for the limit of the next stiffness.

        `share` of the limit is by how much stiff contacts have another one, where only one stiffness is known.
        """
        last = self.found[-1].middle
        if len(self.found) > 1:
            share = extrapolated(self.found[-2].middle, last, self.ratio) / last - 1.0 if last else 0.0
        way = last * share * (1.0 - 1.0 / self.ratio)
        margin = max(MARGIN * abs(way), tolerance * abs(last))
        return last + way - margin, last + way + margin


def extrapolated(softer: float, stiffer: float, ratio: float) -> float:
    """Return the value of stiff contacts from two that springs are off by, the second `ratio` times less."""
    return (ratio * stiffer - softer) / (ratio - 1.0)


def can_be_stiffer(plan: LimitPlan) -> bool:
    """Return True for springs, unless the key is one of stiffness or a system has its own, or whole numbers only."""
    scenario = plan.document.build()
    has_springs = scenario.time.has_springs and not scenario.systems
    return has_springs and not plan.span.is_whole and not any(part in plan.key for part in OF_STIFFNESS)


def refuse_without_springs(*plans: LimitPlan) -> None:
    """Raise InvalidInputError where none of the plans can be searched with stiffer springs."""
    if any(can_be_stiffer(plan) for plan in plans):
        return
    if not any(plan.document.build().time.has_springs for plan in plans):
        raise InvalidInputError(NO_SPRINGS)
    key = plans[0].key
    message = f"--stiffer: {SCHEMES[SPRINGS].contacts} are not made stiffer for a limit of {key}, or beside soil"
    raise InvalidInputError(message)


def ratio_of(scenario: Scenario) -> float:
    """Return by how much less springs of RATIO times the stiffness give way."""
    return float(RATIO**HERTZ_POWER) if scenario.contact.law == "hertz-mindlin" else RATIO


def stiffer_plan(plan: LimitPlan, change: Change[Any], scale: float) -> LimitPlan:
    """Return the search for a limit at another stiffness scale; a step given by hand is shorter in proportion."""
    scenario = plan.scenario_at(change.low)
    apart: dict[str, object] = {STIFFNESS: scale}
    if scenario.time.step != "auto":
        apart[STEP] = scenario.time.step * (scenario.contact.stiffness_scale / scale) ** 0.5
    return replace(plan, tolerance=SHARPER * plan.tolerance, apart=apart)
