"""run.h5: complete, with units, and readable when cut off, damaged or still open."""

import shutil
import time
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from blocksim.errors import InputMissingError, InvalidInputError, OutputError
from blocksim.scenario import place_bodies
from blocksim.simulation import Result
from blocksim.simulation.instruments import MOTION, Frame, Recorder
from blocksim.simulation.schemes import SCHEMES
from blocksim.simulation.stores.hdf5 import FrameFile, read_frames
from tests.simulation.conftest import Shipped

UNITS = {"x": "m", "angle": "rad", "vy": "m s-1", "spin": "rad s-1", "time": "s", "mass": "kg", "inertia": "kg m2"}


MEASURED = SCHEMES["explicit"].row_names


def file_of(result: Result) -> Path:
    assert result.folder is not None
    return result.folder / "run.h5"


def open_file(path: Path, soft: Shipped) -> FrameFile:
    return FrameFile(path, Recorder(place_bodies(soft()), 1.0, 1e-6), "schema = 1\n", SCHEMES["explicit"].ledger)


def add_frames(sink: FrameFile, count: int) -> None:
    for step in range(count):
        sink.append(Frame(step, (np.full((len(MOTION), 3), float(step)),), np.full(len(MEASURED), float(step))))


def test_every_data_set_says_its_unit(kept: Result) -> None:
    units: dict[str, str] = {}

    def note_unit(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset):
            units[name.rpartition("/")[2]] = item.attrs["unit"]

    with h5py.File(file_of(kept), "r") as file:
        file.visititems(note_unit)
    assert set(MOTION) | set(MEASURED) | {"step", "time", "n_committed", "scenario"} <= set(units)
    assert UNITS.items() <= units.items()
    assert {units[name] for name in ("kinetic", "potential", "friction", "dashpot")} == {"J"}


def test_file_alone_tells_scenario_and_bodies(kept: Result) -> None:
    assert kept.folder is not None
    with h5py.File(file_of(kept), "r") as file:
        assert bytes(file["parameters/scenario"][()]).decode() == (kept.folder / "scenario.toml").read_text()
        np.testing.assert_allclose(file["particles/blocks/mass"][:], 0.10887, rtol=1e-4)
        np.testing.assert_array_equal(file["particles/blocks/time"][:], kept.frames.time)
        assert int(file["n_committed"][()]) == len(kept.frames)


def test_file_of_a_run_under_way_can_be_read(soft: Shipped, tmp_path: Path) -> None:
    with open_file(tmp_path / "run.h5", soft) as sink:
        add_frames(sink, 3)
        sink.commit()
        assert len(read_frames(tmp_path / "run.h5", soft())) == 3
        add_frames(sink, 200)
        assert len(read_frames(tmp_path / "run.h5", soft())) == 3
    frames = read_frames(tmp_path / "run.h5", soft())
    assert len(frames) == 203
    assert frames.x[-1].tolist() == [199.0] * 3


def test_a_flush_that_takes_long_is_a_tenth_of_the_time_at_most(soft: Shipped, tmp_path: Path) -> None:
    with open_file(tmp_path / "run.h5", soft) as sink:
        for took, waiting in ((60.0, 1), (0.0, 0)):
            sink.flushed_at, sink.flush_seconds = time.monotonic() - 300.0, took
            add_frames(sink, 1)
            assert len(sink.waiting) == waiting


@pytest.mark.parametrize("size", [0, 7, 60, 3000])
def test_file_that_is_cut_off_is_refused(kept: Result, soft: Shipped, tmp_path: Path, size: int) -> None:
    (tmp_path / "run.h5").write_bytes(file_of(kept).read_bytes()[:size])
    with pytest.raises(InvalidInputError, match=r"run\.h5: not a "):
        read_frames(tmp_path / "run.h5", soft())


def test_open_file_that_is_cut_off_is_refused_and_not_waited_for(soft: Shipped, tmp_path: Path) -> None:
    with open_file(tmp_path / "run.h5", soft) as sink:
        add_frames(sink, 100)
        sink.commit()
        (tmp_path / "cut.h5").write_bytes((tmp_path / "run.h5").read_bytes()[:3000])
    with pytest.raises(InvalidInputError, match="cut off at 3000 of"):
        read_frames(tmp_path / "cut.h5", soft())


@pytest.mark.parametrize("name", ["n_committed", "particles/blocks/x", "observables", "particles/blocks/step"])
def test_missing_data_set_is_refused(kept: Result, soft: Shipped, tmp_path: Path, name: str) -> None:
    shutil.copyfile(file_of(kept), tmp_path / "run.h5")
    with h5py.File(tmp_path / "run.h5", "r+") as file:
        del file[name]
    with pytest.raises(InvalidInputError, match="not a complete run file"):
        read_frames(tmp_path / "run.h5", soft())


def test_file_of_other_bodies_is_refused(kept: Result, soft: Shipped) -> None:
    with pytest.raises(InvalidInputError, match="holds 3 bodies, not 10"):
        read_frames(file_of(kept), soft("tower"))


def test_file_without_a_frame_says_so(soft: Shipped, tmp_path: Path) -> None:
    scenario = soft()
    with FrameFile(tmp_path / "run.h5", Recorder(place_bodies(scenario), 1.0, 1e-6), "", ()):
        pass
    with pytest.raises(InvalidInputError, match="holds no frame: the run was killed before its first one"):
        read_frames(tmp_path / "run.h5", scenario)


def test_missing_file_is_reported(soft: Shipped, tmp_path: Path) -> None:
    with pytest.raises(InputMissingError, match="no such file"):
        read_frames(tmp_path / "run.h5", soft())


def test_full_disk_is_one_message_and_the_file_stays_readable(
    soft: Shipped, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_room(*_: object) -> None:
        raise OSError(28, "No space left on device")

    def fill_disk() -> None:
        with open_file(tmp_path / "run.h5", soft) as sink:
            add_frames(sink, 4)
            sink.commit()
            monkeypatch.setattr("os.posix_fallocate", no_room)
            add_frames(sink, 4)
            sink.commit()

    with pytest.raises(OutputError, match=r"run\.h5: cannot be written: No space left on device"):
        fill_disk()
    assert len(read_frames(tmp_path / "run.h5", soft())) == 4


def test_folder_that_cannot_be_written_is_reported(soft: Shipped, tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="No such file or directory"):
        open_file(tmp_path / "nowhere" / "run.h5", soft)
