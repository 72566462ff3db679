"""How far springs shift a limit, and the limit of stiff contacts from those of two stiffnesses.

What topples on springs has turned before, as its toe sinks in, and needs so much less tilt: the critical tilt of a
block is atan(b/h) less the angle F/(k b) that it has turned by when all its weight F is on one corner of stiffness k.
In a wall the part that topples turns as a whole, as the load leaves the heel. So the largest turn on the standing side
of a bracket is the shift: on the dry wall of Ferris & Tin-Loi 1.74 and 0.22 degrees at the stiffness scales 0.001 and
0.01, where its limits are 1.9 and 0.20 degrees below those of stiff contacts. The shift goes as 1/stiffness, so that
two of them extrapolate.
"""

import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from blocksim.simulation.movement import Manner
from blocksim.study.criterion import Verdict
from blocksim.study.limit import LimitResult
from blocksim.study.limit_plan import NAMES, RATIO, SPRINGS, STIFFER
from blocksim.study.limit_search import Change

GIVE = 5e-3  # share of a limit that is warned of
TILT = "ground.tilt"
ROTATION = ".rotation_deg"


class Give(NamedTuple):
    """How far contacts have given way where a structure still stands."""

    value: float  # of the key, in its unit
    turn: float  # deg, the largest of all blocks
    share: float  # of the limit, by which it is off


def gives_of(found: LimitResult) -> Iterator[Give]:
    """Yield how far contacts have given way at each limit of a search with springs."""
    if found.plan.document.build().time.scheme == SPRINGS:
        yield from (give for change in found.limits if (give := _give(found, change)) is not None)


def _give(found: LimitResult, change: Change[Verdict]) -> Give | None:
    value = change.low if change.below is Verdict.STANDS else change.high
    row = found.rows[value]
    if row.get("outcome") != Manner.STANDS.value:  # it has turned otherwise, too
        return None
    turn = max(abs(float(str(row[name]))) for name in row if name.endswith(ROTATION))  # from how blocks were placed
    return Give(value, turn, math.radians(turn) / _slope(found, value))


def _slope(found: LimitResult, value: float) -> float:
    """Return the angle (rad) of which a turn is a share: the tilt, or half a radian where another key is varied.

    Of the load k that topples a block by k g along the ground, atan k = a, a turn d takes away 2 d/sin(2 a) k.
    """
    if found.plan.key != TILT:
        return 0.5
    return float(found.plan.scenario_at(value).ground.tilt) or math.inf


def stiff_limits(found: Mapping[str, LimitResult]) -> list[float]:
    """Return the limits of stiff contacts, from those of springs and of springs RATIO times as stiff.

    `found` has the searches by the names of their variants. Nothing where the two are not there, or part.
    """
    soft = found.get(NAMES[SPRINGS])
    stiff = next((one for name, one in found.items() if name.startswith(STIFFER)), None)
    if soft is None or stiff is None or [one.below for one in soft.limits] != [one.below for one in stiff.limits]:
        return []
    pairs = zip(map(_middle, soft.limits), map(_middle, stiff.limits), strict=True)
    return [(RATIO * stiffer - softer) / (RATIO - 1.0) for softer, stiffer in pairs]


def _middle(change: Change[Verdict]) -> float:
    return 0.5 * (change.low + change.high)
