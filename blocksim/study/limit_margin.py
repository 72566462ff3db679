"""By how much a limit is unknown beyond its bracket: what rest speed and stiffness cannot decide.

What falls under a load a little above its limit begins with a small acceleration a. A run takes it for rest where it is
slower than `time.rest_speed` for `time.rest_hold`, so for a < rest_speed/rest_hold; and to its end T it comes no
farther than a T^2/2, so that it stands where that is less than what the criterion names, and less than a tenth of the
time more would take it beyond. Over gravity, that acceleration is the part of a horizontal load, of the tangent of a
tilt or of a coefficient of friction that is not decided (a block that slides), and about that part of a ratio of
lengths (one that topples). Limits are reported too far on the falling side by it. What has settled before time zero
rests within 1e-8 of gravity, and where supports move a limit is none of rest.

Springs that shift a limit by less than what they are made stiffer for leave it on the near side by that share.
"""

import math
from dataclasses import replace

from blocksim.scenario import Scenario, place_bodies
from blocksim.scenario.motion import settles
from blocksim.scenario.placement import smallest_width
from blocksim.simulation.movement import FURTHER, MOVED_SHARE
from blocksim.study.criterion import Verdict
from blocksim.study.limit_give import TILT, give_at, most_shift, standing_side
from blocksim.study.limit_result import LimitResult, Margin
from blocksim.study.limit_search import Change

RATIO = 10.0 / 9.0  # of the way to stiff contacts over that to springs ten times as stiff
COEFFICIENTS = ("friction.", ".friction")
HORIZONTAL = "loads."


def with_margins(found: LimitResult, probed: float, *, as_given: bool) -> LimitResult:
    """Return a result whose brackets are as wide as they have to be.

    `probed` is the share within which stiffer springs were searched; with `as_given` the limits are those of springs.
    """
    margins = {one: margin_at(found, one, probed, as_given=as_given) for one in found.falls_as_given}
    return replace(found, margins=margins)


def margin_at(found: LimitResult, change: Change[Verdict], probed: float, *, as_given: bool) -> Margin:
    """Return the shares of a limit that are not decided."""
    scenario = found.plan.scenario_at(standing_side(change))
    rest = undecided_acceleration(scenario, found.plan.criterion.least_moved) / scenario.gravity / _size(found, change)
    return Margin(rest, 0.0 if as_given else _of_springs(found, change, probed))


def undecided_acceleration(scenario: Scenario, least_moved: float | None) -> float:
    """Return the acceleration (m/s2) below which a run cannot be told from rest; `least_moved` (m) is the criterion's.

    Zero where blocks settle before time zero, supports move, or nothing pulls.
    """
    time = scenario.time
    if settles(scenario) or scenario.motion is not None or not scenario.gravity > 0.0:
        return 0.0
    moved = MOVED_SHARE * smallest_width(body for body in place_bodies(scenario) if not body.fixed)
    way = moved if least_moved is None else least_moved
    of_end = min(2.0 * way, moved / FURTHER) / time.end**2
    hold = max(time.rest_hold, 0.0)
    of_rest = time.rest_speed / hold if time.stop_at_rest and hold > 0.0 else 0.0
    return max(of_end, of_rest)


def _size(found: LimitResult, change: Change[Verdict]) -> float:
    """Return what a load, over gravity, is a share of: a tilt (rad), a coefficient; one for other keys."""
    plan, value = found.plan, standing_side(change)
    if plan.key == TILT:
        size = abs(float(plan.scenario_at(value).ground.tilt))
    elif not plan.unit and (any(part in plan.key for part in COEFFICIENTS) or plan.key.startswith(HORIZONTAL)):
        size = abs(value)
    else:
        return 1.0
    return min(size, 1.0) or 1.0


def _of_springs(found: LimitResult, change: Change[Verdict], probed: float) -> float:
    """Return the share by which stiff contacts may have another limit, where it is not extrapolated to them."""
    if not found.plan.document.build().time.has_springs:
        return 0.0
    levels = found.levels.get(change)
    if levels is not None:
        return 0.0 if levels.stiff is not None or levels.problem else RATIO * probed
    give = give_at(found, change)
    most = most_shift(found, change) if give is None else give.share
    return most if math.isfinite(most) else 0.0
