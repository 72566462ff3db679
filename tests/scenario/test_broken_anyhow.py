"""Whatever is done to a scenario, it loads or is refused with a located message: no other error, ever."""

from pathlib import Path

from hypothesis import example, given, strategies as st

from blocksim.errors import Problem, ScenarioError
from blocksim.scenario import Document, scenario_to_toml

SCENARIOS = Path(__file__).parents[2] / "scenarios"
TEXT = (SCENARIOS / "three_blocks.toml").read_text() + '[sweep]\n"time.end" = [1, 2]\n'
LINES = [line for line in TEXT.split("\n") if line and not line.startswith("#")]
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


@given(st.integers(0, len(LINES) - 1), st.sampled_from(ODD_VALUES), st.booleans())
def test_any_value_anywhere(number: int, value: str, again: bool) -> None:
    key = LINES[number].split("=")[0]
    line = f"{key}= {value}"
    check("\n".join([*LINES[:number], line, *([line] if again else []), *LINES[number + 1 :]]))


KEYS = ["time.end", "structures.0", "structures.0.count", "blocks"]
KEYS += ["friction.block_block", "friction.block_block.static"]


@given(st.sampled_from(KEYS), st.sampled_from(ODD_VALUES))
def test_any_value_set_from_outside(key: str, value: str) -> None:
    check(TEXT, [f"{key}={value}"])


@given(st.text(max_size=30))
@example("structures.0=1")
@example("structures.00000000000000000000000.count=1")
@example('sweep."time.end"=[]')
@example("sweep=1")
@example("a=" + "9" * 5000)
def test_any_setting(setting: str) -> None:
    check(TEXT, [setting])
