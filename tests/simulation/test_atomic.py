"""A file is whole or not there."""

import errno
import os
import stat
import subprocess
import sys
from collections.abc import Iterator
from contextlib import nullcontext
from pathlib import Path

import pytest

from blocksim.errors import OutputError
from blocksim.simulation import files
from blocksim.study.manifest import Manifest


def test_text_is_written_in_utf8_with_plain_line_ends(tmp_path: Path) -> None:
    files.write_text(tmp_path / "a.txt", "±\n")
    assert (tmp_path / "a.txt").read_bytes() == "±\n".encode()


def test_failed_write_leaves_the_old_file_and_nothing_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.txt").write_text("old")

    def fail(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", fail)
    with pytest.raises(OutputError, match=r"a\.txt: cannot be written: No space left on device"):
        files.write_text(tmp_path / "a.txt", "new")
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a.txt": "old"}


@pytest.fixture
def umask() -> Iterator[None]:
    """Restore the umask."""
    before = os.umask(0o022)
    yield
    os.umask(before)


def mode_of(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


@pytest.mark.parametrize(("mask", "mode"), [(0o077, 0o600), (0o027, 0o640), (0o002, 0o664)])
@pytest.mark.usefixtures("umask")
def test_a_new_file_has_the_permissions_that_the_umask_leaves(tmp_path: Path, mask: int, mode: int) -> None:
    os.umask(mask)
    files.write_text(tmp_path / "a.csv", "x")
    Manifest(tmp_path / "manifest.jsonl").close()
    assert {mode_of(path) for path in tmp_path.iterdir()} == {mode}


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o444])
@pytest.mark.usefixtures("umask")
def test_a_file_keeps_its_permissions_when_it_is_replaced(tmp_path: Path, mode: int) -> None:
    path = tmp_path / "a.csv"
    path.write_text("old")
    path.chmod(mode)
    with files.atomic_path(path) as temporary:
        assert mode_of(temporary) | 0o200 == mode | 0o200  # what may not be read is at no time there to be read
        temporary.write_text("new")
    assert (path.read_text(), mode_of(path)) == ("new", mode)


WRITER = """
import sys
from pathlib import Path
from blocksim.simulation.files import atomic_path
with atomic_path(Path(sys.argv[1])) as temporary:
    temporary.write_text("half")
    print("half", flush=True)
    sys.stdin.read()
"""


def test_what_a_kill_leaves_goes_with_the_next_write_and_what_others_write_stays(tmp_path: Path) -> None:
    path, edits = tmp_path / "a.csv", tmp_path / ".a.csv.unsaved1.csv"
    edits.write_text("of an editor")
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-c", WRITER, str(path)], stdin=pipe, stdout=pipe) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == b"half\n"
        files.write_text(path, "new")
        assert len(list(tmp_path.iterdir())) == 3  # the other one is still writing
        other.kill()
    files.write_text(path, "newer")
    assert {one.name: one.read_text() for one in tmp_path.iterdir()} == {path.name: "newer", edits.name: "of an editor"}


def test_the_name_goes_to_the_disk_too_once_the_file_has_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[tuple[Path, str]] = []
    monkeypatch.setattr(files, "sync_file", lambda path: synced.append((path, (tmp_path / "a.txt").read_text())))
    files.write_text(tmp_path / "a.txt", "new")
    assert synced == [(tmp_path, "new")]


def test_folder_that_cannot_be_brought_to_the_disk_is_no_failure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for number in (errno.EINVAL, errno.EIO):

        def fail(_: Path, number: int = number) -> None:
            raise OSError(number, "no")

        monkeypatch.setattr(files, "sync_file", fail)
        with nullcontext() if number == errno.EINVAL else pytest.raises(OutputError):
            files.write_text(tmp_path / "a.txt", "new")


def test_a_file_takes_the_place_of_the_older_one_once_it_is_whole(tmp_path: Path) -> None:
    (tmp_path / "a.mp4").write_text("old")
    with files.atomic_path(tmp_path / "a.mp4") as temporary:
        assert temporary.suffix == ".mp4"  # some programs choose the format by it
        temporary.write_text("new")
        assert (tmp_path / "a.mp4").read_text() == "old"
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a.mp4": "new"}
