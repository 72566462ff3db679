"""Scenes stepped by the non-smooth scheme."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.scenario.models.timeline import Nonsmooth
from blocksim.simulation.schemes import build_scene
from blocksim.verification.scene import CaseScene, Simulation
from tests.kernels.scenes import ENDLESS, RIGID, rigid

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence


@pytest.fixture(autouse=True)
def division() -> Iterator[None]:
    """Divide as compiled code does, which computes all cases, IEEE 754's infinities among them, and then takes one.

    The two points of a contact coincide at an edge: then the case of both is 1/0, and one of the others is taken.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        yield


@pytest.fixture(scope="session")
def begin() -> Callable[..., Simulation]:
    """Start a scenario; keywords are keys of [time]."""
    return lambda scenario, **stepping: Simulation(build_scene(rigid(scenario, **stepping)))


@pytest.fixture(scope="session")
def single() -> Callable[..., Simulation]:
    """Start single bodies; keywords of [time] go there, all others to the scene."""

    def start(bodies: Sequence[Mapping[str, object]], **values: Any) -> Simulation:
        stepping = {name: values.pop(name) for name in list(values) if name in Nonsmooth.model_fields}
        scenario = CaseScene(bodies, time=RIGID, **values).scenario()
        return Simulation(build_scene(rigid(scenario, end=ENDLESS, **stepping)))

    return start
