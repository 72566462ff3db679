"""Experiment and sweep of a scenario."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, Self, get_args

from pydantic import (
    BeforeValidator,
    Field,
    GetJsonSchemaHandler,
    PlainValidator,
    ValidationInfo,
    WithJsonSchema,
    field_validator,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from blocksim.scenario import quantities as q
from blocksim.scenario.models.base import OneOf, Table, Whole, table_path
from blocksim.scenario.models.variation import VALUES_SCHEMA, Variation, read_sampled, read_spread
from blocksim.scenario.spelling import nearest

MAX_SAMPLES = 1_000_000
MAX_SEED = 2**53

Mode = Literal["grid", "list", "table", "lhs", "sobol", "normal"]
SAMPLED = ("lhs", "sobol", "normal")
"""Modes that draw `samples` values of every key."""
KEYS_OF = {"samples": SAMPLED, "seed": SAMPLED, "table": ("table",)}
"""Keys of [sweep] that only some modes have."""


def _existing_table(value: object, info: ValidationInfo) -> object:
    """Resolve the path against the scenario's folder, which is the validation context, and look for it."""
    if isinstance(value, Path):
        return value
    folder = None if info.context is None else info.context["folder"]
    return table_path(value, folder, "experiments/three_blocks.csv")


TablePath = Annotated[Path, BeforeValidator(_existing_table), WithJsonSchema({"type": "string", "minLength": 1})]


class Experiment(Table):
    """Measurements to compare with."""

    table: TablePath = Field(description="CSV table of the experiment, relative to the scenario file")


@dataclass(frozen=True, slots=True)
class _Slip:
    """Stands for the value of a misspelt key of [sweep]."""

    meant: str


def _variation(value: object, info: ValidationInfo) -> Variation:
    """Read what the mode allows; where the mode itself is wrong, anything that some mode allows."""
    if isinstance(value, _Slip):
        raise q.invalid(f"unknown key, did you mean {value.meant!r}?", at="key")
    mode = info.data.get("mode")
    if mode == "table":
        raise q.invalid('mode "table" takes keys and values from its table', at="key")
    is_sampled = mode in SAMPLED
    if mode is None and isinstance(value, Mapping):
        is_sampled = "count" not in value and bool({"from", "to", "mean", "sd"} & set(value))
    return read_sampled(value) if is_sampled else read_spread(value)


def _of_the_mode(value: object, info: ValidationInfo) -> object:
    """Refuse a key that belongs to other modes."""
    modes = KEYS_OF[str(info.field_name)]
    mode = info.data.get("mode")
    if mode is not None and mode not in modes:
        message = (
            f"mode {q.shown(mode)} has no key {info.field_name}, which belongs to {', '.join(map(q.shown, modes))}"
        )
        raise q.invalid(message, at="key")
    return value


Values = Annotated[Variation, PlainValidator(_variation), WithJsonSchema(VALUES_SCHEMA)]


class Sweep(Table):
    """Scenario keys to vary; in the file every dotted key is a key in quotes next to `mode`."""

    mode: Annotated[Mode, OneOf(get_args(Mode))] = Field(
        default="grid",
        description="grid: every combination; list: all first values, all second values …; table: rows of a file; "
        "lhs: Latin hypercube; sobol: scrambled Sobol points; normal: independent random draws",
    )
    samples: Annotated[int, Whole(1, MAX_SAMPLES), BeforeValidator(_of_the_mode)] = Field(
        default=128, description="number of cases to draw (lhs, sobol, normal; sobol is balanced at powers of two)"
    )
    seed: Annotated[int, Whole(0, MAX_SEED), BeforeValidator(_of_the_mode)] = Field(
        default=0, description="random seed (lhs, sobol, normal)"
    )
    table: Annotated[TablePath | None, BeforeValidator(_of_the_mode)] = Field(
        default=None,
        description="CSV table of cases, relative to the scenario file: one column per key, units as in `overlap [mm]`",
    )
    vary: dict[str, Values] = Field(
        description="dotted key of the scenario, and a list, { from, to, count }, { from, to }, { mean, sd } or "
        '{ mean, sd, from, to }; scale = "log" with from and to'
    )

    @model_validator(mode="before")
    @classmethod
    def _collect(cls, value: object) -> object:
        if not isinstance(value, Mapping) or "vary" in value:
            return value
        own = {key: entry for key, entry in value.items() if key in OWN_KEYS}
        keys = {key: _Slip(meant) if (meant := slip_of(key)) else value[key] for key in value if key not in own}
        if not keys and own.get("mode") != "table":
            raise q.invalid('nothing to vary; add a line such as "contact.stiffness_scale" = [0.1, 1.0]')
        return {**own, "vary": keys}

    @field_validator("vary")
    @classmethod
    def _lists_first(cls, vary: dict[str, Variation]) -> dict[str, Variation]:
        """Put lists before distributions, as in a resolved file: Sobol's dimensions follow the order of keys."""
        return dict(sorted(vary.items(), key=lambda entry: not isinstance(entry[1], tuple)))

    @model_validator(mode="after")
    def _suits_its_mode(self) -> Self:
        counts = {key: len(values) for key, values in self.vary.items() if isinstance(values, tuple)}
        if self.mode == "list" and len(set(counts.values())) > 1:
            told = ", ".join(f"{count} for {key}" for key, count in counts.items())
            message = f'mode "list" takes one value of every key at a time, but the numbers of values differ: {told}'
            raise q.invalid(message, "mode")
        if self.mode == "table" and self.table is None:
            raise q.invalid('mode "table" needs the path of a table, as in table = "samples.csv"', "mode")
        return self

    @property
    def is_sampled(self) -> bool:
        """Whether values are drawn at random."""
        return self.mode in SAMPLED

    def as_table(self) -> dict[str, Any]:
        """Return the table of the file that says this, with all values in SI."""
        own = {name: getattr(self, name) for name, modes in KEYS_OF.items() if self.mode in modes}
        vary = {key: [*one] if isinstance(one, tuple) else one.as_table() for key, one in self.vary.items()}
        return {"mode": self.mode, **own, **vary}

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Describe the table of the file, where the varied keys are next to `mode`."""
        table = handler.resolve_ref_schema(handler(schema))
        return {
            "type": "object",
            "title": "Sweep",
            "description": table.get("description", ""),
            "properties": {key: table["properties"][key] for key in OWN_KEYS},
            "additionalProperties": VALUES_SCHEMA,
            "minProperties": 1,
        }


OWN_KEYS = tuple(name for name in Sweep.model_fields if name != "vary")


def slip_of(key: object) -> str | None:
    """Return the key of [sweep] itself that a word was probably meant to be."""
    return nearest(str(key), OWN_KEYS, most=2)
