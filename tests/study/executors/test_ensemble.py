"""Members run together, and cases kept one by one in folders."""

import os
from pathlib import Path

import pytest

from blocksim.scenario import Document
from blocksim.simulation import files, simulate
from blocksim.simulation.checkpoint import CheckpointPolicy
from blocksim.simulation.results import read_summary
from blocksim.study.executors.ensemble import BATCH, rows_of, run_case, run_members
from blocksim.study.run import run
from tests.study.conftest import SCENARIOS

FRICTION = "friction.block_ground"


@pytest.fixture(scope="module")
def slide() -> Document:
    return Document.read(SCENARIOS / "slide.toml").with_values({"contact.stiffness_scale": 0.001, "time.end": 0.05})


def test_members_end_as_runs_of_their_own_whatever_fails_beside_them(slide: Document) -> None:
    values: list[dict[str, object]] = [
        {FRICTION: 0.3},
        {"bodies.0.y": "11 mm"},  # inside the ground
        {"contact.max_overlap": "1e-12 m"},  # fails on the way
        {"time.step": "1 s"},  # cannot be started
        {FRICTION: 0.4},
    ]
    members = list(run_members(slide, values))
    assert [bool(member.problem) for member in members] == [False, True, True, True, False]
    ends = [simulate(slide.with_values(values[i]).build()).columns for i in (0, 4)]
    assert [member.final for member in members] == [ends[0], None, None, None, ends[1]]


def test_members_keep_their_order_beyond_a_batch(slide: Document) -> None:
    ends = [0.001 + 1e-5 * number for number in range(BATCH + 3)]
    finals = [member.final for member in run_members(slide, ({"time.end": end} for end in ends))]
    places = [final["x_mm"][0] for final in finals if final is not None]
    assert len(places) == len(ends)
    assert places == sorted(places)


def test_blocks_that_settled_have_moved_from_where_they_settled_together_and_in_folders(
    slide: Document, tmp_path: Path
) -> None:
    soft = {"contact.stiffness_scale": 3e-7, "start.settle": True, "bodies.0.velocity": [0.0, 0.0]}
    scenario = slide.with_values({**soft, "ground.tilt": "5 deg"}).build()
    (row,) = rows_of([scenario], 1, peaks=True)
    assert row["outcome"] == "stands"
    assert abs(float(str(row["displacement_mm"]))) < 1e-3
    assert abs(float(str(row["turn_deg"]))) < 1e-3
    assert 12.5 - float(str(row["block.y_mm"])) > 0.01 * 25.0  # that far a block has moved
    assert run_case(scenario, tmp_path / "case") == row
    assert run_case(scenario, tmp_path / "case") == row  # as the folder has it


@pytest.mark.parametrize("lost", [None, "run.h5", "checkpoint.0"])
def test_interrupted_case_continues_where_it_can(nominal: Document, tmp_path: Path, lost: str | None) -> None:
    scenario = nominal.with_values({"time.end": 0.01}).build()
    whole = run_case(scenario, tmp_path / "whole")
    stopped = run(scenario, out=tmp_path / "case", precautions=CheckpointPolicy(wall_time=0.0))
    assert stopped.status == "interrupted"
    if lost is not None:
        (tmp_path / "case" / lost).unlink()
    assert run_case(scenario, tmp_path / "case") == whole
    parts = read_summary(tmp_path / "case" / files.SUMMARY).resumed_from
    assert parts == (() if lost else (stopped.summary.steps,))
    ends = [(tmp_path / name / files.FINAL).read_bytes() for name in ("whole", "case")]
    assert ends[0] == ends[1]


def test_finished_case_whose_frames_were_cut_is_run_again(nominal: Document, tmp_path: Path) -> None:
    scenario = nominal.with_values({"time.end": 0.01}).build()
    row = run_case(scenario, tmp_path)
    frames = (tmp_path / files.FRAMES).read_bytes()
    os.truncate(tmp_path / files.FRAMES, len(frames) // 2)
    assert run_case(scenario, tmp_path) == row
    assert (tmp_path / files.FRAMES).read_bytes() == frames
