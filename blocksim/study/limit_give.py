"""How far springs shift a limit: as far as blocks have turned, or at most as far as they can give way.

What topples on springs has turned before, as its toe sinks in, and needs so much less tilt: the critical tilt of a
block is atan(b/h) less the angle F/(k b) that it has turned by when all its weight F is on one corner of stiffness k.
In a wall the part that topples turns as a whole, as the load leaves the heel. So the largest turn on the standing side
of a bracket is the shift: on the dry wall of Ferris & Tin-Loi 1.74 and 0.22 degrees at the stiffness scales 0.001 and
0.01, where its limits are 1.9 and 0.20 degrees below those of stiff contacts. The shift goes as 1/stiffness, so that
two of them extrapolate (limit_stiff.py).

A structure that has moved, or rocked back, has turned otherwise too. Of that only a bound is known, if everything rests
on one corner of the softest contact; and none where supports move: what impacts of a rocking block leave depends on the
springs too, and a pulse that begins at its peak while springs carry none of it makes it slip too far, with the root of
1/stiffness (simulation/onset.py). With springs of the materials' own stiffness both are small.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

from blocksim.scenario import Scenario, place_bodies
from blocksim.scenario.models.pulse import Pulse
from blocksim.scenario.motion import settles
from blocksim.simulation.movement import Manner
from blocksim.study.criterion import Verdict
from blocksim.study.limit_result import LimitResult
from blocksim.study.limit_search import Change
from blocksim.world.interactions import contact_classes, interactions_of

GIVE = 5e-3  # share of a limit that is warned of
TILT = "ground.tilt"
ROTATION = ".rotation_deg"


class Give(NamedTuple):
    """How far contacts have given way where a structure still stands."""

    value: float  # of the key, in its unit
    turn: float  # deg, the largest of all blocks
    share: float  # of the limit, by which it is off


def gives_of(found: LimitResult) -> Iterator[Give]:
    """Yield how far contacts have given way at each limit of a search with springs, as the scenario has them."""
    yield from (give for change in found.limits_as_given if (give := give_at(found, change)) is not None)


def give_at(found: LimitResult, change: Change[Verdict]) -> Give | None:
    """Return how far springs have given way at a limit; None where it is not known from what stands there."""
    if not found.plan.document.build().time.has_springs:
        return None
    value = standing_side(change)
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


def standing_side(change: Change[Verdict]) -> float:
    """Return the end of a bracket at which nothing has fallen."""
    return change.high if change.below is Verdict.FALLS else change.low


def most_shift(found: LimitResult, change: Change[Verdict]) -> float:
    """Return a bound of the share of a limit that springs take away, by their load and how slender blocks are."""
    scenario = found.plan.scenario_at(standing_side(change))
    slender = slenderness(scenario)
    is_late = isinstance(scenario.motion, Pulse) and scenario.motion.is_abrupt and not settles(scenario)
    known = give_at(found, change)
    if known is not None and not is_late:
        return max(known.share, 2.0 * math.radians(known.turn) / slender)
    if is_late or (scenario.motion is not None and scenario.contact.stiffness_scale < 1.0):
        return math.inf
    sink = most_sink(scenario)
    width = min(min(body.size_x, body.size_y) for body in place_bodies(scenario))
    moved = found.plan.criterion.least_moved
    return max(2.0 * sink / (width * slender), sink / moved if moved else 0.0)


def slenderness(scenario: Scenario) -> float:
    """Return sin(2 a) of the most slender block or of all of them together, tan a = width/height; 1 for squat ones."""
    placed = [body for body in place_bodies(scenario) if not body.fixed]
    sizes = [(body.size_x, body.size_y) for body in placed]
    xs = [body.x + side * body.size_x for body in placed for side in (-0.5, 0.5)]
    ys = [body.y + side * body.size_y for body in placed for side in (-0.5, 0.5)]
    sizes.append((max(xs) - min(xs), max(ys) - min(ys)))
    return min(math.sin(2.0 * math.atan2(min(width, height), height)) for width, height in sizes)


def most_sink(scenario: Scenario) -> float:
    """Return how far (m) the softest contact gives way under the weight of all free blocks, in shear if softer."""
    placed = place_bodies(scenario)
    weight = scenario.gravity * sum(body.mass for body in placed if not body.fixed)
    table = interactions_of(scenario, contact_classes(scenario, tuple(placed)))
    stiffness = min(
        one.normal_stiffness * min(1.0, one.shear_ratio) for row in table for one in row if one.normal_stiffness > 0.0
    )
    power = 2.0 / 3.0 if scenario.contact.law == "hertz-mindlin" else 1.0
    return float((weight / stiffness) ** power)
