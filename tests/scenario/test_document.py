"""Loading: from files and from Python, with values set from outside."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest

from blocksim.errors import ScenarioError
from blocksim.scenario import Document, load_scenario, scenario_to_toml
from tests.golden import Golden

GROUND = "friction.block_ground"


@pytest.fixture
def file(tmp_path: Path, valid_text: str) -> Path:
    path = tmp_path / "case.toml"
    path.write_text(valid_text)
    return path


def test_every_shipped_scenario_loads_under_its_own_name(shipped: Path) -> None:
    assert load_scenario(shipped).name == shipped.stem


def test_a_file_may_have_a_byte_order_mark_and_windows_line_ends(tmp_path: Path, file: Path) -> None:
    other = tmp_path / "windows.toml"
    other.write_bytes(b"\xef\xbb\xbf" + file.read_bytes().replace(b"\n", b"\r\n"))
    assert load_scenario(other) == load_scenario(str(file))


def test_the_defaults_are_the_documented_ones(file: Path, golden: Golden) -> None:
    golden(scenario_to_toml(load_scenario(file)))


@pytest.mark.parametrize(
    ("overrides", "attribute", "value"),
    [
        (["time.end=5"], "time.end", 5.0),
        (["time.end = 5 ms"], "time.end", 0.005),
        (['time.end="5 ms"'], "time.end", 0.005),
        (["time.stop_at_rest=false"], "time.stop_at_rest", False),
        (["name=other"], "name", "other"),
        (["description=what = this?"], "description", "what = this?"),
        (["time.end=1", "time.end=3"], "time.end", 3.0),
        (["contact.restitution=0.4"], "contact.restitution.block_block", 0.4),
        (["contact.restitution.block_block=0.4"], "contact.restitution.block_ground", 0.2),
        (
            ["contact.restitution=0.4", "contact.restitution.block_block=0.3"],
            "contact.restitution.block_ground",
            0.4,
        ),
        (["contact={ restitution = { block_ground = 0.1 } }"], "contact.restitution.block_ground", 0.1),
        ({"time.end": 5}, "time.end", 5.0),
        (['provenance."time.end"=assumed'], "provenance", {"time.end": "assumed"}),
        ({"structures.0.velocity.1": "2 m/s"}, "structures.0.velocity", (0.0, 2.0)),  # from the default
        (
            {"friction.block_ground": "21 deg", "friction.block_ground.static": 0.25},
            "friction.block_ground.static",
            0.25,
        ),
        ({"friction.block_ground": 0.38, "friction.block_ground.static": 0.25}, "friction.block_ground.kinetic", 0.25),
        ({"ground.tilt": "0.25 rad", "time.end": 7.0}, "ground.tilt", 0.25),
    ],
)
def test_overrides(file: Path, overrides: Mapping[str, object] | Sequence[str], attribute: str, value: object) -> None:
    found: object = load_scenario(file, overrides)
    for name in attribute.split("."):
        found = found[int(name)] if isinstance(found, tuple) else getattr(found, name)
    assert found == value


def test_an_element_beyond_a_list_is_refused(file: Path) -> None:
    with pytest.raises(ScenarioError, match=r"structures\.0\.velocity is a list of 2, numbered from 0"):
        load_scenario(file, {"structures.0.velocity.2": 1.0})


@pytest.mark.parametrize(
    "given", ["", "\n[friction]\nblock_block = 0.31\n", "\n[friction]\nblock_block.static = 0.31\n"]
)
def test_setting_the_kinetic_friction_keeps_the_static_one(tmp_path: Path, valid_text: str, given: str) -> None:
    path = tmp_path / "friction.toml"
    path.write_text(valid_text + given)
    pair = load_scenario(path, {"friction.block_block.kinetic": 0.2}).friction.block_block
    assert (pair.static, pair.kinetic) == (0.31, 0.2)


def test_setting_values_leaves_the_document_as_it_was(file: Path) -> None:
    document = Document.read(file)
    before = document.build()
    changed = document.with_values({"structures.0.count": 9, "blocks.brick.width": 1})
    assert document.build() == before
    assert changed.build() != before


def test_the_experiment_table_is_found_beside_the_scenario(
    tmp_path: Path, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "table.csv").touch()
    monkeypatch.chdir("/")
    experiment = load_scenario(file, {"experiment.table": "table.csv"}).experiment
    assert experiment is not None
    assert experiment.table == (tmp_path / "table.csv").resolve()


def test_sweep_values_are_spread_evenly_with_both_ends(file: Path) -> None:
    vary = {
        "structures.0.offset": {"from": "1 mm", "to": "4 mm", "count": 4},
        "ground.tilt": {"from": "0 rad", "to": "0.5 rad", "count": 3},
        "contact.stiffness_scale": [0.1, 1],
        "time.step": ["auto", "1 us"],
    }
    sweep = load_scenario(file, {"sweep": vary}).sweep
    assert sweep is not None
    assert sweep.mode == "grid"
    offsets = sweep.vary["structures.0.offset"]
    assert isinstance(offsets, tuple)
    first, *between, last = offsets
    assert (first, last) == ("1 mm", "4 mm")  # as typed
    assert between == pytest.approx([0.002, 0.003], abs=1e-18)
    others = [sweep.vary[key] for key in vary][1:]
    assert others == [("0 rad", "0.25 rad", "0.5 rad"), (0.1, 1), ("auto", "1 us")]


def test_sweep_values_that_only_fit_together_are_accepted(file: Path) -> None:
    sweep = {"mode": "list", "friction.block_block.static": [0.2], "friction.block_block.kinetic": [0.4]}
    assert load_scenario(file, {"friction.block_block.kinetic": 0.25, "sweep": sweep}).sweep is not None
