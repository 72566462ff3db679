"""Files that a scenario names: found in reach, refused outside, read up to a size, and only where they are files."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from blocksim.errors import InputMissingError, InvalidInputError, ScenarioError
from blocksim.scenario import Document, load_scenario, scenario_from_mapping
from blocksim.scenario.input_files import file_access, read_limited, refuse_large
from tests.scenario.conftest import data_of

TABLE = "block,quantity,unit,replicate,value\n1,x,mm,1,16\n"
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
def naming(place: Path, valid_text: str) -> Callable[[str], Path]:
    """Write a scenario that names an experiment."""

    def write(table: str) -> Path:
        path = place / "mine" / "case.toml"
        path.write_text(f'{valid_text}\n[experiment]\ntable = "{table}"\n', encoding="utf-8")
        return path

    return write


@pytest.mark.parametrize("way", ["../theirs/measured.csv", "{}/theirs/measured.csv", "link.csv", "linked/measured.csv"])
def test_what_leads_outside_is_refused_with_the_line_and_the_way_out(
    place: Path, naming: Callable[[str], Path], way: str
) -> None:
    (place / "mine" / "link.csv").symlink_to(place / "theirs" / "measured.csv")
    (place / "mine" / "linked").symlink_to(place / "theirs")
    scenario = naming(way.format(place))
    with pytest.raises(ScenarioError, match=r"case\.toml:21: experiment\.table: .*leads outside .*--allow-outside"):
        load_scenario(scenario)
    assert load_scenario(scenario, allow_outside=True).experiment is not None


def test_what_is_missing_outside_is_not_told(naming: Callable[[str], Path]) -> None:
    with pytest.raises(ScenarioError, match="leads outside"):
        load_scenario(naming("../theirs/nothing.csv"))


def test_a_motion_outside_is_refused(place: Path, valid_text: str) -> None:
    path = place / "mine" / "case.toml"
    path.write_text(f'{valid_text}\n[motion]\nkind = "table"\ntable = "../theirs/shaking.csv"\n', encoding="utf-8")
    with pytest.raises(ScenarioError, match=r"motion\.table: .*leads outside"):
        load_scenario(path)
    assert load_scenario(path, allow_outside=True).motion is not None


def test_tables_below_the_current_folder_are_in_reach(
    place: Path, naming: Callable[[str], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = naming("../theirs/measured.csv")
    monkeypatch.chdir(place)
    assert load_scenario(scenario).experiment is not None


def test_a_home_as_the_current_folder_puts_nothing_into_reach(
    place: Path, naming: Callable[[str], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = naming("../theirs/measured.csv")
    (place / "home").mkdir()
    monkeypatch.setenv("HOME", str(place / "home"))
    for folder in (place, place / "home"):
        monkeypatch.chdir(folder)
        with pytest.raises(ScenarioError, match="leads outside"):
            load_scenario(scenario)


@pytest.mark.parametrize(
    "given", [["experiment.table=../theirs/measured.csv"], {"experiment.table": "../theirs/measured.csv"}]
)
def test_a_path_given_by_hand_may_lead_anywhere(
    naming: Callable[[str], Path], given: list[str] | dict[str, object]
) -> None:
    assert load_scenario(naming("nothing.csv"), given).experiment is not None


def test_cases_of_a_sweep_name_no_file_outside(naming: Callable[[str], Path]) -> None:
    document = Document.read(naming("nothing.csv"))
    with pytest.raises(ScenarioError, match="leads outside"):  # values that come from a file, as those of a sweep
        document.with_values({"experiment.table": "../theirs/measured.csv"}).build()


def test_a_document_keeps_what_was_allowed_when_it_was_read(naming: Callable[[str], Path]) -> None:
    scenario = naming("../theirs/measured.csv")
    with file_access(anywhere=True):
        allowed = Document.read(scenario)
    assert allowed.build().experiment is not None
    with pytest.raises(ScenarioError, match="leads outside"):
        Document.read(scenario).build()


def test_data_from_python_are_held_to_the_same(place: Path) -> None:
    data = data_of(experiment={"table": str(place / "theirs" / "measured.csv")})
    with pytest.raises(ScenarioError, match="leads outside"):
        scenario_from_mapping(data)
    assert scenario_from_mapping(data, allow_outside=True).experiment is not None


@pytest.mark.parametrize("name", ["x" * 300 + ".csv", "loop.csv"])
def test_names_that_cannot_be_followed_are_mistakes_with_a_line(
    place: Path, naming: Callable[[str], Path], name: str
) -> None:
    (place / "mine" / "loop.csv").symlink_to("loop.csv")
    with pytest.raises(ScenarioError, match=r"case\.toml:21: experiment\.table: "):
        load_scenario(naming(name))


READERS = pytest.mark.parametrize("read", [read_limited, refuse_large])
Reader = Callable[[Path, int], object]


@READERS
def test_a_file_is_read_up_to_the_limit(tmp_path: Path, read: Reader) -> None:
    path = tmp_path / "data"
    path.write_bytes(b"0123456789")
    assert read(path, 10) in {b"0123456789", None}
    with pytest.raises(InvalidInputError, match="data: larger than 9e-06 MB"):
        read(path, 9)


@READERS
def test_what_is_missing_is_reported_so(tmp_path: Path, read: Reader) -> None:
    for name in ("nothing", "x" * 300, "a\0b"):
        with pytest.raises(InputMissingError):
            read(tmp_path / name, 10)


@READERS
def test_pipes_devices_and_folders_are_not_waited_for(tmp_path: Path, read: Reader) -> None:
    os.mkfifo(tmp_path / "pipe")
    for place in (tmp_path / "pipe", tmp_path, Path(os.devnull), Path("/dev/zero")):
        with pytest.raises(InvalidInputError, match="not a file"):
            read(place, 10)


def test_a_file_of_holes_is_refused_without_reading_it(tmp_path: Path) -> None:
    with (tmp_path / "huge").open("wb") as file:
        file.truncate(1 << 42)
    with pytest.raises(InvalidInputError, match="larger than 1 MB"):
        read_limited(tmp_path / "huge", 1_000_000)
