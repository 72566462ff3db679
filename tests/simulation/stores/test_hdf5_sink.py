"""HDF5 files on a disk that fills: HDF5 sees a file that works, the writer hears of the trouble."""

import errno
import os
from pathlib import Path

import h5py
import numpy as np
import pytest

from blocksim.simulation.stores.hdf5_files import SafeFile, Sink

ROWS = np.arange(50_000.0)


def write(path: Path) -> None:
    path.touch()
    with SafeFile(path) as safe:
        for name in "abcd":
            safe.file.create_dataset(name, data=ROWS, chunks=(5000,), compression="gzip")
            safe.check()


def test_file_is_as_hdf5_would_write_it(tmp_path: Path) -> None:
    write(tmp_path / "a.h5")
    with h5py.File(tmp_path / "a.h5") as file:
        for name in "abcd":
            np.testing.assert_array_equal(file[name][()], ROWS)


@pytest.mark.parametrize("room", [0, 100, 3_000, 50_000, 150_000])
def test_full_disk_is_an_error_and_not_the_end_of_the_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, room: int
) -> None:
    plain = os.pwrite

    def write_where_there_is_room(handle: int, content: bytes, place: int) -> int:
        if place + len(content) > room:
            raise OSError(errno.ENOSPC, "No space left on device")
        return plain(handle, content, place)

    monkeypatch.setattr("os.pwrite", write_where_there_is_room)
    with pytest.raises(OSError, match="No space left"):
        write(tmp_path / "a.h5")
    assert (tmp_path / "a.h5").stat().st_size <= room


def test_what_the_disk_did_not_take_can_be_read_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a").write_bytes(b"0123456789")
    sink = Sink(tmp_path / "a")

    def fail(*_: object) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("os.pwrite", fail)
    for place, content in ((8, b"ABCD"), (2, b"ab"), (3, b"c")):
        sink.seek(place)
        assert sink.write(content) == len(content)
    sink.seek(0)
    assert sink.read(14) == b"01ac4567ABCD\0\0"
    assert sink.seek(0, os.SEEK_END) == 12
    sink.close()
