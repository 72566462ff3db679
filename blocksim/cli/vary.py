"""Reading --vary KEY=VALUES."""

import tomllib
from collections.abc import Sequence

from pydantic import ValidationError

from blocksim.errors import InvalidInputError
from blocksim.scenario.models.study import Sweep

RANGE_PARTS = 3


def parse_vary(texts: Sequence[str]) -> dict[str, tuple[object, ...]]:
    """Return the values of every key from texts such as `key=a,b,c` and `key=from:to:count`.

    Raises InvalidInputError, naming the text.
    """
    return dict(_parse_one(text) for text in texts)


def _parse_one(text: str) -> tuple[str, tuple[object, ...]]:
    key, equals, values = text.partition("=")
    key = key.strip()
    if not equals or not key or not values.strip():
        message = f"--vary {text}: write KEY=a,b,c or KEY=from:to:count"
        raise InvalidInputError(message)
    parts = values.split(":")
    if len(parts) != RANGE_PARTS:
        return key, tuple(_value(part) for part in values.split(","))
    spread = {"from": _value(parts[0]), "to": _value(parts[1]), "count": _value(parts[2])}
    try:
        return key, Sweep.model_validate({"vary": {key: spread}}).vary[key]
    except ValidationError as error:
        message = f"--vary {text}: {error.errors()[0]['msg']}"
        raise InvalidInputError(message) from None


def _value(text: str) -> object:
    """Return a TOML value, or the bare text (such as 5 mm/s) where it is none."""
    text = text.strip()
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text
