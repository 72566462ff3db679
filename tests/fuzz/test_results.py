"""Results that are damaged or made by a stranger: told in a line, drawn as far as they can be, and nothing worse."""

import pytest
from hypothesis import strategies as st

from tests.fuzz.child import Child
from tests.fuzz.conftest import assert_harmless, search, tries
from tests.fuzz.mutations import BINARY, JSON, SCENARIO, TABLE, damaged
from tests.fuzz.runs import FRAMES, Run

WAYS = {**dict.fromkeys(FRAMES, BINARY), "run.json": JSON, "final.csv": TABLE, "scenario.toml": SCENARIO}
COMMANDS = (
    ("export", "--out", "all.csv"),
    ("export", "--format", "vtkhdf", "--out", "all.vtkhdf"),
    ("compare",),
    ("report", "--out", "report.html"),
    ("plot", "--out", "strip.png"),
    ("plot", "--kind", "history", "--out", "history.svg"),
)
OFTEN = tuple(command for command in COMMANDS for _ in range(1 if command[0] == "plot" else 3))
CODES = {0, 1, 65, 66}
RARELY = 20  # one of so many files takes the place of another


@pytest.fixture(scope="module")
def usual(child: Child, run: Run) -> dict[tuple[str, ...], float]:
    """Return how long (s of processor time) each command takes with sound results, when all is imported."""
    _, lefts = [{command: child.call(run.folder, *command, "good") for command in COMMANDS} for _ in range(2)]
    assert {left.code for left in lefts.values()} <= {0, 1}
    return {command: left.seconds for command, left in lefts.items()}


def _damage(data: st.DataObject, run: Run) -> str:
    """Write all files of the run, one of them damaged or in the place of another; return its name."""
    name = data.draw(st.sampled_from(sorted(WAYS)))
    content = data.draw(damaged(run.files[name], WAYS[name]))
    if data.draw(st.integers(1, RARELY)) == RARELY:
        content = run.files[data.draw(st.sampled_from(sorted(run.files)))]
    place = "run.h5" if name in FRAMES else name
    for one in run.files.keys() - FRAMES[1:]:
        (run.folder / "bad" / one).write_bytes(content if one == place else run.files[one])
    return place


@tries(500)
def test_damaged_results_are_reported_in_a_line(
    child: Child, run: Run, usual: dict[tuple[str, ...], float], tried: int
) -> None:
    def check(data: st.DataObject) -> None:
        place = _damage(data, run)
        command = data.draw(st.sampled_from(OFTEN))
        left = child.call(run.folder, *command, "bad")
        assert_harmless(left, CODES, usual[command])
        if left.code in {65, 66}:
            assert f"bad/{place}" in left.err, left.err

    search(tried, st.data(), check)
