"""How time passes and what is kept of it."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, get_args

from pydantic import BeforeValidator, Discriminator, Field, Tag, WithJsonSchema

from blocksim.scenario import quantities as q
from blocksim.scenario.models.base import OneOf, Table, whole
from blocksim.scenario.spelling import nearest

Scheme = Literal["explicit", "nonsmooth"]
_WORDS = OneOf(get_args(Scheme))

MOST_SLIPS = 2
"""Of a misspelt scheme, so that the keys beside it are judged as those that are meant."""
MOST_SUBSTEPS = 1000
MOST_SWEEPS = 1_000_000
LEAST_TOLERANCE = 1e-12
"""Of velocities in m/s; sums of impulses are no more exact than that."""
_STEP = q.Quantity(q.TIME, above=0.0)
_TOLERANCE = q.Quantity(q.SPEED, at_least=LEAST_TOLERANCE)


def _step(value: object) -> object:
    if isinstance(value, str) and not any(c.isdigit() for c in value):
        if value == "auto":
            return value
        message = f'{q.shown(value)} is not a time step; use "auto" or {_STEP.wanted}'
        raise q.invalid(message)
    return _STEP.read(value)


_STEP_SCHEMA: dict[str, Any] = {"anyOf": [{"const": "auto"}, *_STEP.json_schema()["anyOf"]]}
Step = Annotated[float | Literal["auto"], BeforeValidator(_step), WithJsonSchema(_STEP_SCHEMA)]


class Time(Table):
    """End and step, whatever the scheme."""

    scheme: Annotated[Scheme, _WORDS] = Field(
        default="explicit",
        description="how time is stepped: explicit (springs and dashpots) or nonsmooth (impulses)",
    )
    end: q.PositiveTime = Field(default=2.0, description="simulated time")
    step: Step = Field(default="auto", description='time step, or "auto" for the largest safe one')
    force_step: bool = Field(default=False, description="true to accept a step above the safe one")
    stop_at_rest: bool = Field(default=True, description="true to end the run once everything rests")
    rest_speed: q.PositiveSpeed = Field(default=1e-4, description="slower than this counts as rest")
    rest_hold: q.NonNegativeTime = Field(default=0.05, description="rest must last this long")


class Explicit(Time):
    """Springs and dashpots, resolved by small steps."""

    scheme: Annotated[Literal["explicit"], _WORDS] = Field(default="explicit", description="the scheme of this table")
    safety: q.Safety = Field(
        default=0.05, description="share of the stability limit that the automatic step is, at most 0.1"
    )


class Nonsmooth(Time):
    """Impulses between rigid blocks, Newton's restitution and Coulomb's friction; a hundred times longer steps."""

    scheme: Annotated[Literal["nonsmooth"], _WORDS] = Field(description="the scheme of this table")
    substeps: Annotated[
        int,
        BeforeValidator(whole(1, MOST_SUBSTEPS)),
        Field(json_schema_extra={"minimum": 1, "maximum": MOST_SUBSTEPS}),
    ] = Field(default=4, description="parts of a step; contacts are found once a step and solved in every part")
    velocity_tolerance: Annotated[float, _TOLERANCE] | None = Field(
        default=None,
        description="a part of a step is solved once no impulse changes a velocity by more (default: 1 mm/s, from 100 "
        "blocks on 100 mm/s)",
    )
    velocity_sweeps: Annotated[
        int, BeforeValidator(whole(1, MOST_SWEEPS)), Field(json_schema_extra={"minimum": 1, "maximum": MOST_SWEEPS})
    ] = Field(default=1000, description="so often all contacts are gone through at most to solve a part of a step")
    restitution_threshold: q.NonNegativeSpeed = Field(default=0.01, description="slower impacts do not rebound")


def scheme_of(value: object) -> str:
    """Return which model reads a [time] table: that of its scheme, or of the one that a misspelt word is nearest to."""
    scheme = value.get("scheme") if isinstance(value, Mapping) else getattr(value, "scheme", None)
    if not isinstance(scheme, str):
        return "explicit"
    return scheme if scheme in SCHEMES else nearest(scheme, SCHEMES, most=MOST_SLIPS) or "explicit"


AnyTime = Annotated[
    Annotated[Explicit, Tag("explicit")] | Annotated[Nonsmooth, Tag("nonsmooth")], Discriminator(scheme_of)
]
"""Any stepping, told apart by its `scheme`."""
SCHEMES: dict[str, type[Time]] = {"explicit": Explicit, "nonsmooth": Nonsmooth}
"""Scheme as written in a scenario, and its class."""


class Output(Table):
    """What is recorded; it never changes the motion."""

    every: q.PositiveTime = Field(default=0.001, description="time between two recorded frames")
    contacts: bool = Field(default=False, description="true to record all contacts and their forces in every frame")
