"""A run whose results are damaged: as it finished, as a kill leaves it, and as a stranger may have written it."""

import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from blocksim.scenario import Model, load_scenario
from blocksim.simulation.instruments import Frame, Recorder
from blocksim.simulation.stores.hdf5 import FrameFile, read_frames
from tests.fuzz.child import Child

FRAMES = ("run.h5", "killed.h5", "old.h5")
SOFT = ("--set", "contact.stiffness_scale=0.001", "--set", "time.end=0.05")
COMPILING = 500.0  # s, where the kernels are not there yet


@dataclass(frozen=True)
class Run:
    """A folder with the runs `good` and `bad`, and what the files of `good` hold; more frames beside them."""

    folder: Path
    files: dict[str, bytes]


def finished_run(child: Child, folder: Path, scenario: Path) -> Run:
    """Run a scenario for a moment."""
    left = child.call(folder, "run", scenario, *SOFT, "--out", "good", "--quiet", patience=COMPILING)
    assert left.code == 0, left
    child.close()  # the compiler has taken memory that no later command needs
    shutil.copytree(folder / "good", folder / "bad")
    files = {path.name: path.read_bytes() for path in (folder / "good").iterdir()}
    return Run(folder, {**files, "killed.h5": _left_open(folder / "good"), "old.h5": _rewritten(folder / "good")})


def _left_open(folder: Path) -> bytes:
    """Return the frames of a run as they lie on the disk while it continues, which is how a kill leaves them."""
    scenario = load_scenario(folder / "scenario.toml")
    frames = read_frames(folder / "run.h5", Model(scenario))
    motion = np.stack([frames.x, frames.y, frames.angle, frames.vx, frames.vy, frames.spin], axis=1)
    rows = np.stack([*frames.energy.values(), frames.contact_count, frames.largest_overlap], axis=1)
    path = folder / "killed.h5"
    with FrameFile(path, Recorder(Model(scenario).bodies, 1.0, 1e-5), "", list(frames.energy)) as sink:
        for step, moving, row in zip(frames.step.tolist(), motion, rows, strict=True):
            sink.append(Frame(step, (moving,), row))
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
