"""The stepping schemes; a new one is one file beside this one and one entry in `SCHEMES`."""

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario import Scenario
from blocksim.simulation.schemes.explicit import EXPLICIT
from blocksim.simulation.schemes.nonsmooth import NONSMOOTH
from blocksim.simulation.schemes.scheme import AnyScene, Scene, Scheme

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
    scene: AnyScene = scheme_named(scenario).build(scenario)
    return scene


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
    "build_scene",
    "measured_row",
    "scheme_named",
    "scheme_of",
]
