"""Files that cannot be scenarios at all, and data from Python."""

import re
import time
from pathlib import Path

import pytest

from blocksim.errors import InputMissingError, ScenarioError
from blocksim.scenario import load_scenario, scenario_from_mapping
from tests.golden import Golden
from tests.scenario.conftest import VALID, Refusal, edited

CASES: dict[str, str | bytes] = {
    "empty file": "",
    "comments only": "# later\n",
    "not UTF-8": b"name = \xff\xfe",
    "binary file": b"name\x00\x01\x02",
    "ten megabytes": "#" * 10_000_000,
    "lists in lists": "name = " + "[" * 100_000 + "]" * 100_000,
    "tables in tables": "name = " + "{a = " * 300 + "1" + "}" * 300,
    "seventeen levels": "name = " + "[" * 17 + "]" * 17,
    "a whole number of five thousand digits": "schema = " + "1" * 5000,
    "nothing but schema and name": 'schema = 1\nname = "a"\n',
}


@pytest.mark.parametrize("content", CASES.values(), ids=CASES)
def test_files(refusal: Refusal, golden: Golden, content: str | bytes) -> None:
    code, message = refusal(content)
    assert code == 65
    golden(message)


@pytest.mark.parametrize("key", ["{}", "[{}]", "[[{}]]", "a = {{ {} = 1 }}", "'a'.'b'.{}"])
@pytest.mark.parametrize("parts", [65, 400_000])
def test_a_key_of_many_parts_is_refused_where_it_stands_and_at_once(refusal: Refusal, key: str, parts: int) -> None:
    text = "schema = 1\n" + key.format(".".join(["a"] * parts)) + " = 1"
    before = time.process_time()
    code, message = refusal(text)
    assert time.process_time() - before < 2.0, "tomllib has taken the square of the parts"
    assert code == 65
    assert message.splitlines()[0] == "bad.toml:2: tables or lists are nested too deeply for a scenario"


@pytest.mark.parametrize("table", ["sweep", "provenance"])
def test_a_quoted_key_of_many_parts_is_refused(refusal: Refusal, table: str) -> None:
    code, _ = refusal(edited(f'[{table}]\n"{".".join(["a"] * 400_000)}" = [1, 2]'))
    assert code == 65


def test_a_flood_of_mistakes_is_cut_short(refusal: Refusal) -> None:
    code, message = refusal(VALID + "\n[time]\n" + "".join(f"x{i} = 0\n" for i in range(50_000)))
    assert code == 65
    assert len(re.findall(r"^bad\.toml:\d+: time\.x\d+: unknown key", message, re.MULTILINE)) == 50
    assert message.endswith("\nbad.toml: more mistakes follow")


@pytest.mark.parametrize("name", ["three_block.toml", "nowhere/a.toml", "cases"])
def test_files_that_are_not_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, golden: Golden, name: str) -> None:
    monkeypatch.chdir(tmp_path)
    Path("three_blocks.toml").touch()
    Path("cases").mkdir()
    with pytest.raises(InputMissingError) as caught:
        load_scenario(name)
    assert caught.value.exit_code == 66
    golden(str(caught.value))


def endless() -> dict[str, object]:
    """Return a mapping that contains itself."""
    data: dict[str, object] = {}
    data["again"] = data
    return data


@pytest.mark.parametrize(
    "data",
    [{"schema": 1, "name": "a", "material": {}, "blocks": {}, "bodies": []}, endless()],
    ids=["keys but no lines", "endless"],
)
def test_data_from_python(golden: Golden, data: dict[str, object]) -> None:
    with pytest.raises(ScenarioError) as caught:
        scenario_from_mapping(data)
    golden(str(caught.value))
