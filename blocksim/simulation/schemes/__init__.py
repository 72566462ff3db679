"""The stepping schemes; a new one is one file beside this one and one entry in `SCHEMES`."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario import Scenario
from blocksim.simulation.schemes.explicit import EXPLICIT
from blocksim.simulation.schemes.nonsmooth import NONSMOOTH
from blocksim.simulation.schemes.scheme import AnyScene, Scene, Scheme
from blocksim.world import scenes
from blocksim.world.scenes import Built, Refusal, Stack, alike, build_one

SCHEMES = {scheme.name: scheme for scheme in (EXPLICIT, NONSMOOTH)}
"""Scheme as written in a scenario, and what it does."""


def scheme_named(scenario: Scenario) -> Scheme:
    """Return the scheme that a scenario names."""
    return SCHEMES[scenario.time.scheme]


def scheme_of(scene: AnyScene) -> Scheme:
    """Return the scheme that a scene is of."""
    return next(scheme for scheme in SCHEMES.values() if isinstance(scene, scheme.scene_type))


def build_scene(scenario: Scenario) -> AnyScene:
    """Return the scene of a scenario at time zero. Raises what the scheme raises for a scenario that it cannot run."""
    scene: AnyScene = build(scenario).scene
    return scene


def build(scenario: Scenario) -> Built:
    """Return the same scene with the blocks as they were placed."""
    return build_one(scenario, scheme_named(scenario).construction)


def build_stacks(scenarios: Sequence[Scenario]) -> Iterator[Stack | Refusal]:
    """Build the scenes of scenarios at time zero, those of one scheme and shape together."""
    for places in alike([scenario.time.scheme for scenario in scenarios]):
        construction = scheme_named(scenarios[places[0]]).construction
        stacks = scenes.build_stacks([scenarios[i] for i in places], construction)
        yield from (one.numbered(places) for one in stacks)


def measured_row(scene: AnyScene) -> NDArray[np.float64]:
    """Return energies (J), number of contacts and largest overlap (m), as `measured` of the scheme names them."""
    scheme = scheme_of(scene)
    row = np.zeros(len(scheme.measured))
    scheme.measure(scene, row)
    return row


__all__ = [
    "SCHEMES",
    "AnyScene",
    "Scene",
    "Scheme",
    "build",
    "build_scene",
    "build_stacks",
    "measured_row",
    "scheme_named",
    "scheme_of",
]
