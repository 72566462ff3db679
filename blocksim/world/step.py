"""The time step that a run takes: as the scenario asks, within what its stiffest contact state admits."""

import math
from itertools import combinations_with_replacement

import numpy as np

from blocksim.errors import InvalidInputError
from blocksim.kernels.arrays import ALL, Records
from blocksim.scenario import Scenario
from blocksim.scenario.models.stepping import Explicit
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


def admissible_step(bodies: Records, table: Records, safety: float, law: str, load: Load) -> float:
    """Return the largest safe step (s) of these bodies with these contact parameters."""
    is_block = bodies["faces"][:-1] == ALL
    kinds = _kinds(bodies[:-1][is_block])
    grounds = sorted({0, *np.unique(bodies["contact_class"][:-1][~is_block]).tolist()})

    def stiffness(i: int, j: int, inverse_mass: float) -> ContactStiffness:
        row = table[i, j]
        ratio = max(row.normal_damping, row.shear_damping)
        normal = steepest(law, float(row.normal_stiffness), inverse_mass, load)
        return ContactStiffness(normal, normal * float(row.shear_ratio), float(ratio))

    grounded = [(body, None, stiffness(c, ground, body.inverse_mass)) for body, c in kinds for ground in grounds]
    paired = [
        (a, b, stiffness(ca, cb, a.inverse_mass + b.inverse_mass))
        for (a, ca), (b, cb) in combinations_with_replacement(kinds, 2)
    ]
    return stable_step([*grounded, *paired], safety)


def _kinds(blocks: Records) -> list[tuple[ContactBody, int]]:
    """Return every kind of block once: its sides and inverse masses, and its contact class."""
    columns = (2.0 * blocks["half_x"], 2.0 * blocks["half_y"], blocks["inverse_mass"], blocks["inverse_inertia"])
    rows = np.unique(np.column_stack([*columns, blocks["contact_class"]]), axis=0)
    return [(ContactBody(*row[:-1]), int(row[-1])) for row in rows.tolist()]


def expected_load(scenario: Scenario, bodies: Records) -> Load:
    """Return the speed that the fastest point may reach by falling, or by sliding all the time, and the weight."""
    along = scenario.gravity * abs(math.sin(scenario.ground.tilt))
    speed = fastest_start(bodies) + fastest_fall(scenario, bodies) + along * scenario.time.end
    blocks = _blocks(bodies)
    return Load(speed, scenario.gravity * float(np.sum(blocks.mass[blocks.inverse_mass > 0.0])))


def fastest_start(bodies: Records) -> float:
    """Return an upper bound (m/s) of the speed of any point of a block at the start."""
    blocks = _blocks(bodies)
    return float(np.max(np.hypot(blocks.vx, blocks.vy) + blocks.radius * np.abs(blocks.spin)))


def fastest_fall(scenario: Scenario, bodies: Records) -> float:
    """Return the speed (m/s) at which the highest corner would reach the lowest ground, from rest."""
    blocks = _blocks(bodies)
    lowest = min((y for _, y in scenario.ground.profile or ()), default=0.0)
    height = max(0.0, float(np.max(blocks.y + blocks.radius)) - lowest)
    return math.sqrt(2.0 * scenario.gravity * math.cos(scenario.ground.tilt) * height)


def _blocks(bodies: Records) -> Records:
    """Return all bodies but the ground and its pieces."""
    blocks: Records = bodies[bodies.faces == ALL][:-1].view(np.recarray)
    return blocks


class UncountableStepsError(StepError):
    """Step and end do not go together: more steps than can be counted, or none of any length."""

    def __init__(self, end: float, step: float) -> None:
        """Say both."""
        super().__init__(f"{end:.4g} s cannot be divided into steps of {step:.4g} s")


def choose_step(scenario: Scenario, bodies: Records, table: Records) -> float:
    """Return the step (s) the run will take; raises StepTooLargeError."""
    if not isinstance(scenario.time, Explicit):
        message = f"scenario {scenario.name} is not one of the explicit scheme"
        raise ValueError(message)  # noqa: TRY004 - the scenario is of the right type
    with np.errstate(all="ignore"):  # absurd sizes and stiffnesses end in a step of zero, which is refused below
        load = expected_load(scenario, bodies)
        limit = admissible_step(bodies, table, scenario.time.safety, scenario.contact.law, load)
    limit = min(limit, scenario.time.end)
    asked = scenario.time.step
    step = limit if asked == "auto" else asked
    if not 0.0 < step < math.inf or scenario.time.end / step > MOST_STEPS:
        raise UncountableStepsError(scenario.time.end, step)
    if step > limit and not scenario.time.force_step:
        raise StepTooLargeError(step, limit)
    return step
