"""Scenes stepped by the non-smooth scheme."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from blocksim.scenario.models.stepping import Nonsmooth
from blocksim.simulation.schemes import build_scene
from blocksim.verification.scene import Scene, Simulation
from tests.kernels.nonsmooth.scenes import ENDLESS, rigid

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence


@pytest.fixture(scope="session")
def begin() -> Callable[..., Simulation]:
    """Start a scenario; keywords are keys of [time]."""
    return lambda scenario, **stepping: Simulation(build_scene(rigid(scenario, **stepping)))


@pytest.fixture(scope="session")
def single() -> Callable[..., Simulation]:
    """Start single bodies; keywords of [time] go there, all others to the scene."""

    def start(bodies: Sequence[Mapping[str, object]], **values: Any) -> Simulation:
        stepping = {name: values.pop(name) for name in list(values) if name in Nonsmooth.model_fields}
        scenario = Scene(bodies, **values).scenario()
        return Simulation(build_scene(rigid(scenario, end=ENDLESS, **stepping)))

    return start
