"""The whole scenario, and its JSON Schema."""

from collections.abc import Mapping
from html import escape
from typing import Annotated, Any, Literal, Self

import pydantic
from pydantic.json_schema import SkipJsonSchema

from blocksim.notebook import Shown
from blocksim.scenario import units as q
from blocksim.scenario.models.actuators import Actuator, stretches_of
from blocksim.scenario.models.base import HELD, SYSTEMS, Identifier, OneOf, SystemTable, Table, read_tables, setting
from blocksim.scenario.models.contact import Contact, Friction, Pair, Strength
from blocksim.scenario.models.geometry import Block, BodySpec, Ground, Material, Wall
from blocksim.scenario.models.gravity import GravityField
from blocksim.scenario.models.loads import AnyLoad
from blocksim.scenario.models.motion import AnyMotion
from blocksim.scenario.models.study import Experiment, Sweep
from blocksim.scenario.models.timeline import AnyProbe, AnyTime, Event, Explicit, Output, Start
from blocksim.scenario.structures import AnyStructure

DIALECT = "https://json-schema.org/draft/2020-12/schema"


class Scenario(Shown, Table):
    """Complete input of one simulation, in SI.

    Build it with `load_scenario` or `scenario_from_mapping`, which also check what no single table can know:
    that named blocks and materials exist and that no bodies overlap.
    """

    schema_version: Annotated[Literal[1], OneOf((1,))] = setting("version of the file format", alias="schema")
    name: Identifier = setting("name of the scenario and of its results folder")
    description: str = setting("free text", "")
    gravity: Annotated[GravityField, q.ACCELERATION] = setting("gravity and its coefficients", GravityField())
    materials: dict[Identifier, Material] = setting("materials by name, as in [materials.aluminium]")
    blocks: dict[Identifier, Block] = setting("blocks by name, as in [blocks.brick]", {})
    structures: tuple[AnyStructure, ...] = setting("generators of bodies", ())
    bodies: tuple[BodySpec, ...] = setting("single bodies", ())
    ground: Ground = setting("the ground", Ground())
    walls: tuple[Wall, ...] = setting("straight segments of boundary, in addition to the ground", ())
    motion: AnyMotion | None = setting("prescribed motion of ground, walls and fixed bodies", None)
    events: tuple[Event, ...] = setting("what happens to bodies and walls during the run", ())
    loads: tuple[AnyLoad, ...] = setting("loads on bodies, and on all of them", ())
    actuators: tuple[Actuator, ...] = setting("jacks that move points of bodies", ())
    start: Start = setting("what happens before time zero", Start())
    friction: Friction = setting("friction between blocks and with the ground", Friction())
    pairs: dict[str, dict[str, Pair]] = setting("pairs of materials that differ, as in [pairs.aluminium.ground]", {})
    strength: Strength = setting("factor by which strength is divided", Strength())
    contact: Contact = setting("contact model and its numbers", Contact())
    time: AnyTime = setting("time stepping", Explicit())
    output: Output = setting("what is recorded", Output())
    probes: tuple[AnyProbe, ...] = setting("time histories to record", ())
    experiment: Experiment | None = setting("measurements to compare with", None)
    sweep: Sweep | None = setting("what `blocksim sweep` varies", None)
    provenance: dict[str, str] = setting(
        "where values come from: dotted key and text, for calibrated or assumed values", {}
    )

    systems: SkipJsonSchema[
        Annotated[dict[str, tuple[pydantic.SerializeAsAny[SystemTable], ...]], pydantic.BeforeValidator(read_tables)]
    ] = setting("tables of systems beside blocks and supports, by their name", {}, alias="(systems)")

    @pydantic.model_validator(mode="before")
    @classmethod
    def _with_systems(cls, data: object) -> object:
        if not isinstance(data, Mapping) or not any(name in SYSTEMS for name in data):
            return data
        held = {name: entry for name, entry in data.items() if name in SYSTEMS}
        return {**{key: entry for key, entry in data.items() if key not in held}, HELD: held}

    @pydantic.model_validator(mode="after")
    def _until_heads_stop(self) -> Self:
        if self.actuators and "end" not in self.time.model_fields_set:
            end = max(stretches_of(one.displacement)[-1].start for one in self.actuators)
            time = self.time.model_copy(update={"end": end})
            object.__setattr__(self, "time", time)  # the table is frozen
        return self

    @pydantic.model_serializer(mode="wrap")
    def _without_systems(self, write: pydantic.SerializerFunctionWrapHandler) -> dict[str, Any]:
        data: dict[str, Any] = write(self)
        systems: dict[str, Any] = data.pop(HELD, data.pop("systems", {}))
        return data | systems

    def __repr__(self) -> str:
        """Return a line with the name and the contents; all values are in `scenario_to_toml`."""
        parts: list[str] = [*(structure.kind for structure in self.structures), *self.systems]
        if self.bodies:
            parts.append(f"{len(self.bodies)} single {'body' if len(self.bodies) == 1 else 'bodies'}")
        return f"<Scenario {self.name}: {', '.join(parts)}; scheme {self.time.scheme}>"

    def _repr_html_(self) -> str:
        """Return the same line, blocks and materials, all values as in a file, and the start, for notebooks."""
        from blocksim.scenario.resolution import scenario_to_toml  # noqa: PLC0415 - needs this model

        rows = ""
        for name, block in self.blocks.items():
            size = "shaped by its structure" if block.size_x == 0.0 else f"{block.size_x:g} × {block.size_y:g} m"
            cells = name, size, f"{block.depth:g} m deep", block.material
            rows += f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in cells)}</tr>"
        values = f"<details><summary>all values</summary><pre>{escape(scenario_to_toml(self))}</pre></details>"
        return f"<p>{escape(repr(self)[1:-1])}</p><table>{rows}</table>{values}{super()._repr_html_()}"


def json_schema() -> dict[str, Any]:
    """Describe the file for editors and other programs: quantities as SI numbers or as strings with a unit."""
    found = Scenario.model_json_schema(by_alias=True, mode="validation")
    for name, table in SYSTEMS.items():
        items = table.model_json_schema(by_alias=True)
        found["properties"][name] = {"type": "array", "description": items["description"], "items": items}
    return {"$schema": DIALECT, **found}
