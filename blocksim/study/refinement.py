"""The numerical settings that a study of convergence refines one at a time, and the scenario at each level of one.

A level counts refinements of the scenario's own value: 0 is that value, 1 the next finer, -1 the next coarser.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import log10, sqrt

from blocksim.errors import InvalidInputError
from blocksim.scenario import Scenario, place_bodies
from blocksim.scenario.models.stepping import Explicit, Nonsmooth
from blocksim.simulation.schemes import build_scene
from blocksim.world.nonsmooth import velocity_tolerance

STEP, STIFFNESS, SPACING, TOLERANCE = "step", "stiffness", "spacing", "tolerance"
STUDIES = (STEP, STIFFNESS, SPACING, TOLERANCE)
PARTICLE_MODELS = frozenset({"particles", "kernel"})
SOFTEST = 1e-3  # stiffness scale
DIGITS = 6  # of a level's value, so that the value that is reported gives the same run when it is set


@dataclass(frozen=True)
class Refinement:
    """One setting: `value * factor` is the next finer level of a value; `coarser` levels go the other way."""

    study: str
    title: str
    key: str
    own: float
    factor: float
    coarser: int

    def value(self, level: int) -> float:
        """Return the value at a level, the scenario's own to the last bit."""
        return self.own if level == 0 else float(f"{self.own * self.factor**level:.{DIGITS}g}")

    def at(self, scenario: Scenario, level: int) -> Scenario:
        """Return the scenario at a level, everything else as it was."""
        return with_setting(scenario, self.key, self.value(level))


def with_setting(scenario: Scenario, key: str, value: float) -> Scenario:
    """Return the scenario with a key `table.name` set."""
    table, name = key.split(".")
    changed = getattr(scenario, table).model_copy(update={name: value})
    return scenario.model_copy(update={table: changed})


def refinements_of(scenario: Scenario, studies: Iterable[str] | None = None) -> tuple[Refinement, ...]:
    """Return the refinements that mean something for a scenario, or those of the named studies among them.

    Raises InvalidInputError for an unknown name, and where nothing is left.
    """
    asked = STUDIES if studies is None else tuple(studies)
    unknown = [name for name in asked if name not in STUDIES]
    if unknown:
        message = f"'{unknown[0]}' is no study of convergence; there are {', '.join(STUDIES)}"
        raise InvalidInputError(message)
    chosen = tuple(one for one in _possible(scenario) if one.study in asked)
    if not chosen:
        raise InvalidInputError(f"nothing to study: {effects_note(scenario)}")
    return chosen


def _possible(scenario: Scenario) -> list[Refinement]:
    if isinstance(scenario.time, Nonsmooth):
        return [_rigid_step(scenario), _tolerance(scenario, scenario.time)]
    spacing = [_spacing(scenario)] if has_particles(scenario) else []
    return [_step(scenario, scenario.time), _stiffness(scenario), *spacing]


def has_particles(scenario: Scenario) -> bool:
    """Return True if the contact model examines the particles on the boundaries."""
    return scenario.contact.model in PARTICLE_MODELS


def effects_note(scenario: Scenario) -> str:
    """Say what is not studied, and why; nothing where all is."""
    if isinstance(scenario.time, Nonsmooth):
        return "contacts are rigid: neither a stiffness nor the particle spacing has an effect"
    if has_particles(scenario):
        return "the explicit scheme solves every step exactly and has no tolerance"
    return f'the particle spacing has no effect on contact.model = "{scenario.contact.model}"'


def _step(scenario: Scenario, time: Explicit) -> Refinement:
    """Halve the safety of the automatic step, or the step given by hand; double it where that is safe."""
    by_hand = time.step != "auto"
    key, own = ("time.step", time.step) if by_hand else ("time.safety", time.safety)
    return _halved(scenario, key, float(own))


def _rigid_step(scenario: Scenario) -> Refinement:
    """Halve the step, as given or as it was chosen; double it where that is safe."""
    return _halved(scenario, "time.step", float(build_scene(scenario).world.controls[0].step))


def _halved(scenario: Scenario, key: str, own: float) -> Refinement:
    halved = Refinement(STEP, "time step", key, own, 0.5, 0)
    coarser = next((n for n in (2, 1) if _is_safe(halved.at(scenario, -n))), 0)
    return replace(halved, coarser=coarser)


def _tolerance(scenario: Scenario, time: Nonsmooth) -> Refinement:
    """Tighten the tolerance of the velocity pass by half a decade, also from ten times the scenario's."""
    own = velocity_tolerance(time, len(place_bodies(scenario)))
    return Refinement(TOLERANCE, "velocity tolerance", "time.velocity_tolerance", own, sqrt(0.1), 2)


def _is_safe(scenario: Scenario) -> bool:
    """Return True if a scenario's step is admissible."""
    try:
        type(scenario.time).model_validate(scenario.time.model_dump())
        build_scene(scenario)
    except (ValueError, InvalidInputError):
        return False
    return True


def _stiffness(scenario: Scenario) -> Refinement:
    """Raise the stiffness by half a decade, also from a thousandth of the materials' own, where runs are cheap."""
    own = scenario.contact.stiffness_scale
    coarser = min(max(round(2.0 * log10(own / SOFTEST)), 2), 6)
    return Refinement(STIFFNESS, "stiffness", "contact.stiffness_scale", own, sqrt(10.0), coarser)


def _spacing(scenario: Scenario) -> Refinement:
    """Halve the spacing of the boundary particles, also from twice the scenario's."""
    return Refinement(
        SPACING, "particle spacing", "contact.particle_spacing", scenario.contact.particle_spacing, 0.5, 1
    )
