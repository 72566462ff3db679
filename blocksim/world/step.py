"""The time step that a run takes: as the scenario asks, within what its stiffest contact state admits."""

import math
from itertools import combinations_with_replacement

import numpy as np

from blocksim.errors import InvalidInputError
from blocksim.scenario import Scenario
from blocksim.scenario.models.stepping import Explicit
from blocksim.world.bounds import Bounds, Kind
from blocksim.world.interactions import Interactions
from blocksim.world.stable_step import ContactBody, ContactStiffness, Load, stable_step, steepest

MOST_STEPS = 2**53  # beyond that a step number is no exact float


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


def fastest_fall(scenario: Scenario, bounds: Bounds) -> float:
    """Return the speed (m/s) at which the highest corner would reach the lowest ground, from rest."""
    lowest = min((y for _, y in scenario.ground.profile or ()), default=0.0)
    height = max(0.0, bounds.top - lowest)
    return math.sqrt(2.0 * scenario.gravity * math.cos(scenario.ground.tilt) * height)


class UncountableStepsError(StepError):
    """Step and end do not go together: more steps than can be counted, or none of any length."""

    def __init__(self, end: float, step: float) -> None:
        """Say both."""
        super().__init__(f"{end:.4g} s cannot be divided into steps of {step:.4g} s")


def choose_step(scenario: Scenario, bounds: Bounds, table: Interactions) -> float:
    """Return the step (s) the run will take; raises StepTooLargeError."""
    if not isinstance(scenario.time, Explicit):
        message = f"scenario {scenario.name} is not one of the explicit scheme"
        raise ValueError(message)  # noqa: TRY004 - the scenario is of the right type
    with np.errstate(all="ignore"):  # absurd sizes and stiffnesses end in a step of zero, which is refused below
        try:
            load = expected_load(scenario, bounds)
            limit = admissible_step(bounds, table, scenario.time.safety, scenario.contact.law, load)
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
