"""A scenario with all that follows from it: every answer is made once, when it is first asked for.

A scenario declares, a model knows: where blocks lie, what loads act on, how supports move, which run it is. Functions
of the rooms above take a model, or the part of it that they need; what takes long there is kept in the model too, as
`derived` marks it. A varied model validates the tables that have changed, and takes over what follows from the others.
"""

from collections.abc import Callable, Collection, Mapping
from functools import cache, partial
from hashlib import sha256
from pathlib import Path
from typing import Any, Generic, Self, TypeVar, cast

import pydantic

from blocksim.scenario import check, events, motion as motions, placement as places, resolution
from blocksim.scenario.document import Document, Source, document_of
from blocksim.scenario.models import base
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.open_faces import acting_loads
from blocksim.scenario.placement import GEOMETRY

T = TypeVar("T")
KEPT_ALONE = Scenario.model_fields.keys() - {"schema_version", "systems", "experiment", "sweep", "provenance"}
"""Tables that are valid or not whatever the others hold; relations between tables are checked afterwards."""
ANSWERS: list["Derived[Any]"] = []


class Derived(Generic[T]):
    """What follows from some tables of a scenario: made once for a model, and kept in it.

    A varied model takes the answer of its origin where none of these tables has changed.
    """

    def __init__(self, function: "Callable[[Model], T]", tables: Collection[str]) -> None:
        """Take what makes the answer, and the tables of the scenario that it follows from alone."""
        self.__doc__ = function.__doc__
        self.function, self.tables = function, frozenset(tables)
        ANSWERS.append(self)

    def __call__(self, model: "Model") -> T:
        """Return the answer for a model."""
        while model.origin is not None and self.tables.isdisjoint(model.changed):
            model = model.origin
        if self not in model.kept:
            model.kept[self] = self.function(model)
        answer: T = model.kept[self]
        return answer

    def __get__(self, model: "Model | None", _: type) -> T:
        """Return the answer where it is an attribute of a model."""
        return cast("T", self) if model is None else self(model)


def derived(*tables: str) -> "Callable[[Callable[[Model], T]], Derived[T]]":
    """Make a function of a model an answer, which follows from these tables of the scenario."""
    return partial(Derived, tables=tables)


HASHED_TEXTS: list[Derived[list[str]]] = [
    derived(table, "systems")(lambda model, table=table: resolution.hashed_texts(model.scenario, table))  # type: ignore[misc]
    for table in Scenario.model_fields
]


class Model:
    """What a scenario describes, in SI (m, kg, s, rad): its blocks as they are placed, and what acts on them.

    Parameters
    ----------
    source :
        What `blocksim.load` takes: a file, nested dictionaries in the form of a file, or a scenario.

    Attributes
    ----------
    scenario : what was declared; `document` is its text, in which mistakes are shown
    bodies : all blocks as they are placed, those of structures first; `placement` has where each comes from
    segments : straight pieces of ground and walls; none of level ground without a profile
    soils, probes : the tables of soil, and all probes by name, one of every actuator among them
    acting_loads : loads in the order of the file, those on sides of structures once a face
    settles : True where the scene comes to rest before time zero
    motion, drives : displacement of the supports over time, and motions of driven bodies
    implausible_values : a warning for each value that is hardly meant
    hash : SHA-256 (hex) of all that determines motion and output, whatever the order of the file

    Raises
    ------
    ScenarioError
        With all mistakes in the scenario.
    InputMissingError
        Where a file cannot be read.

    Examples
    --------
    >>> from blocksim import Model
    >>> model = Model("scenarios/three_blocks.toml")
    >>> [(body.name, round(body.x, 3), round(body.mass, 3)) for body in model.bodies]
    [('1', 0.016, 0.109), ('2', 0.038, 0.109), ('3', 0.06, 0.109)]
    >>> smooth = model.varied({"friction.block_block": 0.1})
    >>> smooth.bodies is model.bodies
    True
    """

    scenario: Scenario

    def __init__(self, source: Source) -> None:
        """Check the scenario, unless it has been checked; a model shares its answers."""
        if isinstance(source, Model):
            vars(self).update(vars(source))
            return
        self.kept: dict[Derived[Any], Any] = {}
        self.origin: Model | None = None  # of which this is a variation,
        self.changed: Collection[str] = ()  # by these tables
        if isinstance(source, Scenario):
            self.scenario = source
            return
        document = document_of(source)
        self.scenario, placed = document.examined()
        self.kept |= {vars(Model)["document"]: document, vars(Model)["placement"]: placed}

    @classmethod
    def stored(cls, path: Path) -> Self:
        """Take a scenario in a folder of results, which may come from somebody else: no link is followed."""
        return cls(Document.read(path, is_stored=True))

    def __repr__(self) -> str:
        """Return a line with what the scenario contains."""
        return f"<Model{repr(self.scenario).removeprefix('<Scenario')}"

    def __reduce__(self) -> tuple[type[Self], tuple[Scenario]]:
        """Leave to others, such as processes, what follows from the scenario."""
        return type(self), (self.scenario,)

    document = derived(*Scenario.model_fields)(lambda model: document_of(model.scenario))
    placement = derived(*GEOMETRY)(lambda model: places.place(model.scenario))
    bodies = derived(*GEOMETRY)(lambda model: model.placement.bodies)
    segments = derived("ground", "walls")(lambda model: places.place_segments(model.scenario))
    soils = derived("systems")(lambda model: places.soil_tables(model.scenario))
    acting_loads = derived(*GEOMETRY, "loads")(lambda model: (*acting_loads(model.scenario, model.placement),))
    motion = derived("motion", "time")(lambda model: motions.motion_pieces(model.scenario))
    drives = derived("bodies", "structures", "time", "motion")(lambda model: motions.drives_of(model.scenario))
    settles = derived(*GEOMETRY, "start", "motion", "time")(lambda model: motions.settles(model.scenario, model.bodies))
    probes = derived("probes", "actuators")(lambda model: events.probes_of(model.scenario))
    implausible_values = derived(*Scenario.model_fields)(
        lambda model: check.implausible_values(model.scenario, model.bodies)
    )
    hash = derived(*Scenario.model_fields)(
        lambda me: sha256(b"{%b}" % ",".join(sorted(t for of in HASHED_TEXTS for t in of(me))).encode()).hexdigest()
    )

    def varied(self, settings: Mapping[str, object]) -> "Model":
        """Return a model with other values; what follows from other tables of the scenario is shared with this one.

        Parameters
        ----------
        settings :
            Values by dotted key, numbers in SI or strings with a unit; tables lie where those of the file may.

        Raises
        ------
        ScenarioError
            Where a key leads nowhere, or a scenario with these values is not valid: with the mistakes that are found
            when it is loaded.
        """
        changed = self.document.with_values(settings)
        tables = {str(one.path[0]) for one in changed.overrides[len(self.document.overrides) :]}
        return self._with_tables(changed, tables) or Model(changed)

    def _with_tables(self, changed: Document, tables: set[str]) -> "Model | None":
        """Return a model with some tables of a document; None where all tables have to be validated together.

        So messages about mistakes are made in one place.
        """
        moves_end = self.scenario.actuators and tables & {"time", "actuators"}  # which follows from the actuators
        if moves_end or not tables <= KEPT_ALONE:
            return None
        context = {"folder": changed.folder}
        given = {name: {name: changed.data[name]} if name in changed.data else {} for name in tables}
        try:
            with changed.file_access():
                read = {name: _alone(name).model_validate(one, context=context) for name, one in given.items()}
        except pydantic.ValidationError:
            return None
        parts = {name: getattr(one, name) for name, one in read.items()}
        model = Model(self.scenario.model_copy(update=parts))
        is_changed_again = self.origin is not None and tables.issuperset(self.changed)
        model.origin, model.changed = self.origin if is_changed_again else self, tables
        model.kept[vars(Model)["document"]] = changed
        with changed.file_access():
            mistakes = check.mistakes_among(
                changed.data, changed.folder, model.scenario, lambda: model.placement, tables
            )
            return None if any(True for _ in mistakes) else model


@cache
def _alone(name: str) -> type[base.Table]:
    """Return a table that has one of the fields of a scenario."""
    info = Scenario.model_fields[name]
    fields: dict[str, Any] = {name: (info.annotation, info)}
    return pydantic.create_model("Scenario", __base__=base.Table, **fields)
