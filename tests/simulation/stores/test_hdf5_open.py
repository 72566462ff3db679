"""Run files of writers that have not closed them: read as they are, and damaged ones refused at once."""

import time
from pathlib import Path

import h5py
import numpy as np
import pytest

from blocksim.errors import InvalidInputError
from blocksim.scenario import Scenario, place_bodies, scenario_from_mapping
from blocksim.simulation.instruments import MOTION, Frame, Recorder
from blocksim.simulation.stores.hdf5 import SUPERBLOCK, FrameFile, is_left_open, lookup3, open_hdf5, read_frames

FRAMES = 300


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    """Return one block."""
    return scenario_from_mapping(
        {
            "schema": 1,
            "name": "one",
            "structures": [{"kind": "stack", "block": "brick", "count": 1}],
            "materials": {"steel": {"density": 7850, "young_modulus": 210e9, "poisson_ratio": 0.3}},
            "blocks": {"brick": {"width": 0.04, "height": 0.02, "length": 0.06, "material": "steel"}},
        }
    )


@pytest.fixture
def killed(scenario: Scenario, tmp_path: Path) -> Path:
    """Return a file as it lies on the disk while its writer is at work."""
    path = tmp_path / "run.h5"
    with FrameFile(tmp_path / "going_on.h5", Recorder(place_bodies(scenario), 1.0, 1e-5), "", ("kinetic",)) as sink:
        for step in range(FRAMES):
            sink.append(Frame(step, (np.full((len(MOTION), 1), step),), np.ones(3)))
        sink.commit()
        path.write_bytes((tmp_path / "going_on.h5").read_bytes())
    return path


def test_checksums_are_those_that_hdf5_writes(tmp_path: Path) -> None:
    for number in range(20):
        path = tmp_path / f"{number}.h5"
        with h5py.File(path, "w", libver="latest") as file:
            file["x"] = np.ones(100 * number)
        head = path.read_bytes()[: SUPERBLOCK.size]
        assert lookup3(head[:-4]) == int.from_bytes(head[-4:], "little")


def test_a_file_that_was_not_closed_gives_all_committed_frames(killed: Path, scenario: Scenario) -> None:
    assert is_left_open(killed)
    with pytest.raises(OSError, match="already open for write"):
        h5py.File(killed, "r")
    before = killed.read_bytes()
    frames = read_frames(killed, scenario)
    assert frames.x[:, 0].tolist() == list(range(FRAMES))
    assert killed.read_bytes() == before, "reading has changed the file"


def test_damage_in_a_file_that_was_not_closed_is_reported_at_once(killed: Path, scenario: Scenario) -> None:
    content = bytearray(killed.read_bytes())  # HDF5 in SWMR mode reads structures with a wrong checksum for ever
    content[60:200] = bytes(140)
    killed.write_bytes(content)
    began = time.process_time()
    with pytest.raises(InvalidInputError, match=r"run\.h5: not a "):
        read_frames(killed, scenario)
    assert time.process_time() - began < 5.0


def test_a_damaged_superblock_is_not_made_whole(killed: Path) -> None:
    content = bytearray(killed.read_bytes())
    content[36] ^= 1  # the address of the root group
    killed.write_bytes(content)
    with pytest.raises(InvalidInputError, match="its superblock is damaged"), open_hdf5(killed):
        pass
