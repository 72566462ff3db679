"""Materials, blocks, single bodies, and the boundary: the ground and walls."""

import math
from collections.abc import Mapping
from functools import cached_property
from itertools import chain, pairwise
from typing import Annotated, Any, Literal, get_args

import pydantic
from pydantic import ConfigDict
from pydantic_core import PydanticKnownError

from blocksim.scenario import geometry, units as q
from blocksim.scenario.models.base import Identifier, OneOf, Table, Whole, require_one, setting
from blocksim.scenario.models.motion import AnyDrive

Side = Literal["width", "height", "length"]
YieldSurface = Literal["mohr-coulomb", "plane-strain-associated"]
SIDES: tuple[Side, ...] = ("width", "height", "length")
RECTANGLE_KEYS = (*SIDES, "upright", "along")
OUTLINE_KEYS = {"outline": ("outline", "depth"), "sides": ("sides", "radius", "depth")}
"""What a block needs that is no rectangle, by the key that tells so."""
COUNTS = {"minItems": geometry.FEWEST, "maxItems": geometry.MOST}  # of the corners of an outline
ABSENT = object()  # in place of a value that is missing
Point = tuple[q.Length, q.Length]


class Material(Table):
    """An elastic material; exactly one of density and unit weight is given."""

    model_config = ConfigDict(json_schema_extra={"oneOf": [{"required": ["density"]}, {"required": ["unit_weight"]}]})

    given_density: q.Density | None = pydantic.Field(  # an alias that type checkers are to see
        default=None, alias="density", description="mass per volume; give this or unit_weight"
    )
    unit_weight: q.UnitWeight | None = setting("weight per volume, divided by 9.81 m/s^2; give this or density", None)
    young_modulus: q.Pressure = setting("Young's modulus E")
    poisson_ratio: q.PoissonRatio = setting("Poisson's ratio")
    friction_angle: q.FrictionAngle | None = setting("makes it a soil: its angle of friction", None)
    cohesion: q.Cohesion | None = setting("cohesion of a soil (default: 0)", None)
    dilation: q.Angle | None = setting("angle of dilation of a soil; only 0 is available", None)
    yield_surface: Annotated[YieldSurface, OneOf(get_args(YieldSurface))] | None = setting(
        "how Drucker and Prager's surface follows from friction angle and cohesion (default: "
        "mohr-coulomb, which fails as they say; plane-strain-associated is the value often printed, too weak here)",
        None,
    )

    def _check(self) -> None:
        missing = 'the density is missing: give density (such as "2700 kg/m^3") or unit_weight'
        require_one(missing, density=self.given_density, unit_weight=self.unit_weight)
        for key in () if self.friction_angle is not None else ("cohesion", "dilation", "yield_surface"):
            if getattr(self, key) is not None:
                message = 'only soil has this; give friction_angle too, "0 deg" where there is none'
                raise q.invalid(message, key, at="key")
        if self.dilation:
            raise q.invalid("soil that dilates is not available; leave dilation out", "dilation")

    @property
    def density(self) -> float:
        """Mass per volume in kg/m³."""
        if self.given_density is not None:
            return self.given_density
        return (self.unit_weight or math.nan) / q.USUAL_GRAVITY


class Block(Table):
    """A block by its three sides and its orientation in the plane, by its outline and its depth, or by its depth alone.

    The names of the sides are only names: `upright` selects the one that stands upright and `along` the one along
    x; the third is the depth. An outline is a convex polygon, or a regular one of a number of `sides`; its centroid is
    the place of a body. Structures that divide a whole into blocks, such as arches, give blocks of a depth their shape.
    """

    model_config = ConfigDict(
        json_schema_extra={"oneOf": [{"required": [*keys]} for keys in (SIDES, *OUTLINE_KEYS.values(), ["depth"])]}
    )

    width: q.PositiveLength | None = setting("width of the block", None)
    height: q.PositiveLength | None = setting("height of the block", None)
    length: q.PositiveLength | None = setting("length of the block", None)
    upright: Annotated[Side, OneOf(SIDES)] = setting("the side that stands upright", "height")
    along: Annotated[Side, OneOf(SIDES)] = setting(
        "the side that lies along x (default: width, or length if width stands upright)",
        default_factory=lambda known: "length" if known.get("upright") == "width" else "width",
    )
    outline: tuple[Point, ...] | None = setting(
        "corners [x, y] of a convex block, in either sense, in place of width, height and length; "
        "x and y of a body are those of its centroid",
        None,
        json_schema_extra=COUNTS,
    )
    sides: Annotated[int, Whole(geometry.FEWEST, geometry.MOST)] | None = setting(
        "number of sides of a regular block, the lowest level, in place of an outline", None
    )
    radius: q.PositiveLength | None = setting("distance of its corners from its centre", None)
    given_depth: q.PositiveLength | None = setting(
        "extent out of the plane of a block with an outline or sides, or with a shape from its structure",
        None,
        alias="depth",
    )
    material: str = setting("the name of the block's material")

    @pydantic.model_validator(mode="before")
    @classmethod
    def _needs_its_shape(cls, data: object) -> object:
        """Mark what is missing for the shape that is begun, so that each key is reported by itself."""
        if not isinstance(data, Mapping):
            return data
        shape = next((key for key in OUTLINE_KEYS if key in data), "")
        needed = OUTLINE_KEYS.get(shape, () if "depth" in data and data.keys().isdisjoint(SIDES) else SIDES)
        return {**dict.fromkeys(needed, ABSENT), **data}

    @pydantic.field_validator(*SIDES, "outline", "sides", "radius", "given_depth", mode="before")
    @classmethod
    def _is_there(cls, value: object) -> object:
        if value is ABSENT:
            raise PydanticKnownError("missing")
        return value

    def _check(self) -> None:
        shape = next((key for key in (*OUTLINE_KEYS, "width") if getattr(self, key) is not None), "depth")
        fields = type(self).model_fields
        given = [fields[name].alias or name for name in fields if name in self.model_fields_set]
        own = {"width": RECTANGLE_KEYS, "depth": ("depth",)} | OUTLINE_KEYS
        foreign = {*RECTANGLE_KEYS, *chain(*OUTLINE_KEYS.values())} - {*own[shape]}
        for key in given:
            if key in foreign:
                elsewhere = "belongs to a block with an outline or sides"
                why = elsewhere if shape == "width" else f"has no meaning beside {shape}"
                raise q.invalid(f"{key} {why}; keep one of them", key, at="key")
        if self.along == self.upright:
            others = " or ".join(q.toml(side) for side in SIDES if side != self.upright)
            raise q.invalid(f"{q.toml(self.upright)} already stands upright; {others} can lie along x", "along")
        for number, message in geometry.faults(self.outline or ()) if shape == "outline" else ():
            raise q.invalid(message, "outline", *(() if number is None else (number,)))
        for _, message in geometry.faults(self.polygon) if self.sides is not None and self.radius is not None else ():
            raise q.invalid(message, "radius")

    @pydantic.model_serializer(mode="wrap")
    def _own_keys(self, write: pydantic.SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out the keys of other shapes: they decide nothing."""
        data: dict[str, Any] = write(self)
        return {key: value for key, value in data.items() if self.has_key(key)}

    def has_key(self, key: str) -> bool:
        """Return whether a key (or the name of its field) has a meaning for the shape of this block."""
        if self.width is None:
            return key not in RECTANGLE_KEYS and getattr(self, "given_depth" if key == "depth" else key) is not None
        return key in {*RECTANGLE_KEYS, "material"}

    @cached_property
    def polygon(self) -> geometry.Corners:
        """Corners (m) counter-clockwise about the centroid; empty for a rectangular block."""
        if self.sides is not None and self.radius is not None:
            return geometry.regular(self.sides, self.radius)
        return geometry.centre_outline(self.outline or ())

    @cached_property
    def size_x(self) -> float:
        """Extent along x in m; of an outline that of its bounding box, 0 where the structure gives the shape."""
        return self._extent(0, self.along)

    @cached_property
    def size_y(self) -> float:
        """Extent upright in m; of an outline that of its bounding box."""
        return self._extent(1, self.upright)

    @property
    def depth(self) -> float:
        """Extent out of the plane in m."""
        if self.given_depth is not None:
            return self.given_depth
        (third,) = set(SIDES) - {self.along, self.upright}
        return getattr(self, third) or 0.0

    def _extent(self, axis: int, side: Side) -> float:
        if not self.polygon:
            return getattr(self, side) or 0.0
        low, high = geometry.box_of(self.polygon)
        return high[axis] - low[axis]


Guide = Literal["none", "no rotation"]


class BodySpec(Table):
    """One body placed by hand."""

    block: str = setting("the name of a block")
    x: q.Length = setting("centre along the ground")
    y: q.Length = setting("centre above the ground")
    angle: q.Angle = setting("rotation, counter-clockwise positive", 0.0)
    velocity: tuple[q.Speed, q.Speed] = setting("velocity of the centre along x and y", (0.0, 0.0))
    spin: q.Spin = setting("angular velocity, counter-clockwise positive", 0.0)
    fixed: bool = setting("true for a body that never moves", default=False)
    motion: AnyDrive | None = setting("prescribed motion of this body alone", None)
    guide: Annotated[Guide, OneOf(get_args(Guide))] = setting(
        'what a frame keeps it from: "no rotation", as of a loading beam whose head stays parallel; or "none"', "none"
    )
    name: Identifier | None = setting("name in tables (default: its number, from 1)", None)

    def _check(self) -> None:
        if self.fixed and (self.velocity != (0.0, 0.0) or self.spin != 0.0):
            raise q.invalid("a fixed body cannot have a velocity or a spin", "fixed")
        if self.motion is not None and self.fixed:
            raise q.invalid("a body with a motion is driven, not fixed; remove one of the two", "fixed")
        if self.guide != "none" and (self.fixed or self.motion is not None or self.spin != 0.0):
            raise q.invalid("a body with a guide is free and does not spin", "guide")
        if self.motion is not None and (self.velocity != (0.0, 0.0) or self.spin != 0.0):
            raise q.invalid("velocity and spin of a driven body follow from its motion", "motion")


class Ground(Table):
    """The half-plane below y = 0, or the region below a profile; a tilt turns gravity, x stays along the ground."""

    tilt: q.TiltAngle = setting("slope of the ground, positive where its +x end is raised", 0.0)
    material: str | None = setting("the name of its material (default: the blocks' own)", None)
    profile: tuple[Point, ...] | None = setting(
        "points [x, y] of its surface towards +x, level beyond both ends (default: level at y = 0)",
        None,
        json_schema_extra={"minItems": 2},
    )

    def _check(self) -> None:
        if self.profile is None:
            return
        if len(self.profile) < 2:
            raise q.invalid("a profile needs at least two points [x, y]", "profile")
        for number, ((x_before, y_before), (x, y)) in enumerate(pairwise(self.profile), start=1):
            x_first, y_first = self.profile[max(number - 2, 0)]
            message = ""
            if (x, y) == (x_before, y_before):
                message = "the same point as the one before"
            elif x < x_before:
                message = f"x goes back from {x_before:.6g} m to {x:.6g} m; a profile runs towards +x"
            elif number > 1 and x_first == x_before == x and (y_before - y_first) * (y - y_before) < 0.0:
                message = "the profile goes back over its own vertical segment"
            if message:
                raise q.invalid(message, "profile", number)


class Wall(Table):
    """Straight segment of boundary with one face: the solid is on the right of the way from `from` to `to`."""

    start: Point = setting("[x, y] of its start; the solid is on the right of the way to its end", alias="from")
    end: Point = setting("[x, y] of its end", alias="to")
    material: str | None = setting("the name of its material (default: as the ground)", None)

    def _check(self) -> None:
        if self.start == self.end:
            raise q.invalid("start and end of a wall must differ", "to")
