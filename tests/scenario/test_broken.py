"""Broken scenarios, files and settings: each is refused with a located message, which stands in golden/broken.txt.

A section of broken/*.txt is what is added to a valid scenario, the first section or that of conftest.py, or lines that
it loses (-) and gets in place (+). In broken/structures.txt it is what stands in place of the structure. In
broken/files/NAME.txt the first is the scenario, the others what stands in the file NAME. broken/settings.toml has
values of --set.
"""

import re
import time
import tomllib
from pathlib import Path
from typing import Any

import pytest
from hypothesis import example, given, strategies as st

from blocksim.analysis.experiment import load_table
from blocksim.errors import InputMissingError, Problem, ScenarioError
from blocksim.scenario import Document, load_scenario, scenario_from_mapping, scenario_to_toml
from tests.golden import Golden, parsed
from tests.scenario.conftest import SCENARIOS, VALID, Edit, Refusal, Refused, edited, read

HERE = Path(__file__).parent
STACK = 'kind = "stack"\nblock = "brick"\ncount = 3\n'
WIDTH = 'width = "40 mm"'


def edits() -> dict[str, tuple[Edit, str]]:
    """Return what is done to which valid scenario, by subject and name."""
    found: dict[str, tuple[Edit, str]] = {}
    for file in sorted(HERE.glob("broken/*.txt")):
        sections = parsed(file.read_text())
        valid = sections.pop("scenario", VALID)
        for name, text in sections.items():
            found[f"{file.stem}: {name}"] = (STACK, f"{text}\n") if file.stem == "structures" else read(text), valid
    return found


EDITS = edits() | {
    "overlong text": ((WIDTH, f'width = "{"4" * 200} mm"'), VALID),
    "whole number beyond any float": ((WIDTH, f"width = {'9' * 400}"), VALID),
    "line with a tab and a bell": ((WIDTH, '\twidth = "\x07"'), VALID),
    "very long line": ((WIDTH, "width = { " + ", ".join(f"k{i} = {i}" for i in range(60)) + " }"), VALID),
}


@pytest.mark.parametrize(("edit", "valid"), EDITS.values(), ids=EDITS)
def test_scenarios(refused: Refused, edit: Edit, valid: str) -> None:
    refused(edit, valid)


def files() -> dict[str, tuple[Edit, str, bytes]]:
    """Return what is wrong in a file that a scenario names: the scenario, the file's name and content."""
    found: dict[str, tuple[Edit, str, bytes]] = {}
    for file in sorted(HERE.glob("broken/files/*.txt")):
        sections = parsed(file.read_text())
        scenario = read(sections.pop("scenario"))
        contents = {name: text.encode() for name, text in sections.items()} | {"bytes": b"\0\1\xff\xfe"}
        found |= {f"{file.stem}: {name}": (scenario, file.stem, content) for name, content in contents.items()}
    return found


FILES = files()


@pytest.mark.parametrize(("edit", "name", "content"), FILES.values(), ids=FILES)
def test_files(tmp_path: Path, refused: Refused, edit: Edit, name: str, content: bytes) -> None:
    (tmp_path / name).write_bytes(content)
    refused(edit)


NO_SCENARIOS: dict[str, str | bytes] = {
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


@pytest.mark.parametrize("content", NO_SCENARIOS.values(), ids=NO_SCENARIOS)
def test_files_that_are_no_scenario(refusal: Refusal, golden: Golden, content: str | bytes) -> None:
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
    for table in ("sweep", "provenance"):
        assert refusal(edited(f'[{table}]\n"{".".join(["a"] * parts)}" = [1, 2]'))[0] == 65


def test_a_flood_of_mistakes_is_cut_short(refusal: Refusal) -> None:
    code, message = refusal(VALID + "\n[time]\n" + "".join(f"x{i} = 0\n" for i in range(50_000)))
    assert code == 65
    assert len(re.findall(r"^bad\.toml:\d+: time\.x\d+: unknown key", message, re.MULTILINE)) == 50
    assert message.endswith("\nbad.toml: more mistakes follow")


SETTINGS: dict[str, Any] = tomllib.loads((HERE / "broken" / "settings.toml").read_text())


@pytest.mark.parametrize("given", SETTINGS.values(), ids=SETTINGS)
def test_settings(refusal: Refusal, golden: Golden, given: Any) -> None:
    density, settings = (given[0], given[1:]) if isinstance(given, list) and given[0] == -1 else (7850, given)
    code, message = refusal(edited(("7850", str(density))), settings)
    assert code == 65
    golden(message)


def test_files_that_are_not_there_and_data_from_python(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, golden: Golden
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("three_blocks.toml").touch()
    Path("cases").mkdir()
    endless: dict[str, object] = {}
    endless["again"] = endless
    told = []
    for source in ("three_block.toml", "nowhere/a.toml", "cases", {"schema": 1, "name": "a", "material": {}}, endless):
        with pytest.raises(InputMissingError if isinstance(source, str) else ScenarioError) as caught:
            load_scenario(source) if isinstance(source, str) else scenario_from_mapping(source)
        told.append(f"{caught.value}\nexit code {caught.value.exit_code}\n")
    for name in ("none.csv", "cases"):
        with pytest.raises(InputMissingError) as missing:
            load_table(tmp_path / name)
        told.append(f"{missing.value}\n")
    golden("\n".join(told))


SWEPT = (SCENARIOS / "three_blocks.toml").read_text() + '[sweep]\n"time.end" = [1, 2]\n'
KEYS = ("time.end", "structures.0", "structures.0.count", "blocks", "friction.block_block")
ODD_VALUES = [
    *("0", "-1", "1e308", "-1e308", "1e-320", "nan", "-inf", "true", "2020-10-14", "07:32:00", "0x10", "1_0"),
    *("[]", "{}", "[[]]", "[{}]", "[1]", '["a"]', "{ from = 1, to = 2, count = 2 }", "{ static = 1 }", "9" * 400),
    *('""', '"x"', '"."', '"schema"', '"structures"', '"\\u0000"', "'''a\nb'''", '"nan m"', '"1e999 m"', '"1 m^99"'),
    *('"1 mm"', '"1 deg"'),
]


def check(text: str, settings: list[str] | None = None) -> None:
    """Load; what is accepted must be written and loaded again, what is not must be told in whole lines."""
    problems: tuple[Problem, ...] = ()
    try:
        scenario = Document.parse(text, folder=SCENARIOS).with_settings(settings or []).build()
    except ScenarioError as error:
        problems = error.problems
    else:
        assert Document.parse(scenario_to_toml(scenario)).build() == scenario
    for problem in problems:
        assert problem.caret_start + problem.caret_length <= max(1, len(problem.line_text)) + 1
        assert "\n" not in problem.where + problem.message + problem.line_text


@given(
    st.text(max_size=30)
    | st.builds("{}={}".format, st.sampled_from([*KEYS, "friction.block_block.static"]), st.sampled_from(ODD_VALUES))
)
@example("structures.0=1")
@example("structures.00000000000000000000000.count=1")
@example('sweep."time.end"=[]')
@example("sweep=1")
@example("a=" + "9" * 5000)
def test_any_setting(setting: str) -> None:
    check(SWEPT, [setting])
