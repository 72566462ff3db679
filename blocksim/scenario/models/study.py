"""What the run is compared with, and what may be varied."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import (
    BeforeValidator,
    Field,
    GetJsonSchemaHandler,
    ValidationInfo,
    WithJsonSchema,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from blocksim.scenario import quantities as q
from blocksim.scenario import units
from blocksim.scenario.models.base import OneOf, Table

MAX_VALUES = 100_000


def _existing_table(value: object, info: ValidationInfo) -> object:
    """Resolve the path against the scenario's folder, which is the validation context, and look for it."""
    if isinstance(value, Path):
        return value
    if not isinstance(value, str) or not value or "\0" in value:
        message = f'{q.shown(value)} is not the path of a table, such as "experiments/three_blocks.csv"'
        raise q.invalid(message)
    if info.context is None:
        return Path(value)
    table = Path(info.context["folder"], value).resolve()
    if not table.is_file():
        what = "is a folder, not a table" if table.is_dir() else "no such file"
        message = f"{q.shown(value)}: {what} (paths are relative to the scenario file)"
        raise q.invalid(message)
    return table


class Experiment(Table):
    """Measurements to compare with."""

    table: Annotated[
        Path,
        BeforeValidator(_existing_table),
        WithJsonSchema({"type": "string", "minLength": 1}),
    ] = Field(description="CSV table of the experiment, relative to the scenario file")


def _expanded(value: object) -> object:
    """Turn a list or { from, to, count } into the tuple of values."""
    if isinstance(value, Mapping) and set(value) == {"from", "to", "count"}:
        return _spread(value)
    if not isinstance(value, list | tuple):
        message = f"{q.shown(value)} is no variation; write a list or {{ from, to, count }}, and the key in quotes"
        raise q.invalid(message)
    if not value:
        message = "the list of values is empty"
        raise q.invalid(message)
    return tuple(value)


def _spread(value: Mapping[str, Any]) -> tuple[object, ...]:
    """Return `count` evenly spaced values, both ends included; SI numbers, angles as texts in rad."""
    count = value["count"]
    if isinstance(count, bool) or not isinstance(count, int) or not 2 <= count <= MAX_VALUES:  # noqa: PLR2004
        message = f"count {q.shown(count)} is not a whole number from 2 to {MAX_VALUES}"
        raise q.invalid(message)
    (first, dimension), (last, other) = (_end(value[name]) for name in ("from", "to"))
    if dimension != other:
        message = f"from {q.shown(value['from'])} and to {q.shown(value['to'])} are not of one kind"
        raise q.invalid(message)
    numbers = [first + (last - first) * i / (count - 1) for i in range(count - 1)] + [last]
    return tuple(f"{number!r} rad" for number in numbers) if dimension == units.ANGLE else tuple(numbers)


def _end(value: object) -> tuple[float, units.Dimension]:
    if not isinstance(value, str):
        return q.Quantity(q.NUMBER).read(value), units.NUMBER
    try:
        return q.parse_quantity(value, q.LENGTH)
    except ValueError as error:
        message = f"{q.shown(value)}: {error}"
        raise q.invalid(message) from None


_VALUES_SCHEMA: dict[str, Any] = {
    "anyOf": [
        {"type": "array", "minItems": 1},
        {
            "type": "object",
            "properties": {
                "from": {"type": ["number", "string"]},
                "to": {"type": ["number", "string"]},
                "count": {"type": "integer", "minimum": 2, "maximum": MAX_VALUES},
            },
            "required": ["from", "to", "count"],
            "additionalProperties": False,
        },
    ]
}
Values = Annotated[tuple[Any, ...], BeforeValidator(_expanded)]


class Sweep(Table):
    """Which scenario keys to vary; in the file every dotted key stands in quotes beside `mode`."""

    mode: Annotated[Literal["grid", "list"], OneOf(("grid", "list"), planned=("table", "lhs", "sobol", "normal"))] = (
        Field(default="grid", description="grid: every combination; list: all first values, all second values …")
    )
    vary: dict[str, Values] = Field(description="dotted key of the scenario and its values")

    @model_validator(mode="before")
    @classmethod
    def _collect(cls, value: object) -> object:
        if not isinstance(value, Mapping) or "vary" in value:
            return value
        keys = {key: entry for key, entry in value.items() if key != "mode"}
        if not keys:
            message = 'nothing to vary; add a line such as "contact.stiffness_scale" = [0.1, 1.0]'
            raise q.invalid(message)
        return {"mode": value.get("mode", "grid"), "vary": keys}

    @model_validator(mode="after")
    def _equally_long(self) -> Self:
        counts = {key: len(values) for key, values in self.vary.items()}
        if self.mode == "list" and len(set(counts.values())) > 1:
            told = ", ".join(f"{count} for {key}" for key, count in counts.items())
            message = f'mode "list" takes one value of every key at a time, but there are {told}'
            raise q.invalid(message, "mode")
        return self

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Describe the table of the file, where the varied keys stand beside `mode`."""
        table = handler.resolve_ref_schema(handler(schema))
        return {
            "type": "object",
            "title": "Sweep",
            "description": table.get("description", ""),
            "properties": {"mode": table["properties"]["mode"]},
            "additionalProperties": _VALUES_SCHEMA,
            "minProperties": 1,
        }
