"""A sweep keeps one row a case, repeats nothing, and goes on where a case fails."""

import os
import signal
from multiprocessing import active_children
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from blocksim.errors import InputMissingError, InvalidInputError, OutputExistsError, StoppedEarlyError
from blocksim.scenario import Document, load_scenario
from blocksim.study import pool
from blocksim.study.many import read_sweep, sweep
from blocksim.study.single import run
from tests.study.conftest import SCENARIOS

KINETIC = "friction.block_block.kinetic"
END = "time.end"
OVERLAP = "contact.max_overlap"
TWO = {KINETIC: [0.2, 0.25]}


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """Give the scenarios that are run from now on."""
    made: list[object] = []

    def counted(scenario: object, **options: object) -> object:
        made.append(scenario)
        return run(scenario, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(pool, "run", counted)
    return made


def test_pool_of_two_gives_the_rows_of_one_process(nominal: Document, tmp_path: Path) -> None:
    vary = {KINETIC: [0.2, 0.25, 0.3]}
    two = sweep(nominal, vary, jobs=2, out=tmp_path / "two").table
    one = sweep(nominal, vary, jobs=1, out=tmp_path / "one").table
    pd.testing.assert_frame_equal(two.drop(columns="seconds"), one.drop(columns="seconds"), check_exact=True)
    assert two[KINETIC].tolist() == [0.2, 0.25, 0.3]
    assert two["status"].tolist() == ["finished"] * 3


def test_row_is_what_a_single_run_gives(nominal: Document, tmp_path: Path) -> None:
    row = sweep(nominal, {KINETIC: [0.25]}, jobs=1, out=tmp_path).table.iloc[0]
    single = run(nominal.with_values({KINETIC: 0.25}).build())
    assert row["3.x_mm"] == single.final["x_mm"][2]
    assert row["2.rotation_deg"] == single.final["rotation_deg"][1]
    assert not row["inside"]


def test_folder_holds_plan_table_and_cases(nominal: Document, tmp_path: Path) -> None:
    result = sweep(nominal, TWO, jobs=1, out=tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"sweep.toml", "sweep.csv", "cases", "experiment.csv"}
    assert sorted(result.table["case"]) == sorted(path.name for path in (tmp_path / "cases").iterdir())
    back = read_sweep(tmp_path)
    assert back.table["case"].tolist() == result.table["case"].tolist()
    np.testing.assert_allclose(back.table["3.x_mm"], result.table["3.x_mm"], rtol=1e-12)
    case = load_scenario(tmp_path / "cases" / result.table["case"][1] / "scenario.toml")
    assert case.friction.block_block.kinetic == 0.25
    assert case.sweep is None


def test_plan_is_a_scenario_that_repeats_the_sweep(nominal: Document, tmp_path: Path, runs: list[object]) -> None:
    first = sweep(nominal, TWO, jobs=1, out=tmp_path)
    assert len(runs) == 2
    again = sweep(tmp_path / "sweep.toml", jobs=1, out=tmp_path)
    assert again.table["case"].tolist() == first.table["case"].tolist()
    assert len(runs) == 2


def test_default_folder_is_named_by_what_is_varied(
    nominal: Document, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    short = nominal.with_values({END: 0.01})
    folders = {sweep(short, vary, jobs=1).folder for vary in (TWO, TWO, {KINETIC: [0.2]})}
    assert len(folders) == 2
    assert {folder.parent for folder in folders} == {Path("results/three_blocks_nominal")}


def test_called_again_it_runs_only_what_is_missing(nominal: Document, tmp_path: Path, runs: list[object]) -> None:
    first = sweep(nominal, TWO, jobs=1, out=tmp_path)
    (tmp_path / "cases" / first.table["case"][0] / "done.json").unlink()
    again = sweep(nominal, TWO, jobs=1, out=tmp_path)
    assert len(runs) == 3
    pd.testing.assert_frame_equal(first.table.drop(columns="seconds"), again.table.drop(columns="seconds"))
    assert again.table["seconds"][1] == first.table["seconds"][1]


def test_failed_case_is_not_run_again_either(nominal: Document, tmp_path: Path, runs: list[object]) -> None:
    for _ in range(2):
        result = sweep(nominal, {OVERLAP: [1e-9, 1e-3]}, jobs=1, out=tmp_path)
        assert result.table["status"].tolist() == ["failed", "finished"]
        assert result.failed == 1
    assert len(runs) == 2


def test_damaged_case_is_run_again(nominal: Document, tmp_path: Path, runs: list[object]) -> None:
    first = sweep(nominal, TWO, jobs=1, out=tmp_path)
    (tmp_path / "cases" / first.table["case"][0] / "final.csv").write_text("")
    again = sweep(nominal, TWO, jobs=1, out=tmp_path)
    assert len(runs) == 3
    assert again.failed == 0


def test_equal_cases_are_one_run(nominal: Document, tmp_path: Path, runs: list[object]) -> None:
    table = sweep(nominal, {END: [0.01, "10 ms"]}, jobs=1, out=tmp_path).table
    assert len(runs) == 1
    assert len(table) == 2
    assert table["case"][0] == table["case"][1]


def test_overwrite_runs_everything_again(nominal: Document, tmp_path: Path, runs: list[object]) -> None:
    sweep(nominal, TWO, jobs=1, out=tmp_path)
    sweep(nominal, TWO, jobs=1, out=tmp_path, overwrite=True)
    assert len(runs) == 4


def test_impossible_case_has_a_row_with_the_reason(nominal: Document, tmp_path: Path) -> None:
    result = sweep(nominal, {KINETIC: [0.2, 0.9]}, jobs=1, out=tmp_path)
    assert result.table["status"].tolist() == ["finished", "invalid"]
    assert "above static friction" in result.table["reason"][1]
    assert result.failed == 1


def test_broken_case_does_not_end_the_others(
    nominal: Document, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(scenario: object, **options: object) -> object:
        if not list((tmp_path / "cases").glob("*")):
            Path(str(options["out"])).mkdir(parents=True)
            raise ZeroDivisionError("oh")
        return run(scenario, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(pool, "run", broken)
    table = sweep(nominal, TWO, jobs=1, out=tmp_path).table
    assert table["status"].tolist() == ["failed", "finished"]
    assert table["reason"][0] == "internal error: ZeroDivisionError: oh"


def test_other_sweep_in_the_folder_is_not_mixed_in(nominal: Document, tmp_path: Path) -> None:
    sweep(nominal, TWO, jobs=1, out=tmp_path)
    with pytest.raises(OutputExistsError, match="another sweep is there; --overwrite"):
        sweep(nominal, {KINETIC: [0.1]}, jobs=1, out=tmp_path)
    result = sweep(nominal, {KINETIC: [0.1]}, jobs=1, out=tmp_path, overwrite=True)
    assert [path.name for path in (tmp_path / "cases").iterdir()] == result.table["case"].tolist()


@pytest.mark.parametrize("overwrite", [False, True])
def test_foreign_folder_is_left_alone(nominal: Document, tmp_path: Path, overwrite: bool) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(OutputExistsError, match="not a sweep"):
        sweep(nominal, TWO, out=tmp_path, overwrite=overwrite)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_mistake_leaves_no_folder(nominal: Document, tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError):
        sweep(nominal, {"friction.block_blok": [1]}, out=tmp_path / "sweep")
    with pytest.raises(InvalidInputError, match="nothing to vary"):
        sweep(nominal, out=tmp_path / "sweep")
    assert list(tmp_path.iterdir()) == []


def test_ctrl_c_keeps_the_rows_so_far_and_the_next_call_does_the_rest(
    nominal: Document, tmp_path: Path, runs: list[object]
) -> None:
    slow = nominal.with_values({END: 1000.0, "time.stop_at_rest": False})
    vary = {END: [0.01, 1000.0, 0.02]}

    def press_ctrl_c(*_: object) -> None:
        signal.setitimer(signal.ITIMER_REAL, 0.2)

    before = signal.signal(signal.SIGALRM, lambda *_: os.kill(os.getpid(), signal.SIGINT))
    try:
        with pytest.raises(StoppedEarlyError, match="1 of 3 cases done; the same command does the others"):
            sweep(slow, vary, jobs=1, out=tmp_path, on_row=press_ctrl_c)
    finally:
        signal.signal(signal.SIGALRM, before)
    assert len(read_sweep(tmp_path).table) == 1
    assert len(runs) == 2


def test_share_inside_counts_failed_cases_as_outside(nominal: Document, tmp_path: Path) -> None:
    calibrated = Document.read(SCENARIOS / "three_blocks.toml")
    result = sweep(calibrated, {OVERLAP: [1e-3, 1e-12]}, jobs=1, out=tmp_path)
    assert result.table["inside"].tolist()[0] is True
    assert result.share_inside == 0.5
    assert read_sweep(tmp_path).share_inside == 0.5
    assert result.share_inside_of(SCENARIOS / "experiments" / "three_blocks.csv") == 0.5
    assert nominal.build().sweep is None


def test_sweep_without_experiment_has_no_share(tmp_path: Path) -> None:
    vary = {"contact.stiffness_scale": [0.001, 0.002]}
    result = sweep(Document.read(SCENARIOS / "slide.toml"), vary, jobs=1, out=tmp_path)
    assert result.share_inside is None


@pytest.mark.parametrize("text", ["", "a,b\n1,2\n", "case,status\n1,2\n1,2,3,4\n"])
def test_rubbish_for_a_sweep_table_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "sweep.csv").write_text(text)
    with pytest.raises(InvalidInputError, match=r"sweep\.csv: not the table of a sweep"):
        read_sweep(tmp_path)


def test_missing_sweep_table_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputMissingError, match="no such file"):
        read_sweep(tmp_path)


def test_interrupt_between_two_rows_ends_the_workers_at_once(tmp_path: Path) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    shipped = Path(__file__).parents[2] / "scenarios" / "three_blocks_nominal.toml"
    endless = Document.read(shipped).with_settings(["contact.stiffness_scale=0.001", "time.stop_at_rest=false"])
    with pytest.raises(StoppedEarlyError, match="1 of 3 cases done"):
        sweep(endless, {"time.end": [0.001, 1e4, 2e4]}, out=tmp_path / "out", jobs=2, on_row=interrupt)
    assert active_children() == []
