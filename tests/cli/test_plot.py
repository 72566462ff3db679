"""blocksim plot: pictures of finished, failed and damaged runs."""

import re
import subprocess
import sys
from pathlib import Path

from PIL import Image

from tests.cli.conftest import Command


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
        *(["plot", run, "--kind", kind, "--dpi", "50", "--out", f"{kind}.png"] for kind in ("strip", "history")),
        ["animate", run, "--speed", "1", "--fps", "2", "--width", "200", "--out", "film.gif"],
        *(["export", run, "--format", form, "--out", f"run.{form}"] for form in ("csv", "vtkhdf")),
        ["report", run, swept, "--out", "report.html"],
    ]
    command = [sys.executable, "-c", SOLVER_FREE.format(calls=calls)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
