"""Contacts in run.h5: whole for all frames that are committed, whatever happens to the writer."""

import shutil
from pathlib import Path

import numpy as np

from blocksim.scenario import place_bodies
from blocksim.simulation.instruments import MOTION, Frame, Recorder
from blocksim.simulation.schemes import SCHEMES
from blocksim.simulation.stores.hdf5 import FrameFile, read_frames
from blocksim.simulation.trajectory import CONTACT_ROW, Rows
from tests.simulation.conftest import Shipped

MEASURED = SCHEMES["explicit"].row_names


def table_of(step: int) -> Rows:
    """Return as many contacts as the step has digits of three, at places that tell them apart."""
    rows = np.zeros(step % 3, CONTACT_ROW)
    rows["x"] = step + 0.25 * np.arange(len(rows))
    rows["body_b"] = -1
    return rows


def add_frames(sink: FrameFile, first: int, last: int) -> None:
    for step in range(first, last):
        motion, measured = np.full((len(MOTION), 3), float(step)), np.zeros(len(MEASURED))
        sink.append(Frame(step, (motion,), measured, table_of(step)))


def test_what_was_committed_is_there_after_a_kill(soft: Shipped, tmp_path: Path) -> None:
    scenario = soft(output__contacts=True)
    path, ledger = tmp_path / "run.h5", SCHEMES["explicit"].ledger
    with FrameFile(path, Recorder(place_bodies(scenario), 1.0, 1e-6, contacts=True), "", ledger) as sink:
        add_frames(sink, 0, 1000)
        sink.commit()
        add_frames(sink, 1000, 1400)
        shutil.copyfile(path, tmp_path / "killed.h5")  # the writer never closed this one
    for name, count in (("killed.h5", 1000), ("run.h5", 1400)):
        contacts = read_frames(tmp_path / name, scenario).contacts
        assert contacts is not None
        assert len(contacts) == count
        for step in (0, 1, 2, 500, count - 1):
            np.testing.assert_array_equal(contacts.at(step), table_of(step))
