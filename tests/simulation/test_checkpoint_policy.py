"""Checkpoints come when they are due, by turns, and never before the frames that they count."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from blocksim.simulation.checkpoint import (
    NEVER,
    CheckpointPolicy,
    CheckpointWriter,
    Past,
    Position,
    origin_of,
    read_checkpoint,
)
from blocksim.simulation.schemes import build_scene
from tests.simulation.sliding import sliding

if TYPE_CHECKING:
    from pathlib import Path

SCENARIO = sliding({})


class Frames:
    """Notes which checkpoints are there when frames go to the disk."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.seen: list[int] = []

    def sync(self) -> None:
        self.seen.append(len(list(self.folder.glob("checkpoint.*"))))


def at(step: int) -> Position:
    return Position(step=step, frames=1, frames_sha256="", start_energy=1.0, solver_seconds=0.5, threads=1)


def steps_in(folder: Path) -> dict[str, int]:
    return {path.name: read_checkpoint(path).head.position.step for path in folder.glob("checkpoint.*")}


def test_two_are_kept_by_turns_after_the_frames(tmp_path: Path) -> None:
    frames = Frames(tmp_path)
    writer = CheckpointWriter(tmp_path, origin_of(SCENARIO), frames.sync)
    scene = build_scene(SCENARIO)
    for step in (10, 20, 30):
        writer.write(scene, at(step))
    assert steps_in(tmp_path) == {"checkpoint.0": 30, "checkpoint.1": 20}
    assert frames.seen == [0, 1, 2]
    writer.write(scene, at(30))  # is there already
    assert frames.seen == [0, 1, 2]


@pytest.mark.parametrize("name", ["checkpoint.0", "checkpoint.1"])
def test_the_one_that_a_run_continues_from_is_replaced_last(tmp_path: Path, name: str) -> None:
    past = Past(resumed_from=(7,), checkpoint=tmp_path / name, step=7)
    writer = CheckpointWriter(tmp_path, origin_of(SCENARIO), Frames(tmp_path).sync, past=past)
    writer.write(build_scene(SCENARIO), at(10))
    (written,) = steps_in(tmp_path)
    assert written != name
    assert read_checkpoint(tmp_path / written).head.position.resumed_from == (7,)


def test_steps_and_simulated_time_are_due_at_their_multiples(tmp_path: Path) -> None:
    periods = CheckpointPolicy(checkpoint_steps=10, checkpoint_time=1.4).periods(0.1)
    writer = CheckpointWriter(tmp_path, origin_of(SCENARIO), Frames(tmp_path).sync, periods)
    assert periods == (10, 14)
    assert [writer.next_step(done) for done in (0, 9, 10, 14, 20)] == [10, 10, 14, 20, 28]
    assert [done for done in range(1, 30) if writer.is_due(done)] == [10, 14, 20, 28]


def test_wall_time_alone_stops_the_loop_nowhere(tmp_path: Path) -> None:
    writer = CheckpointWriter(tmp_path, origin_of(SCENARIO), Frames(tmp_path).sync, seconds=60.0)
    assert writer.next_step(5) == NEVER
    assert not writer.is_due(5)
    writer.seconds = 0.0
    assert writer.is_due(5)
