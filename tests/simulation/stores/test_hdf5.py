"""run.h5: every number comes back under its name and unit, all that is committed, whatever happens to the writer."""

import shutil
import time
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from blocksim.errors import InvalidInputError, OutputError
from blocksim.scenario import PlacedBody, Scenario, place_bodies
from blocksim.simulation import Result
from blocksim.simulation.instruments import MOTION, Frame, Recorder
from blocksim.simulation.schemes import SCHEMES
from blocksim.simulation.stores.hdf5 import FrameFile, read_frames
from blocksim.simulation.trajectory import CONTACT_ROW, Rows
from tests.simulation.conftest import Shipped

UNITS = {"x": "m", "angle": "rad", "vy": "m s-1", "spin": "rad s-1", "time": "s", "mass": "kg", "inertia": "kg m2"}
SCHEME = SCHEMES["explicit"]
STEP = 1e-6  # s


@pytest.fixture(scope="module")
def scenario(soft: Shipped) -> Scenario:
    return soft(output__contacts=True)


def opened(path: Path, placed: tuple[PlacedBody, ...], *, contacts: bool = False) -> FrameFile:
    return FrameFile(path, Recorder(placed, 1.0, STEP, contacts=contacts), "schema = 1\n", SCHEME.ledger)


def table_of(step: int) -> Rows:
    """Return some contacts at places that tell them apart."""
    rows = np.zeros(step % 3, CONTACT_ROW)
    rows["x"] = step + 0.25 * np.arange(len(rows))
    rows["body_b"] = -1
    return rows


def add_frames(sink: FrameFile, first: int, last: int) -> None:
    for step in range(first, last):
        motion, measured = np.full((len(MOTION), 3), float(step)), np.full(len(SCHEME.row_names), float(step))
        sink.append(Frame(step, (motion,), measured, table_of(step)))


def test_file_alone_tells_scenario_bodies_and_units(kept: Result, folder: Path) -> None:
    units: dict[str, str] = {}

    def note_unit(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset):
            units[name.rpartition("/")[2]] = item.attrs["unit"]

    with h5py.File(folder / "run.h5", "r") as file:
        file.visititems(note_unit)
        assert bytes(file["parameters/scenario"][()]).decode() == (folder / "scenario.toml").read_text()
        np.testing.assert_allclose(file["particles/blocks/mass"][:], 0.10887, rtol=1e-4)
        np.testing.assert_array_equal(file["particles/blocks/time"][:], kept.frames.time)
        assert int(file["n_committed"][()]) == len(kept.frames)
    assert set(MOTION) | set(SCHEME.row_names) | {"step", "time", "n_committed", "scenario"} <= set(units)
    assert UNITS.items() <= units.items()
    assert {units[name] for name in ("kinetic", "potential", "friction", "dashpot")} == {"J"}


def test_every_number_comes_back_under_its_name(scenario: Scenario, tmp_path: Path) -> None:
    random, path = np.random.default_rng(1), tmp_path / "run.h5"
    rows = [(random.random((len(MOTION), 3)), random.random(len(SCHEME.row_names))) for _ in range(3)]
    written = [Frame(step, (motion,), measured) for step, (motion, measured) in zip((0, 5, 7), rows, strict=True)]
    with opened(path, place_bodies(scenario)) as sink:
        for frame in written:
            sink.append(frame)
    back = read_frames(path, scenario)
    assert back.step.tolist() == [0, 5, 7]
    assert back.time.tolist() == [0.0, 5 * STEP, 7 * STEP]
    for place, name in enumerate(MOTION):
        np.testing.assert_array_equal(getattr(back, name), [frame.states[0][place] for frame in written], err_msg=name)
    energies = [*back.energy.values(), back.contact_count, back.largest_overlap]
    assert list(back.energy) == list(SCHEME.ledger)
    np.testing.assert_array_equal(np.stack(energies, axis=1), [frame.measured for frame in written])


def test_what_was_committed_is_there_under_way_and_after_a_kill(scenario: Scenario, tmp_path: Path) -> None:
    path, killed = tmp_path / "run.h5", tmp_path / "killed.h5"
    with opened(path, place_bodies(scenario), contacts=True) as sink:
        add_frames(sink, 0, 1000)
        sink.commit()
        add_frames(sink, 1000, 1400)
        assert len(read_frames(path, scenario)) == 1000
        shutil.copyfile(path, killed)  # the writer never closed this one
    for file, count in ((killed, 1000), (path, 1400)):
        frames = read_frames(file, scenario)
        assert frames.contacts is not None
        assert len(frames) == len(frames.contacts) == count
        assert frames.x[-1].tolist() == [count - 1.0] * 3
        for step in (0, 1, 2, 500, count - 1):
            np.testing.assert_array_equal(frames.contacts.at(step), table_of(step))
    with h5py.File(path, "r+") as stored:
        stored["n_committed"][()] = 2  # killed after the third was written, before it was announced
    assert read_frames(path, scenario).step.tolist() == [0, 1]
    with h5py.File(path, "r+") as stored:
        stored["n_committed"][()] = 1400
        stored["contacts/normal_force"].resize(3, axis=0)
    with pytest.raises(InvalidInputError, match="contacts/normal_force: holds 3 contacts, not 1399"):
        read_frames(path, scenario)


def test_outlines_are_stored_once_and_rectangles_store_none(scenario: Scenario, tmp_path: Path) -> None:
    first, *others = place_bodies(scenario)
    wedge = ((-0.01, -0.01), (0.02, -0.01), (-0.01, 0.02))
    for placed, name in (((first, *others), "plain"), ((first._replace(outline=wedge), *others), "outlined")):
        opened(tmp_path / name, placed).close()
    with h5py.File(tmp_path / "plain") as plain, h5py.File(tmp_path / "outlined") as outlined:
        assert "outlines" not in plain["particles/blocks"]
        stored = outlined["particles/blocks/outlines"]
        assert stored.attrs["unit"] == "m"
        np.testing.assert_array_equal(stored[0], [*wedge, wedge[-1]])
        np.testing.assert_array_equal(stored[1], others[0].corners)


def test_a_flush_that_takes_long_is_a_tenth_of_the_time_at_most(scenario: Scenario, tmp_path: Path) -> None:
    with opened(tmp_path / "run.h5", place_bodies(scenario)) as sink:
        for took, waiting in ((60.0, 1), (0.0, 0)):
            sink.flushed_at, sink.flush_seconds = time.monotonic() - 300.0, took
            add_frames(sink, 0, 1)
            assert len(sink.waiting) == waiting


def test_full_disk_is_one_message_and_the_file_stays_readable(
    scenario: Scenario, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_room(*_: object) -> None:
        raise OSError(28, "No space left on device")

    def fill_disk() -> None:
        with opened(tmp_path / "run.h5", place_bodies(scenario)) as sink:
            add_frames(sink, 0, 4)
            sink.commit()
            monkeypatch.setattr("os.posix_fallocate", no_room)
            add_frames(sink, 4, 8)
            sink.commit()

    with pytest.raises(OutputError, match=r"run\.h5: cannot be written: No space left on device"):
        fill_disk()
    assert len(read_frames(tmp_path / "run.h5", scenario)) == 4
    with pytest.raises(OutputError, match="No such file or directory"):
        opened(tmp_path / "nowhere" / "run.h5", place_bodies(scenario))
