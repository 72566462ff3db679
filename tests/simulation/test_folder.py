"""Files are whole or not there; nothing that blocksim has not written is removed; no two runs write into one folder."""

import errno
import json
import os
import shutil
import stat
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from pathlib import Path

import h5py
import numpy as np
import pytest

from blocksim.errors import OutputError, OutputExistsError
from blocksim.scenario import Model
from blocksim.simulation import files, renew_copies
from blocksim.simulation.files import (
    clear_remains,
    holds_run,
    prepare_folder,
    refuse_foreign,
    write_text,
)
from blocksim.simulation.trajectory import COLUMNS, csv_text
from blocksim.study.manifest import Manifest
from blocksim.view.animation import write_gif, write_mp4
from blocksim.view.style import open_figure, save_figure
from tests.golden import Golden
from tests.simulation.conftest import SCENARIOS, Shipped


def content_of(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.parametrize("is_killed", [False, True])
@pytest.mark.parametrize("size", [0, 10**9])
def test_runs_of_other_versions_are_runs_whatever_their_words_and_frames(
    copy: Path, size: int, *, is_killed: bool
) -> None:
    wording = "# Resolved by blocksim: every value that was used, in SI units (m, kg, s, N, Pa), angles in rad.\n"
    (copy / "scenario.toml").write_text(wording + (copy / "scenario.toml").read_text().partition("\n")[2])
    (copy / "final.csv").write_text("block,columns,of,another,version\n")
    os.truncate(copy / "run.h5", min(size, (copy / "run.h5").stat().st_size))
    if is_killed:
        for name in ("run.json", "done.json", "final.csv"):
            (copy / name).unlink()
        for name in (".final.csv.k2j3h4_x.csv", ".run.h5.new"):
            (copy / name).write_text("half")
    with pytest.raises(OutputExistsError, match="contains an unfinished run" if is_killed else "contains another run"):
        prepare_folder(copy, overwrite=False)
    prepare_folder(copy, overwrite=True)
    assert not any(copy.iterdir())


def refusal(folder: Path, *, overwrite: bool = True) -> str:
    """Return why a folder is not emptied, and assert that nothing in it is touched."""
    before = content_of(folder)
    with pytest.raises(OutputExistsError) as caught:
        prepare_folder(folder, overwrite=overwrite)
    assert content_of(folder) == before
    return str(caught.value)


TAKEN = ("scenario.toml", "motion.csv", ".final.csv.swp")
RESULTS = ("experiment.csv", "final.csv", "run.h5", "run.json", "done.json", "probe-base.csv")


def test_what_a_person_has_written_is_never_removed(copy: Path, tmp_path: Path, golden: Golden) -> None:
    """Foreign files, files with the names of results, and scenarios that no run has resolved."""
    texts = []
    for name in ("thesis.tex", *TAKEN):
        place = Path(shutil.copytree(copy, tmp_path / f"a run with {name}"))
        (place / name).write_text("years,of,work\n")
        texts += [refusal(place), refusal(place, overwrite=False)]
    for name in (*TAKEN, *RESULTS):
        place = tmp_path / f"only {name}"
        place.mkdir()
        (place / name).write_text("years,of,work\n")
        texts.append(refusal(place))
    (tmp_path / "mine").mkdir()
    shutil.copyfile(SCENARIOS / "tower.toml", tmp_path / "mine" / "scenario.toml")
    texts.append(refusal(tmp_path / "mine"))
    (tmp_path / "broken").symlink_to(tmp_path / "nowhere")
    (tmp_path / "file").write_text("mine", encoding="utf-8")
    (tmp_path / "link").symlink_to("file")
    for name in ("broken", "broken/run", "file", "file/run", "link", "link/run"):
        with pytest.raises(OutputExistsError) as caught:
            prepare_folder(tmp_path / name, overwrite=True)
        texts.append(str(caught.value))
    assert (tmp_path / "file").read_text(encoding="utf-8") == "mine"
    assert not (tmp_path / "nowhere").exists()
    golden("\n".join(texts))


def test_a_link_in_the_place_of_a_result_is_not_removed_but_replaced_and_not_what_it_leads_to(
    copy: Path, tmp_path: Path
) -> None:
    theirs = Path(shutil.move(copy / "final.csv", tmp_path / "theirs.csv"))
    before = theirs.read_bytes()
    (copy / "final.csv").symlink_to(theirs)
    assert "final.csv" in refusal(copy)
    write_text(copy / "final.csv", csv_text({name: [] for name in COLUMNS}))
    assert (theirs.read_bytes(), (copy / "final.csv").is_symlink()) == (before, False)


def test_end_of_a_run_leaves_the_unsaved_edits_of_an_editor(copy: Path) -> None:
    for name in (".final.csv.swp", ".run.h5.new", ".run.json.abcd1234.json"):
        (copy / name).write_text("unsaved")
    clear_remains(copy, ())
    assert {name for name in content_of(copy) if name.startswith(".")} == {".final.csv.swp"}


def test_table_of_a_person_is_neither_replaced_nor_removed_as_a_copy(copy: Path, soft: Shipped) -> None:
    (copy / "motion.csv").write_text("time_s,displacement_mm\n0,0\n1,2\n")
    renew_copies(soft(), copy)
    assert (copy / "motion.csv").is_file()


@pytest.mark.parametrize("text", ["", "[]", "{}", "[" * 100_000, "x" * 2_000_000], ids=lambda text: text[:2])
def test_folder_holds_only_its_own_scenario_and_rubbish_in_done_is_no_finished_run(
    copy: Path, soft: Shipped, text: str
) -> None:
    assert holds_run(copy, Model(soft()))
    assert not holds_run(copy, Model(soft(friction__block_block=0.3)))
    (copy / "done.json").write_text(text)
    assert not holds_run(copy, Model(soft()))


def texts_in(folder: Path) -> dict[str, str]:
    return {path.name: path.read_text(encoding="utf-8") for path in folder.iterdir()}


def test_a_file_takes_the_place_of_the_older_one_once_it_is_whole_and_on_the_disk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    synced: list[tuple[Path, bytes]] = []
    monkeypatch.setattr(files, "sync_file", lambda path: synced.append((path, (tmp_path / "a.txt").read_bytes())))
    (tmp_path / "a.mp4").write_text("old")
    with files.atomic_path(tmp_path / "a.mp4") as temporary:
        assert temporary.suffix == ".mp4"  # some programs choose the format by it
        temporary.write_text("new")
        assert (tmp_path / "a.mp4").read_text() == "old"
        files.write_text(tmp_path / "a.txt", "±\n")
    assert synced[0] == (tmp_path, b"\xc2\xb1\n")  # the name goes to the disk too, once the file has it
    assert texts_in(tmp_path) == {"a.mp4": "new", "a.txt": "±\n"}


def test_failed_write_leaves_the_old_file_and_nothing_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.txt").write_text("old")

    def fail(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", fail)
    with pytest.raises(OutputError, match=r"a\.txt: cannot be written: No space left on device"):
        files.write_text(tmp_path / "a.txt", "new")
    assert texts_in(tmp_path) == {"a.txt": "old"}


@pytest.mark.parametrize("number", [errno.EINVAL, errno.EIO])
def test_folder_that_need_not_be_brought_to_the_disk_is_no_failure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    def fail(_: Path) -> None:
        raise OSError(number, "no")

    monkeypatch.setattr(files, "sync_file", fail)
    with nullcontext() if number == errno.EINVAL else pytest.raises(OutputError):
        files.write_text(tmp_path / "a.txt", "new")


@pytest.fixture
def umask() -> Iterator[None]:
    before = os.umask(0o022)
    yield
    os.umask(before)


def mode_of(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


@pytest.mark.parametrize(("mask", "mode"), [(0o077, 0o600), (0o002, 0o664)])
@pytest.mark.usefixtures("umask")
def test_a_new_file_has_the_permissions_that_the_umask_leaves(tmp_path: Path, mask: int, mode: int) -> None:
    os.umask(mask)
    files.write_text(tmp_path / "a.csv", "x")
    Manifest(tmp_path / "manifest.jsonl").close()
    assert {mode_of(path) for path in tmp_path.iterdir()} == {mode}


@pytest.mark.parametrize("mode", [0o600, 0o444])
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
    assert texts_in(tmp_path) == {path.name: "newer", edits.name: "of an editor"}


PNG = b"\x89PNG\r\n\x1a\n"
REPORT = b'<!doctype html><meta name="generator" content="blocksim report">'
OTHERS = {
    "thesis.pdf": b"%PDF-1.5\n1 0 obj\n<< /Creator (blocksim) >>\nendobj\n2 0 obj\n<< /Creator (TeX) >>\nendobj\n"
    b"trailer\n<< /Root 3 0 R /Info 2 0 R >>\n%%EOF\n",
    "photo.png": PNG + b"\0\0\0\x0dIHDR" + bytes(17) + b"\0\0\0\x11tEXtComment\0blocksim" + bytes(4),
    "drawing.svg": b"<svg><text>blocksim</text></svg>",
    "clip.gif": b"GIF89a blocksim",
    "clip.mp4": b"\0\0\0\x10ftypisom\0\0\0\0\0\0\0\x10moovblocksim",
    "site.html": b"<html>blocksim report</html>",
    "data.csv": b"time_s,block,mass\n",
    "data.json": b'{"machine": "blocksim"}',
    "data.vtkhdf": b"\x89HDF\r\n\x1a\nVTKHDF blocksim",
    "empty": b"",
}


def draw(path: Path) -> None:
    with open_figure(2.0, 1.0) as figure:
        figure.text(0.5, 0.5, "blocksim")
        save_figure(figure, path)


def film(path: Path) -> None:
    writer = write_gif if path.suffix == ".gif" else write_mp4
    writer(path, iter([np.full((64, 64, 3), 255, dtype=np.uint8)] * 3), np.full(3, 0.1))


def vtkhdf(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file.create_group("VTKHDF")
        file["blocksim/block_names"] = [b"1"]


OWN: dict[str, Callable[[Path], object]] = {
    **dict.fromkeys(("a.png", "a.svg", "a.pdf"), draw),
    **dict.fromkeys(("a.gif", "a.mp4"), film),
    "a.html": lambda path: path.write_bytes(REPORT),
    "a.json": lambda path: path.write_text(json.dumps({"machine": {}, "measurements": []}, indent=2)),
    "a.csv": lambda path: path.write_text("time_s,block,x_mm,y_mm,rotation_deg,vx_mm_s\n"),
    "a.vtkhdf": vtkhdf,
}


@pytest.mark.parametrize("name", OWN)
def test_own_file_is_known_and_replaced(tmp_path: Path, name: str) -> None:
    OWN[name](tmp_path / name)
    refuse_foreign(tmp_path / name)


@pytest.mark.parametrize("name", OTHERS)
def test_file_of_others_is_replaced_only_when_asked(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(OTHERS[name])
    with pytest.raises(OutputExistsError, match="already exists; rerun with --overwrite"):
        refuse_foreign(tmp_path / name)
    refuse_foreign(tmp_path / name, overwrite=True)


def test_what_is_no_file_or_in_no_folder_is_told_before_the_work_begins(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"out\.gif: cannot be written: there is no folder .*/none$"):
        refuse_foreign(tmp_path / "none" / "out.gif")
    (tmp_path / "folder").mkdir()
    for place in (tmp_path / "folder", Path("/dev/null"), tmp_path / "nowhere"):
        (tmp_path / "out.png").unlink(missing_ok=True)
        (tmp_path / "out.png").symlink_to(place)
        with pytest.raises(OutputExistsError, match=r"out\.png: .*write elsewhere with --out"):
            refuse_foreign(tmp_path / "out.png", overwrite=True)
