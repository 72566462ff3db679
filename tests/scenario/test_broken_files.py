"""Files that cannot be scenarios at all: message in full, exit code, nothing written."""

import re
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from blocksim.errors import InputMissingError, ScenarioError
from blocksim.scenario import load_scenario, scenario_from_mapping

Refusal = Callable[..., tuple[int, str]]
NESTED = "bad.toml: tables or lists are nested too deeply for a scenario"

CASES: dict[str, tuple[str | bytes, str]] = {
    "empty file": ("", "bad.toml: the file is empty; a scenario starts with schema = 1 and a name"),
    "comments only": (
        "# later\n",
        "bad.toml: the file is empty; a scenario starts with schema = 1 and a name",
    ),
    "not UTF-8": (b"name = \xff\xfe", "bad.toml: not a text file in UTF-8"),
    "binary file": (b"name\x00\x01\x02", "bad.toml: not a text file"),
    "ten megabytes": ("#" * 10_000_000, "bad.toml: larger than 1 MB; this is not a scenario"),
    "lists in lists": ("name = " + "[" * 100_000 + "]" * 100_000, NESTED),
    "tables in tables": ("name = " + "{a = " * 300 + "1" + "}" * 300, NESTED),
    "seventeen levels": ("name = " + "[" * 17 + "]" * 17, NESTED),
}


@pytest.mark.parametrize(("content", "message"), CASES.values(), ids=CASES)
def test_files(refusal: Refusal, content: str | bytes, message: str) -> None:
    assert refusal(content) == (65, message)


@pytest.mark.parametrize("key", ["{}", "[{}]", "[[{}]]", "a = {{ {} = 1 }}", "'a'.'b'.{}"])
@pytest.mark.parametrize("parts", [65, 400_000])
def test_a_key_of_many_parts_is_refused_where_it_stands_and_at_once(refusal: Refusal, key: str, parts: int) -> None:
    text = "schema = 1\n" + key.format(".".join(["a"] * parts)) + " = 1"
    before = time.process_time()
    code, message = refusal(text)
    assert time.process_time() - before < 2.0, "tomllib has taken the square of the parts"
    assert (code, message.splitlines()[0]) == (65, NESTED.replace("toml:", "toml:2:"))


@pytest.mark.parametrize("table", ["sweep", "provenance"])
def test_a_quoted_key_of_many_parts_is_refused(refusal_of_edit: Refusal, table: str) -> None:
    key = ".".join(["a"] * 400_000)
    code, _ = refusal_of_edit(None, f'\n[{table}]\n"{key}" = [1, 2]\n')
    assert code == 65


def test_a_whole_number_of_five_thousand_digits(refusal: Refusal) -> None:
    code, message = refusal("schema = " + "1" * 5000)
    assert code == 65
    assert message.startswith("bad.toml: not valid TOML: ")
    assert "\n" not in message


def test_nothing_but_schema_and_name(refusal: Refusal) -> None:
    caret = "\n    1 | schema = 1\n      | ^^^^^^^^^^\n"
    expected = (
        f"bad.toml:1: materials: this key is missing: materials by name, as in [materials.aluminium]{caret}"
        f"bad.toml:1: blocks: this key is missing: blocks by name, as in [blocks.brick]{caret}"
        f"bad.toml:1: nothing to simulate: add a [[structures]] or a [[bodies]] table{caret}"
    )
    assert refusal('schema = 1\nname = "a"\n') == (65, expected.rstrip("\n"))


def test_a_flood_of_mistakes_is_cut_short(refusal: Refusal, valid_text: str) -> None:
    code, message = refusal(valid_text + "\n[time]\n" + "".join(f"x{i} = 0\n" for i in range(50_000)))
    assert code == 65
    assert len(re.findall(r"^bad\.toml:\d+: time\.x\d+: unknown key", message, re.MULTILINE)) == 50
    assert message.endswith("\nbad.toml: more mistakes follow")


def test_missing_file_suggests_its_neighbour(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("three_blocks.toml").touch()
    with pytest.raises(InputMissingError) as caught:
        load_scenario("three_block.toml")
    assert str(caught.value) == "three_block.toml: no such file, did you mean 'three_blocks.toml'?"
    assert caught.value.exit_code == 66


def test_missing_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputMissingError, match=r"^nowhere/a\.toml: no such file$"):
        load_scenario("nowhere/a.toml")


def test_folder_instead_of_a_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("cases").mkdir()
    with pytest.raises(InputMissingError) as caught:
        load_scenario("cases")
    assert str(caught.value) == "cases: this is a folder; a scenario file is needed"
    assert caught.value.exit_code == 66


@pytest.mark.parametrize("name", ["a\0b.toml", "a" * 5000])
def test_impossible_file_names(name: str) -> None:
    with pytest.raises(InputMissingError, match="cannot be read: "):
        load_scenario(name)


def test_data_from_python_have_keys_but_no_lines() -> None:
    with pytest.raises(ScenarioError) as caught:
        scenario_from_mapping({"schema": 1, "name": "a", "material": {}, "blocks": {}, "bodies": []})
    assert str(caught.value).split("\n") == [
        "scenario: material: unknown key, did you mean 'materials'?",
        "scenario: nothing to simulate: add a [[structures]] or a [[bodies]] table",
    ]


def test_endless_data_from_python() -> None:
    endless: dict[str, object] = {}
    endless["again"] = endless
    with pytest.raises(ScenarioError, match="nested too deeply"):
        scenario_from_mapping(endless)
