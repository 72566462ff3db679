"""The loads of a run as pictures know them: on which body, how they go with time, and when events end them."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario import Scenario, place_bodies
from blocksim.scenario.models.history import Stretch
from blocksim.scenario.models.loads import AnyLoad, Gravity, OnBody

_Floats = NDArray[np.float64]


class Acting(NamedTuple):
    """A load, the number of its body (-1: all free ones), its factor or tilt (rad) over time, and when (s) it ends."""

    load: AnyLoad
    body: int
    stretches: tuple[Stretch, ...]
    end: float

    def values(self, times: _Floats) -> _Floats:
        """Return its factor, or the tilt (rad) of gravity, at these times (s)."""
        starts, values, rates = np.array(self.stretches).T
        piece = (np.searchsorted(starts, times, side="right") - 1).clip(min=0)
        return np.where(times < self.end, values[piece] + rates[piece] * (times - starts[piece]), 0.0)


def acting_loads(scenario: Scenario, event_times: Sequence[float]) -> tuple[Acting, ...]:
    """Return the loads of a scenario whose events happen at these times (s)."""
    numbers = {body.name: number for number, body in enumerate(place_bodies(scenario))} if scenario.loads else {}
    tilt = scenario.ground.tilt
    found = []
    for load in scenario.loads:
        stretches = load.stretches_from(tilt) if isinstance(load, Gravity) else load.stretches()
        ends = (at for event, at in zip(scenario.events, event_times, strict=True) if load.name in event.unload)
        body = numbers[load.body] if isinstance(load, OnBody) else -1
        found.append(Acting(load, body, stretches, min(ends, default=math.inf)))
    return tuple(found)
