"""The stepping schemes; a new one is one file and one line in `blocksim.scenario.models.stepping.SCHEMES`."""

from collections.abc import Iterator, Mapping, Sequence
from importlib import import_module

import numpy as np
from numpy.typing import NDArray

from blocksim.errors import BlocksimError
from blocksim.kernels.common.systems import Coupled, measure_systems, plan_of
from blocksim.scenario import Scenario
from blocksim.scenario.models.stepping import SCHEMES as TABLES
from blocksim.scenario.motion import settles
from blocksim.simulation.schemes.scheme import COUNTED, AnyScene, Scene, Scheme
from blocksim.world import build as scenes
from blocksim.world.build import Built, Refusal, Stack, build_one, couple, group_equal, stack_of_one
from blocksim.world.systems import others_of


class _Schemes(Mapping[str, Scheme]):
    """Scheme as written in a scenario, and what it does: as the models of `time` declare it."""

    def __getitem__(self, name: str) -> Scheme:
        module, _, declared = TABLES[name].declared_in.partition(":")
        scheme: Scheme = getattr(import_module(module), declared)
        return scheme

    def __iter__(self) -> Iterator[str]:
        return iter(TABLES)

    def __len__(self) -> int:
        return len(TABLES)


SCHEMES: Mapping[str, Scheme] = _Schemes()


def scheme_named(scenario: Scenario) -> Scheme:
    """Return the scheme that a scenario names."""
    return SCHEMES[scenario.time.scheme]


def scheme_of(scene: AnyScene | Coupled) -> Scheme:
    """Return the scheme that a scene is of."""
    schemes = (one for scheme in SCHEMES.values() for one in (scheme, scheme.with_systems) if one is not None)
    return next(scheme for scheme in schemes if isinstance(scene, scheme.scene_type))


def build_scene(scenario: Scenario) -> AnyScene:
    """Return the scene of a scenario at time zero. Raises what the scheme raises for a scenario that it cannot run."""
    scene: AnyScene = build(scenario).scene
    return scene


def build(scenario: Scenario) -> Built:
    """Return the same scene with the blocks as they were placed."""
    built = build_one(scenario, scheme_named(scenario).construction)
    others = others_of(scenario)
    return built._replace(scene=couple(scenario, built.scene, others)) if others else built


def build_stacks(scenarios: Sequence[Scenario]) -> Iterator[Stack | Refusal]:
    """Build the scenes of scenarios at time zero, those of one scheme and shape together.

    A scene with systems beside blocks and supports, one of a scheme without a way to advance members together, and one
    that settles before it begins, is a stack of its own.
    """
    for places in group_equal([_together(scenario) for scenario in scenarios]):
        some = [scenarios[i] for i in places]
        if _together(some[0]) is None:
            yield from (_alone(i, scenarios[i]) for i in places)
            continue
        yield from scenes.build_stacks(some, scheme_named(some[0]).construction, places)


def _together(scenario: Scenario) -> str | None:
    """Return what scenes have in common that are built together; None for those that are not, and with events."""
    scheme = scheme_named(scenario)
    is_alone = scenario.systems or scenario.events or scheme.advance_members is None or settles(scenario)
    return None if is_alone else scheme.name


def _alone(number: int, scenario: Scenario) -> Stack | Refusal:
    try:
        built = build(scenario)
    except BlocksimError as error:
        return Refusal(number, error)
    return Stack([number], [built.placed], stack_of_one(built.scene))


def ledger_names(scene: AnyScene | Coupled) -> tuple[str, ...]:
    """Return the names of the energies (J) of a scene: those of its scheme, then of its further systems."""
    names = scheme_of(scene).ledger
    if not isinstance(scene, Coupled):
        return names
    return (*names, *(name for energies in plan_of(scene.systems).energies for name in energies))


def measure_row(scene: AnyScene | Coupled) -> NDArray[np.float64]:
    """Return energies (J) as `ledger_names` has them, number of contacts and largest overlap (m)."""
    scheme = scheme_of(scene)
    row = np.zeros(len(scheme.measured))
    scheme.measure(scene, row)
    if not isinstance(scene, Coupled):
        return row
    further = np.concatenate([energies for energies, _ in _measured_systems(scene)])
    return np.concatenate([row[: -len(COUNTED)], further, row[-len(COUNTED) :]])


def mass_of_systems(scene: AnyScene | Coupled) -> float:
    """Return the mass (kg) of all systems beside the blocks."""
    return sum((mass for _, mass in _measured_systems(scene)), 0.0) if isinstance(scene, Coupled) else 0.0


def _measured_systems(scene: Coupled) -> list[tuple[NDArray[np.float64], float]]:
    """Return energies (J) and mass (kg) of each system."""
    counts = [len(names) + 1 for names in plan_of(scene.systems).energies]
    row = np.zeros(sum(counts))
    measure_systems(scene, row)
    return [(part[:-1], float(part[-1])) for part in np.split(row, np.cumsum(counts)[:-1])]


__all__ = [
    "SCHEMES",
    "AnyScene",
    "Scene",
    "Scheme",
    "build",
    "build_scene",
    "build_stacks",
    "ledger_names",
    "mass_of_systems",
    "measured_row",
    "scheme_named",
    "scheme_of",
]
