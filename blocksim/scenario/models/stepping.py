"""How time passes and what is kept of it."""

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, WithJsonSchema

from blocksim.scenario import quantities as q
from blocksim.scenario.models.base import OneOf, Table

_STEP = q.Quantity(q.TIME, above=0.0)


def _step(value: object) -> object:
    if isinstance(value, str) and not any(c.isdigit() for c in value):
        if value == "auto":
            return value
        message = f'{q.shown(value)} is no time step; use "auto" or {_STEP.wanted}'
        raise q.invalid(message)
    return _STEP.read(value)


_STEP_SCHEMA: dict[str, Any] = {"anyOf": [{"const": "auto"}, *_STEP.json_schema()["anyOf"]]}
Step = Annotated[float | Literal["auto"], BeforeValidator(_step), WithJsonSchema(_STEP_SCHEMA)]


class Time(Table):
    """Stepping scheme, end and step."""

    scheme: Annotated[Literal["explicit"], OneOf(("explicit",), planned=("nonsmooth",))] = Field(
        default="explicit", description="how time is stepped"
    )
    end: q.PositiveTime = Field(default=2.0, description="simulated time")
    step: Step = Field(default="auto", description='time step, or "auto" for the largest safe one')
    safety: q.Safety = Field(
        default=0.05, description="share of the stability limit that the automatic step is, at most 0.1"
    )
    force_step: bool = Field(default=False, description="true to accept a step above the safe one")
    stop_at_rest: bool = Field(default=True, description="true to end the run once everything rests")
    rest_speed: q.PositiveSpeed = Field(default=1e-4, description="slower than this counts as rest")
    rest_hold: q.NonNegativeTime = Field(default=0.05, description="rest must last this long")


class Output(Table):
    """What is recorded; it never changes the motion."""

    every: q.PositiveTime = Field(default=0.001, description="time between two recorded frames")
