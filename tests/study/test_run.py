"""One run, from Python and as it lies on the disk; compared with an experiment, as sweeps are."""

import shutil
from pathlib import Path

import h5py
import pandas as pd
import pytest

import blocksim
from blocksim.analysis.compare import Comparison
from blocksim.analysis.metrics import Settings
from blocksim.errors import InputMissingError, InvalidInputError
from blocksim.scenario import Document, Model, Scenario, load_scenario
from blocksim.simulation import Result, simulate_into
from blocksim.simulation.instruments import bytes_of_series
from blocksim.study.compare import compare, compare_run, compare_sweep
from blocksim.study.manifest import SweepResult
from blocksim.study.run import run
from blocksim.study.run_folder import find_run, read_run
from blocksim.study.sweep import sweep
from blocksim.study.verify import verify_run
from blocksim.world.describe import describe
from tests.golden import Golden
from tests.simulation.test_probes import PROBES, PULSE, scene
from tests.study.conftest import SCENARIOS

PAPER = SCENARIOS / "experiments" / "three_blocks.csv"
BRIEF = {"time.end": 0.002, "contact.stiffness_scale": 0.001}


@pytest.fixture(scope="module")
def kept(scenario: Scenario, tmp_path_factory: pytest.TempPathFactory) -> Result:
    return run(scenario, out=tmp_path_factory.mktemp("results") / "three_blocks_nominal" / "abc")


@pytest.fixture
def copy(kept: Result, tmp_path: Path) -> Path:
    assert kept.folder is not None
    return Path(shutil.copytree(kept.folder, tmp_path / "run"))


def test_python_users_need_four_names_and_a_run_without_a_folder_writes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    result = blocksim.run(blocksim.load(SCENARIOS / "three_blocks.toml", {"contact.stiffness_scale": 0.001}))
    assert result.folder is None
    assert blocksim.compare(result).to_frame().shape[0] == 6
    assert list(tmp_path.iterdir()) == []
    vary = {"contact.stiffness_scale": [0.001], "time.end": [0.01]}
    assert blocksim.sweep(SCENARIOS / "tower.toml", vary, out=tmp_path, jobs=1).failed == 0


def test_result_table_and_folder_compare_alike_and_a_table_alone_needs_an_experiment(kept: Result) -> None:
    assert kept.folder is not None
    places: tuple[Result | pd.DataFrame | Path, ...] = (kept, kept.final, kept.folder, kept.folder.parent)
    expected = [row.simulated for row in compare_run(kept).rows]
    for place in places:
        assert [row.simulated for row in compare_run(place, PAPER).rows] == expected
    with pytest.raises(InputMissingError, match="--experiment"):
        compare_run(kept.final)


def test_unfinished_run_is_not_judged(scenario: Scenario, tmp_path: Path) -> None:
    limited = scenario.contact.model_copy(update={"max_overlap": 1e-9})
    failed = run(scenario.model_copy(update={"contact": limited}), out=tmp_path / "run")
    for given in (failed, tmp_path / "run"):
        with pytest.raises(InvalidInputError, match="has failed"):
            compare_run(given)


def test_final_table_without_one_of_the_blocks_is_named(copy: Path) -> None:  # and not the experiment's, which has it
    lines = (copy / "final.csv").read_text().splitlines(keepends=True)
    (copy / "final.csv").write_text("".join(lines[:1] + lines[2:]))
    with pytest.raises(InvalidInputError, match=r"final\.csv: its blocks are not those of scenario\.toml"):
        compare_run(copy)


def test_an_interrupted_run_and_a_damaged_summary_are_told(copy: Path, golden: Golden) -> None:
    told, summary = [], (copy / "run.json").read_text()
    for text in (summary.replace('"finished"', '"interrupted"'), "{"):
        (copy / "run.json").write_text(text)
        told.append(read_run(copy).remark)
    golden("\n".join(told), rules=["numbers", "counts"])


@pytest.fixture(scope="module")
def swept(nominal: Document, tmp_path_factory: pytest.TempPathFactory) -> SweepResult:
    """Give two members, of which the second fails."""
    vary = {"contact.max_overlap": [1e-3, 1e-9]}
    return sweep(nominal, vary, out=tmp_path_factory.mktemp("sweep") / "out", jobs=1)


def test_member_of_a_sweep_is_judged_as_a_run_of_its_own_and_by_the_settings(swept: SweepResult, kept: Result) -> None:
    found, alone = compare_sweep(swept), compare(kept)
    assert isinstance(alone, Comparison)
    verdicts = {(row.block, row.quantity): int(row.verdict == "inside") for row in alone.rows}
    rows = found.findings["inside"].rows[:-1]
    assert {(row["block"], row["quantity"]): row["inside"] for row in rows} == verdicts
    assert found.share_inside == swept.share_inside
    assert any("not probabilities" in message for message in found.messages)  # chosen members are no sample
    assert compare_sweep(swept, settings=Settings(threshold=0.0)).inside


def refused(path: Path) -> str:
    """Return why there is no run to be found."""
    with pytest.raises((InputMissingError, InvalidInputError)) as caught:
        find_run(path)
    return str(caught.value)


def test_place_without_a_run_says_what_it_is_and_what_to_do(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, golden: Golden
) -> None:
    monkeypatch.chdir(tmp_path)
    told = [refused(SCENARIOS / "tower.toml")]
    blocksim.run(blocksim.load(SCENARIOS / "tower.toml", BRIEF), out="results/tower/other")
    told.append(refused(SCENARIOS / "tower.toml"))
    measured = "block,quantity,unit,replicate,value\n1,x,mm,1,16\n"
    for name, text, place in (
        ("sweep below/sweep-a/sweep.csv", "", "sweep below"),
        ("results above/quay/a1/done.json", "", "results above"),
        ("results above/wall/a1/done.json", "", "results above"),
        ("stopped run/a1/run.h5", "", "stopped run"),
        ("sweep/sweep.csv", "", "sweep"),
        ("table/measured.csv", measured, "table/measured.csv"),
        ("empty/nix/nix", "", "empty/nix"),
        ("empty/nix/nix", "", "nothing"),
    ):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
        told.append(refused(tmp_path / place))
    golden("\n\n".join(told))


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("tower", {"time.end": 0.05}),
        ("three_blocks_nonsmooth", {"time.end": 0.2, "output.every": "1 ms", "output.contacts": True}),
        ("record_column", {"time.end": 0.5}),
        ("soil/vertical_cut", {"time.end": 0.01}),
    ],
)
def test_size_of_a_run_is_forecast_within_a_factor_of_two(
    tmp_path: Path, name: str, changes: dict[str, object]
) -> None:
    scenario = load_scenario(SCENARIOS / f"{name}.toml", changes)
    result = run(scenario, out=tmp_path)
    described = describe(Model(scenario))
    assert result.frames.time.size > 0.9 * described.frames  # nothing came to rest before
    stored = sum(path.stat().st_size for path in tmp_path.iterdir() if path.name.startswith(("run.h5", "probe-")))
    told = described.bytes + bytes_of_series(Model(scenario), described.steps, described.step, 14)
    assert 0.5 * stored < told < 2.0 * stored


def test_a_changed_sample_is_found_when_a_run_is_verified(tmp_path: Path) -> None:
    result = simulate_into(scene("nonsmooth", PROBES, 0.03, motion=PULSE), tmp_path)
    assert verify_run(tmp_path).agrees
    with h5py.File(tmp_path / "run.h5", "r+") as file:
        file["probes/joint4/slip"][2] += 1e-18
    step = result.probes["joint4"].step[2]
    (found,) = verify_run(tmp_path).entries
    assert (found.file, found.entry) == ("run.h5", f"probes/joint4/slip at step {step}")
