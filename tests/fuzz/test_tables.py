"""Tables that are damaged or hostile: of experiments, of a support's motion, of cases and of the results of sweeps."""

import re
import shutil
from pathlib import Path

import pytest
from hypothesis import strategies as st

from tests.fuzz.child import Child
from tests.fuzz.conftest import ROOT, assert_harmless, search, tries
from tests.fuzz.mutations import TABLE, damaged
from tests.fuzz.runs import Run

EXPERIMENT = (ROOT / "scenarios" / "experiments" / "three_blocks.csv").read_bytes()
MOTION = b"# a pulse\ntime_s,acceleration_g\n0.00,0\n0.01,0.12\n0.02,-0.3\n0.03,0.05\n0.04,0\n"
CASES = b"""# readings
structures.0.overlap [mm],friction.block_block.kinetic,time.scheme
10.1,0.19,explicit
9.8,0.21,nonsmooth
10.0,0.2,explicit
"""
TEXTS = {"experiment": EXPERIMENT, "motion": MOTION, "cases": CASES}
DAMAGED = st.sampled_from(sorted(TEXTS)).flatmap(lambda kind: st.tuples(st.just(kind), damaged(TEXTS[kind], TABLE)))
PLACED = re.compile(r"bad\.csv(:| line )\d+: |bad\.csv: line \d+: |^scene\.toml:\d+: ", re.MULTILINE)
WHOLE = ("not a text file", "the table is empty", "too large for a table", "lines with samples", "measures block")


@pytest.fixture(scope="module")
def place(run: Run) -> Path:
    """Return a folder with scenarios that name a table beside them."""
    plain = (ROOT / "scenarios" / "three_blocks.toml").read_text(encoding="utf-8")
    plain = re.sub(r"(?ms)^\[(experiment|sweep|provenance)\].*?(?=^\[|\Z)", "", plain)
    for name, table in (("motion", '[motion]\nkind = "table"'), ("cases", '[sweep]\nmode = "table"')):
        text = f'{plain}\n{table}\ntable = "bad.csv"\n'
        (run.folder / name).mkdir()
        (run.folder / name / "scene.toml").write_text(text, encoding="utf-8")
    (run.folder / "experiment").mkdir()
    return run.folder


COMMANDS = {
    "experiment": ("compare", "../good", "--experiment", "bad.csv"),
    "motion": ("check", "scene.toml"),
    "cases": ("sweep", "scene.toml", "--dry-run"),
}


def check_table(child: Child, place: Path, kind: str, content: bytes) -> None:
    (place / kind / "bad.csv").write_bytes(content)
    left = child.call(place / kind, *COMMANDS[kind])
    assert_harmless(left, {0, 1, 65} if kind == "experiment" else {0, 65})
    if left.code == 65:
        assert PLACED.search(left.err) or any(told in left.err for told in WHOLE), left.err


def test_sound_tables_are_taken(child: Child, place: Path) -> None:
    for kind, text in TEXTS.items():
        (place / kind / "bad.csv").write_bytes(text)
        left = child.call(place / kind, *COMMANDS[kind])
        assert left.code in {0, 1}, left.err


@tries(1000)
def test_damaged_tables_are_refused_with_their_line(child: Child, place: Path, tried: int) -> None:
    search(tried, DAMAGED, lambda table: check_table(child, place, *table))


KEPT = ("x_mm", "y_mm", "rotation_deg", "left_mm", "right_mm")
ENDS = {
    "1": (16.0, 25.0, 0.0, 0.0, 32.0),
    "2": (72.0, 16.0, -90.0, 47.0, 97.0),
    "3": (131.0, 16.0, -90.0, 106.0, 156.0),
}
DRAWN = (("compare",), ("report", "--out", "report.html"), ("plot", "--out", "sweep.png"))
OFTEN = (*DRAWN[:2], *DRAWN[:2], DRAWN[2])


def _table() -> bytes:
    """Return the table of nine cases, of which one has failed."""
    ends = [f"{block}.{name}" for block in ENDS for name in KEPT]
    keys = ("friction.block_block.static", "contact.stiffness_scale")
    lines = [",".join(("case", *keys, "status", "reason", "seconds", "inside", *ends))]
    for number in range(9):
        values = (f"{value + 0.3 * number}" for block in ENDS.values() for value in block)
        setting = (f"{0.2 + 0.05 * (number // 3)}", ("0.001", "0.01", "0.1")[number % 3])
        lines.append(
            ",".join((f"{number:012x}", *setting, "finished", "at rest", "0.5", str(number % 2 == 0), *values))
        )
    lines.append(",".join(("00000000000a", "0.4", "0.1", "failed", "not finite", "0.1", *[""] * (len(ends) + 1))))
    return "\n".join([*lines, ""]).encode()


@pytest.fixture(scope="module")
def usual(child: Child, folder: Path) -> dict[tuple[str, ...], float]:
    """Write a sweep; return how long (s of processor time) each command takes with it, when all is imported."""
    (folder / "sweep").mkdir()
    shutil.copytree(ROOT / "scenarios" / "experiments", folder / "sweep" / "experiments")
    shutil.copy(ROOT / "scenarios" / "sweep_friction_stiffness.toml", folder / "sweep" / "sweep.toml")
    (folder / "sweep" / "sweep.csv").write_bytes(_table())
    _, lefts = [{command: child.call(folder, *command, "sweep") for command in DRAWN} for _ in range(2)]
    assert {left.code for left in lefts.values()} <= {0, 1}, lefts
    return {command: left.seconds for command, left in lefts.items()}


@tries(200)
def test_damaged_tables_of_sweeps_do_no_harm(
    child: Child, folder: Path, usual: dict[tuple[str, ...], float], tried: int
) -> None:
    def check(data: st.DataObject) -> None:
        (folder / "sweep" / "sweep.csv").write_bytes(data.draw(damaged(_table(), TABLE)))
        command = data.draw(st.sampled_from(OFTEN))
        left = child.call(folder, *command, "sweep")
        assert_harmless(left, {0, 1, 65}, usual[command])
        if left.code == 65:
            assert "sweep" in left.err

    search(tried, st.data(), check)
