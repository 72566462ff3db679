"""How bodies touch: friction and contact."""

import math
from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal, Self

from pydantic import ConfigDict, GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from blocksim.scenario import laws, units as q
from blocksim.scenario.models.base import OneOf, Table, setting

Model = Annotated[Literal["surface", "particles", "kernel"], OneOf(("surface", "particles", "kernel"))]
Impacts = Annotated[Literal["simultaneous", "sequential"], OneOf(("simultaneous", "sequential"))]
SUPPORT = {"wendland-c2": 2.0, "cubic-spline": 2.0, "quintic-spline": 3.0}
"""Radius at which a kernel function ends, in smoothing lengths."""
Kernel = Annotated[Literal["wendland-c2", "cubic-spline", "quintic-spline"], OneOf(tuple(SUPPORT))]
SPACINGS_PER_LENGTH = 1.3  # smoothing length by default, in particle spacings
LEAST_SPACINGS = 0.8
"""Least smoothing length, in particle spacings; below it a particle may have no neighbour on a flat side."""
NO_FIXED_STIFFNESS = 'law "{}" takes it from the materials and contact_radius; use stiffness_scale'


GROUND = "ground"
"""Stands for the ground where pairs name materials; no material can have this name."""


class Short(Table):
    """A table in whose place a bare value may stand in the file."""

    bare: ClassVar[JsonSchemaValue]

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Accept both."""
        return {"anyOf": [cls.bare, handler(schema)]}


class PairFriction(Short):
    """Coulomb friction of one material pair, falling from static to kinetic with the sliding speed.

    mu(v) = kinetic + (static - kinetic) exp(-|v| / transition_speed). A bare number or friction angle in the
    file means static = kinetic. With kinetic_ratio, kinetic follows static where that is varied.
    """

    bare = q.FrictionCoefficient().json_schema({"type": "number"})
    static: q.Friction = setting("friction coefficient at rest")
    kinetic_ratio: q.Ratio | None = setting("kinetic over static friction, in place of kinetic", None, exclude=True)
    kinetic: q.Friction = setting(
        "friction coefficient in fast sliding (default: static)",
        default_factory=lambda known: known.get("static", math.inf) * (known.get("kinetic_ratio") or 1.0),
    )
    transition_speed: q.PositiveSpeed = setting("sliding speed of the transition", 0.005)

    @model_validator(mode="before")
    @classmethod
    def _table(cls, value: object) -> object:
        if isinstance(value, Mapping | PairFriction):
            return value
        if isinstance(value, int | float | str) and not isinstance(value, bool):
            return {"static": value}
        message = f"{q.toml(value)} is not a friction coefficient; write a number, an angle, or {{ static, kinetic }}"
        raise q.invalid(message)

    def _check(self) -> None:
        if self.kinetic_ratio is not None and "kinetic" in self.model_fields_set:
            raise q.invalid("kinetic and kinetic_ratio mean the same; keep one of the two", "kinetic_ratio", at="key")
        if self.kinetic > self.static:
            raise q.invalid(f"kinetic friction {self.kinetic:g} is above static friction {self.static:g}", "kinetic")

    def over(self, divisor: float) -> Self:
        """Return the same with both coefficients divided, at most to no slip."""
        less = {name: min(getattr(self, name) / divisor, q.NO_SLIP) for name in ("static", "kinetic")}
        return self.model_copy(update=less)


class Friction(Table):
    """Friction between blocks, and between blocks and the ground; the defaults are the paper's."""

    block_block: PairFriction = setting("friction between two blocks", PairFriction(static=0.31))
    block_ground: PairFriction = setting("friction between a block and the ground", PairFriction(static=0.38))


PARTS = ("soil", "joints")


class Strength(Table):
    """A factor by which strength is divided: `limit` over it gives the factor of safety by strength reduction."""

    factor: q.PositiveNumber = setting("divides tan(friction_angle) and cohesion of soils, and friction of joints", 1.0)
    of: tuple[Annotated[Literal["soil", "joints"], OneOf(PARTS)], ...] = setting(
        "what is divided: soil, joints (between blocks, ground, walls and soil, static and kinetic alike), or both",
        PARTS,
    )

    def _check(self) -> None:
        if not self.of or len({*self.of}) < len(self.of):
            raise q.invalid('name soil, joints or both once, such as of = ["soil", "joints"]', "of")

    def divisor(self, part: str) -> float:
        """Return the factor for one of PARTS."""
        return self.factor if part in self.of else 1.0


class Restitution(Short):
    """Coefficients of restitution; a bare number in the file sets both."""

    bare: ClassVar = {"type": "number", "minimum": 0, "maximum": 1}
    block_block: q.Share = setting("restitution between two blocks (assumed)", 0.2)
    block_ground: q.Share = setting("restitution between a block and the ground (assumed)", 0.2)

    @model_validator(mode="before")
    @classmethod
    def _both(cls, value: object) -> object:
        if isinstance(value, int | float) and not isinstance(value, bool):
            return {"block_block": value, "block_ground": value}
        if isinstance(value, Mapping | Restitution):
            return value
        if isinstance(value, str) and any(letter.isdigit() for letter in value):  # a number in quotes, or in per cent
            q.Quantity(q.NUMBER).read(value)
        raise q.invalid(f"{q.toml(value)} is not a restitution; write a number or {{ block_block, block_ground }}")


class Pair(Table):
    """Values of one pair of materials, or of a material and the ground; the rest follows the defaults."""

    model_config = ConfigDict(json_schema_extra={"minProperties": 1})

    friction: PairFriction | None = setting("friction, as friction.block_block", None)
    restitution: q.Share | None = setting("restitution", None)
    normal_stiffness: q.Stiffness | None = setting("stiffness of one contact point, linear law only", None)
    shear_stiffness_ratio: q.PositiveNumber | None = setting("shear over normal stiffness", None)
    shear_damping_ratio: q.NonNegativeNumber | None = setting("damping ratio in shear", None)

    def _check(self) -> None:
        if not self.model_fields_set:
            raise q.invalid("this pair is empty; give friction, restitution, a stiffness or a damping ratio")


class Contact(Table):
    """Contact model, force law and their numbers."""

    model: Model = setting("how contacts are found: surface, particles or kernel", "surface")
    law: Annotated[str, OneOf(tuple(laws.LAWS))] = setting(
        f"how the force grows with the overlap: {' or '.join(laws.LAWS)}", laws.LINEAR.name
    )
    restitution: Restitution = setting("rebound speed over impact speed", Restitution())
    impacts: Impacts = setting(
        "impacts within one substep, rigid contacts only: simultaneous, or sequential: one after the other, with steps "
        "cut at impacts, for single blocks that bounce or rock, rows that pass blows on, and restitution above 0.5",
        "simultaneous",
    )
    stiffness_scale: q.PositiveNumber = setting("factor on the stiffness of every contact", 1.0)
    normal_stiffness: q.Stiffness | None = setting(
        "stiffness of one contact point, linear law only (default: from the materials)", None
    )
    shear_stiffness_ratio: q.PositiveNumber | None = setting(
        "shear over normal stiffness (default: Mindlin, from Poisson's ratio)", None
    )
    shear_damping_ratio: q.NonNegativeNumber | None = setting("damping ratio in shear (default: the normal one)", None)
    max_overlap: q.PositiveLength | None = setting(
        "overlap that stops the run; with springs at most half of the smallest side of a pair "
        "(default: 5 % of that side, 50 % for rigid contacts)",
        None,
    )
    skin: q.PositiveLength | None = setting(
        "largest gap between blocks that are listed as neighbours; sets how often the list is updated and "
        "how long it is; with springs the motion is bit-identical (default: 25 % of the smallest side of all blocks, "
        "5 % with particles)",
        None,
    )
    contact_radius: q.PositiveLength = setting(
        "radius of curvature R* of every contact (assumed; hertz-mindlin only)", 0.001
    )
    particle_spacing: q.PositiveLength = setting("spacing of the boundary particles (particles, kernel)", 0.001)
    smoothing_length: q.PositiveLength | None = setting(
        "smoothing length of the kernel (kernel only; default: 1.3 particle_spacing)", None
    )
    kernel: Kernel = setting(
        "kernel function (kernel only): wendland-c2, cubic-spline or quintic-spline", "wendland-c2"
    )

    @property
    def resolved_smoothing_length(self) -> float:
        """Smoothing length in m, as given or by default."""
        return SPACINGS_PER_LENGTH * self.particle_spacing if self.smoothing_length is None else self.smoothing_length

    def _check(self) -> None:
        if not laws.LAWS[self.law].is_linear and self.normal_stiffness is not None:
            raise q.invalid(NO_FIXED_STIFFNESS.format(self.law), "normal_stiffness")
        least = LEAST_SPACINGS * self.particle_spacing
        if self.model == "kernel" and self.smoothing_length is not None and self.smoothing_length < least:
            message = (
                f"{self.smoothing_length * 1e3:g} mm reaches too few particles; at least {LEAST_SPACINGS:g} "
                f"particle_spacing ({least * 1e3:g} mm) is needed"
            )
            raise q.invalid(message, "smoothing_length")
