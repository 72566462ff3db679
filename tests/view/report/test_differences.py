"""Runs of one name in a report are told apart by what their scenarios differ in."""

from dataclasses import replace
from pathlib import Path

from blocksim.simulation.movement import Manner, Movement
from blocksim.view.report.differences import labels
from blocksim.view.report.page import page_text
from blocksim.view.report.stored import read_stored
from blocksim.view.report.subjects import Subject, run_subject
from tests.view.report.folders import write_run


def subject(folder: Path, key: str, name: str = "three_blocks", **settings: object) -> Subject:
    overrides = {text.replace("__", "."): value for text, value in settings.items()}
    write_run(folder / key, name, count=2, overrides=overrides)
    return run_subject(key, read_stored(folder / key))


def test_runs_of_one_name_are_labelled_with_the_keys_that_differ(tmp_path: Path) -> None:
    one = subject(tmp_path, "a", friction__block_block=0.3)
    other = subject(tmp_path, "b", friction__block_block=0.5, gravity=1.62)
    alone = subject(tmp_path, "c", "slide")
    assert labels([one, other, alone]) == {
        "a": "gravity = 9.81, friction.block_block.static = 0.3",
        "b": "gravity = 1.62, friction.block_block.static = 0.5",
    }
    assert "gravity = 1.62, friction.block_block.static = 0.5" in page_text([one, other], title="", version="0")


def test_report_names_the_outcome_and_the_block_that_moved_first(tmp_path: Path) -> None:
    write_run(tmp_path / "run", count=2)
    stored = read_stored(tmp_path / "run")
    assert stored.summary is not None
    movement = Movement(
        outcome=Manner.FELL,
        largest_displacement_mm=12.3,
        displaced_block="2",
        largest_rotation_deg=90.0,
        rotated_block="3",
        first_mover="3",
        first_moved_s=0.045,
    )
    moved = replace(stored, summary=stored.summary.model_copy(update={"movement": movement}))
    rows = dict(run_subject("a", moved).page["summary"])
    assert rows["outcome"] == "fell"
    assert rows["first moved"] == "block 3 at 0.045 s"
    assert "outcome" not in dict(run_subject("a", stored).page["summary"])
