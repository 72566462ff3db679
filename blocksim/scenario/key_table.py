"""The table of all scenario keys and their defaults in scenarios/README.md, written from the models."""

import re
import sys
import typing
from collections.abc import Iterator
from pathlib import Path

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from blocksim.scenario.models.base import HELD, SYSTEMS
from blocksim.scenario.models.contact import Contact, Friction, Pair, PairFriction, Restitution
from blocksim.scenario.models.geometry import Block, BodySpec, Ground, Material, Wall
from blocksim.scenario.models.loads import HISTORIES, LOADS, Load
from blocksim.scenario.models.motion import OWN_DRIVES
from blocksim.scenario.models.record import MOTIONS
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.models.stepping import PROBES, SCHEMES, Event, NewVelocity, Output, Probe, Start, Time
from blocksim.scenario.models.study import Experiment, Sweep
from blocksim.scenario.overrides import options, si_unit
from blocksim.scenario.structures import KINDS, Structure

BEGIN = "<!-- keys: written by `make readme` -->"
END = "<!-- end of keys -->"
HEAD = "| key | unit | default | meaning |\n| --- | --- | --- | --- |"
SHARED = (Structure, Load, Time, Probe)
"""What kinds of a table have in common, listed once."""


def key_table() -> str:
    """Return all keys as a Markdown table: key, SI unit, default, meaning."""
    sections: list[tuple[str, type[BaseModel]]] = [
        ("", Scenario),
        ("materials.NAME", Material),
        ("blocks.NAME", Block),
        ("structures, every kind", Structure),
        *((f'structures, kind = "{kind}"', model) for kind, model in KINDS.items()),
        ("bodies", BodySpec),
        *((f'bodies.motion, kind = "{kind}"', model) for kind, model in OWN_DRIVES.items()),
        ("ground", Ground),
        ("walls", Wall),
        *((f'motion, kind = "{kind}"', model) for kind, model in MOTIONS.items()),
        ("events", Event),
        ("events.velocity", NewVelocity),
        ("loads, every kind", Load),
        *((f'loads, kind = "{kind}"', model) for kind, model in LOADS.items()),
        *((f'loads.history, kind = "{kind}"', model) for kind, model in HISTORIES.items()),
        ("start", Start),
        ("friction", Friction),
        ("friction.PAIR", PairFriction),
        ("pairs.A.B", Pair),
        ("contact", Contact),
        ("contact.restitution", Restitution),
        ("time", Time),
        *((f'time, scheme = "{scheme}"', model) for scheme, model in SCHEMES.items()),
        ("output", Output),
        ("probes, every kind", Probe),
        *((f'probes, kind = "{kind}"', model) for kind, model in PROBES.items()),
        ("experiment", Experiment),
        ("sweep", Sweep),
        *SYSTEMS.items(),
    ]
    rows = [row for prefix, model in sections for row in _rows(prefix, model)]
    return "\n".join([HEAD, *rows])


def with_part(text: str, begin: str, part: str, end: str) -> str:
    """Return a page with what stands between two marks replaced."""
    marked = re.compile(f"{re.escape(begin)}.*{re.escape(end)}", re.DOTALL)
    return marked.sub(lambda _: f"{begin}\n{part}\n{end}", text)


def _rows(prefix: str, model: type[BaseModel]) -> Iterator[str]:
    place, _, note = prefix.partition(", ")
    shared = next((base.model_fields for base in SHARED if issubclass(model, base) and model is not base), {})
    for name, info in model.model_fields.items():
        has_rows_of_its_own = _is_table(info) and model not in {Friction, Pair, Sweep} and name != "provenance"
        if name == "kind" or info.alias == HELD or name in shared or has_rows_of_its_own:
            continue
        key = f"{place}.{info.alias or name}" if place else (info.alias or name)
        if model is Sweep and name == "vary":
            key = 'sweep."KEY"'
        where = f" ({note})" if note else ""
        default = f"`{info.default.static}`" if model is Friction else _default(info)
        yield f"| `{key}`{where} | {si_unit(info)} | {default} | {info.description} |"


def _is_table(info: FieldInfo) -> bool:
    kind = typing.get_origin(info.annotation) or info.annotation
    is_model = (
        isinstance(kind, type) and issubclass(kind, dict | tuple | BaseModel) and "Speed" not in str(info.annotation)
    )
    parts = list(options(info.annotation))
    optional = len(parts) > 1 and any(isinstance(part, type) and issubclass(part, BaseModel) for part in parts)
    has_values = re.search(r"\b(float|int)\b|tuple\[str", str(info.annotation)) is not None
    return (is_model and not has_values) or optional or "Any" in str(info.annotation)


def _default(info: FieldInfo) -> str:
    if info.is_required():
        return "**required**"
    value = info.default
    if value is None or value is PydanticUndefined or info.default_factory is not None:  # explained by the meaning
        return "–"
    if isinstance(value, bool):
        return str(value).lower()
    return f"`{value}`" if value not in ("", ()) else "empty"


if __name__ == "__main__":
    readme = Path(sys.argv[1])
    readme.write_text(with_part(readme.read_text(encoding="utf-8"), BEGIN, key_table(), END), encoding="utf-8")
