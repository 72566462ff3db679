"""Folders and tables of studies drawn and reported: from their own files, damaged or not."""

import json
from pathlib import Path

import numpy as np
import pytest

from blocksim.errors import InvalidInputError
from blocksim.scenario import replace_values
from blocksim.study.fragility import FragilityAnswer, fragility
from blocksim.study.limit import limit
from blocksim.study.pictures import plot, read_indices
from blocksim.study.report import report
from blocksim.study.run_folder import read_run
from tests.study.test_fragility import FRICTION, SLIDES, SLOPE, TILTS
from tests.study.test_limit import SQUAT, TILT, block_on_a_slope


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> FragilityAnswer:
    """Give a study; not to be changed."""
    return fragility(
        SLOPE, TILTS, FRICTION, members=8, fails=SLIDES, jobs=1, out=tmp_path_factory.mktemp("s") / "study"
    )


def test_the_picture_has_the_counts_and_the_curve_of_the_result(study: FragilityAnswer) -> None:
    found = FragilityAnswer.read(study.folder).picture_of()
    assert study.plan is not None
    assert found.x.tolist() == list(study.plan.levels)
    assert found.share.tolist() == [point.share for point in study.points]
    assert list(zip(found.low, found.high, strict=True)) == [(point.low, point.high) for point in study.points]
    assert found.band is not None
    curve = study.probability(found.band.x)
    assert curve is not None
    assert found.band.probability == pytest.approx(curve)
    assert "median 21.7" in found.notes[0]


def test_plot_and_report_take_the_study(
    study: FragilityAnswer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert plot(study) == Path("slope_fragility.png")
    assert (tmp_path / "slope_fragility.png").stat().st_size > 0
    with pytest.raises(InvalidInputError, match="a fragility study is drawn as 'fragility', not as 'lines'"):
        plot(study, kind="lines")
    with pytest.raises(InvalidInputError, match=r"--forces shows contacts of a run, but .* is a fragility study"):
        plot(study.folder, forces=True)
    text = report(study.folder, out="study.html").read_text()
    assert 'data-kind="study"' in text
    assert 'src="data:image/png;base64,' in text
    assert '<td class="n"><bdi>14</bdi></td>' in text


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"points": "none"}, "not the answer of a fragility study"),
        ({"points": []}, "no sample of this study has a result"),
    ],
)
def test_a_damaged_answer_is_told(study: FragilityAnswer, tmp_path: Path, change: dict[str, object], why: str) -> None:
    data = json.loads((study.folder / "fragility.json").read_text())
    (tmp_path / "fragility.json").write_text(json.dumps({**data, **change}))
    (tmp_path / "fragility.toml").write_bytes((study.folder / "fragility.toml").read_bytes())
    with pytest.raises(InvalidInputError, match=why):
        plot(tmp_path, out=tmp_path / "picture.png")
    assert not (tmp_path / "picture.png").exists()


def test_a_limit_is_drawn_as_its_mechanism_beside_the_last_that_stands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    found = limit(block_on_a_slope(SQUAT), TILT, tolerance=0.02, out="found")
    (change,) = found.limits
    assert found.plan is not None
    assert set(found.case_folders) == {change.low, change.high}
    for value, name in found.case_folders.items():
        run = read_run(Path("found/cases") / name)
        release = "always" if value == change.high else "at rest"  # it falls before time zero
        kept = {"output.contacts": True, "start.release": release, "time.stop_at_rest": value != change.high}
        assert run.scenario == replace_values(found.plan.scenario_at(value), kept)
        if value == change.low:
            assert float(run.frames.time[-1]) == pytest.approx(found.rows[value]["seconds"])
    assert plot(found) == Path("slope_mechanism.png")
    text = report(found, out="limit.html").read_text()
    assert "Both sides of every bracket" in text
    assert 'src="data:image/png;base64,' in text
    assert limit(block_on_a_slope(SQUAT), TILT, tolerance=0.02, out="found").case_folders == found.case_folders


def test_a_limit_without_a_change_has_nothing_to_draw_and_a_report(tmp_path: Path) -> None:
    still = {"ground.tilt": {"from": "1 deg", "to": "2 deg", "count": 2}}
    found = limit(block_on_a_slope(SQUAT), still, out=tmp_path / "found")
    with pytest.raises(InvalidInputError, match="nothing changes within its range; nothing to draw"):
        plot(found, out=tmp_path / "picture.png")
    assert "nothing changes within the range" in report(found, out=tmp_path / "limit.html").read_text()
    assert not (tmp_path / "found" / "cases").exists()


SOBOL = "output,unit,key,S1,± S1,ST,± ST\nx of block 2,mm,a,0.1,0.2,0.7,0.3\nx of block 2,mm,b,0.2,nan,0.4,\n"
MORRIS = "output,unit,key,mu*,±,mu,sigma\nx of block 2,mm,a,5,1,-5,0\nmeasured outcome,share,a,0.5,0.1,0.5,0\n"


def written(folder: Path, text: str) -> Path:
    path = folder / "indices.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_sobol_bars_are_total_indices_with_those_of_the_key_alone(tmp_path: Path) -> None:
    (bars,), labels = read_indices(written(tmp_path, SOBOL))
    assert (bars.title, bars.keys) == ("x of block 2", ("a", "b"))
    assert bars.values.tolist() == [0.7, 0.4]
    assert bars.part is not None
    assert bars.part.tolist() == [0.1, 0.2]
    assert bars.half_widths[0] == 0.3
    assert np.isnan(bars.half_widths[1])
    assert "variance" in labels[0]


def test_morris_bars_have_the_unit_of_their_result(tmp_path: Path) -> None:
    (x, outcome), labels = read_indices(written(tmp_path, MORRIS))
    assert (x.title, x.values.tolist(), x.part) == ("x of block 2 (mm)", [5.0], None)
    assert outcome.title == "measured outcome"
    assert labels[1] == ""


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("block,quantity\n1,x\n", "not the table of `blocksim sensitivity --out`"),
        (SOBOL.replace("0.7", "much"), "indices.csv:2"),
        (SOBOL.splitlines()[0] + "\n", "no result varies"),
    ],
)
def test_other_tables_are_refused(tmp_path: Path, text: str, told: str) -> None:
    with pytest.raises(InvalidInputError, match=told):
        read_indices(written(tmp_path, text))
