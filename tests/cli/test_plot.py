"""blocksim plot: pictures of finished, failed and damaged runs."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image

from tests.cli.conftest import SOFT, Command


def test_picture_is_written_and_told(blocksim: Command, finished: Path) -> None:
    answer = blocksim("plot", finished, "--out", "strip.png")
    assert (answer.code, answer.out, answer.err) == (0, "", "picture: strip.png\n")
    assert Path("strip.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("command", ["plot", "export", "animate", "report"])
def test_file_of_others_is_replaced_only_when_asked(blocksim: Command, finished: Path, command: str) -> None:
    out = {"plot": "thesis.pdf", "export": "lab.csv", "animate": "clip.gif", "report": "index.html"}[command]
    Path(out).write_text("years of work")
    brief = ("--speed", "1", "--fps", "5", "--width", "200") if command == "animate" else ()
    answer = blocksim(command, finished, "--out", out, *brief)
    assert (answer.code, answer.err) == (73, f"{out}: already exists; rerun with --overwrite\n")
    assert Path(out).read_text() == "years of work"
    assert blocksim(command, finished, "--out", out, *brief, "--overwrite").code == 0
    assert blocksim(command, finished, "--out", out, *brief).code == 0


@pytest.mark.parametrize(("kind", "told"), [("final", "measured 74.41 [71.69, 78.53]"), ("history", "energy (mJ)")])
def test_other_kinds_are_drawn(blocksim: Command, finished: Path, kind: str, told: str) -> None:
    assert blocksim("plot", finished, "--kind", kind).err == f"picture: three_blocks_nominal_{kind}.png\n"
    assert blocksim("plot", finished, "--kind", kind, "--out", "picture.svg").code == 0
    assert f"<!-- {told} -->" in Path("picture.svg").read_text(encoding="utf-8")


def test_the_motion_of_supports_is_drawn_without_a_run(blocksim: Command) -> None:
    answer = blocksim("plot", "scenarios/pulse.toml", "--kind", "motion")
    assert (answer.code, answer.err) == (0, "picture: pulse_motion.png\n")


def test_probes_are_drawn_by_name(blocksim: Command) -> None:
    probe = ("--set", 'probes=[{ kind = "force", on = "supports", name = "base" }, { kind = "energy" }]')
    brief = ("--set", "time.end=0.02", "--out", "out")
    assert blocksim("run", "scenarios/three_blocks_nonsmooth.toml", *probe, *brief).code == 0
    answer = blocksim("plot", "out", "--kind", "probe", "--probe", "base", "--out", "probe.svg")
    assert (answer.code, answer.err) == (0, "picture: probe.svg\n")
    assert "<!-- probe base -->" in Path("probe.svg").read_text(encoding="utf-8")
    answer = blocksim("plot", "out", "--kind", "probe", "--block", "1")
    assert (answer.code, answer.err) == (
        65,
        "--block selects the blocks of a run's history, but this picture is of kind probe\n",
    )


def test_the_last_frame_is_reached_by_the_time_printed_above_it(blocksim: Command, finished: Path) -> None:
    assert blocksim("plot", finished, "--out", "strip.svg").code == 0
    texts = Path("strip.svg").read_text(encoding="utf-8")
    printed = re.findall(r"<!-- ([0-9.]+) s, final -->", texts)
    for kind in ("strip", "final"):
        for at in (printed[0], f"{printed[0]} s", f"{1000.0 * float(printed[0]):.0f} ms"):
            assert blocksim("plot", finished, "--kind", kind, "--at", at, "--out", "end.svg").code == 0
            assert f"<!-- {printed[0]} s, final -->" in Path("end.svg").read_text(encoding="utf-8")


def test_page_frames_and_colours_are_those_asked_for(blocksim: Command, finished: Path) -> None:
    look = ("--frames", 4, "--colour", "speed", "--size", "640x480px", "--dpi", 80)
    assert blocksim("plot", finished, *look, "--out", "strip.png").code == 0
    with Image.open("strip.png") as picture:
        assert picture.size == (640, 480)
    assert blocksim("plot", finished, *look[:4], "--out", "strip.svg").code == 0
    texts = Path("strip.svg").read_text(encoding="utf-8")
    assert len(re.findall(r"<!-- [0-9.]+ s(?:, \w+)? -->", texts)) == 4
    assert "<!-- speed (m/s) -->" in texts


def test_failed_run_can_be_drawn(blocksim: Command) -> None:
    failing = ("--set", "contact.max_overlap=1e-9", "--out", "out")
    assert blocksim("run", "scenarios/three_blocks_nominal.toml", *SOFT, *failing).code == 76
    assert blocksim("plot", "out").code == 0


SWEEP = ("sweep", "scenarios/three_blocks_nominal.toml", *SOFT, "--set", "time.end=0.01", "--jobs", 1, "--out", "swept")


def test_sweep_over_one_key_is_drawn(blocksim: Command) -> None:
    assert blocksim(*SWEEP, "--vary", "structures.0.overlap=9 mm:11 mm:3").code == 0
    answer = blocksim("plot", "swept")
    assert (answer.code, answer.out, answer.err) == (0, "", "picture: three_blocks_nominal.png\n")
    assert blocksim("plot", "swept", "--out", "sweep.svg", "--quiet").err == ""
    text = Path("sweep.svg").read_text(encoding="utf-8")
    assert "<!-- structures.0.overlap (mm) -->" in text
    assert "Band: smallest to largest of the measured repeats." in text


def test_table_of_sensitivities_is_drawn(blocksim: Command) -> None:
    text = "output,unit,key,mu*,±,mu,sigma\nx of block 2,mm,gravity,5,1,-5,0\n"
    Path("indices.csv").write_text(text, encoding="utf-8")
    answer = blocksim("plot", "indices.csv")
    assert (answer.code, answer.err) == (0, "picture: indices.png\n")


SOLVER_FREE = """
import sys
from typer.testing import CliRunner
from blocksim.cli.commands import app
for arguments in {calls}:
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, (arguments, result.output, result.stderr)
assert "numba" not in sys.modules
assert not any(name.startswith("blocksim.kernels") for name in sys.modules)
"""


def test_stored_results_are_shown_without_the_solver(finished: Path, finished_sweep: Path, tmp_path: Path) -> None:
    run, swept = str(finished), str(finished_sweep)
    calls = [
        *(["plot", run, "--kind", kind, "--out", f"{kind}.png"] for kind in ("strip", "final", "history")),
        ["animate", run, "--speed", "1", "--fps", "5", "--width", "200", "--out", "film.gif"],
        *(["export", run, "--format", form, "--out", f"run.{form}"] for form in ("csv", "vtkhdf")),
        ["report", run, swept, "--out", "report.html"],
        ["plot", swept, "--out", "sweep.png"],
    ]
    done = subprocess.run(
        [sys.executable, "-c", SOLVER_FREE.format(calls=calls)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
