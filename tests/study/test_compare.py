"""Sweeps judged from Python, from their folders and tables."""

from pathlib import Path

import pytest

from blocksim.analysis.compare import Comparison
from blocksim.analysis.metrics import Judgement, Settings
from blocksim.errors import InputMissingError
from blocksim.scenario import Document
from blocksim.study.compare import compare, compare_sweep
from blocksim.study.manifest import SweepResult
from blocksim.study.run import run
from blocksim.study.sweep import sweep
from tests.study.conftest import SCENARIOS

PAPER = SCENARIOS / "experiments" / "three_blocks.csv"


@pytest.fixture(scope="module")
def swept(nominal: Document, tmp_path_factory: pytest.TempPathFactory) -> SweepResult:
    """Give two members, of which the second fails."""
    vary = {"contact.max_overlap": [1e-3, 1e-9]}
    return sweep(nominal, vary, out=tmp_path_factory.mktemp("sweep") / "out", jobs=1)


def test_sweep_and_its_folder_are_judged_alike(swept: SweepResult) -> None:
    found = [compare(swept), compare(swept.folder), compare(str(swept.folder), PAPER)]
    assert all(isinstance(one, Judgement) and one.members == 2 for one in found)
    first, second, third = (one.to_dict() for one in found)
    assert first == second
    assert first["metrics"] == third["metrics"]


def test_member_of_a_sweep_is_judged_as_a_run_of_its_own(swept: SweepResult, nominal: Document) -> None:
    alone = compare(run(nominal.build()))
    rows = compare_sweep(swept).findings["inside"].rows[:-1]
    verdicts = {(row.block, row.quantity): int(row.verdict == "inside") for row in alone.rows}
    assert {(row["block"], row["quantity"]): row["inside"] for row in rows} == verdicts
    assert isinstance(alone, Comparison)


def test_verdict_agrees_with_the_column_of_the_sweep_and_with_its_settings(swept: SweepResult) -> None:
    found = compare_sweep(swept)
    assert found.share_inside == swept.share_inside
    assert any("not probabilities" in message for message in found.messages)  # chosen members are no sample
    assert compare_sweep(swept, settings=Settings(threshold=0.0)).inside


def test_table_alone_needs_an_experiment(swept: SweepResult, tmp_path: Path) -> None:
    swept.table.to_csv(tmp_path / "sweep.csv", index=False)
    with pytest.raises(InputMissingError, match="--experiment"):
        compare_sweep(tmp_path)
    assert compare_sweep(tmp_path, PAPER).members == 2
