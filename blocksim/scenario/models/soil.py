"""[[soils]]: bodies of soil, filled with particles of one spacing."""

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Annotated, Literal, get_args

import numpy as np

from blocksim.scenario import geometry, spelling, units as q
from blocksim.scenario.models.base import SYSTEMS, Identifier, OneOf, SystemTable, setting
from blocksim.scenario.models.geometry import Point

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from blocksim.scenario.models.scenario import Scenario
    from blocksim.scenario.placement import PlacedBody

Kind = Literal["outline", "rectangle", "slope", "fill"]
Start = Literal["geostatic", "ramp"]
Gradient = Literal["raw", "corrected"]
MOST_PARTICLES = 1_000_000
LEAST_ACROSS = 4
RAMP_TIME = 0.1  # s, in which gravity grows where soil starts without stress
SPACINGS_A_SIDE = 8  # least number of spacings across the thinnest block
MILLI = 1e3
SHAPES: dict[str, tuple[str, ...]] = {
    "outline": ("outline",),
    "rectangle": ("x", "y"),
    "slope": ("x", "y", "angle"),
    "fill": ("x", "y"),
}
"""Keys that give the shape, by kind."""


class SoilTable(SystemTable):
    """A body of soil: an outline, a rectangle, a slope or what is poured onto blocks, filled with particles."""

    declared_in = "blocksim.world.systems.soils:SOILS"
    name: Identifier = setting("name of the soil in tables")
    material: str = setting("the name of its material, which has a friction_angle")
    kind: Annotated[Kind, OneOf(get_args(Kind))] = setting(
        "what is given of its shape: an outline; x and y of a rectangle; these and the angle of a slope; x and y of a "
        "fill, a rectangle poured in from above: without the blocks in it, and what is below them",
        "outline",
    )
    outline: tuple[Point, ...] | None = setting(
        "corners [x, y] in order; where an edge is inclined, discs of a spacing stay inside", None
    )
    x: Point | None = setting("where a rectangle, a fill, or the base of a slope, begins and ends", None)
    y: Point | None = setting("where it begins and ends above the ground", None)
    angle: q.SlopeAngle | None = setting(
        "rise of the face of a slope, from its foot at the left; above 90 deg from the right", None
    )
    spacing: q.PositiveLength = setting("distance of the particles at the start, the same for all soils")
    start: Annotated[Start, OneOf(get_args(Start))] = setting(
        "geostatic: stresses of the weight above; ramp: no stress, and gravity grows over 0.1 s", "geostatic"
    )
    lifts: int = setting(
        "number of layers in which soil is filled in while the scene settles, each at rest before the next one; the "
        "greatest of all soils counts",
        1,
        ge=1,
    )
    gradient: Annotated[Gradient, OneOf(get_args(Gradient))] = setting(
        "corrected, or raw: two thirds of the time, but on a rough base too little thrust on blocks", "corrected"
    )

    def _check(self) -> None:
        wanted = SHAPES[self.kind]
        for key in ("outline", "x", "y", "angle"):
            is_given = getattr(self, key) is not None
            if is_given and key not in wanted:
                raise q.invalid(f"this key does not belong to kind {q.toml(self.kind)}", key, at="key")
            if not is_given and key in wanted:
                raise q.invalid(f"kind {q.toml(self.kind)} needs the key {key}", "kind", at="key")
        for key in ("x", "y"):
            ends = getattr(self, key)
            if ends is not None and ends[1] <= ends[0]:
                raise q.invalid("the end must be beyond the begin", key)
        if self.angle is not None and self.x is not None and max(self._heads) >= self.x[1] - self.x[0]:
            raise q.invalid("the face reaches the other end below the crest", "angle")
        corners = self.outline or tuple((float(x), float(y)) for x, y in self.corners)
        key = SHAPES[self.kind][0]
        if len(corners) < 3:
            raise q.invalid("an outline needs at least three corners [x, y]", key)
        if len(set(corners)) < len(corners):
            raise q.invalid("two corners are the same", key)
        for one, other in geometry.self_crossings(np.array(corners)):
            raise q.invalid(f"edges {one + 1} and {other + 1} of the outline meet", key)
        if abs(geometry.area_of(corners)) <= geometry.ROUND_OFF**2:
            raise q.invalid("the outline has no area", key)

    @property
    def corners(self) -> "NDArray[np.float64]":
        """Corners (m, (k, 2)), counter-clockwise."""
        (x0, x1), (y0, y1) = self.x or (0.0, 0.0), self.y or (0.0, 0.0)
        left, right = self._heads
        return geometry.corners_of(self.outline or [(x0, y0), (x1, y0), (x1 - right, y1), (x0 + left, y1)])

    @property
    def _heads(self) -> tuple[float, float]:
        """Return how far (m) the crest begins after the left end and ends before the right one."""
        (_, _), (y0, y1) = self.x or (0.0, 0.0), self.y or (0.0, 0.0)
        back = 0.0 if self.angle is None else (y1 - y0) / math.tan(self.angle)
        return max(back, 0.0), max(-back, 0.0)

    def impossible(self, scenario: "Scenario", placed: "Sequence[PlacedBody]") -> Iterator[tuple[str, str]]:
        """Find a material that is no soil, a spacing that does not suit, and what the outline meets."""
        from blocksim.scenario import start  # noqa: PLC0415 - it needs the scenario's own model

        if self.material not in scenario.materials:
            hint = spelling.did_you_mean_or_list(self.material, scenario.materials)
            yield "material", f"unknown material {q.toml(self.material)}, {hint}"
        elif scenario.materials[self.material].friction_angle is None:
            yield "material", f"{q.toml(self.material)} is no soil; give this material a friction_angle"
        thinnest = min(placed, key=lambda body: body.least_width, default=None)
        across = geometry.count_across(self.corners, self.spacing)
        first = scenario.systems["soils"][0]
        unfit = []
        if isinstance(first, SoilTable) and self.spacing != first.spacing:
            unfit.append(f"all soils have the same spacing, here {MILLI * first.spacing:.6g} mm")
        if thinnest and SPACINGS_A_SIDE * self.spacing > thinnest.least_width * (1.0 + 1e-9):
            most = MILLI * thinnest.least_width / SPACINGS_A_SIDE
            which = f"of the blocks, which body {thinnest.name} has"
            unfit.append(f"above an eighth of the smallest side {which}: at most {most:.4g} mm")
        if self.lifts > across[1]:
            yield "lifts", f"{self.lifts} lifts of {across[1]} rows of particles; at most one a row"
        if min(across) < LEAST_ACROSS:
            unfit.append(f"only {min(across)} particles across; at least {LEAST_ACROSS} are needed")
        if across[0] * across[1] > MOST_PARTICLES:
            unfit.append(f"{across[0] * across[1]} particles are too many; at most {MOST_PARTICLES} are allowed")
        yield from (("spacing", message) for message in unfit)
        if not unfit:
            yield from start.meetings(self, "outline" if self.kind == "outline" else "kind", scenario, placed)


SYSTEMS["soils"] = SoilTable
