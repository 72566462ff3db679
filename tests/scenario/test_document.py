"""Loading: from files and from Python, forms of values and settings, and the files that a scenario names."""

import os
from collections.abc import Callable
from difflib import ndiff
from pathlib import Path

import pytest

from blocksim.errors import InputMissingError, InvalidInputError, ScenarioError
from blocksim.scenario import Document, Model, Scenario, load_scenario, scenario_from_mapping, scenario_to_toml
from blocksim.scenario.input_files import file_access, read_limited, refuse_large
from tests.golden import Golden, parsed
from tests.scenario.conftest import VALID, data_of, edited, read


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "case.toml"
    path.write_text(VALID)
    return path


def test_a_file_may_have_a_byte_order_mark_and_windows_line_ends(tmp_path: Path, file: Path) -> None:
    other = tmp_path / "windows.toml"
    other.write_bytes(b"\xef\xbb\xbf" + file.read_bytes().replace(b"\n", b"\r\n"))
    assert load_scenario(other) == load_scenario(str(file))


def test_the_defaults_are_the_documented_ones(file: Path, golden: Golden) -> None:
    golden(scenario_to_toml(load_scenario(file)))


def test_forms_become_what_they_stand_for(golden: Golden) -> None:
    """What each section of valid/forms.txt changes in the resolved scenario, and the first block as it lies."""

    def resolved(scenario: Scenario) -> list[str]:
        first = Model(scenario).bodies[0]
        size = f"{first.size_x:g} by {first.size_y:g} by {first.depth:g} m, {first.density:g} kg/m^3"
        return [f"(first block: {size})", *scenario_to_toml(scenario).splitlines()]

    before = resolved(Document.parse(VALID).build())
    for name, text in parsed((Path(__file__).parent / "valid" / "forms.txt").read_text()).items():
        lines = text.split("\n")
        settings = [line.removeprefix("--set ") for line in lines if line.startswith("--set ")]
        added = "\n".join(line for line in lines if not line.startswith("--set "))
        document = Document.parse(edited(read(added)) if added else VALID).with_settings(settings)
        changed = ndiff(before, resolved(document.build()))
        golden("\n".join(line for line in changed if line[0] in "+-"), name, rules=["digits"])


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
def naming(place: Path) -> Naming:
    """Write a scenario that names an experiment."""

    def write(table: str) -> Path:
        path = place / "mine" / "case.toml"
        path.write_text(f'{VALID}\n[experiment]\ntable = "{table}"\n', encoding="utf-8")
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
