"""Time step and skin of the explicit scheme: as the scenario asks, or chosen.

The step stays within what the stiffest contact state (stable_step.py) and the speeds of a scene admit.

Contacts are found by the corners that lie in another block at the end of a step. So in one step no block may come far
into another, let alone through it: at the greatest speed expected it moves by at most a twentieth of the smallest side,
and by a fifth of the skin of the list of neighbours, which is thinner with particles. Blocks whose impacts stay below
the usual limit of overlap, a twentieth of that side as well, move by a tenth of that in a step, as an impact takes some
thirty of them; what this bound shortens are the steps of scenes whose blocks are too fast for their springs. They end
with exit code 76 where such blocks meet, instead of passing through one another.

Bodies no farther apart than the skin are listed as neighbours, and only listed ones are examined for contacts. The list
is made again before two that are not in it can meet, so that a skin decides how long the list is and how often it is
made, and never what moves where. Particles need nothing on top: those of the `particles` model lie inside the block's
edge, and those of the `kernel` model touch nothing before they are inside the other block, however far the kernel
reaches.
"""

import math
from collections.abc import Sequence
from itertools import combinations_with_replacement

import numpy as np

from blocksim.errors import InvalidInputError
from blocksim.kernels.explicit.inertia import APPROACH_STEPS
from blocksim.scenario import Scenario
from blocksim.scenario.models.stepping import Explicit
from blocksim.scenario.placement import length_beside
from blocksim.world.applied import greatest_push, steepest_tilt
from blocksim.world.bounds import Bounds, fastest_fall, given_speed, greatest_speed, support_speed
from blocksim.world.interactions import Interactions
from blocksim.world.stable_step import ContactBody, ContactStiffness, Load, frequency_squared, stable_step, steepest
from blocksim.world.systems import largest_step

MOST_STEPS = 2**53  # beyond that a step number is no exact float
TRAVEL_SHARE, TRAVEL_SHARE_OF_PARTICLES = 0.05, 0.01  # of the smallest side, that a block may move in a step
# Shares of the smallest side, measured: in the surface model a body has eight corners to examine, so that a long list
# costs less than making it again; with particles a long list holds hundreds of them a pair.
SKIN_SHARE, SKIN_SHARE_OF_PARTICLES = 0.25, 0.05
LEAST_APPROACH, MOST_APPROACH = 0.1, 0.5  # of the default skin
RESERVE = 2.5  # times the speed expected: blocks that are struck are faster; the automatic step leaves as much
ROUND_UP = 1.0005  # so that four digits of a number are not less than it
MILLI = 1e3


class StepError(InvalidInputError):
    """The time step of a scenario cannot be taken."""


class StepTooLargeError(StepError):
    """A manual step exceeds the admissible one and is not forced; `limit` in s."""

    def __init__(self, step: float, limit: float) -> None:
        """Report both."""
        self.limit = limit
        super().__init__(
            f"{step:.4g} s is above the largest safe step {limit:.4g} s; "
            'use step = "auto", or force_step = true to override'
        )


class UncountableStepsError(StepError):
    """Step and end are incompatible: more steps than can be counted, or steps of length zero."""

    def __init__(self, end: float, step: float) -> None:
        """Report both."""
        super().__init__(f"{end:.4g} s cannot be divided into steps of {step:.4g} s")


class SkinTooSmallError(InvalidInputError):
    """Two blocks at `speed` (m/s) come too near in a `step` (s) for the skin (m) given by hand; `least` in m."""

    def __init__(self, skin: float, least: float, speed: float, step: float) -> None:
        """Say by how much, and the least skin."""
        self.least = least
        super().__init__(
            f"{MILLI * skin:.4g} mm is too small for this time step: two blocks that meet at {speed:.4g} m/s each come "
            f"{MILLI * nearer_in_a_step(speed, step):.4g} mm closer in {step:.4g} s, and the contact could be missed; "
            f"at least {MILLI * ROUND_UP * least:.4g} mm is needed. Leave skin out for the default"
        )


def admissible_step(bounds: Bounds, table: Interactions, safety: float, law: str, load: Load) -> float:
    """Return the largest safe step (s) of blocks within these bounds with these contact parameters."""
    kinds = [
        (
            ContactBody(2.0 * kind.half_x, 2.0 * kind.half_y, kind.inverse_mass, kind.inverse_inertia),
            kind.contact_class,
        )
        for kind in bounds.standing
    ]

    def stiffness(i: int, j: int, inverse_mass: float) -> ContactStiffness:
        row = table[i][j]
        normal = steepest(law, row.normal_stiffness, inverse_mass, load)
        return ContactStiffness(normal, normal * row.shear_ratio, max(row.normal_damping, row.shear_damping))

    grounded = [
        (body, None, stiffness(c, ground, body.inverse_mass)) for body, c in kinds for ground in {0, *bounds.grounds}
    ]
    if law == "linear":  # stiffness goes with the classes only: of hundreds of kinds in a class the stiffest decides
        classes = combinations_with_replacement(dict.fromkeys(c for _, c in kinds), 2)
        springs = [(ca, cb, stiffness(ca, cb, 0.0)) for ca, cb in classes]
        paired = [(_stiffest(kinds, ca, one), _stiffest(kinds, cb, one), one) for ca, cb, one in springs]
    else:
        paired = [
            (a, b, stiffness(ca, cb, a.inverse_mass + b.inverse_mass))
            for (a, ca), (b, cb) in combinations_with_replacement(kinds, 2)
        ]
    return stable_step([*grounded, *paired], safety)


def _stiffest(kinds: Sequence[tuple[ContactBody, int]], of_class: int, springs: ContactStiffness) -> ContactBody:
    """Return the body of a class with the stiffest mode on given springs."""
    bodies = (body for body, one in kinds if one == of_class)
    return max(bodies, key=lambda body: frequency_squared(body, springs.normal, springs.shear))


def expected_load(scenario: Scenario, bounds: Bounds) -> Load:
    """Return the speed that the fastest point may reach by falling, or by sliding all the time, and the weight."""
    push = greatest_push(scenario)
    along = scenario.gravity * math.sin(steepest_tilt(scenario)) + push
    speed = given_speed(scenario, bounds) + fastest_fall(scenario, bounds) + along * scenario.time.end
    return Load(speed, (scenario.gravity + push) * bounds.mass)


def step_of_contacts(scenario: Scenario, bounds: Bounds, table: Interactions, safety: float) -> float:
    """Return the largest safe step (s) of the contacts of a scenario's blocks."""
    return admissible_step(bounds, table, safety, scenario.contact.law, expected_load(scenario, bounds))


def safety_of(scenario: Scenario) -> float:
    """Return the automatic step as a share of the stability limit. Raises ValueError without springs."""
    if not isinstance(scenario.time, Explicit):
        message = f"scenario {scenario.name} does not use the explicit scheme"
        raise ValueError(message)  # noqa: TRY004 - the scenario is of the right type
    return scenario.time.safety


def choose_step(scenario: Scenario, bounds: Bounds, table: Interactions) -> float:
    """Return the step (s) the run will take; raises StepTooLargeError."""
    safety = safety_of(scenario)
    with np.errstate(all="ignore"):  # absurd sizes and stiffnesses end in a step of zero, which is refused below
        try:
            of_contacts = step_of_contacts(scenario, bounds, table, safety)
            speed = greatest_speed(scenario, bounds, table) + support_speed(scenario)
            share = TRAVEL_SHARE if scenario.contact.model == "surface" else TRAVEL_SHARE_OF_PARTICLES
            of_travel = share * bounds.smallest / speed if speed > 0.0 else math.inf
            limit = min(of_contacts, of_travel, largest_step(scenario))
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


def nearer_in_a_step(speed: float, step: float) -> float:
    """Return how much nearer (m) two bodies come in a step (s) that meet at this speed (m/s) each."""
    return 2.0 * speed * step


def choose_skin(scenario: Scenario, bounds: Bounds, table: Interactions, step: float) -> float:
    """Return the skin (m) the run will have, given the step (s).

    Raises SkinTooSmallError. Only for a skin given by hand: in a step by the rules two blocks come nearer by at most
    0.4 of the default. With springs a block that outruns the list ends the run, so that there is a reserve. Rigid
    contacts are found late then, and all blocks look ahead as far as they move in a step: that is enough.
    """
    given = scenario.contact.skin
    if given is None:
        share = SKIN_SHARE_OF_PARTICLES if _has_particles(scenario) else SKIN_SHARE
        return length_beside(bounds.smallest) * share
    speed = greatest_speed(scenario, bounds, table) + support_speed(scenario)
    reserve = RESERVE if scenario.time.has_springs else 1.0
    # a list holds for one step at least, even where it is updated at every one
    least = reserve * nearer_in_a_step(speed, step)
    if given < least:
        raise SkinTooSmallError(given, least, speed, step)
    return given


def choose_approach(scenario: Scenario, bounds: Bounds, table: Interactions, step: float) -> float:
    """Return the gap (m) below which bodies are listed whatever the skin: what they are seen to approach in.

    As far as the fastest comes while approaches are looked for, within shares of the default skin. Models with
    particles look for none.
    """
    if _has_particles(scenario):
        return 0.0
    default = length_beside(bounds.smallest) * SKIN_SHARE
    way = APPROACH_STEPS * step * greatest_speed(scenario, bounds, table)
    return min(max(way, LEAST_APPROACH * default), MOST_APPROACH * default)


def _has_particles(scenario: Scenario) -> bool:
    return scenario.contact.model != "surface" and scenario.time.has_springs
