"""A file is whole or not there."""

import errno
from contextlib import nullcontext
from pathlib import Path

import pytest

from blocksim.errors import OutputError
from blocksim.simulation import atomic


def test_text_is_written_in_utf8_with_plain_line_ends(tmp_path: Path) -> None:
    atomic.write_text(tmp_path / "a.txt", "±\n")
    assert (tmp_path / "a.txt").read_bytes() == "±\n".encode()


def test_failed_write_leaves_the_old_file_and_nothing_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.txt").write_text("old")

    def fail(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", fail)
    with pytest.raises(OutputError, match=r"a\.txt: cannot be written: No space left on device"):
        atomic.write_text(tmp_path / "a.txt", "new")
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a.txt": "old"}


def test_the_name_goes_to_the_disk_too_once_the_file_has_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[tuple[Path, str]] = []
    monkeypatch.setattr(atomic, "sync_file", lambda path: synced.append((path, (tmp_path / "a.txt").read_text())))
    atomic.write_text(tmp_path / "a.txt", "new")
    assert synced == [(tmp_path, "new")]


def test_folder_that_cannot_be_brought_to_the_disk_is_no_failure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for number in (errno.EINVAL, errno.EIO):

        def fail(_: Path, number: int = number) -> None:
            raise OSError(number, "no")

        monkeypatch.setattr(atomic, "sync_file", fail)
        with nullcontext() if number == errno.EINVAL else pytest.raises(OutputError):
            atomic.write_text(tmp_path / "a.txt", "new")


def test_a_file_takes_the_place_of_the_older_one_once_it_is_whole(tmp_path: Path) -> None:
    (tmp_path / "a.mp4").write_text("old")
    with atomic.replacing(tmp_path / "a.mp4") as temporary:
        assert temporary.suffix == ".mp4"  # some programs choose the format by it
        temporary.write_text("new")
        assert (tmp_path / "a.mp4").read_text() == "old"
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a.mp4": "new"}


@pytest.mark.parametrize(
    ("error", "told"), [(OSError(28, "No space left on device"), OutputError), (KeyError(), KeyError)]
)
def test_a_file_that_is_not_finished_leaves_the_older_one(
    tmp_path: Path, error: Exception, told: type[Exception]
) -> None:
    (tmp_path / "a.mp4").write_text("old")

    def begin() -> None:
        with atomic.replacing(tmp_path / "a.mp4") as temporary:
            temporary.write_text("half")
            raise error

    with pytest.raises(told):
        begin()
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a.mp4": "old"}
