"""The table of all scenario keys and their defaults in scenarios/README.md, written from the models."""

import re
import sys
import typing
from collections.abc import Iterator
from pathlib import Path

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from blocksim.scenario.models import actuators, contact, geometry, gravity, loads, motion, scenario, study, timeline
from blocksim.scenario.models.base import HELD, SYSTEMS
from blocksim.scenario.overrides import options, si_unit
from blocksim.scenario.structures import KINDS
from blocksim.scenario.structures.base import Structure
from blocksim.scenario.structures.masonry import Opening
from tests.verification.reference import with_part

BEGIN = "<!-- keys: written by `make readme` -->"
END = "<!-- end of keys -->"
HEAD = "| key | unit | default | meaning |\n| --- | --- | --- | --- |"
SPELT = {contact.Friction, contact.Pair, contact.Strength, study.Sweep}  # whose tables and lists have rows here
SHARED = (Structure, loads.Load, timeline.Time, timeline.Probe)
"""What kinds of a table have in common, listed once."""


def key_table() -> str:
    """Return all keys as a Markdown table: key, SI unit, default, meaning."""
    sections: list[tuple[str, type[BaseModel]]] = [
        ("", scenario.Scenario),
        ("gravity", gravity.GravityField),
        ("materials.NAME", geometry.Material),
        ("blocks.NAME", geometry.Block),
        ("structures, every kind", Structure),
        *((f'structures, kind = "{kind}"', model) for kind, model in KINDS.items()),
        ("structures.openings", Opening),
        ("bodies", geometry.BodySpec),
        *((f'bodies.motion, kind = "{kind}"', model) for kind, model in motion.OWN_DRIVES.items()),
        ("ground", geometry.Ground),
        ("walls", geometry.Wall),
        *((f'motion, kind = "{kind}"', model) for kind, model in motion.MOTIONS.items()),
        ("events", timeline.Event),
        ("events.velocity", timeline.NewVelocity),
        ("loads, every kind", loads.Load),
        *((f'loads, kind = "{kind}"', model) for kind, model in loads.LOADS.items()),
        *((f'loads.history, kind = "{kind}"', model) for kind, model in loads.HISTORIES.items()),
        ("actuators", actuators.Actuator),
        *((f'actuators.displacement, kind = "{kind}"', model) for kind, model in actuators.PATHS.items()),
        ("start", timeline.Start),
        ("friction", contact.Friction),
        ("friction.PAIR", contact.PairFriction),
        ("pairs.A.B", contact.Pair),
        ("strength", contact.Strength),
        ("contact", contact.Contact),
        ("contact.restitution", contact.Restitution),
        ("time", timeline.Time),
        *((f'time, scheme = "{scheme}"', model) for scheme, model in timeline.SCHEMES.items()),
        ("output", timeline.Output),
        ("probes, every kind", timeline.Probe),
        *((f'probes, kind = "{kind}"', model) for kind, model in timeline.PROBES.items()),
        ("experiment", study.Experiment),
        ("sweep", study.Sweep),
        *SYSTEMS.items(),
    ]
    rows = [row for prefix, model in sections for row in _rows(prefix, model)]
    return "\n".join([HEAD, *rows])


def _rows(prefix: str, model: type[BaseModel]) -> Iterator[str]:
    place, _, note = prefix.partition(", ")
    shared = next((base.model_fields for base in SHARED if issubclass(model, base) and model is not base), {})
    for name, info in model.model_fields.items():
        if name in {"kind", *shared} or info.alias == HELD:
            continue
        if _is_table(info) and name != "provenance" and model not in SPELT:
            continue  # it has rows of its own
        key = f"{place}.{info.alias or name}" if place else (info.alias or name)
        if model is study.Sweep and name == "vary":
            key = 'sweep."KEY"'
        where = f" ({note})" if note else ""
        default = f"`{info.default.static}`" if model is contact.Friction else _default(info)
        yield f"| `{key}`{where} | {si_unit(info)} | {default} | {info.description} |"


def _is_table(info: FieldInfo) -> bool:
    kind = typing.get_origin(info.annotation) or info.annotation
    is_model = isinstance(kind, type) and issubclass(kind, dict | tuple | BaseModel)
    is_model &= "Speed" not in str(info.annotation)
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
