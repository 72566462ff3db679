"""blocksim report and plot: what is written and drawn, what is refused, and what is left of damaged runs."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import h5py
import pytest

from blocksim.scenario import Document
from blocksim.simulation.observables import table_columns
from blocksim.study.sweep import sweep
from tests.cli.conftest import Command
from tests.view.report.folders import SCENARIOS, write_experiment, write_run, write_sweep

REPORT = Path("report.html")
KINETIC = "friction.block_block.kinetic"


def data_of(path: Path, key: str = "part-1") -> dict[str, Any]:
    """Return the data of one part of a report."""
    text = path.read_text(encoding="utf-8")
    found = re.search(rf'<script type="application/json" id="{key}-data">(.*?)</script>', text, re.DOTALL)
    assert found
    data: dict[str, Any] = json.loads(found[1])
    return data


def test_report_of_a_run_is_written_and_told(blocksim: Command, tmp_path: Path) -> None:
    write_run(tmp_path / "run")
    answer = blocksim("report", "run")
    assert (answer.code, answer.out) == (0, "")
    assert answer.err.startswith(f"report: report.html ({Path('report.html').stat().st_size / 1e6:.1f} MB)")
    text = REPORT.read_text(encoding="utf-8")
    for part in ("Comparison with the measurement", "Energy ledger (J)", "Resolved scenario", "Provenance", "Keys"):
        assert part in text
    assert not re.search(r"""(src|href)=["'](?!#|data:)|url\(|https?://(?!www\.w3\.org/2000/svg)""", text)


@pytest.mark.parametrize("damaged", [False, True])
def test_report_does_not_name_folders_of_the_machine(
    blocksim: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, damaged: bool
) -> None:
    run, swept = tmp_path / "store" / "run", tmp_path / "store" / "swept"
    write_run(run)
    write_sweep(swept)
    summary = json.loads((run / "run.json").read_text())
    command = f"{tmp_path}/bin/blocksim run '{tmp_path}/my walls/x.toml' --set a.b={tmp_path}/c"
    summary["environment"]["command"] = command
    (run / "run.json").write_text(json.dumps(summary))
    if damaged:
        (run / "run.h5").write_bytes(b"nothing")
    write_experiment(tmp_path / "repeats.csv")
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    answer = blocksim("report", run, swept, "--experiment", tmp_path / "repeats.csv")
    assert answer.code == (65 if damaged else 0)
    text = REPORT.read_text(encoding="utf-8")
    assert str(tmp_path) not in text
    assert "<bdi>blocksim run &#39;x.toml&#39; --set a.b=c</bdi>" in text
    assert "repeats.csv" in text


def test_report_of_a_folder_whose_name_is_no_text_leaves_out_frames_beyond_all_reach(
    blocksim: Command, tmp_path: Path
) -> None:
    folder = Path(os.fsdecode(b"caf\xe9"))
    write_run(tmp_path / folder)
    with h5py.File(folder / "run.h5", "r+") as file:
        file["particles/blocks/x"][-1, 0] = 1e300
    assert blocksim("report", folder).code == 0
    text = REPORT.read_text(encoding="utf-8")
    assert "caf?" in text
    ((kept, recorded),) = re.findall(r"(\d+) of (\d+) recorded frames", text)
    assert int(kept) == int(recorded) - 1


def test_varied_inputs_of_a_real_sweep_are_its_keys_and_no_result(blocksim: Command) -> None:
    falling = Document.read(SCENARIOS / "three_blocks_nonsmooth.toml").with_values({"time.end": 0.01})
    tilts, frictions = ["10 deg", "12 deg"], [0.2, 0.25]
    table = sweep(falling, {"ground.tilt": tilts, KINETIC: frictions}, out=Path("swept"), jobs=1)
    assert blocksim("report", "swept").code == 0
    columns = data_of(REPORT)["columns"]
    by_role = {role: [one["name"] for one in columns if one["role"] == role] for role in ("varied", "outcome")}
    assert len(data_of(REPORT)["pictures"][0]["x"]) == 4
    assert "map of block_block.kinetic over ground.tilt" in REPORT.read_text(encoding="utf-8")
    assert by_role["varied"] == list(table.keys) == ["ground.tilt [deg]", KINETIC]
    assert by_role["outcome"] == ["status", "reason", "seconds", "inside", *table_columns()]
    assert "<dt>varied</dt><dd><bdi>ground.tilt [deg], friction.block_block.kinetic</bdi></dd>" in REPORT.read_text()


def test_several_places_are_parts_of_one_file_and_members_beyond_the_limit_are_named(
    blocksim: Command, tmp_path: Path
) -> None:
    write_run(tmp_path / "run")
    write_sweep(tmp_path / "sweep", cases=4, kept=3)
    assert blocksim("report", "run", "sweep", "--runs", 2, "--out", "all.html").code == 0
    sweep = data_of(Path("all.html"), "part-2")
    assert sweep["kind"] == "sweep"
    names = [f"{number:012x}" for number in range(3)]
    assert sweep["members"] == {names[0]: "part-2-member-1", names[1]: "part-2-member-2"}
    assert sweep["left_out"] == names[2:]
    assert data_of(Path("all.html"), "part-2-member-2")["frames"]["names"] == ["1", "2", "3"]


def test_sweep_is_judged_by_the_repeats(blocksim: Command, tmp_path: Path) -> None:
    write_sweep(tmp_path / "sweep", kept=0)
    write_experiment(tmp_path / "repeats.csv")
    assert blocksim("report", "sweep", "--experiment", "repeats.csv").code == 0
    text = REPORT.read_text(encoding="utf-8")
    assert "3 of 6 samples (50.0 %) are within all measured ranges" in text
    assert "<bdi>of the outcome" not in text
    assert "[67.00, 69.00]" in text
    assert data_of(REPORT)["measured"] == {"1.x_mm": [67.0, 69.0], "1.rotation_deg": [-95.0, -85.0]}
    (tmp_path / "other.csv").write_text("block,quantity,unit,replicate,value\nnobody,x,mm,1,5.0\n", encoding="utf-8")
    answer = blocksim("report", "sweep", "--experiment", "other.csv")
    assert answer.code == 65
    assert "nobody" in answer.err


@pytest.mark.parametrize("damaged", ["run.h5", "run.json", "final.csv", "scenario.toml", "experiment.csv"])
def test_damaged_run_is_shown_as_far_as_it_can_be_read(blocksim: Command, tmp_path: Path, damaged: str) -> None:
    write_run(tmp_path / "run")
    (tmp_path / "run" / damaged).write_bytes(b"\xff\x00rubbish")
    answer = blocksim("report", "run")
    assert answer.code == (0 if damaged == "experiment.csv" else 65)
    text = REPORT.read_text(encoding="utf-8")
    assert damaged in text.split("Some parts could not be read or compared")[1]
    assert (data_of(REPORT)["frames"] is None) == (damaged in ("run.h5", "scenario.toml"))


def test_the_last_frame_is_reached_by_the_time_printed_above_it(blocksim: Command, finished: Path) -> None:
    assert blocksim("plot", finished, "--out", "strip.svg").code == 0
    texts = Path("strip.svg").read_text(encoding="utf-8")
    printed = re.findall(r"<!-- ([0-9.]+) s, final -->", texts)
    for kind in ("strip", "final"):
        for at in (printed[0], f"{printed[0]} s", f"{1000.0 * float(printed[0]):.0f} ms"):
            assert blocksim("plot", finished, "--kind", kind, "--at", at, "--out", "end.svg").code == 0
            assert f"<!-- {printed[0]} s, final -->" in Path("end.svg").read_text(encoding="utf-8")


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
        *(["plot", run, "--kind", kind, "--dpi", "50", "--out", f"{kind}.png"] for kind in ("final", "history")),
        ["animate", run, "--speed", "1", "--fps", "2", "--width", "200", "--out", "film.gif"],
        *(["export", run, "--format", form, "--out", f"run.{form}"] for form in ("csv", "vtkhdf")),
        ["report", run, swept, "--out", "report.html"],
    ]
    command = [sys.executable, "-c", SOLVER_FREE.format(calls=calls)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
