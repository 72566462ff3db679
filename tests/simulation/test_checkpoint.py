"""Checkpoints: every bit comes back, damage is refused, and they come when due, by turns, after the frames."""

from __future__ import annotations

import json
from hashlib import sha256
from typing import TYPE_CHECKING

import numpy as np
import pytest

from blocksim.errors import InvalidInputError
from blocksim.kernels.common.arrays import CACHE_LINE
from blocksim.simulation.checkpoint import (
    DIGEST_BYTES,
    NEVER,
    CheckpointPolicy,
    CheckpointWriter,
    Past,
    Position,
    origin_of,
    read_checkpoint,
    restore_scene,
    write_checkpoint,
)
from blocksim.simulation.schemes import ALONE, build_scene
from blocksim.world.build import arrays_of
from tests.simulation.sliding import MODELS, sliding

if TYPE_CHECKING:
    from pathlib import Path

SCENARIO = sliding({})


def at(step: int) -> Position:
    return Position(
        step=step, frames=3, frames_sha256="", start_energy=0.1 + 0.2, solver_seconds=1.5, total_seconds=2.5, threads=2
    )


@pytest.mark.parametrize("name", ["surface-linear", "particles-linear", "nonsmooth"])
def test_scene_comes_back_to_the_last_bit_in_arrays_of_the_same_types(tmp_path: Path, name: str) -> None:
    scenario = sliding(MODELS[name])
    scene, _ = ALONE.advance(build_scene(scenario), 20)
    scene.world.bodies[0].torque = -0.0
    scene.world.bodies[0].fx = np.nan
    write_checkpoint(tmp_path / "checkpoint.0", scene, at(100), origin_of(scenario))
    stored = read_checkpoint(tmp_path / "checkpoint.0")
    back = restore_scene(stored, build_scene(scenario))
    assert stored.head.position == at(100)
    assert type(back) is type(scene)
    for one, other in zip(arrays_of(back), arrays_of(scene), strict=True):
        assert (type(one), one.dtype, one.shape) == (type(other), other.dtype, other.shape)
        assert one.size == 0 or one.ctypes.data % CACHE_LINE == 0
        for field in one.dtype.names or (...,):
            assert np.ascontiguousarray(one[field]).tobytes() == np.ascontiguousarray(other[field]).tobytes()
    if name != "surface-linear":
        with pytest.raises(InvalidInputError, match="do not fit this scene"):
            restore_scene(stored, build_scene(SCENARIO))


@pytest.fixture
def written(tmp_path: Path) -> Path:
    """Return a whole checkpoint, to be damaged."""
    write_checkpoint(tmp_path / "checkpoint.0", build_scene(SCENARIO), at(100), origin_of(SCENARIO))
    return tmp_path / "checkpoint.0"


def test_every_flipped_bit_is_seen(written: Path) -> None:
    whole = written.read_bytes()
    for place in np.random.default_rng(1).integers(0, len(whole), 50).tolist():
        content = bytearray(whole)
        content[place] ^= 1 << place % 8
        written.write_bytes(content)
        with pytest.raises(InvalidInputError, match=r"checkpoint\.0: not a complete checkpoint"):
            read_checkpoint(written)


def test_file_that_is_cut_or_whole_but_no_checkpoint_is_refused(written: Path) -> None:
    whole = written.read_bytes()
    others = (b"", b"{}\n", b'{"format": "blocksim checkpoint 1"}\n', b"\x80\x04pickle\n")
    for content in (
        *(whole[:size] for size in (0, 1, 31, 32, 33, 5000)),
        *(one + sha256(one).digest() for one in others),
    ):
        written.write_bytes(content)
        with pytest.raises(InvalidInputError, match="not a complete checkpoint"):
            read_checkpoint(written)


def forged(path: Path, old: bytes, new: bytes) -> Path:
    """Change a checkpoint so that its checksum is right."""
    content = path.read_bytes()[:-DIGEST_BYTES]
    assert old in content
    content = content.replace(old, new, 1)
    path.write_bytes(content + sha256(content).digest())
    return path


def test_array_that_claims_to_fill_all_memory_is_refused(written: Path) -> None:
    first = next(line for line in written.read_bytes().split(b"\x93NUMPY") if b"'shape': (" in line)
    shape = first[first.index(b"'shape': (") :].split(b"}")[0]
    with pytest.raises(InvalidInputError, match="not a complete checkpoint"):
        read_checkpoint(forged(written, shape, b"'shape': (9" + b"9" * (len(shape) - 13) + b",)"))


@pytest.mark.parametrize("shape", ["[-1,-4]", "[4294967296,4294967296]", "[1099511627776,1]", "[-4]"])
def test_shapes_that_no_array_has_are_refused(written: Path, shape: str) -> None:
    old = f",{json.dumps(read_checkpoint(written).head.arrays[0].shape)}]".encode()
    stored = read_checkpoint(forged(written, old, f",{shape}]".encode()))
    with pytest.raises(InvalidInputError, match="does not fit this scene"):
        restore_scene(stored, build_scene(SCENARIO))


def test_checkpoint_larger_than_the_memory_is_not_read(written: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("blocksim.world.free_memory.available_bytes", lambda: 2 * written.stat().st_size)
    with pytest.raises(InvalidInputError, match="of memory are free"):
        read_checkpoint(written)


def steps_in(folder: Path) -> dict[str, int]:
    return {path.name: read_checkpoint(path).head.position.step for path in folder.glob("checkpoint.*")}


def test_two_are_kept_by_turns_after_the_frames(tmp_path: Path) -> None:
    seen: list[int] = []  # checkpoints that are there when frames go to the disk
    scene = build_scene(SCENARIO)
    writer = CheckpointWriter(
        tmp_path, origin_of(SCENARIO), lambda: seen.append(len(list(tmp_path.glob("checkpoint.*"))))
    )
    for step in (10, 20, 30):
        writer.write(scene, at(step))
    assert steps_in(tmp_path) == {"checkpoint.0": 30, "checkpoint.1": 20}
    writer.write(scene, at(30))  # is there already
    assert seen == [0, 1, 2]


@pytest.mark.parametrize("name", ["checkpoint.0", "checkpoint.1"])
def test_the_one_that_a_run_continues_from_is_replaced_last(tmp_path: Path, name: str) -> None:
    past = Past(resumed_from=(7,), checkpoint=tmp_path / name, step=7)
    CheckpointWriter(tmp_path, origin_of(SCENARIO), lambda: None, past=past).write(build_scene(SCENARIO), at(10))
    (written,) = steps_in(tmp_path)
    assert written != name
    assert read_checkpoint(tmp_path / written).head.position.resumed_from == (7,)


def test_steps_and_simulated_time_are_due_at_their_multiples_and_wall_time_stops_the_loop_nowhere(
    tmp_path: Path,
) -> None:
    periods = CheckpointPolicy(checkpoint_steps=10, checkpoint_time=1.4).periods(0.1)
    writer = CheckpointWriter(tmp_path, origin_of(SCENARIO), lambda: None, periods)
    assert periods == (10, 14)
    assert [writer.next_step(done) for done in (0, 9, 10, 14, 20)] == [10, 10, 14, 20, 28]
    assert [done for done in range(1, 30) if writer.is_due(done)] == [10, 14, 20, 28]
    writer = CheckpointWriter(tmp_path, origin_of(SCENARIO), lambda: None, seconds=60.0)
    assert writer.next_step(5) == NEVER
    assert not writer.is_due(5)
    writer.seconds = 0.0
    assert writer.is_due(5)
