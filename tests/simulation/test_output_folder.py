"""Folders for results that cannot be made: what is in the way is reported, and nothing is touched."""

import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from blocksim.errors import OutputError, OutputExistsError
from blocksim.simulation.atomic import write_text
from blocksim.simulation.folder import prepare_folder
from blocksim.simulation.output_folder import make_folder
from blocksim.simulation.table import COLUMNS, csv_text


@pytest.fixture
def read_only(tmp_path: Path) -> Iterator[Path]:
    """Mount a read-only file system; a superuser, who may mount, is not kept out by permissions."""
    place = tmp_path / "read_only"
    place.mkdir()
    try:
        subprocess.run(["mount", "-t", "tmpfs", "-o", "ro", "tmpfs", place], check=True, capture_output=True)  # noqa: S607
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("nothing can be mounted here")
    yield place
    subprocess.run(["umount", place], check=True)  # noqa: S607


def test_a_link_that_leads_nowhere_is_in_the_way(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    for folder in (tmp_path / "link", tmp_path / "link" / "run"):
        with pytest.raises(OutputExistsError, match="link is a link that leads nowhere"):
            prepare_folder(folder, overwrite=True)
    assert not (tmp_path / "nowhere").exists()


def test_a_file_is_in_the_way(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine", encoding="utf-8")
    (tmp_path / "link").symlink_to("file")
    for folder in (tmp_path / "file", tmp_path / "link", tmp_path / "file" / "run"):
        with pytest.raises(OutputExistsError, match="is a file, not a folder"):
            prepare_folder(folder, overwrite=True)
    assert (tmp_path / "file").read_text(encoding="utf-8") == "mine"


def test_a_link_to_a_folder_is_followed(tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "link").symlink_to("elsewhere")
    make_folder(tmp_path / "link" / "run")
    assert (tmp_path / "elsewhere" / "run").is_dir()


def test_a_name_that_is_too_long_is_reported(tmp_path: Path) -> None:
    with pytest.raises(OutputExistsError, match="cannot be created: File name too long"):
        make_folder(tmp_path / ("x" * 300))


def test_what_a_run_replaces_is_a_link_and_not_what_it_leads_to(tmp_path: Path) -> None:
    (tmp_path / "theirs.csv").write_text("theirs", encoding="utf-8")
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / "final.csv").symlink_to(tmp_path / "theirs.csv")
    write_text(folder / "final.csv", csv_text({name: [] for name in COLUMNS}))
    prepare_folder(folder, overwrite=True)
    assert (tmp_path / "theirs.csv").read_text(encoding="utf-8") == "theirs"
    assert list(folder.iterdir()) == []


def test_a_read_only_file_system_is_reported(read_only: Path) -> None:
    with pytest.raises(OutputExistsError, match="run: cannot be created: Read-only file system"):
        make_folder(read_only / "run")
    make_folder(read_only)
    with pytest.raises(OutputError, match="x: cannot be written: Read-only file system"):
        write_text(read_only / "x", "text")
