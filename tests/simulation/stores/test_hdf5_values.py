"""What was written into run.h5 comes back under its own name, whatever the same reader read before."""

from pathlib import Path

import h5py
import numpy as np

from blocksim.scenario import place_bodies
from blocksim.simulation.instruments import MOTION, Frame, Recorder
from blocksim.simulation.schemes import SCHEMES
from blocksim.simulation.stores.hdf5 import FrameFile, read_frames
from tests.simulation.conftest import Shipped

STEP = 1e-6  # s


def test_every_number_comes_back_under_its_name(soft: Shipped, tmp_path: Path) -> None:
    scheme, scenario = SCHEMES["explicit"], soft()
    random = np.random.default_rng(1)
    rows = [(random.random((len(MOTION), 3)), random.random(len(scheme.row_names))) for _ in range(3)]
    written = [Frame(step, (motion,), measured) for step, (motion, measured) in zip((0, 5, 7), rows, strict=True)]
    path = tmp_path / "run.h5"
    with FrameFile(path, Recorder(place_bodies(scenario), 1.0, STEP), "schema = 1\n", scheme.ledger) as file:
        for frame in written:
            file.append(frame)
    back = read_frames(path, scenario)
    assert back.step.tolist() == [0, 5, 7]
    assert back.time.tolist() == [0.0, 5 * STEP, 7 * STEP]
    for place, name in enumerate(MOTION):
        np.testing.assert_array_equal(getattr(back, name), [frame.states[0][place] for frame in written], err_msg=name)
    energies = [*back.energy.values(), back.contact_count, back.largest_overlap]
    assert list(back.energy) == list(scheme.ledger)
    np.testing.assert_array_equal(np.stack(energies, axis=1), [frame.measured for frame in written])


def test_frames_beyond_what_was_committed_do_not_count(soft: Shipped, tmp_path: Path) -> None:
    scheme, scenario, path = SCHEMES["explicit"], soft(), tmp_path / "run.h5"
    with FrameFile(path, Recorder(place_bodies(scenario), 1.0, STEP), "schema = 1\n", scheme.ledger) as file:
        for step in range(3):
            file.append(Frame(step, (np.zeros((len(MOTION), 3)),), np.zeros(len(scheme.row_names))))
    with h5py.File(path, "r+") as stored:
        stored["n_committed"][()] = 2  # killed after the third was written, before it was announced
    back = read_frames(path, scenario)
    assert (back.step.tolist(), back.x.shape) == ([0, 1], (2, 3))


def test_outlines_are_stored_once_and_rectangles_store_none(soft: Shipped, tmp_path: Path) -> None:
    scheme, scenario = SCHEMES["explicit"], soft()
    first, *others = place_bodies(scenario)
    wedge = ((-0.01, -0.01), (0.02, -0.01), (-0.01, 0.02))
    for placed, name in (((first, *others), "plain"), ((first._replace(outline=wedge), *others), "outlined")):
        with FrameFile(tmp_path / name, Recorder(placed, 1.0, STEP), "schema = 1\n", scheme.ledger):
            pass
    with h5py.File(tmp_path / "plain") as plain, h5py.File(tmp_path / "outlined") as outlined:
        assert "outlines" not in plain["particles/blocks"]
        stored = outlined["particles/blocks/outlines"]
        assert stored.attrs["unit"] == "m"
        np.testing.assert_array_equal(stored[0], [*wedge, wedge[-1]])
        np.testing.assert_array_equal(stored[1], others[0].corners)
