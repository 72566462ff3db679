"""The numerical settings that a study of convergence refines one at a time, and the scenario at each level of one.

A level counts refinements of the scenario's own value: 0 is that value, 1 the next finer, -1 the next coarser.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import log10, sqrt

from blocksim.errors import InvalidInputError
from blocksim.scenario import Scenario
from blocksim.world.build import build_world

STEP, STIFFNESS, SPACING = "step", "stiffness", "spacing"
STUDIES = (STEP, STIFFNESS, SPACING)
PARTICLE_MODELS = frozenset({"particles", "kernel"})
SOFTEST = 1e-3  # stiffness scale
DIGITS = 6  # of a level's value, so that the value that is told gives the same run when it is set


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
    possible = [_step(scenario), _stiffness(scenario)]
    if has_particles(scenario):
        possible.append(_spacing(scenario))
    chosen = tuple(one for one in possible if one.study in asked)
    if not chosen:
        raise InvalidInputError(f"nothing to study: {spacing_note(scenario)}")
    return chosen


def has_particles(scenario: Scenario) -> bool:
    """Tell whether the contact model looks at the particles on the boundaries."""
    return scenario.contact.model in PARTICLE_MODELS


def spacing_note(scenario: Scenario) -> str:
    """Say why the spacing is not studied."""
    return f'the particle spacing has no effect on contact.model = "{scenario.contact.model}"'


def _step(scenario: Scenario) -> Refinement:
    """Halve the safety of the automatic step, or the step given by hand; double it where that is safe."""
    by_hand = scenario.time.step != "auto"
    key, own = ("time.step", scenario.time.step) if by_hand else ("time.safety", scenario.time.safety)
    halved = Refinement(STEP, "time step", key, float(own), 0.5, 0)
    coarser = next((n for n in (2, 1) if _is_safe(halved.at(scenario, -n))), 0)
    return replace(halved, coarser=coarser)


def _is_safe(scenario: Scenario) -> bool:
    """Tell whether a scenario's step is admissible."""
    try:
        type(scenario.time).model_validate(scenario.time.model_dump())
        build_world(scenario)
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
