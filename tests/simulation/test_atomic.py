"""A file is whole or not there."""

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
