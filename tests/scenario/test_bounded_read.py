"""Files of others: read up to a size, and only where they are files, whoever opens them."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from blocksim.errors import InputMissingError, InvalidInputError
from blocksim.scenario.input_files import read_limited, refuse_large

READERS = pytest.mark.parametrize("read", [read_limited, refuse_large])
Reader = Callable[[Path, int], object]


@READERS
def test_a_file_is_read_up_to_the_limit(tmp_path: Path, read: Reader) -> None:
    path = tmp_path / "data"
    path.write_bytes(b"0123456789")
    assert read(path, 10) in {b"0123456789", None}
    with pytest.raises(InvalidInputError, match="data: larger than 9e-06 MB"):
        read(path, 9)


@READERS
def test_what_is_missing_is_reported_so(tmp_path: Path, read: Reader) -> None:
    for name in ("nothing", "x" * 300, "a\0b"):
        with pytest.raises(InputMissingError):
            read(tmp_path / name, 10)


@READERS
def test_pipes_devices_and_folders_are_not_waited_for(tmp_path: Path, read: Reader) -> None:
    os.mkfifo(tmp_path / "pipe")
    for place in (tmp_path / "pipe", tmp_path, Path(os.devnull), Path("/dev/zero")):
        with pytest.raises(InvalidInputError, match="not a file"):
            read(place, 10)


def test_a_file_of_holes_is_refused_without_reading_it(tmp_path: Path) -> None:
    with (tmp_path / "huge").open("wb") as file:
        file.truncate(1 << 42)
    with pytest.raises(InvalidInputError, match="larger than 1 MB"):
        read_limited(tmp_path / "huge", 1_000_000)
