"""Small scenes with soil, for tests of kernels, world and simulation. SI units; everything 50 mm deep."""

from typing import Any

import numpy as np

from blocksim.scenario import Model, Scenario, scenario_from_mapping
from blocksim.simulation.schemes import build, ledger_names, measure_row
from blocksim.verification.scene import SteppedScene

DEPTH = 0.05
UNIT_WEIGHT = 20e3
GRAVITY = 9.81
MATERIALS: dict[str, dict[str, Any]] = {
    "rods": {"unit_weight": UNIT_WEIGHT, "young_modulus": 5.84e6, "poisson_ratio": 0.3, "friction_angle": "21.9 deg"},
    "clay": {
        "unit_weight": UNIT_WEIGHT,
        "young_modulus": 5.84e6,
        "poisson_ratio": 0.3,
        "friction_angle": "20 deg",
        "cohesion": 1e3,
    },
    "water": {"unit_weight": 10e3, "young_modulus": 3e6, "poisson_ratio": 0.45, "friction_angle": "0 deg"},
    "soft": {"density": 2700.0, "young_modulus": 5.84e6, "poisson_ratio": 0.3},
    "smooth": {"density": 2700.0, "young_modulus": 5.84e6, "poisson_ratio": 0.3},
}
BLOCKS: dict[str, dict[str, Any]] = {"far": {"width": 0.04, "height": 0.04, "length": DEPTH, "material": "soft"}}
FAR = {"block": "far", "x": -1.0, "y": 0.02}  # out of the way
LEFT = {"from": [0.0, 0.3], "to": [0.0, 0.0], "material": "smooth"}
SMOOTH_WALLS = {"rods": {"smooth": {"friction": 0.0}}}


def right(x: float) -> dict[str, Any]:
    """Return a smooth wall with its face to the left."""
    return {"from": [x, 0.0], "to": [x, 0.3], "material": "smooth"}


def column(width: float, height: float, spacing: float, **keys: Any) -> dict[str, Any]:
    """Return the table of a rectangle on the ground at x = 0."""
    rectangle = {"kind": "rectangle", "x": [0.0, width], "y": [0.0, height]}
    return {"name": "column", "material": "rods", "spacing": spacing, **rectangle, **keys}


def data_of(*soils: dict[str, Any], end: float = 1.0, **changes: Any) -> dict[str, Any]:
    """Return the data of a scenario with these soils and a block far away."""
    time = {"end": end, "stop_at_rest": False}
    start = {"settle": False}
    data = {"schema": 1, "name": "soil", "materials": MATERIALS, "blocks": BLOCKS, "bodies": [FAR], "time": time}
    data["start"] = start
    return {**data, "soils": list(soils), **changes}


def scene(*soils: dict[str, Any], end: float = 1.0, **changes: Any) -> Scenario:
    """Return a scenario with these soils and a block far away."""
    return scenario_from_mapping(data_of(*soils, end=end, **changes))


class Soil(SteppedScene):
    """A scene with soil under way."""

    def __init__(self, scenario: Scenario) -> None:
        """Build and start it."""
        super().__init__(build(Model(scenario)))

    @property
    def soils(self) -> Any:
        """The arrays of its soils."""
        scene: Any = self.scene
        return scene.systems[0]

    @property
    def weight(self) -> float:
        """Weight (N) of the soil."""
        kinds = self.soils.kinds["mass"][self.soils.states["kind"]]
        return float(kinds.sum()) * 9.81

    def force_on(self, body: int) -> Any:
        """Return what the soil does to a body (N, x and y)."""
        touches = self.soils.touches[: int(self.soils.controls.touch_count[0])]
        on_it = touches[(touches["body"] == body) & (touches["normal_force"] > 0.0)]
        return -np.array([on_it["fx"].sum(), on_it["fy"].sum()])

    def mean_force_on(self, body: int, end: float) -> Any:
        """Return the mean of that until a time (s)."""
        found = []
        while self.time < end:
            self.to_step(self.steps + 20)
            found.append(self.force_on(body))
        return np.mean(found, axis=0)

    def entries(self) -> dict[str, float]:
        """Return the entries (J) of the ledger."""
        return dict(zip(ledger_names(self.scene), measure_row(self.scene).tolist(), strict=False))
