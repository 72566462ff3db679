"""Files of strangers and damaged ones: endless pipes, links to private files, texts that steer terminals and tables."""

import csv
import json
import os
import shutil
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType

import pandas as pd
import pytest

from tests.cli.conftest import SOFT, Command

NOMINAL = "scenarios/three_blocks_nominal.toml"
PRIVATE = "hunter2 = my mother's maiden name, and more of it"
SECONDS = 30


@pytest.fixture(autouse=True)
def _no_waiting() -> Iterator[None]:
    """Fail instead of waiting for the other end of a pipe."""

    def fail(_: int, __: FrameType | None) -> None:
        raise TimeoutError("it waits")

    before = signal.signal(signal.SIGALRM, fail)
    signal.alarm(SECONDS)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


@pytest.fixture
def swept(finished_sweep: Path, tmp_path: Path) -> Path:
    """Give a copy of the sweep."""
    return Path(shutil.copytree(finished_sweep, tmp_path / "swept"))


@pytest.mark.parametrize(
    "arguments",
    [
        ("check", "pipe"),
        ("run", "pipe"),
        ("sweep", "pipe"),
        ("plot", "pipe"),
        ("compare", "pipe"),
        ("plot", "pipe.csv"),
        ("check", NOMINAL, "--set", "experiment.table=pipe"),
        ("compare", "RUN", "--experiment", "pipe"),
        ("report", "RUN", "--experiment", "pipe"),
        ("sweep", NOMINAL, "--mode", "table", "--set", 'sweep={mode="table",table="pipe"}'),
    ],
    ids=lambda words: " ".join(words[:2]),
)
def test_a_pipe_is_refused_and_not_waited_for(blocksim: Command, finished: Path, arguments: tuple[str, ...]) -> None:
    for name in ("pipe", "pipe.csv"):
        os.mkfifo(name)
    answer = blocksim(*(finished if word == "RUN" else word for word in arguments))
    assert answer.code == 65, answer
    assert "pipe" in answer.err
    assert answer.out == ""


def test_a_pipe_of_the_shell_is_reported_how_to_be_read(blocksim: Command) -> None:
    reading, writing = os.pipe()
    os.write(writing, b"schema = 1\n")
    answer = blocksim("check", f"/dev/fd/{reading}")
    assert answer.code == 65
    assert answer.err == f"/dev/fd/{reading}: not a file, but a pipe; save its content in a file first\n"
    os.close(reading)
    os.close(writing)


def tells(*answers: object) -> bool:
    """Return True where it is in answers, or in any file that was written here."""
    written = [path.read_bytes() for path in Path().iterdir() if path.is_file() and not path.is_symlink()]
    return any(b"hunter2" in text for text in written) or any("hunter2" in str(answer) for answer in answers)


@pytest.fixture(params=["pipe", "link to a private file"])
def put(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Callable[[Path], None]:
    """Put a pipe, or a link, in place of a file."""

    def replace(path: Path) -> None:
        path.unlink()
        if request.param == "pipe":
            os.mkfifo(path)
            return
        private = tmp_path_factory.mktemp("home") / "private"
        private.write_text(PRIVATE)
        path.symlink_to(private)

    return replace


@pytest.mark.parametrize("command", ["compare", "report"])
@pytest.mark.parametrize("name", ["scenario.toml", "run.json", "final.csv", "run.h5", "experiment.csv"])
def test_pipes_and_links_in_a_run_are_not_read(
    blocksim: Command, copied: Path, put: Callable[[Path], None], command: str, name: str
) -> None:
    put(copied / name)
    answer = blocksim(command, copied)
    assert answer.code in ({1} if (command, name) == ("compare", "run.h5") else {65, 66}), answer
    assert not tells(answer)


@pytest.mark.parametrize("command", ["compare", "report"])
@pytest.mark.parametrize("name", ["sweep.csv", "sweep.toml"])
def test_pipes_and_links_in_a_sweep_are_not_read(
    blocksim: Command, swept: Path, put: Callable[[Path], None], command: str, name: str
) -> None:
    put(swept / name)
    answer = blocksim(command, swept)
    assert answer.code in {0, 65, 66}, answer  # without its table a sweep is none, and a report can do without the plan
    assert not tells(answer)


JUDGED = ("run.json", "final.csv", "scenario.toml", "experiment.csv")
READ_BY = {"run.h5": ("plot", "export", "animate"), **dict.fromkeys(JUDGED, ("compare",))}


@pytest.mark.parametrize("name", READ_BY)
def test_damaged_file_is_named_by_every_command_that_reads_it(blocksim: Command, copied: Path, name: str) -> None:
    for content in (b"", b"rubbish" * 100, b"\x00\xff\xfe", None):
        if content is None:
            (copied / name).unlink()
        else:
            (copied / name).write_bytes(content)
        for command in READ_BY[name]:
            answer = blocksim(command, copied)
            assert answer.code in ({65, 66} if content is None else {65})
            assert name in answer.err
            assert answer.out == ""


def test_a_table_that_a_stored_scenario_names_is_no_link_even_within_reach(blocksim: Command, copied: Path) -> None:
    Path("notes.csv").write_text((copied / "experiment.csv").read_text())
    (copied / "experiment.csv").unlink()
    (copied / "experiment.csv").symlink_to(Path("notes.csv").resolve())
    answer = blocksim("compare", copied)
    assert answer.code == 65
    assert "experiment.csv" in answer.err
    assert "links in result folders are not followed" in answer.err


def test_cases_of_a_sweep_that_are_links_are_left_out(blocksim: Command, swept: Path, copied: Path) -> None:
    first, second, *_ = pd.read_csv(swept / "sweep.csv", dtype={"case": str})["case"]
    shutil.copytree(copied, swept / "cases" / first)
    (swept / "cases" / second).symlink_to(copied)
    assert blocksim("report", swept, "--out", "page.html").code == 0
    page = Path("page.html").read_text(encoding="utf-8")
    assert "part-1-member-1" in page
    assert "part-1-member-2" not in page


@pytest.mark.parametrize("command", ["plot", "report", "compare", "check"])
def test_nothing_of_a_stranger_steers_the_terminal(blocksim: Command, copied: Path, command: str) -> None:
    evil = "\x1b]0;owned\x07\x9b31m\u202egnp.exe"
    summary = json.loads((copied / "run.json").read_text())
    (copied / "run.json").write_text(json.dumps({**summary, "status": "failed", "reason": evil}))
    text = (copied / "scenario.toml").read_text()
    quoted = json.dumps(evil)
    (copied / "scenario.toml").write_text(text.replace("schema = 1\n", f"schema = 1\ndescription = {quoted}\n"))
    answer = blocksim(command, copied / "scenario.toml" if command == "check" else copied)
    told = answer.out + answer.err
    assert told
    assert not {"\x1b", "\x07", "\x9b", "\u202e"} & set(told)


def test_no_cell_of_a_table_begins_a_formula(blocksim: Command) -> None:
    formula = "=HYPERLINK(1).csv"
    for name in (formula, "usual.csv"):
        Path(name).write_text("time_s,displacement_mm\n0,0\n1,1\n", encoding="utf-8")
    nominal = Path(NOMINAL).read_text(encoding="utf-8").partition("[experiment]")[0]
    Path("theirs.toml").write_text(f'{nominal}\n[motion]\nkind = "table"\ntable = "usual.csv"\n', encoding="utf-8")
    values = ("--vary", f"motion.table={formula},usual.csv", "--vary", "ground.tilt=-1 deg,0 deg")
    assert blocksim("sweep", "theirs.toml", *SOFT, "--set", "time.end=0.01", *values, "--out", "swept").code == 0
    with Path("swept/sweep.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert {row["motion.table"] for row in rows} == {f"'{formula}", "usual.csv"}
    assert {row["ground.tilt [deg]"] for row in rows} == {"-1.0", "0.0"}
    for name in (formula, "usual.csv"):
        shutil.copy(name, "swept")  # a study holds no copies of varied tables
    assert blocksim("verify-run", "swept").code == 0
