"""The time step that a run takes: as the scenario asks, within what its stiffest contact state and its speeds admit.

Contacts are found by the corners that lie in another block at the end of a step. So in one step no block may come far
into another, let alone through it: at the greatest speed expected it moves by at most a twentieth of the smallest side,
and by a fifth of the skin of the list of neighbours, which is thinner with particles. Blocks whose impacts stay below
the usual limit of overlap, a twentieth of that side as well, move by a tenth of that in a step, as an impact takes some
thirty of them; what this bound shortens are the steps of scenes whose blocks are too fast for their springs. They end
with exit code 76 where such blocks meet, instead of in progress behind one another.
"""

import math
from itertools import combinations_with_replacement

import numpy as np

from blocksim.errors import InvalidInputError
from blocksim.scenario import Scenario
from blocksim.scenario.models.stepping import Explicit
from blocksim.world.bounds import Bounds, Kind
from blocksim.world.interactions import Interactions
from blocksim.world.speeds import fastest_fall, greatest_speed, support_speed
from blocksim.world.stable_step import ContactBody, ContactStiffness, Load, stable_step, steepest

MOST_STEPS = 2**53  # beyond that a step number is no exact float
TRAVEL_SHARE, TRAVEL_SHARE_OF_PARTICLES = 0.05, 0.01  # of the smallest side, that a block may move in a step


class StepError(InvalidInputError):
    """The time step of a scenario cannot be taken."""


class StepTooLargeError(StepError):
    """A step given by hand exceeds the admissible one and is not forced; `limit` in s."""

    def __init__(self, step: float, limit: float) -> None:
        """Say both."""
        self.limit = limit
        super().__init__(
            f"{step:.4g} s is above the largest safe step {limit:.4g} s; "
            'use step = "auto", or force_step = true to take it all the same'
        )


def admissible_step(bounds: Bounds, table: Interactions, safety: float, law: str, load: Load) -> float:
    """Return the largest safe step (s) of blocks within these bounds with these contact parameters."""
    kinds = [(_contact_body(kind), kind.contact_class) for kind in bounds.kinds]

    def stiffness(i: int, j: int, inverse_mass: float) -> ContactStiffness:
        row = table[i][j]
        normal = steepest(law, row.normal_stiffness, inverse_mass, load)
        return ContactStiffness(normal, normal * row.shear_ratio, max(row.normal_damping, row.shear_damping))

    grounded = [
        (body, None, stiffness(c, ground, body.inverse_mass)) for body, c in kinds for ground in {0, *bounds.grounds}
    ]
    paired = [
        (a, b, stiffness(ca, cb, a.inverse_mass + b.inverse_mass))
        for (a, ca), (b, cb) in combinations_with_replacement(kinds, 2)
    ]
    return stable_step([*grounded, *paired], safety)


def _contact_body(kind: Kind) -> ContactBody:
    return ContactBody(2.0 * kind.half_x, 2.0 * kind.half_y, kind.inverse_mass, kind.inverse_inertia)


def expected_load(scenario: Scenario, bounds: Bounds) -> Load:
    """Return the speed that the fastest point may reach by falling, or by sliding all the time, and the weight."""
    along = scenario.gravity * abs(math.sin(scenario.ground.tilt))
    speed = bounds.speed + fastest_fall(scenario, bounds) + along * scenario.time.end
    return Load(speed, scenario.gravity * bounds.mass)


class UncountableStepsError(StepError):
    """Step and end do not go together: more steps than can be counted, or none of any length."""

    def __init__(self, end: float, step: float) -> None:
        """Say both."""
        super().__init__(f"{end:.4g} s cannot be divided into steps of {step:.4g} s")


def step_of_travel(scenario: Scenario, bounds: Bounds, table: Interactions) -> float:
    """Return the longest step (s) in which no block moves far; infinite where nothing moves."""
    speed = greatest_speed(scenario, bounds, table) + support_speed(scenario)
    share = TRAVEL_SHARE if scenario.contact.model == "surface" else TRAVEL_SHARE_OF_PARTICLES
    return share * bounds.smallest / speed if speed > 0.0 else math.inf


def choose_step(scenario: Scenario, bounds: Bounds, table: Interactions) -> float:
    """Return the step (s) the run will take; raises StepTooLargeError."""
    if not isinstance(scenario.time, Explicit):
        message = f"scenario {scenario.name} is not one of the explicit scheme"
        raise ValueError(message)  # noqa: TRY004 - the scenario is of the right type
    with np.errstate(all="ignore"):  # absurd sizes and stiffnesses end in a step of zero, which is refused below
        try:
            load = expected_load(scenario, bounds)
            limit = admissible_step(bounds, table, scenario.time.safety, scenario.contact.law, load)
            limit = min(limit, step_of_travel(scenario, bounds, table))
        except ArithmeticError:  # Python's own powers do not end in infinity
            limit = 0.0
    limit = min(limit, scenario.time.end)
    asked = scenario.time.step
    step = limit if asked == "auto" else asked
    if not 0.0 < step < math.inf or scenario.time.end / step > MOST_STEPS:
        raise UncountableStepsError(scenario.time.end, step)
    if step > limit and not scenario.time.force_step:
        raise StepTooLargeError(step, limit)
    return step
