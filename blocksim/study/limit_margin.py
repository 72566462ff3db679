"""By how much a limit is off: what springs take away, and what rest speed cannot decide.

**Springs.** What topples on springs has turned before, as its toe sinks in, and needs so much less tilt: the critical
tilt of a block is atan(b/h) less the angle F/(k b) that it has turned by when all its weight F is on one corner of
stiffness k. In a wall the part that topples turns as a whole, as the load leaves the heel. So the largest turn on the
standing side of a bracket is the shift. A structure that has moved, or rocked back, has turned otherwise too. Of that
only a bound is known, if everything rests on one corner of the softest contact; and none where supports move: what
impacts of a rocking block leave depends on the springs too, and a pulse that begins at its peak while springs carry
none of it makes it slip too far, with the root of 1/stiffness (simulation/run.py).

**Stiff contacts.** All that is linear in 1/k where it is small, and so is what it takes away from a limit:
L(k) = L - a/k. Of two stiffnesses, one r times the other, L = (r L(r k) - L(k))/(r - 1). With the law of Hertz a
contact gives way as k^(-2/3), so that r is 10^(2/3) for a ratio of 10. What is left out is of second order: for
L(k) = L (1 - s - c s^2) it is c s^2/r of L, and c is about one for a block that topples about its toe. That much is
added to both sides of the bracket. Where gravity comes at once, a scene falls on its springs by F/k, and with the
velocity that it has then, which goes as 1/k^(1/2), it rocks. Without a start at rest the answer is therefore a bracket
that holds the extrapolations of both powers.

**Rest.** What falls under a load a little above its limit begins with a small acceleration a. A run takes it for rest
where it is slower than `time.rest_speed` for `time.rest_hold`, so for a < rest_speed/rest_hold; and to its end T it
comes no farther than a T^2/2, so that it stands where that is less than what the criterion names, and less than a tenth
of the time more would take it beyond. Over gravity, that acceleration is the part of a horizontal load, of the tangent
of a tilt or of a coefficient of friction that is not decided (a block that slides), and about that part of a ratio of
lengths (one that topples). Limits are reported too far on the falling side by it. What has settled before time zero
rests within 1e-8 of gravity, and where supports move a limit is none of rest.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from pydantic import BaseModel

from blocksim.errors import InvalidInputError
from blocksim.scenario import Scenario, place_bodies, placement
from blocksim.scenario.models import motion, timeline
from blocksim.scenario.motion import settles
from blocksim.simulation.observables import FURTHER, MOVED_SHARE, Response
from blocksim.study.criterion import Verdict
from blocksim.study.limit_plan import NAMES, Change, LimitPlan, Number
from blocksim.study.rows import Row
from blocksim.world.interactions import contact_classes, interactions_of

RATIO = 10.0  # of stiffness between a search and the next one
BEYOND = 10.0 / 9.0  # of the way to stiff contacts over that to springs ten times as stiff
FAR = 0.08  # of a limit: two of them that are no farther apart are extrapolated
HERTZ_POWER = 2.0 / 3.0
AIM = 0.07  # of the way to the next limit, by which that may be elsewhere
GIVE = 5e-3  # share of a limit that is warned of
TILT = "ground.tilt"
ROTATION = ".rotation_deg"
COEFFICIENTS = ("friction.", ".friction")
HORIZONTAL = "loads."
STIFFNESS = "contact.stiffness_scale"
OF_STIFFNESS = ("stiffness", "young_modulus", "poisson_ratio", "contact_radius", "time.")
NO_SPRINGS = f"rigid contacts have no stiffness: --stiffer is for springs (time.scheme {timeline.SPRINGS})"


class Level(BaseModel, frozen=True):
    """The bracket of a limit at one stiffness scale."""

    stiffness_scale: float
    low: float
    high: float

    @property
    def middle(self) -> float:
        """The middle of the bracket."""
        return 0.5 * (self.low + self.high)


class Margin(BaseModel, frozen=True):
    """Shares of a limit by which it may lie beyond its bracket."""

    rest: float  # on the standing side
    springs: float  # on the falling side


class Give(NamedTuple):
    """How far contacts have given way where a structure still stands."""

    value: float  # of the key, in its unit
    turn: float  # deg, the largest of all blocks
    share: float  # of the limit, by which it is off


@dataclass(frozen=True)
class Levels:
    """One limit at the stiffness given, then at RATIO times the one before; why there are no more, if some lack."""

    levels: tuple[Level, ...]
    ratio: float  # by which springs of the next stiffness give way less
    is_at_rest: bool = True  # at the start
    problem: str = ""

    @property
    def is_far(self) -> bool:
        """True where the last two are too far apart to be extrapolated, or there is only one."""
        if len(self.levels) == 1:
            return True
        before, last = (level.middle for level in self.levels[-2:])
        return abs(last - before) > FAR * abs(last)

    @property
    def stiff(self) -> tuple[float, float] | None:
        """The bracket of stiff contacts, from the last two; None where there is only one."""
        if len(self.levels) == 1:
            return None
        before, last = self.levels[-2:]
        ratios = (self.ratio,) if self.is_at_rest else (self.ratio, math.sqrt(self.ratio))
        low = min(extrapolate_limit(before.high, last.low, ratio) for ratio in ratios)
        high = max(extrapolate_limit(before.low, last.high, ratio) for ratio in ratios)
        middle = extrapolate_limit(before.middle, last.middle, self.ratio)
        unknown = (middle - before.middle) ** 2 / self.ratio / abs(middle) if middle else 0.0
        return low - unknown, high + unknown

    def aim(self, share: float, tolerance: float) -> tuple[float, float]:
        """Return between which values to look for the limit of the next stiffness.

        `share` of the limit is by how much stiff contacts have another one, where only one stiffness is known.
        """
        last = self.levels[-1].middle
        if len(self.levels) > 1:
            share = extrapolate_limit(self.levels[-2].middle, last, self.ratio) / last - 1.0 if last else 0.0
        way = last * share * (1.0 - 1.0 / self.ratio)
        margin = max(AIM * abs(way), tolerance * abs(last))
        return last + way - margin, last + way + margin


def extrapolate_limit(softer: float, stiffer: float, ratio: float) -> float:
    """Return the value of stiff contacts from two that springs are off by, the second `ratio` times less."""
    return (ratio * stiffer - softer) / (ratio - 1.0)


def ratio_of(scenario: Scenario) -> float:
    """Return by how much less springs of RATIO times the stiffness give way."""
    return float(RATIO**HERTZ_POWER) if scenario.contact.law == "hertz-mindlin" else RATIO


def can_be_stiffer(plan: LimitPlan) -> bool:
    """Return True for springs, unless the key is one of stiffness or a system has its own, or whole numbers only."""
    has_springs = plan.scenario.time.has_springs and not plan.scenario.systems
    return has_springs and not plan.span.is_whole and not any(part in plan.key for part in OF_STIFFNESS)


def refuse_without_springs(*plans: LimitPlan) -> None:
    """Raise InvalidInputError where none of the plans can be searched with stiffer springs."""
    if any(can_be_stiffer(plan) for plan in plans):
        return
    if not any(plan.scenario.time.has_springs for plan in plans):
        raise InvalidInputError(NO_SPRINGS)
    message = f"--stiffer: {NAMES[timeline.SPRINGS]} are not made stiffer for a limit of {plans[0].key}, or beside soil"
    raise InvalidInputError(message)


class StandingSide:
    """The end of a bracket at which nothing has fallen."""

    def __init__(self, plan: LimitPlan, change: Change[Verdict], rows: Mapping[Number, Row]) -> None:
        """Take a change of a search and all its rows."""
        self.plan, self.change = plan, change
        self.value = change.high if change.below is Verdict.FALLS else change.low
        self.scenario = plan.scenario_at(self.value)
        self.give = self._give(rows[self.value])

    def _give(self, row: Row) -> Give | None:
        """Return how far springs have given way; None where it is not known from what stands there."""
        if not self.plan.scenario.time.has_springs or row.get("outcome") != Response.STANDS.value:  # it turned too
            return None
        turn = max(abs(float(str(row[name]))) for name in row if name.endswith(ROTATION))
        # of the load k that topples a block by k g along the ground, atan k = a, a turn d takes away 2 d/sin(2 a) k
        slope = (float(self.scenario.ground.tilt) or math.inf) if self.plan.key == TILT else 0.5
        return Give(self.value, turn, math.radians(turn) / slope)

    @property
    def most_shift(self) -> float:
        """A bound of the share of a limit that springs take away, by their load and how slender blocks are."""
        scenario = self.scenario
        slender = slenderness(scenario)
        is_late = isinstance(scenario.motion, motion.Pulse) and scenario.motion.is_abrupt and not settles(scenario)
        if self.give is not None and not is_late:
            return max(self.give.share, 2.0 * math.radians(self.give.turn) / slender)
        if is_late or (scenario.motion is not None and scenario.contact.stiffness_scale < 1.0):
            return math.inf
        sink = largest_static_compression(scenario)
        width = min(min(body.size_x, body.size_y) for body in place_bodies(scenario))
        moved = self.plan.criterion.least_moved
        return max(2.0 * sink / (width * slender), sink / moved if moved else 0.0)

    def margin(self, levels: Levels | None, probed: float, *, as_given: bool) -> Margin:
        """Return the shares of the limit that are not decided.

        `probed` is the share within which stiffer springs were searched; with `as_given` the limit is that of springs.
        """
        plan, scenario = self.plan, self.scenario
        rest = undecided_acceleration(scenario, plan.criterion.least_moved)
        if rest:  # over gravity it is a share of a tilt (rad), of a coefficient; of one for other keys
            is_coefficient = any(part in plan.key for part in COEFFICIENTS) or plan.key.startswith(HORIZONTAL)
            load = 1.0
            if plan.key == TILT:
                load = min(abs(float(scenario.ground.tilt)), 1.0) or 1.0
            elif is_coefficient and not plan.unit:
                load = min(abs(self.value), 1.0) or 1.0
            rest = rest / scenario.gravity / load
        if as_given or not plan.scenario.time.has_springs:
            return Margin(rest=rest, springs=0.0)
        if levels is not None:
            is_known = levels.stiff is not None or levels.problem
            return Margin(rest=rest, springs=0.0 if is_known else BEYOND * probed)
        most = self.most_shift if self.give is None else self.give.share
        return Margin(rest=rest, springs=most if math.isfinite(most) else 0.0)


def slenderness(scenario: Scenario) -> float:
    """Return sin(2 a) of the most slender block or of all of them together, tan a = width/height; 1 for squat ones."""
    placed = [body for body in place_bodies(scenario) if not body.fixed]
    sizes = [(body.size_x, body.size_y) for body in placed]
    xs = [body.x + side * body.size_x for body in placed for side in (-0.5, 0.5)]
    ys = [body.y + side * body.size_y for body in placed for side in (-0.5, 0.5)]
    sizes.append((max(xs) - min(xs), max(ys) - min(ys)))
    return min(math.sin(2.0 * math.atan2(min(width, height), height)) for width, height in sizes)


def largest_static_compression(scenario: Scenario) -> float:
    """Return how far (m) the softest contact gives way under the weight of all free blocks, in shear if softer."""
    placed = place_bodies(scenario)
    weight = scenario.gravity * sum(body.mass for body in placed if not body.fixed)
    table = interactions_of(scenario, contact_classes(scenario, tuple(placed)))
    stiffness = min(
        one.normal_stiffness * min(1.0, one.shear_ratio) for row in table for one in row if one.normal_stiffness > 0.0
    )
    power = HERTZ_POWER if scenario.contact.law == "hertz-mindlin" else 1.0
    return float((weight / stiffness) ** power)


def undecided_acceleration(scenario: Scenario, least_moved: float | None) -> float:
    """Return the acceleration (m/s2) below which a run cannot be told from rest; `least_moved` (m) is the criterion's.

    Zero where blocks settle before time zero, supports move, or nothing pulls.
    """
    time = scenario.time
    if settles(scenario) or scenario.motion is not None or not scenario.gravity > 0.0:
        return 0.0
    moved = MOVED_SHARE * placement.smallest_width(body for body in place_bodies(scenario) if not body.fixed)
    way = moved if least_moved is None else least_moved
    of_end = min(2.0 * way, moved / FURTHER) / time.end**2
    hold = max(time.rest_hold, 0.0)
    of_rest = time.rest_speed / hold if time.stop_at_rest and hold > 0.0 else 0.0
    return max(of_end, of_rest)
