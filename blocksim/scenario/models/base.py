"""Common base of all tables of a scenario, of those of further systems, and field types that are not quantities."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self, get_args

import pydantic
from pydantic import Field
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import PydanticUndefined

from blocksim.scenario import input_files, spelling, units

if TYPE_CHECKING:
    from blocksim.scenario.models.scenario import Scenario
    from blocksim.scenario.placement import PlacedBody


class Table(pydantic.BaseModel):
    """One TOML table: frozen, no unknown keys, no silent conversions."""

    model_config = pydantic.ConfigDict(frozen=True, strict=True, extra="forbid", allow_inf_nan=False)

    @pydantic.model_validator(mode="after")
    def _checked(self) -> Self:
        self._check()
        return self

    def _check(self) -> None:
        """Raise pydantic's error where values do not go together, each valid by itself."""


def setting(description: str, default: Any = PydanticUndefined, **more: Any) -> Any:
    """Return the field of a key: its meaning and its default, without which it is required; the rest as for Field."""
    return Field(default=default, description=description, **more)


POSITIVE_TIME = units.Quantity(units.TIME, above=0.0)


@dataclass(frozen=True)
class OneOf(units.FieldReader):
    """Annotation of a literal field: the words that are available."""

    available: tuple[str | int, ...]

    @property
    def wanted(self) -> str:
        """Return what is allowed."""
        return " or ".join(units.toml(word) for word in self.available)

    def read(self, value: object) -> object:
        """Pass an available word; raises a pydantic error that lists the available words."""
        if type(value) in (str, int) and value in self.available:
            return value
        words = [word for word in self.available if isinstance(word, str)]
        similar = spelling.nearest(value, words, most=2) if isinstance(value, str) else None
        hint = f"did you mean {units.toml(similar)}?" if similar else f"use {self.wanted}"
        raise units.invalid(f"{units.toml(value)} is unknown, {hint}")

    def json_schema(self, usual: JsonSchemaValue) -> JsonSchemaValue:
        """Return the JSON Schema with the words, which a literal has by itself."""
        return usual if {"enum", "const"} & usual.keys() else {**usual, "enum": [*self.available]}


@dataclass(frozen=True)
class TimeOr(units.FieldReader):
    """Annotation of a time above 0 (s) or one word; `what` it is stands in messages."""

    word: str
    what: str

    def read(self, value: object) -> object:
        """Pass the word, or read the time; raises a pydantic error."""
        if isinstance(value, str) and not any(letter.isdigit() for letter in value):
            if value == self.word:
                return value
            raise units.invalid(f'{units.toml(value)} is not {self.what}; use "{self.word}" or {POSITIVE_TIME.wanted}')
        return POSITIVE_TIME.read(value)

    def json_schema(self, usual: JsonSchemaValue) -> JsonSchemaValue:
        """Return the JSON Schema of both."""
        number, _ = usual["anyOf"]
        return {"anyOf": [{"const": self.word}, *POSITIVE_TIME.json_schema(number)["anyOf"]]}


@dataclass(frozen=True)
class Whole(units.FieldReader):
    """Annotation of a whole number in a range."""

    least: int
    most: int

    def read(self, value: object) -> object:
        """Pass a whole number in the range; raises a pydantic error."""
        if isinstance(value, bool) or not isinstance(value, int) or not self.least <= value <= self.most:
            text, bare = str(value).strip().removesuffix(".0"), ", without quotes" if isinstance(value, str) else ""
            is_whole = not isinstance(value, bool | int) and text.lstrip("-").isdecimal()
            how = f"; write {text[: units.MAX_SHOWN]}{bare}" if is_whole else ""
            raise units.invalid(f"{units.toml(value)} is not a whole number from {self.least} to {self.most}{how}")
        return value

    def json_schema(self, usual: JsonSchemaValue) -> JsonSchemaValue:
        """Return the JSON Schema with the range."""
        return {**usual, "minimum": self.least, "maximum": self.most}


def by_kind(union: Any) -> dict[str, type[Any]]:
    """Return the tables of an annotated union by their kind, as written in a scenario."""
    tables = get_args(get_args(union)[0])
    return {word: table for table in tables for word in get_args(table.model_fields["kind"].annotation)}


def require_one(missing: str, **values: object) -> None:
    """Raise pydantic's error unless exactly one of some keys has a value; `missing` is the message for none."""
    given = [key for key, value in values.items() if value is not None]
    if not given:
        raise units.invalid(missing)
    if len(given) > 1:
        raise units.invalid(f"{' and '.join(given)} are both given; keep one of them", given[-1])


PATH_SCHEMA = pydantic.WithJsonSchema({"type": "string", "minLength": 1})
"""Of the path of a file, for editors."""


def table_path(value: object, folder: Path | str | None, example: str, *key: str) -> Path:
    """Return the file that a key names, found from a folder, or unchecked without one; raises a pydantic error.

    The key is given where a whole table is read, not its value alone.
    """
    if not isinstance(value, str) or not value or "\0" in value:
        raise units.invalid(f"{units.toml(value)} is not the path of a table, such as {units.toml(example)}", *key)
    if folder is None:
        return Path(value)
    try:
        return input_files.table_in(folder, value)
    except input_files.OutOfReachError as error:
        raise units.invalid(str(error), *key) from None


def _identifier(value: object) -> object:
    if not isinstance(value, str):
        raise units.invalid(f"{units.toml(value)} is not a string in quotes")
    allowed = value.isascii() and all(c.isalnum() or c in "._-" for c in value)
    if not allowed or not 1 <= len(value) <= MAX_NAME or value[0] in ".-" or value[-1] == ".":
        characters = f"1 to {MAX_NAME} of a-z A-Z 0-9 . _ - are allowed, no . or - first, no . last"
        raise units.invalid(f"{units.toml(value)} is not a name; {characters}")
    return value


MAX_NAME = 100
Identifier = Annotated[
    str,
    pydantic.BeforeValidator(_identifier),
    Field(json_schema_extra={"pattern": "^[A-Za-z0-9_]([A-Za-z0-9._-]{0,98}[A-Za-z0-9_-])?$"}),
]
"""A name that can be a folder or a table cell on every system."""


HELD = "(systems)"
"""Where a scenario keeps the tables of all systems; no key that a file could have."""


class SystemTable(Table):
    """One entry of the tables of a system; every system adds its own keys."""

    declared_in: ClassVar[str]  # module:name of its blocksim.world.systems.system.System

    def impossible(
        self,
        scenario: "Scenario",  # noqa: ARG002 - for those of systems
        placed: "Sequence[PlacedBody]",  # noqa: ARG002 - for those of systems
    ) -> Iterator[tuple[str, str]]:
        """Yield keys and what is wrong with them, although every value is valid by itself."""
        yield from ()


SYSTEMS: dict[str, type[SystemTable]] = {}  # table of a scenario and its model


def read_tables(held: Any, info: pydantic.ValidationInfo) -> dict[str, tuple[SystemTable, ...]]:
    """Return the validated tables of all systems; raises pydantic's error, with their places."""
    several: Any = tuple  # of which type follows at run time
    fields: dict[str, Any] = {name: (several[SYSTEMS[name], ...], ...) for name in held}
    read = pydantic.create_model("Systems", __base__=Table, **fields).model_validate(held, context=info.context)
    return {name: getattr(read, name) for name in held}
