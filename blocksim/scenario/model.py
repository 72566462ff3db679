"""A scenario with all that follows from it: every answer is made once, when it is first asked for.

A scenario declares, a model knows: where blocks lie, what loads act on, how supports move, which run it is. Functions
of the rooms above take a model, or the part of it that they need; what takes long there is kept in the model too, as
`derived` marks it. A varied model validates the tables that have changed, and takes over what follows from the others.
"""

import functools
from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Any, Self, TypeVar

import pydantic

from blocksim.scenario import check, events, motion as motions, placement as places, resolution
from blocksim.scenario.document import Document, Source, document_of
from blocksim.scenario.models import base
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.models.soil import SoilTable
from blocksim.scenario.models.timeline import AnyProbe
from blocksim.scenario.open_faces import ActingLoad, acting_loads
from blocksim.scenario.placement import GEOMETRY, PlacedBody, PlacedSegment, Placement

T = TypeVar("T")
KEPT_ALONE = Scenario.model_fields.keys() - {"schema_version", "systems", "experiment", "sweep", "provenance"}
"""Tables that are valid or not whatever the others hold; relations between tables are checked afterwards."""
ANSWERS: list[Callable[["Model"], Any]] = []


def derived(*tables: str) -> Callable[[Callable[["Model"], T]], Callable[["Model"], T]]:
    """Keep what a function of a model returns in the model; it follows from these tables of the scenario alone.

    A varied model takes the answer of its origin where none of them has changed.
    """
    follows_from = frozenset(tables)

    def of_function(function: Callable[["Model"], T]) -> Callable[["Model"], T]:
        @functools.wraps(function)
        def answer(model: "Model") -> T:
            origin = model.origin
            if origin is not None and follows_from.isdisjoint(model.changed):
                return answer(origin)
            if answer not in model.kept:
                model.kept[answer] = function(model)
            value: T = model.kept[answer]
            return value

        vars(answer)["follows_from"] = follows_from
        ANSWERS.append(answer)
        return answer

    return of_function


class Model:
    """What a scenario describes, in SI (m, kg, s, rad): its blocks as they are placed, and what acts on them.

    Parameters
    ----------
    source :
        What `blocksim.load` takes: a file, nested dictionaries in the form of a file, or a scenario.

    Raises
    ------
    ScenarioError
        With all mistakes in the scenario.
    InputMissingError
        Where a file cannot be read.

    Examples
    --------
    >>> model = Model({
    ...     "schema": 1,
    ...     "name": "two bricks",
    ...     "materials": {"clay": {"density": 1800.0, "young_modulus": "5 GPa", "poisson_ratio": 0.2}},
    ...     "blocks": {"brick": {"width": 0.2, "height": 0.1, "depth": 0.1, "material": "clay"}},
    ...     "structures": [{"kind": "stack", "block": "brick", "count": 2}],
    ... })
    >>> [(body.name, body.mass, body.y) for body in model.bodies]
    """

    scenario: Scenario

    def __init__(self, source: "Source | Model") -> None:
        """Check the scenario, unless it has been checked; a model shares its answers."""
        if isinstance(source, Model):
            vars(self).update(vars(source))
            return
        self.kept: dict[Callable[[Model], Any], Any] = {}  # answers
        self.origin: Model | None = None  # of which this is a variation,
        self.changed: Collection[str] = ()  # by these tables
        self._document: Document | None = None
        if isinstance(source, Scenario):
            self.scenario = source
            return
        self._document = document_of(source)
        self.scenario, placed = self._document.examined()
        self.kept[Model._placement] = placed

    @classmethod
    def stored(cls, path: Path) -> Self:
        """Take a scenario in a folder of results, which may come from somebody else: no link is followed."""
        return cls(Document.read(path, is_stored=True))

    def __repr__(self) -> str:
        """Return a line with what the scenario contains."""
        return f"<Model{repr(self.scenario).removeprefix('<Scenario')}"

    def __getstate__(self) -> object:
        """Leave to others, such as processes, what follows from the scenario."""
        return self.scenario

    def __setstate__(self, scenario: Scenario) -> None:
        """Take a scenario that has been checked."""
        self.__init__(scenario)  # type: ignore[misc]

    @property
    def document(self) -> Document:
        """The text of the scenario, in which mistakes are shown."""
        if self._document is None:
            self._document = document_of(self.scenario)
        return self._document

    @derived(*GEOMETRY)
    def _placement(self) -> Placement:
        return places.place(self.scenario)

    @property
    def placement(self) -> Placement:
        """All blocks, and the structure or single body that each comes from."""
        return self._placement()

    @property
    def bodies(self) -> tuple[PlacedBody, ...]:
        """All blocks as they are placed: those of structures first, in the order of the file."""
        return self.placement.bodies

    @property
    @derived("ground", "walls")
    def segments(self) -> tuple[PlacedSegment, ...]:
        """Straight pieces of ground and walls; none of level ground without a profile."""
        return places.place_segments(self.scenario)

    @property
    def soils(self) -> list[SoilTable]:
        """The soils of the scenario."""
        return places.soil_tables(self.scenario)

    @property
    @derived(*GEOMETRY, "loads")
    def acting_loads(self) -> tuple[ActingLoad, ...]:
        """Loads in the order of the file, those on sides of structures once a face."""
        return tuple(acting_loads(self.scenario, self.placement))

    @property
    @derived("motion", "time")
    def motion(self) -> motions.MotionPieces:
        """Displacement of the supports over time."""
        return motions.motion_pieces(self.scenario)

    @property
    @derived("bodies", "structures", "time", "motion")
    def drives(self) -> tuple[motions.Drive, ...]:
        """Motions of driven bodies, in the order of the bodies."""
        return motions.drives_of(self.scenario)

    @property
    @derived("probes", "actuators")
    def probes(self) -> dict[str, AnyProbe]:
        """All probes by name: those of the file, and one of every actuator."""
        return events.probes_of(self.scenario)

    @property
    @derived(*Scenario.model_fields)
    def implausible_values(self) -> list[str]:
        """A warning for each value that is hardly meant."""
        return check.implausible_values(self.scenario, self.bodies)

    @property
    def hash(self) -> str:
        """SHA-256 (hex) of all that determines motion and output, as `scenario_hash` has it."""
        return resolution.hash_of_texts(texts(self) for texts in HASHED_TEXTS)

    def varied(self, settings: Mapping[str, object]) -> "Model":
        """Return a model with other values; what follows from other tables of the scenario is shared with this one.

        Parameters
        ----------
        settings :
            Values by dotted key, numbers in SI or strings with a unit, as in `blocksim.replace`.

        Raises
        ------
        ScenarioError
            Where a key leads nowhere, or a scenario with these values is not valid: with the mistakes that are found
            when it is loaded.

        Examples
        --------
        >>> smooth = model.varied({"friction.block_block": 0.1})
        >>> smooth.scenario.friction.block_block.kinetic
        0.1
        >>> smooth.bodies is model.bodies
        True
        """
        changed = self.document.with_values(settings)
        tables = {str(one.path[0]) for one in changed.overrides[len(self.document.overrides) :]}
        return self._with_tables(changed, tables) or Model(changed)

    def _with_tables(self, changed: Document, tables: set[str]) -> "Model | None":
        """Return a model with some tables of a document; None where all tables have to be validated together.

        So messages about mistakes are made in one place.
        """
        moves_end = self.scenario.actuators and tables & {"time", "actuators"}  # which follows from the actuators
        if moves_end or self.scenario.sweep is not None or not tables <= KEPT_ALONE:
            return None
        try:
            with changed.file_access():
                parts = {name: _table_of(name, changed) for name in tables}
        except pydantic.ValidationError:
            return None
        model = Model(self.scenario.model_copy(update=parts))
        model._document, model.origin, model.changed = changed, self, tables
        mistakes = check.mistakes_among(changed.data, model.scenario, model._placement, tables)
        return None if any(True for _ in mistakes) else model


def _hashed_texts(table: str) -> Callable[[Model], list[str]]:
    return derived(table)(lambda model: resolution.hashed_texts(model.scenario, table))


HASHED_TEXTS = [_hashed_texts(table) for table in Scenario.model_fields]


@functools.cache
def _alone(name: str) -> type[base.Table]:
    """Return a table that has one of the fields of a scenario."""
    info = Scenario.model_fields[name]
    fields: dict[str, Any] = {name: (info.annotation, info)}
    return pydantic.create_model("Scenario", __base__=base.Table, **fields)


def _table_of(name: str, changed: Document) -> Any:
    """Return one validated field of a scenario. Raises pydantic's error."""
    data = {name: changed.data[name]} if name in changed.data else {}
    return getattr(_alone(name).model_validate(data, context={"folder": changed.folder}), name)
