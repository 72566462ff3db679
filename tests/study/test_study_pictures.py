"""Folders of studies drawn and reported: from their own files, damaged or not."""

import json
from pathlib import Path

import pytest

from blocksim.errors import InvalidInputError
from blocksim.study.api import plot, report
from blocksim.study.fragility import FragilityResult, fragility
from blocksim.study.study_pictures import read_fragility_picture
from tests.study.test_fragility import FRICTION, SLIDES, SLOPE, TILTS


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> FragilityResult:
    """Give a study; not to be changed."""
    return fragility(
        SLOPE, TILTS, FRICTION, members=8, fails=SLIDES, jobs=1, out=tmp_path_factory.mktemp("s") / "study"
    )


def test_the_picture_has_the_counts_and_the_curve_of_the_result(study: FragilityResult) -> None:
    found = read_fragility_picture(study.folder)
    assert found.x.tolist() == list(study.plan.levels)
    assert found.share.tolist() == [point.share for point in study.points]
    assert list(zip(found.low, found.high, strict=True)) == [point.limits for point in study.points]
    assert found.band is not None
    curve = study.probability(found.band.x)
    assert curve is not None
    assert found.band.probability == pytest.approx(curve)
    assert "median 21.7" in found.notes[0]


def test_plot_and_report_take_the_study(
    study: FragilityResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
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
        ({"points": []}, "no member of this study has a result"),
    ],
)
def test_a_damaged_answer_is_told(study: FragilityResult, tmp_path: Path, change: dict[str, object], why: str) -> None:
    data = json.loads((study.folder / "fragility.json").read_text())
    (tmp_path / "fragility.json").write_text(json.dumps({**data, **change}))
    (tmp_path / "fragility.toml").write_bytes((study.folder / "fragility.toml").read_bytes())
    with pytest.raises(InvalidInputError, match=why):
        plot(tmp_path, out=tmp_path / "picture.png")
    assert not (tmp_path / "picture.png").exists()
