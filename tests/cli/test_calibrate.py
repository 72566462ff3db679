"""blocksim calibrate: what it writes, tells and refuses; killed, it continues."""

import json
import re
import signal
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from blocksim.scenario import Document
from tests.cli.conftest import PATIENCE, SCENARIOS, SOFT, Answer, Command, Process

FRICTION, SPEED = "friction.block_ground", "bodies.0.velocity.0"
TABLE = "block,quantity,unit,replicate,value\nblock,x,mm,1,41\nblock,x,mm,2,43\n"
FIT = ("--fit", f"{FRICTION}=0.2:0.5")
NEAR = ("--fit", f"{FRICTION}=0.3:0.307")  # all of which stop in the range without scatter
SCATTER = ("--scatter", f"{SPEED}=0.5 m/s+-0.01 m/s")
SHORT = ("--trials", 20, "--samples", 8, "--fresh", 128)
Slide = Callable[..., Answer]


@pytest.fixture
def slide(blocksim: Command, tmp_path: Path) -> Slide:
    """Calibrate the friction of the slide to a table in which the block stops after 41 and 43 mm."""
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "slide.toml").write_text((SCENARIOS / "slide.toml").read_text())
    (tmp_path / "measured.csv").write_text(TABLE)

    def call(*arguments: object, scenario: str = "mine/slide.toml") -> Answer:
        return blocksim("calibrate", scenario, *SOFT, "--experiment", "measured.csv", *arguments)

    return call


def test_friction_of_the_slide_is_found(slide: Slide, blocksim: Command) -> None:
    answer = slide(*FIT, *SCATTER, *SHORT, "--out", "fitted.toml", "--json")
    assert (answer.code, answer.err) == (0, "")
    data = json.loads(answer.out)
    value = data["fitted"][0]["value"]
    assert value == pytest.approx(0.5**2 / (2 * 9.81 * 0.042), rel=0.02)  # x = v^2 / (2 mu g), 42 mm
    assert data["interval"][0] < data["share_inside"] < data["interval"][1]
    # v within 42 mm +- 1 mm is v +- 1.19 %, that is 0.595 standard deviations: P = 0.448
    assert data["share_inside"] == pytest.approx(0.448, abs=0.13)
    assert blocksim("check", "fitted.toml").code == 0
    fitted = Document.read("fitted.toml")
    told = fitted.build().provenance[FRICTION]
    assert "prior 0.2 to 0.5, seed 0, 20 trials of 8 samples" in told
    assert "of 128 fresh samples, measured.csv" in told
    assert "# one block sliding" not in fitted.source.text
    assert "as in Table 1" in fitted.source.text  # the user's comments stay


def test_nothing_found_is_1_and_the_nearest_is_reported(slide: Slide) -> None:
    few = ("--trials", 20, "--samples", 4, "--fresh", 8)
    answer = slide("--fit", f"{FRICTION}=0.4:0.9", *SCATTER, *few, "--out", "fitted.toml")
    assert answer.code == 1
    assert "nothing found: no sample is inside all ranges" in answer.out
    head, _, row = (line.split() for line in answer.out.splitlines()[-3:])
    assert head == ["quantity", "measured", "median", "inside"]
    assert row[:5] == ["x_mm", "of", "block", "[41.00,", "43.00]"]
    x = float(row[5])
    assert 29.0 < x < 32.5  # the search goes towards the range, to the least friction: 0.5^2 / (2 * 9.81 * 0.4) = 31.9
    assert row[6] == "0%"
    assert "nothing inside, 0." in answer.err
    assert max(map(len, answer.out.splitlines())) <= 80
    assert "not calibrated (nothing inside all ranges" in Path("fitted.toml").read_text()
    again = slide("--fit", f"{FRICTION}=0.4:0.9", *SCATTER, *few, "--out", "fitted.toml", "--overwrite", "--json")
    assert (again.code, json.loads(again.out)["found"]) == (1, False)


def test_table_fits_the_screen_and_bounds_are_warned_of(slide: Slide) -> None:
    answer = slide("--fit", f"{FRICTION}=0.4:0.5", *SCATTER, *SHORT, "--out", "fitted.toml")
    assert answer.code == 1
    lines = answer.out.splitlines()
    assert lines[0].split() == ["key", "prior", "fitted"]
    assert max(map(len, lines)) <= 80
    assert "P(inside all ranges) = 0.0" in answer.out
    assert "lies at a bound of its prior" in answer.err
    assert "20/20: " in answer.err
    assert answer.err.splitlines()[-1] == "written: fitted.toml"


def test_nothing_is_overwritten_unless_asked(slide: Slide, tmp_path: Path) -> None:
    few = (*NEAR, *SCATTER, "--trials", 2, "--samples", 2, "--fresh", 2, "--out", "fitted.toml", "--quiet")
    assert slide(*few).code == 0
    before = (tmp_path / "fitted.toml").read_text()
    again = slide(*few)
    assert (again.code, again.out) == (73, "")
    assert "fitted.toml: already exists; --overwrite replaces it" in again.err
    (tmp_path / "fitted.toml").unlink()
    journal = slide(*few)
    assert journal.code == 73
    assert "--resume continues them, --overwrite starts again" in journal.err
    other = slide(*few, "--seed", 1, "--resume")
    assert other.code == 73
    assert "another calibration (seed differ)" in other.err
    assert slide(*few, "--overwrite").code == 0
    assert (tmp_path / "fitted.toml").read_text() == before
    (tmp_path / "fitted.trials.jsonl").write_text("trials in the lab, by hand")
    foreign = slide(*few, "--overwrite")
    assert (foreign.code, foreign.out) == (65, "")
    assert "fitted.trials.jsonl: not the journal of a calibration" in foreign.err
    assert (tmp_path / "fitted.trials.jsonl").read_text() == "trials in the lab, by hand"


def test_finished_calibration_that_is_resumed_ends_with_0_and_leaves_its_file(slide: Slide, tmp_path: Path) -> None:
    few = (*NEAR, *SCATTER, "--trials", 2, "--samples", 2, "--fresh", 2, "--out", "fitted.toml", "--quiet")
    first, file = slide(*few), tmp_path / "fitted.toml"
    before = file.read_text()
    assert slide(*few, "--resume") == first
    assert file.read_text() == before
    assert slide(*few, "--resume", "--trials", 3).code == 73
    file.write_text(f"{before}# mine\n")
    assert slide(*few, "--resume").code == 73
    assert file.read_text().endswith("# mine\n")


def test_scatter_of_the_scenario_is_the_default_and_stays_in_the_file(slide: Slide, tmp_path: Path) -> None:
    scenario = tmp_path / "mine" / "slide.toml"
    own = f'\n[sweep]  # my scatter\nmode = "normal"\n"{SPEED}" = {{ mean = "0.5 m/s", sd = "0.01 m/s" }}\n'
    scenario.write_text(scenario.read_text() + own)
    few = (*FIT, "--trials", 4, "--samples", 4, "--fresh", 4)
    assert slide(*few, "--out", "own.toml").code == 0
    assert slide(*few, *SCATTER, "--out", "given.toml").code == 0
    assert own in Path("own.toml").read_text()
    assert Path("own.toml").read_text() == Path("given.toml").read_text()


def test_single_run_without_scatter_says_that_it_is_one(slide: Slide) -> None:
    answer = slide(*FIT, "--trials", 20, "--samples", 1, "--out", "fitted.toml")
    assert answer.code == 0
    assert "one run, without input scatter: inside all ranges" in answer.out


def test_trials_that_tie_are_reported_with_their_range_and_none_is_called_the_fit(slide: Slide) -> None:
    few = (*NEAR, "--samples", 1, "--trials", 4, "--out", "fitted.toml")  # every trial stops inside the range
    answer = slide(*few)
    assert answer.code == 0
    heads, _, row, _, tie = answer.out.splitlines()[:5]
    assert (re.split(r"  +", heads), "fitted" in answer.out) == (["key", "prior", "equally good", "written"], False)
    low, high, value = (float(text) for text in re.findall(r"0\.30\d*", row)[1:])
    assert 0.3 < low <= value <= high < 0.307
    assert high - low > 0.003
    assert tie.startswith("4 of 4 trials tie: the measurement does not decide")
    assert max(map(len, answer.out.splitlines())) <= 80
    text = Path("fitted.toml").read_text()
    assert f"calibrated, one of 4 equally good trials ({low:g} to {high:g}), prior 0.3 to 0.307" in text
    assert "calibrated by blocksim: one of 4 equally good trials: " in text.splitlines()[0]
    assert "# one of 4 equally good, see [provenance]" in text
    data = json.loads(slide(*few, "--overwrite", "--json").out)
    assert (data["tied_trials"], data["fitted"][0]["equally_good"]) == (4, [low, high])


@pytest.mark.long
def test_stopped_killed_and_resumed_it_finds_the_same(slide: Slide, process: Process, tmp_path: Path) -> None:
    many = (*FIT, *SCATTER, "--trials", 22, "--samples", 4, "--fresh", 4)
    assert slide(*many, "--out", "whole.toml", "--quiet").code == 0
    given = ("mine/slide.toml", *SOFT, "--experiment", "measured.csv", *many, "--out", "cut.toml", "--resume")
    journal = tmp_path / "cut.trials.jsonl"
    for number, lines in ((signal.SIGTERM, 5), (signal.SIGKILL, 20)):
        running = process("calibrate", *given)
        until = time.monotonic() + PATIENCE
        while not journal.exists() or journal.read_text().count("\n") < lines:
            assert time.monotonic() < until
            assert running.poll() is None
            time.sleep(0.01)
        running.send_signal(number)
        _, told = running.communicate()
        assert not (tmp_path / "cut.toml").exists()
        if number == signal.SIGTERM:
            assert running.returncode == 75
            assert "of 22 trials; --resume runs the rest" in told
    assert slide(*many, "--out", "cut.toml", "--resume", "--quiet").code == 0
    assert (tmp_path / "cut.toml").read_text() == (tmp_path / "whole.toml").read_text()
