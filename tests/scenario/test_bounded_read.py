"""Files of others: read up to a size, and only where they are files."""

import os
from pathlib import Path

import pytest

from blocksim.errors import InputMissingError, InvalidInputError
from blocksim.scenario.input_files import read_limited, refuse_large


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Return a file of ten bytes."""
    path = tmp_path / "data"
    path.write_bytes(b"0123456789")
    return path


def test_a_file_of_the_limit_is_read_whole(path: Path) -> None:
    assert read_limited(path, 10) == b"0123456789"


def test_a_larger_file_is_refused(path: Path) -> None:
    with pytest.raises(InvalidInputError, match="data: larger than 9e-06 MB"):
        read_limited(path, 9)


def test_a_file_of_holes_is_refused_without_reading_it(tmp_path: Path) -> None:
    with (tmp_path / "huge").open("wb") as file:
        file.truncate(1 << 42)
    with pytest.raises(InvalidInputError, match="larger than 1 MB"):
        read_limited(tmp_path / "huge", 1_000_000)


def test_what_is_missing_is_reported_so(tmp_path: Path) -> None:
    for name in ("nothing", "x" * 300, "a\0b"):
        with pytest.raises(InputMissingError):
            read_limited(tmp_path / name, 10)


def test_pipes_devices_and_folders_are_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for place in (tmp_path / "pipe", tmp_path, Path(os.devnull), Path("/dev/zero")):
        with pytest.raises(InvalidInputError, match="not a file"):
            read_limited(place, 10)


def test_files_that_a_library_opens_are_held_to_the_same(path: Path, tmp_path: Path) -> None:
    refuse_large(path, 10)
    for place, limit, told in ((path, 9, "larger than"), (tmp_path, 10, "not a file")):
        with pytest.raises(InvalidInputError, match=told):
            refuse_large(place, limit)
    for name in ("nothing", "x" * 300, "a\0b"):
        with pytest.raises(InputMissingError):
            refuse_large(tmp_path / name, 10)
