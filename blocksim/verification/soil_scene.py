"""Scenes with soil for verification: columns, walls that are drawn back, walls of blocks. Everything 50 mm deep, SI."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from blocksim.scenario import scenario_from_mapping
from blocksim.simulation.schemes import build_scene, ledger_names
from blocksim.verification.scene import Simulation

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from blocksim.verification.case import Setting

DEPTH, UNIT_WEIGHT, DENSITY = 0.05, 20e3, 2721.7  # m, N/m3 of soil, kg/m3 of blocks
YOUNG_MODULUS, POISSON_RATIO = 5.84e6, 0.3
ANGLE = math.radians(21.9)  # of friction: the rods of the paper's field
ROUGH, SMOOTH = math.tan(ANGLE), 0.0
WIDTH, HEIGHT = 0.032, 0.025  # m, of blocks
COARSE, FINE = 0.005, 0.0025  # m: spacings
TALL = 0.1  # m, of columns
WALL = 0.3  # m: height of walls
GRAVITY = 9.81
SINE = math.sin(ANGLE)
ACTIVE = (1.0 - SINE) / (1.0 + SINE)  # K = sigma_x/sigma_y: Mohr and Coulomb's
BAND = math.sin(math.atan(SINE))  # soil of constant volume slips in a band at tan(phi*) = sin(phi): E. H. Davis, 1968
ACTIVE_OF_BANDS = (1.0 - BAND) / (1.0 + BAND)
AT_REST = (1.0 - SINE / math.sqrt(3.0)) / (1.0 + 2.0 * SINE / math.sqrt(3.0))  # Drucker and Prager's, no strain aside
EVERY = 20  # steps between two samples of a force
SOFT = {"young_modulus": YOUNG_MODULUS, "poisson_ratio": POISSON_RATIO}
RODS = {**SOFT, "unit_weight": UNIT_WEIGHT, "friction_angle": f"{math.degrees(ANGLE)!r} deg"}
MATERIALS: dict[str, dict[str, Any]] = {
    "rods": RODS,
    "rods_of_SPHinXsys": {**RODS, "yield_surface": "plane-strain-associated"},  # the only one that it has
    "wall": {**SOFT, "density": DENSITY},
    "block": {**SOFT, "density": DENSITY},
}
GRADIENTS = (("raw", ""), ("corrected", "corrected: "))  # and how names of their rows begin
FAR = {"block": "far", "x": -1.0, "y": 0.02}  # out of the way


class SoilScene(Simulation):
    """A rectangle of soil with its lower left corner at x, y, between what is given."""

    def __init__(  # noqa: PLR0913 - what cases differ by
        self,
        size: tuple[float, float],
        spacing: float,
        *,
        x: float = 0.0,
        y: float = 0.0,
        walls: Sequence[float] = (),
        base: float = ROUGH,
        wall: float = SMOOTH,
        bodies: Sequence[Mapping[str, Any]] = (FAR,),
        blocks: Mapping[str, Mapping[str, Any]] | None = None,
        friction: float = 0.6,
        gravity: float = GRAVITY,
        **keys: Any,
    ) -> None:
        """Build and start it; `walls` are places of faces, that at 0 to the right, others to the left."""
        far = {"far": {"width": 0.04, "height": 0.04, "length": DEPTH, "material": "block"}}
        table = {"name": "soil", "material": "rods", "kind": "rectangle", "spacing": spacing, **keys}
        pairs = {"ground": {"friction": base}, "wall": {"friction": wall}, "block": {"friction": SMOOTH}}
        data = {
            "schema": 1,
            "name": "soil",
            "materials": MATERIALS,
            "blocks": {**far, **(blocks or {})},
            "bodies": list(bodies),
            "soils": [{**table, "x": [x, x + size[0]], "y": [y, y + size[1]]}],
            "walls": [_wall(place, is_left=place == 0.0) for place in walls],
            "pairs": {str(table["material"]): pairs},
            "friction": {"block_block": 1.0, "block_ground": friction},
            "gravity": gravity,
            "time": {"end": 10.0, "stop_at_rest": False},
        }
        super().__init__(build_scene(scenario_from_mapping(data)))

    @property
    def soils(self) -> Any:
        """The arrays of the soil."""
        scene: Any = self.scene
        return scene.systems[0]

    @property
    def points(self) -> Any:
        """Places and velocities of all particles."""
        return self.soils.points

    @property
    def weight(self) -> float:
        """Weight (N) of the soil."""
        return float(self.soils.kinds["mass"][0]) * len(self.points) * float(abs(self.world.controls[0].gravity_y))

    def force_on(self, body: int) -> NDArray[np.float64]:
        """Return what the soil does to a body (N, x and y); a negative number counts from the last, the ground."""
        number = body % self.world.bodies.size
        touches = self.soils.touches[: int(self.soils.controls.touch_count[0])]
        on_it = touches[(touches["body"] == number) & (touches["normal_force"] > 0.0)]
        return -np.array([on_it["fx"].sum(), on_it["fy"].sum()])

    def mean_force_on(self, body: int, end: float) -> NDArray[np.float64]:
        """Return the mean of that until a time (s)."""
        found = []
        while self.time < end:
            self.to_step(self.steps + EVERY)
            found.append(self.force_on(body))
        return np.asarray(np.mean(found, axis=0))

    def entries(self) -> dict[str, float]:
        """Return the entries (J) of the ledger."""
        return dict(zip(ledger_names(self.scene), self.measured().tolist(), strict=False))


def _wall(place: float, *, is_left: bool) -> dict[str, Any]:
    ends = ([place, WALL], [place, 0.0]) if is_left else ([place, 0.0], [place, WALL])
    return {"from": ends[0], "to": ends[1], "material": "wall"}


def pressure_share(force: float, height: float) -> float:
    """Return K of a horizontal force (N) on a wall of this height (m)."""
    return 2.0 * abs(force) / (UNIT_WEIGHT * height**2 * DEPTH)


def gradients(setting: Setting) -> tuple[tuple[str, str], ...]:
    """Return the gradients of a case and how names of its rows begin: both, or the raw one alone at quick sizes."""
    return GRADIENTS[:1] if setting.quick else GRADIENTS
