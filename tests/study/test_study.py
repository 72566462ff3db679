"""A study that is added: two modules and a line give it folders, resuming, JSON, CSV and reports."""

import json
from pathlib import Path

import pytest

from blocksim.errors import InvalidInputError, OutputExistsError, StoppedEarlyError
from blocksim.study import answer as studies
from blocksim.study.answer import study_in
from blocksim.study.executors import Execution
from blocksim.study.pictures import plot
from blocksim.study.report import report
from blocksim.study.verify import verify_study
from tests.study.slip import SlipAnswer, slip


@pytest.fixture(autouse=True)
def _line(monkeypatch: pytest.MonkeyPatch) -> None:
    """Add the line."""
    monkeypatch.setitem(studies.STUDIES, "slip", "tests.study.slip:SLIP")


def test_it_writes_an_answer_that_is_read_back_drawn_reported_and_verified(tmp_path: Path) -> None:
    answer = slip((10.0, 25.0), tmp_path / "slip")
    folder = answer.folder
    assert [point.outcome for point in answer.points] == ["stands", "slid"]
    assert SlipAnswer.read(folder).points == answer.points
    assert json.loads((folder / "slip.json").read_text())["environment"]["blocksim"]
    assert (folder / "slip.csv").read_text() == "tilt [deg],outcome\n10.0,stands\n25.0,slid\n"
    assert answer.table["outcome"].tolist() == ["stands", "slid"]
    study = study_in(folder)
    assert study is not None
    assert study.answer is SlipAnswer
    assert plot(folder, out=tmp_path / "slip.png").read_bytes() == b"10.0: stands, 25.0: slid"
    with pytest.raises(InvalidInputError, match="a study of slip is drawn as 'steps', not as 'lines'"):
        plot(folder, out=tmp_path / "slip.png", kind="lines", overwrite=True)
    with pytest.raises(InvalidInputError, match=r"--forces shows contacts of a run, but .* is a study of slip"):
        plot(folder, out=tmp_path / "slip.png", forces=True, overwrite=True)
    assert "What every tilt came to" in report(folder, out=tmp_path / "slip.html").read_text()
    (verdict,) = verify_study(folder, study)
    assert verdict.agrees
    assert verdict.rows == 2
    (folder / "slip.json").write_text((folder / "slip.json").read_text().replace('"slid"', '"fell"'))
    (verdict,) = verify_study(folder, study)
    assert [(one.entry, one.stored, one.now) for one in verdict.entries] == [("points.1.outcome", "fell", "slid")]


def test_it_goes_on_where_it_was_stopped_and_another_one_is_refused(tmp_path: Path) -> None:
    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    with pytest.raises(StoppedEarlyError, match="stopped after 1 runs; rerun the command to finish"):
        slip((10.0, 25.0), tmp_path / "slip", Execution(jobs=1), on_row=stop)
    assert slip((10.0, 25.0), tmp_path / "slip", Execution(jobs=1)).run == 1
    with pytest.raises(OutputExistsError, match="contains another study of slip; --overwrite replaces it"):
        slip((11.0,), tmp_path / "slip")
