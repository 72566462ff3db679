"""Nothing that a run has not written is ever removed from its folder, and no two runs write into one."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from blocksim.errors import OutputError, OutputExistsError
from blocksim.simulation import renew_copies, simulate_into
from blocksim.simulation.files import (
    clear_remains,
    default_folder,
    folder_lock,
    holds_run,
    make_folder,
    newest_run,
    prepare_folder,
    write_text,
)
from blocksim.simulation.trajectory import COLUMNS, csv_text
from tests.simulation.conftest import SCENARIOS, Shipped
from tests.simulation.sliding import MODELS, interrupted_at, sliding

if TYPE_CHECKING:
    from collections.abc import Iterator


def content_of(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_leftovers_of_a_kill_do_not_block_a_folder(copy: Path) -> None:
    for name in ("done.json", "run.json", "final.csv"):
        (copy / name).unlink()
    (copy / ".final.csv.k2j3h4_x.csv").write_text("half")
    (copy / ".run.h5.new").write_text("half")
    with pytest.raises(OutputExistsError, match="contains an unfinished run"):
        prepare_folder(copy, overwrite=False)
    prepare_folder(copy, overwrite=True)
    assert not any(copy.iterdir())


@pytest.mark.parametrize("is_killed", [False, True])
@pytest.mark.parametrize("size", [0, 1000, 5000, 10**9])
def test_runs_of_other_versions_are_runs_whatever_their_words_and_frames(
    copy: Path, size: int, *, is_killed: bool
) -> None:
    wording = "# Resolved by blocksim: every value that was used, in SI units (m, kg, s, N, Pa), angles in rad.\n"
    (copy / "scenario.toml").write_text(wording + (copy / "scenario.toml").read_text().partition("\n")[2])
    (copy / "final.csv").write_text("block,columns,of,another,version\n")
    os.truncate(copy / "run.h5", min(size, (copy / "run.h5").stat().st_size))
    for name in ("run.json", "done.json", "final.csv") if is_killed else ():
        (copy / name).unlink()
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


@pytest.mark.parametrize("overwrite", [False, True])
def test_foreign_file_is_never_removed(copy: Path, overwrite: bool) -> None:
    (copy / "thesis.tex").write_text("years of work")
    assert "not a blocksim run (thesis.tex)" in refusal(copy, overwrite=overwrite)


TAKEN = ("scenario.toml", "experiment.csv", "motion.csv", ".final.csv.swp")


@pytest.mark.parametrize("name", [*TAKEN, "final.csv", "run.h5", "run.json", "done.json", "probe-base.csv"])
def test_a_file_of_a_person_with_the_name_of_a_result_is_never_removed(tmp_path: Path, copy: Path, name: str) -> None:
    for folder in (tmp_path / "alone", copy) if name in TAKEN else (tmp_path / "alone",):
        folder.mkdir(exist_ok=True)
        (folder / name).write_text("years,of,work\n")
        assert name in refusal(folder)


def test_scenario_written_by_a_person_is_never_removed(tmp_path: Path) -> None:
    shutil.copyfile(SCENARIOS / "tower.toml", tmp_path / "scenario.toml")
    assert "scenario.toml" in refusal(tmp_path)


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
    (copy / "experiment.csv").write_text("corrected by hand")
    with pytest.raises(OutputExistsError, match=r"experiment\.csv: changed since blocksim wrote it"):
        renew_copies(soft(), copy)
    assert (copy / "experiment.csv").read_text() == "corrected by hand"


@pytest.mark.parametrize("text", ["", "{", "[]", "{}", "\0", "[" * 100_000, "x" * 2_000_000], ids=lambda text: text[:2])
def test_folder_holds_only_its_own_scenario_and_rubbish_in_done_is_no_finished_run(
    copy: Path, soft: Shipped, text: str
) -> None:
    assert holds_run(copy, soft())
    assert not holds_run(copy, soft(friction__block_block=0.3))
    (copy / "done.json").write_text(text)
    assert not holds_run(copy, soft())


def test_newest_finished_run_is_found(folder: Path, tmp_path: Path) -> None:
    assert newest_run(tmp_path) is None
    for number, name in enumerate(("b", "c", "a")):
        done = Path(shutil.copytree(folder, tmp_path / name)) / "done.json"
        os.utime(done, (1e9 + number, 1e9 + number))
    (tmp_path / "a" / "done.json").unlink()
    assert newest_run(tmp_path) == tmp_path / "c"


def test_what_changes_the_result_changes_the_default_folder(soft: Shipped) -> None:
    assert default_folder(soft()) == default_folder(soft(description="other words"))
    assert default_folder(soft()) != default_folder(soft(contact__restitution=0.21))
    assert default_folder(soft()).parent == Path("results/three_blocks_nominal")


def test_files_and_links_that_lead_to_no_folder_are_in_the_way(tmp_path: Path) -> None:
    (tmp_path / "broken").symlink_to(tmp_path / "nowhere")
    (tmp_path / "file").write_text("mine", encoding="utf-8")
    (tmp_path / "link").symlink_to("file")
    for names, told in ((("broken",), "broken is a broken link"), (("file", "link"), "is a file, not a folder")):
        for folder in (tmp_path / name / run for name in names for run in ("", "run")):
            with pytest.raises(OutputExistsError, match=told):
                prepare_folder(folder, overwrite=True)
    assert (tmp_path / "file").read_text(encoding="utf-8") == "mine"
    assert not (tmp_path / "nowhere").exists()
    with pytest.raises(OutputExistsError, match="cannot be created: File name too long"):
        make_folder(tmp_path / ("x" * 300))
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "good").symlink_to("elsewhere")
    make_folder(tmp_path / "good" / "run")
    assert (tmp_path / "elsewhere" / "run").is_dir()


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


def test_a_read_only_file_system_is_reported(read_only: Path) -> None:
    with pytest.raises(OutputExistsError, match="run: cannot be created: Read-only file system"):
        make_folder(read_only / "run")
    make_folder(read_only)
    with pytest.raises(OutputError, match="x: cannot be written: Read-only file system"):
        write_text(read_only / "x", "text")


@pytest.mark.parametrize(("resume", "overwrite"), [(False, False), (True, False), (False, True)])
def test_no_run_writes_where_another_one_does(tmp_path: Path, resume: bool, overwrite: bool) -> None:
    scenario = sliding(MODELS["surface-linear"], end=0.002)
    interrupted_at(scenario, tmp_path, [50])
    before = content_of(tmp_path)
    with folder_lock(tmp_path), pytest.raises(OutputExistsError, match="a run is in progress here"):
        simulate_into(scenario, tmp_path, resume=resume, overwrite=overwrite)
    assert content_of(tmp_path) == before
    assert simulate_into(scenario, tmp_path, resume=True).summary.resumed_from == (50,)


HOLD = """
import sys
from pathlib import Path
from blocksim.simulation.files import folder_lock
with folder_lock(Path(sys.argv[1])):
    print("folder_lock", flush=True)
    sys.stdin.read()
"""


def test_folder_is_free_again_when_whoever_had_it_was_killed(tmp_path: Path) -> None:
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-c", HOLD, str(tmp_path)], stdin=pipe, stdout=pipe) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == b"folder_lock\n"
        with pytest.raises(OutputExistsError), folder_lock(tmp_path):
            pass
        other.kill()
        other.wait()
        with folder_lock(tmp_path):
            pass
