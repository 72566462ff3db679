"""Experiment and sweep of a scenario, and the values of one varied key."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, get_args

import pydantic
from pydantic import GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError

from blocksim.scenario import spelling, units as q
from blocksim.scenario.models.base import PATH_SCHEMA, OneOf, Table, Whole, setting, table_path

MAX_VALUES = 100_000
SIGNIFICANT = 12
"""Digits that spaced and sampled values keep: mathematical libraries differ in the last ones."""
FARTHEST = 8.0
"""Largest distance from the mean, in standard deviations, at which a truncated normal distribution may begin."""

NO_DIMENSION = q.NUMBER.dimension
Scale = Literal["linear", "log"]


class _Spread:
    """What distributions have in common: SI, radians where `angle`; `unit` is the one that the file has, if any."""

    __slots__ = ()
    ends: ClassVar[Mapping[str, str]]  # names of fields by the keys of the file
    angle: bool
    unit: str

    def as_table(self) -> dict[str, object]:
        """Return the table of the file that says this: finite numbers, with its unit if that gives them again."""
        table: dict[str, object] = {}
        for key, name in self.ends.items():
            number: float = getattr(self, name)
            if math.isfinite(number):
                table[key] = toml_number(number, angle=self.angle)
                if self.unit:
                    text = f"{number / float(q.parse_unit(self.unit).factor):.{SIGNIFICANT}g} {self.unit}"
                    table[key] = text if q.parse_quantity(text)[0] == number else table[key]
        return {**table, "scale": "log"} if getattr(self, "scale", "linear") == "log" else table


@dataclass(frozen=True, slots=True)
class Uniform(_Spread):
    """Evenly distributed from `low` to `high`, or their logarithms are."""

    ends: ClassVar = {"from": "low", "to": "high"}
    low: float
    high: float
    scale: Scale = "linear"
    angle: bool = False
    unit: str = ""


@dataclass(frozen=True, slots=True)
class Normal(_Spread):
    """Normally distributed, with nothing below `low` or above `high`."""

    ends: ClassVar = {"mean": "mean", "sd": "sd", "from": "low", "to": "high"}
    mean: float
    sd: float
    low: float = -math.inf
    high: float = math.inf
    angle: bool = False
    unit: str = ""


Distribution = Uniform | Normal
Variation = tuple[Any, ...] | Distribution


def toml_number(number: float, *, angle: bool) -> object:
    """Return a number as in a scenario: an angle as a string with its unit."""
    return f"{number!r} rad" if angle else number


def _unit(value: Mapping[str, Any], *names: str) -> str:
    """Return the first unit that was typed at some keys."""
    texts = (value[name] for name in names if isinstance(value.get(name), str))
    return next((unit for text in texts if (unit := q.unit_in(text))), "")


def _read_spread(value: object) -> tuple[Any, ...]:
    """Return the values of a list or of { from, to, count }; raises a pydantic error for anything else.

    `count` values are evenly spaced: both ends as written, between them SI numbers, angles as texts in rad. Between
    ends that are written as whole numbers such values stay whole, for keys that take no others.
    """
    if not isinstance(value, Mapping):
        return _levels(value, "{ from, to, count }")
    is_whole = {"from", "to"} <= set(value) and "count" not in value and set(value) <= {"from", "to", "scale"}
    if is_whole or "mean" in value or "sd" in value:
        message = "a distribution needs one of the modes lhs, sobol and normal; "
        raise q.invalid(message + "otherwise write a list or { from, to, count }")
    _refuse_slips(value, ("from", "to", "count", "scale"), needed=("from", "to", "count"))
    count = value["count"]
    if isinstance(count, bool) or not isinstance(count, int) or not 2 <= count <= MAX_VALUES:
        raise q.invalid(f"count {q.toml(count)} is not a whole number from 2 to {MAX_VALUES}")
    (first, last), angle = _numbers(value, "from", "to")
    scale = _scale(value, first, last)
    if scale == "log":
        powers = (first * (last / first) ** (i / (count - 1)) for i in range(1, count - 1))
        inner = [float(f"{number:.{SIGNIFICANT - 1}e}") for number in powers]
    else:
        inner = [first + (last - first) * i / (count - 1) for i in range(1, count - 1)]
    if type(value["from"]) is type(value["to"]) is int:
        return tuple(int(number) if number.is_integer() else number for number in (first, *inner, last))
    ends = [  # as typed, with their unit
        value[name] if isinstance(value[name], str) else toml_number(number, angle=angle)
        for name, number in (("from", first), ("to", last))
    ]
    return (ends[0], *(toml_number(number, angle=angle) for number in inner), ends[1])


def _read_distribution(value: object) -> Variation:
    """Return the levels of a list, or the distribution of a table; raises a pydantic error."""
    if not isinstance(value, Mapping):
        return _levels(value, "{ from, to } or { mean, sd }")
    if "count" in value:
        raise q.invalid('count belongs to the modes "grid" and "list"; here `samples` sets the number', "count")
    found: Distribution
    if "mean" in value or "sd" in value:
        _refuse_slips(value, ("mean", "sd", "from", "to"), needed=("mean", "sd"))
        bounds = [name for name in ("from", "to") if name in value]
        (mean, sd, *given), angle = _numbers(value, "mean", "sd", *bounds)
        if sd <= 0.0:
            raise q.invalid(f"the standard deviation {q.toml(value['sd'])} is not above 0", "sd")
        ends = dict(zip(bounds, given, strict=True))
        low, high = ends.get("from", -math.inf), ends.get("to", math.inf)
        found = Normal(mean, sd, low, high, angle, _unit(value, "mean", "sd"))
    else:
        _refuse_slips(value, ("from", "to", "scale", "mean", "sd"), needed=("from", "to"))
        (low, high), angle = _numbers(value, "from", "to")
        found = Uniform(low, high, _scale(value, low, high), angle, _unit(value, "from", "to"))
    if low >= high:
        raise q.invalid(f"from = {q.toml(value['from'])} is not below to = {q.toml(value['to'])}", "from")
    if isinstance(found, Normal):
        reach = FARTHEST * found.sd
        if low > found.mean + reach or high < found.mean - reach:
            message = f"the bounds exclude everything within {FARTHEST:g} standard deviations of the mean"
            raise q.invalid(message, "from" if low > found.mean else "to")
    return found


def _levels(value: object, tables: str) -> tuple[Any, ...]:
    if not isinstance(value, list | tuple):
        raise q.invalid(f"{q.toml(value)} is not a variation; write a list or {tables}, and the key in quotes")
    if not value:
        raise q.invalid("the list of values is empty")
    return tuple(value)


def _refuse_slips(value: Mapping[str, Any], known: tuple[str, ...], needed: tuple[str, ...]) -> None:
    """Refuse keys that a variation does not have, and report missing ones."""
    if not set(value) & set(known):
        table = f"{{ {', '.join(needed)} }}"
        raise q.invalid(f"{q.toml(value)} is not a variation; write a list or {table}, and the key in quotes")
    for key in value:
        if key not in known:
            meant = spelling.nearest(str(key), known, most=2)
            hint = f"did you mean {meant!r}?" if meant else f"allowed are: {', '.join(known)}"
            raise q.invalid(f"unknown key {q.toml(key)}, {hint}")
    missing = [key for key in needed if key not in value]
    if missing:
        raise q.invalid(f"{' and '.join(missing)} {'is' if len(missing) == 1 else 'are'} missing")


def is_descending(value: Mapping[str, Any]) -> bool:
    """Return True if `from` and `to` are of one kind and `from` is the greater; False for what cannot be read."""
    try:
        (first, last), _ = _numbers(value, "from", "to")
    except PydanticCustomError:
        return False
    return first > last


def _scale(value: Mapping[str, Any], low: float, high: float) -> Scale:
    scale = value.get("scale", "linear")
    OneOf(("linear", "log")).read(scale)
    if scale == "log" and not (low > 0.0 and high > 0.0):
        raise q.invalid('scale = "log" needs from and to above 0', "scale")
    return "log" if scale == "log" else "linear"


def _numbers(value: Mapping[str, Any], *names: str) -> tuple[list[float], bool]:
    """Return the SI numbers of keys of one kind, and whether they are angles."""
    ends = []
    for end in (value[name] for name in names):
        if not isinstance(end, str):
            ends.append((q.Quantity(q.NUMBER).read(end), NO_DIMENSION))
            continue
        try:
            ends.append(q.parse_quantity(end, q.LENGTH))
        except ValueError as error:
            raise q.invalid(f"{q.toml(end)}: {error}") from None
    kinds = {dimension for number, dimension in ends if number != 0.0 or dimension != NO_DIMENSION}
    if len(kinds) > 1:
        *others, last = (f"{name} {q.toml(value[name])}" for name in names)
        raise q.invalid(f"{', '.join(others)} and {last} are not of one kind")
    return [number for number, _ in ends], q.ANGLE.dimension in kinds


_END: dict[str, Any] = {"type": ["number", "string"]}
_COUNT: dict[str, Any] = {"type": "integer", "minimum": 2, "maximum": MAX_VALUES}
_SPREAD = {"from": _END, "to": _END, "count": _COUNT, "scale": {"enum": ["linear", "log"]}}
_NORMAL = {"mean": _END, "sd": _END, "from": _END, "to": _END}
_TABLES = ((_SPREAD, ["from", "to"]), (_NORMAL, ["mean", "sd"]))
VALUES_SCHEMA: dict[str, Any] = {
    "anyOf": [
        {"type": "array", "minItems": 1},
        *(
            {"type": "object", "properties": table, "required": needed, "additionalProperties": False}
            for table, needed in _TABLES
        ),
    ]
}
"""JSON Schema of all values of a varied key."""


MAX_SEED = 2**53

Mode = Literal["grid", "list", "table", "lhs", "sobol", "normal"]
SAMPLED = ("lhs", "sobol", "normal")  # modes that draw `samples` values of every key
KEYS_OF = {"samples": SAMPLED, "seed": SAMPLED, "table": ("table",)}
"""Keys of [sweep] that only some modes have."""


def _existing_table(value: object, info: pydantic.ValidationInfo) -> object:
    """Resolve the path against the scenario's folder, which is the validation context, and look for it."""
    if isinstance(value, Path):
        return value
    folder = None if info.context is None else info.context["folder"]
    return table_path(value, folder, "experiments/three_blocks.csv")


TablePath = Annotated[Path, pydantic.BeforeValidator(_existing_table), PATH_SCHEMA]


class Experiment(Table):
    """Measurements to compare with."""

    table: TablePath = setting("CSV table of the experiment, relative to the scenario file")


@dataclass(frozen=True, slots=True)
class _Slip:
    """Stands for the value of a misspelt key of [sweep]."""

    meant: str


def _variation(value: object, info: pydantic.ValidationInfo) -> Variation:
    """Read what the mode allows; where the mode itself is wrong, anything that some mode allows."""
    if isinstance(value, _Slip):
        raise q.invalid(f"unknown key, did you mean {value.meant!r}?", at="key")
    mode = info.data.get("mode")
    if mode == "table":
        raise q.invalid('mode "table" takes keys and values from its table', at="key")
    is_sampled = mode in SAMPLED
    if mode is None and isinstance(value, Mapping):
        is_sampled = "count" not in value and bool({"from", "to", "mean", "sd"} & set(value))
    return _read_distribution(value) if is_sampled else _read_spread(value)


def _of_the_mode(value: object, info: pydantic.ValidationInfo) -> object:
    """Refuse a key that belongs to other modes."""
    modes = KEYS_OF[str(info.field_name)]
    mode = info.data.get("mode")
    if mode is not None and mode not in modes:
        message = f"mode {q.toml(mode)} has no key {info.field_name}, which belongs to {', '.join(map(q.toml, modes))}"
        raise q.invalid(message, at="key")
    return value


Values = Annotated[Variation, pydantic.PlainValidator(_variation), pydantic.WithJsonSchema(VALUES_SCHEMA)]


class Sweep(Table):
    """Scenario keys to vary; in the file every dotted key is a key in quotes next to `mode`."""

    mode: Annotated[Mode, OneOf(get_args(Mode))] = setting(
        "grid: every combination; list: all first values, all second values …; table: rows of a file; "
        "lhs: Latin hypercube; sobol: scrambled Sobol points; normal: independent random draws",
        "grid",
    )
    samples: Annotated[int, Whole(1, 1_000_000), pydantic.BeforeValidator(_of_the_mode)] = setting(
        "number of cases to draw (lhs, sobol, normal; sobol is balanced at powers of two)", 128
    )
    seed: Annotated[int, Whole(0, MAX_SEED), pydantic.BeforeValidator(_of_the_mode)] = setting(
        "random seed (lhs, sobol, normal)", 0
    )
    table: Annotated[TablePath | None, pydantic.BeforeValidator(_of_the_mode)] = setting(
        "CSV table of cases, relative to the scenario file: one column per key, units as in `overlap [mm]`", None
    )
    vary: dict[str, Values] = setting(
        "dotted key of the scenario, and a list, { from, to, count }, { from, to }, { mean, sd } or "
        '{ mean, sd, from, to }; scale = "log" with from and to'
    )

    @pydantic.model_validator(mode="before")
    @classmethod
    def _collect(cls, value: object) -> object:
        if not isinstance(value, Mapping) or "vary" in value:
            return value
        own = {key: entry for key, entry in value.items() if key in OWN_KEYS}
        slips = {key: spelling.nearest(str(key), OWN_KEYS, most=2) for key in value if key not in own}
        keys = {key: _Slip(meant) if meant else value[key] for key, meant in slips.items()}
        if not keys and own.get("mode") != "table":
            raise q.invalid('nothing to vary; add a line such as "contact.stiffness_scale" = [0.1, 1.0]')
        return {**own, "vary": keys}

    @pydantic.field_validator("vary")
    @classmethod
    def _lists_first(cls, vary: dict[str, Variation]) -> dict[str, Variation]:
        """Put lists before distributions, as in a resolved file: Sobol's dimensions follow the order of keys."""
        return dict(sorted(vary.items(), key=lambda entry: not isinstance(entry[1], tuple)))

    def _check(self) -> None:
        counts = {key: len(values) for key, values in self.vary.items() if isinstance(values, tuple)}
        if self.mode == "list" and len(set(counts.values())) > 1:
            told = ", ".join(f"{count} for {key}" for key, count in counts.items())
            message = f'mode "list" takes one value of every key at a time, but the numbers of values differ: {told}'
            raise q.invalid(message, "mode")
        if self.mode == "table" and self.table is None:
            raise q.invalid('mode "table" needs the path of a table, as in table = "samples.csv"', "mode")

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
