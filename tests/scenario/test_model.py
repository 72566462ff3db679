"""Models: varied ones are what loading gives, share what has not changed, and say the same about mistakes."""

import pickle
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

from blocksim.errors import ScenarioError
from blocksim.scenario import Document, Model, Scenario, model as models, placement, start
from blocksim.world import bodies, excitation, systems  # noqa: F401 - they declare answers too

SCENARIOS = Path(__file__).parents[2] / "scenarios"
FEW = 60  # blocks: the same keys in larger scenarios take longer
SHIPPED = sorted(SCENARIOS.glob("*.toml"))
RAISED = {"true": "false", "linear": "hertz-mindlin", "surface": "kernel"}


def small_ones() -> Iterator[Any]:
    """Yield shipped scenarios of few blocks."""
    for path in SHIPPED:
        bare = Document.read(path).without_sweep()
        if len(Model(bare).bodies) <= FEW:
            yield pytest.param(bare, id=path.stem)


def leaves(data: object, path: tuple[str, ...] = ()) -> Iterator[tuple[str, object]]:
    """Yield the dotted keys of data, and another value for each."""
    if isinstance(data, Mapping):
        for key, value in data.items():
            yield from leaves(value, (*path, str(key)))
    elif isinstance(data, tuple):
        for number, value in enumerate(data):
            yield from leaves(value, (*path, str(number)))
    elif isinstance(data, bool):
        yield ".".join(path), not data
    elif isinstance(data, int | float):
        yield ".".join(path), 1.25 * data
        yield ".".join(path), -1.0
    elif isinstance(data, str):
        size, _, unit = data.partition(" ")
        yield ".".join(path), f"{1.25 * float(size)} {unit}" if size.replace(".", "").isdigit() else f"{data}x"


def built(document: Document, settings: Mapping[str, object]) -> Model | str:
    """Return what loading a document with other values gives, or what it says."""
    try:
        return Model(document.with_values(settings).build())
    except ScenarioError as error:
        return str(error)


@pytest.mark.parametrize("bare", [*small_ones()])
def test_varied_model_is_what_loading_with_other_values_gives(bare: Document) -> None:
    base = Model(bare)
    for key, value in leaves(bare.data):
        expected, said, varied = built(bare, {key: value}), "", base
        try:
            varied = base.varied({key: value})
        except ScenarioError as error:
            said = str(error)
        if isinstance(expected, str):
            assert said == expected
            continue
        assert not said, key
        assert varied.scenario == expected.scenario, key
        assert varied.hash == Model(expected.scenario).hash, key
        assert varied.bodies == expected.bodies, key
        assert (varied.origin is base) == (key.partition(".")[0] in models.KEPT_ALONE), key


class Recorded(Scenario):
    """A scenario that knows which of its tables somebody has looked at."""

    def __getattribute__(self, name: str) -> Any:
        value = super().__getattribute__(name)
        if name in Scenario.model_fields:
            looked_at.add(name)
        return value


looked_at: set[str] = set()


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_answers_and_checks_look_at_no_other_tables_than_they_declare(path: Path) -> None:
    scenario = Model(Document.read(path).without_sweep()).scenario
    recorded = Recorded.model_construct(scenario.model_fields_set, **dict(scenario))
    for answer in models.ANSWERS:
        looked_at.clear()
        answer(Model(recorded))
        assert looked_at <= answer.tables, answer.tables
    for check in start.CHECKS:
        placed = Model(scenario).placement
        looked_at.clear()
        assert not [*check.find(recorded, lambda placed=placed: placed)]  # type: ignore[misc]
        assert looked_at <= placement.GEOMETRY.union(check.tables), check


def test_variation_shares_what_does_not_change_and_processes_get_the_scenario_alone() -> None:
    base = Model(SCENARIOS / "three_blocks.toml")
    other = base.varied({"friction.block_block": 0.2})
    assert other.placement is base.placement
    assert base.varied({"structures.0.overlap": "9 mm"}).bodies != base.bodies
    again = pickle.loads(pickle.dumps(other))  # noqa: S301 - just written
    assert again.kept == {}
    assert (again.scenario, again.hash) == (other.scenario, other.hash)
    assert Model(other).bodies is base.bodies


def test_a_loop_that_varies_the_last_model_keeps_no_chain_of_models() -> None:
    base = Model(SCENARIOS / "three_blocks.toml")
    last = base
    for number in range(5):
        last = last.varied({"friction.block_block": 0.1 * number})
    assert last.origin is base
    assert last.scenario.friction.block_block.kinetic == 0.4
    lifted = last.varied({"gravity": "1.62 m/s^2"})
    assert lifted.bodies is base.bodies
    assert lifted.scenario.friction == last.scenario.friction
