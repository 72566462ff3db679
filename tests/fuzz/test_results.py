"""Results that are damaged or made by a stranger: told in a line, drawn as far as they can be, and nothing worse."""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from blocksim.scenario import load_scenario, place_bodies
from blocksim.simulation.recorder import Frame
from blocksim.simulation.stores.hdf5_reader import read_frames
from blocksim.simulation.stores.hdf5_writer import FrameFile
from tests.fuzz.conftest import LONG, QUICK, ROOT, assert_harmless
from tests.fuzz.mutations import BINARY, JSON, SCENARIO, TABLE, damaged

if TYPE_CHECKING:
    from pathlib import Path

    from tests.fuzz.child import Child

FRAMES = ("run.h5", "killed.h5", "old.h5")
WAYS = {**dict.fromkeys(FRAMES, BINARY), "run.json": JSON, "final.csv": TABLE, "scenario.toml": SCENARIO}
COMMANDS = (
    ("export", "bad", "--out", "all.csv"),
    ("export", "bad", "--format", "vtkhdf", "--out", "all.vtkhdf"),
    ("compare", "bad"),
    ("report", "bad", "--out", "report.html"),
    ("plot", "bad", "--out", "strip.png"),
    ("plot", "bad", "--kind", "history", "--out", "history.svg"),
)
OFTEN = tuple(command for command in COMMANDS for _ in range(1 if command[0] == "plot" else 3))
CODES = {0, 1, 65, 66}
SOFT = ("--set", "contact.stiffness_scale=0.001", "--set", "time.end=0.05")


@pytest.fixture(scope="module")
def run(child: Child, folder: Path) -> dict[str, bytes]:
    """Give the files of a finished run, and its frames as a killed run leaves them; all commands have been tried."""
    scenario = ROOT / "scenarios" / "three_blocks_nominal.toml"
    left = child.call(folder, "run", scenario, *SOFT, "--out", "good", "--quiet")
    assert left.code == 0, left
    shutil.copytree(folder / "good", folder / "bad")
    for command in COMMANDS:
        assert child.call(folder, *command).code in {0, 1}, command
    names = [path.name for path in (folder / "good").iterdir()]
    files = {name: (folder / "good" / name).read_bytes() for name in names}
    child.close()  # the compiler has taken memory that no later command needs
    return {**files, "killed.h5": _left_open(folder / "good"), "old.h5": _rewritten(folder / "good")}


def _left_open(folder: Path) -> bytes:
    """Return the frames of a run as they lie on the disk while it goes on, which is how a kill leaves them."""
    scenario = load_scenario(folder / "scenario.toml")
    frames = read_frames(folder / "run.h5", scenario)
    motion = np.stack([frames.x, frames.y, frames.angle, frames.vx, frames.vy, frames.spin], axis=1)
    rows = np.stack([*frames.energy.values(), frames.contact_count, frames.largest_overlap], axis=1)
    path = folder / "killed.h5"
    with FrameFile(path, place_bodies(scenario), 1e-5, "", ledger=list(frames.energy)) as sink:
        for step, moving, row in zip(frames.step.tolist(), motion, rows, strict=True):
            sink.append(Frame(step, moving, row))
        sink.commit()
        content = path.read_bytes()
    path.unlink()
    return content


def _rewritten(folder: Path) -> bytes:
    """Return the frames in HDF5's oldest format, whose structures have no checksums to catch the damage."""
    path = folder / "old.h5"
    with h5py.File(folder / "run.h5") as source, h5py.File(path, "w", libver="earliest") as target:

        def copy(name: str, found: Any) -> None:
            if isinstance(found, h5py.Dataset):
                made = target.create_dataset(name, data=found[()], chunks=True if found.chunks else None)
                made.attrs.update(found.attrs)

        source.visititems(copy)
    content = path.read_bytes()
    path.unlink()
    return content


def _damage(data: st.DataObject, run: dict[str, bytes], bad: Path) -> str:
    """Write all files of the run, one of them damaged or in the place of another; return its name."""
    name = data.draw(st.sampled_from(sorted(WAYS)))
    content = data.draw(damaged(run[name], WAYS[name]))
    if data.draw(st.integers(0, 19)) == 0:
        content = run[data.draw(st.sampled_from(sorted(run)))]
    place = "run.h5" if name in FRAMES else name
    for one in run.keys() - FRAMES[1:]:
        (bad / one).write_bytes(content if one == place else run[one])
    return place


def _try(child: Child, folder: Path, run: dict[str, bytes], data: st.DataObject) -> None:
    place = _damage(data, run, folder / "bad")
    left = child.call(folder, *data.draw(st.sampled_from(OFTEN)))
    assert_harmless(left, CODES)
    if left.code == 65:
        assert f"bad/{place}" in left.err, left.err


@settings(max_examples=QUICK)
@given(data=st.data())
def test_damaged_results_are_told_in_a_line(
    child: Child, folder: Path, run: dict[str, bytes], data: st.DataObject
) -> None:
    _try(child, folder, run, data)


@pytest.mark.long
@settings(LONG, max_examples=500)
@given(data=st.data())
def test_five_hundred_damaged_results(child: Child, folder: Path, run: dict[str, bytes], data: st.DataObject) -> None:
    _try(child, folder, run, data)
