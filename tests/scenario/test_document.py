"""Loading: from files and from Python, with values set from outside, and the files that a scenario names."""

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import pytest

from blocksim.errors import InputMissingError, InvalidInputError, ScenarioError
from blocksim.scenario import Document, load_scenario, scenario_from_mapping, scenario_to_toml
from blocksim.scenario.input_files import file_access, read_limited, refuse_large
from tests.golden import Golden
from tests.scenario.conftest import data_of

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


TABLE = "block,quantity,unit,replicate,value\n1,x,mm,1,16\n"
Naming = Callable[[str], Path]
OUTSIDE = "../theirs/measured.csv"
MOTION = "time_s,displacement_mm\n0,0\n0.1,1\n"


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Stand in one of two folders side by side, of which the other one holds tables."""
    (tmp_path / "mine").mkdir()
    (tmp_path / "theirs").mkdir()
    (tmp_path / "theirs" / "measured.csv").write_text(TABLE, encoding="utf-8")
    (tmp_path / "theirs" / "shaking.csv").write_text(MOTION, encoding="utf-8")
    monkeypatch.chdir(tmp_path / "mine")
    return tmp_path


@pytest.fixture
def naming(place: Path, valid_text: str) -> Naming:
    """Write a scenario that names an experiment."""

    def write(table: str) -> Path:
        path = place / "mine" / "case.toml"
        path.write_text(f'{valid_text}\n[experiment]\ntable = "{table}"\n', encoding="utf-8")
        return path

    return write


@pytest.mark.parametrize("way", ["../theirs/measured.csv", "{}/theirs/measured.csv", "link.csv", "linked/measured.csv"])
def test_what_leads_outside_is_refused_with_the_line_and_the_way_out(place: Path, naming: Naming, way: str) -> None:
    (place / "mine" / "link.csv").symlink_to(place / "theirs" / "measured.csv")
    (place / "mine" / "linked").symlink_to(place / "theirs")
    scenario = naming(way.format(place))
    with pytest.raises(ScenarioError, match=r"case\.toml:21: experiment\.table: .*leads outside .*--allow-outside"):
        load_scenario(scenario)
    assert load_scenario(scenario, allow_outside=True).experiment is not None


def test_what_is_missing_outside_is_not_told_and_motions_and_data_from_python_are_held_to_the_same(
    place: Path, naming: Naming
) -> None:
    with pytest.raises(ScenarioError, match="leads outside"):
        load_scenario(naming("../theirs/nothing.csv"))
    for data, told in (
        (data_of(motion={"kind": "table", "table": str(place / "theirs" / "shaking.csv")}), r"motion\.table"),
        (data_of(experiment={"table": str(place / "theirs" / "measured.csv")}), r"experiment\.table"),
    ):
        with pytest.raises(ScenarioError, match=rf"{told}: .*leads outside"):
            scenario_from_mapping(data)
        assert scenario_from_mapping(data, allow_outside=True).name == data["name"]


def test_tables_below_the_current_folder_are_in_reach_unless_that_is_a_home(
    place: Path, naming: Naming, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = naming(OUTSIDE)
    monkeypatch.chdir(place)
    assert load_scenario(scenario).experiment is not None
    (place / "home").mkdir()
    monkeypatch.setenv("HOME", str(place / "home"))
    for folder in (place, place / "home"):
        monkeypatch.chdir(folder)
        with pytest.raises(ScenarioError, match="leads outside"):
            load_scenario(scenario)


def test_a_path_given_by_hand_may_lead_anywhere_and_one_of_a_sweep_not(naming: Naming) -> None:
    scenario = naming("nothing.csv")
    for given in ([f"experiment.table={OUTSIDE}"], {"experiment.table": OUTSIDE}):
        assert load_scenario(scenario, given).experiment is not None
    with pytest.raises(ScenarioError, match="leads outside"):  # values that come from a file, as those of a sweep
        Document.read(scenario).with_values({"experiment.table": OUTSIDE}).build()


def test_a_document_keeps_what_was_allowed_when_it_was_read(naming: Naming) -> None:
    scenario = naming(OUTSIDE)
    with file_access(anywhere=True):
        allowed = Document.read(scenario)
    assert allowed.build().experiment is not None
    with pytest.raises(ScenarioError, match="leads outside"):
        Document.read(scenario).build()


@pytest.mark.parametrize("name", ["x" * 300 + ".csv", "loop.csv"])
def test_names_that_cannot_be_followed_are_mistakes_with_a_line(place: Path, naming: Naming, name: str) -> None:
    (place / "mine" / "loop.csv").symlink_to("loop.csv")
    with pytest.raises(ScenarioError, match=r"case\.toml:21: experiment\.table: "):
        load_scenario(naming(name))


@pytest.mark.parametrize("read", [read_limited, refuse_large])
def test_files_are_read_up_to_the_limit_and_only_where_they_are_files(
    tmp_path: Path, read: Callable[[Path, int], object]
) -> None:
    path = tmp_path / "data"
    path.write_bytes(b"0123456789")
    assert read(path, 10) in {b"0123456789", None}
    with pytest.raises(InvalidInputError, match="data: larger than 9e-06 MB"):
        read(path, 9)
    for name in ("nothing", "x" * 300, "a\0b"):
        with pytest.raises(InputMissingError):
            read(tmp_path / name, 10)
    os.mkfifo(tmp_path / "pipe")
    for place in (tmp_path / "pipe", tmp_path, Path(os.devnull), Path("/dev/zero")):
        with pytest.raises(InvalidInputError, match="not a file"):
            read(place, 10)
    os.truncate(path, 1 << 42)  # holes, which take long to read
    with pytest.raises(InvalidInputError, match="larger than 1 MB"):
        read(path, 1_000_000)
