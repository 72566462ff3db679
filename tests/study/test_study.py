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


def test_it_writes_an_answer_that_is_read_back_and_a_table(tmp_path: Path) -> None:
    answer = slip((10.0, 25.0), tmp_path / "slip")
    assert [point.outcome for point in answer.points] == ["stands", "slid"]
    assert SlipAnswer.read(answer.folder).points == answer.points
    data = json.loads((answer.folder / "slip.json").read_text())
    assert data["environment"]["blocksim"]
    assert [point["tilt"] for point in data["points"]] == [10.0, 25.0]
    assert (answer.folder / "slip.csv").read_text() == "tilt [deg],outcome\n10.0,stands\n25.0,slid\n"
    assert answer.table["outcome"].tolist() == ["stands", "slid"]


def test_it_goes_on_where_it_was_stopped_and_runs_nothing_twice(tmp_path: Path) -> None:
    seen: list[float] = []

    def stop(tilt: float, _: object) -> None:
        seen.append(tilt)
        if len(seen) == 1:
            raise KeyboardInterrupt

    with pytest.raises(StoppedEarlyError, match="stopped after 1 runs; rerun the command to finish"):
        slip((10.0, 25.0), tmp_path / "slip", Execution(jobs=1), on_row=stop)
    again = slip((10.0, 25.0), tmp_path / "slip", Execution(jobs=1), on_row=stop)
    assert sorted(seen) == [10.0, 25.0]
    assert again.run == 1
    assert slip((10.0, 25.0), tmp_path / "slip").run == 0
    with pytest.raises(OutputExistsError, match="contains another study of slip; --overwrite replaces it"):
        slip((11.0,), tmp_path / "slip")


def test_it_is_drawn_reported_and_verified(tmp_path: Path) -> None:
    folder = slip((10.0, 25.0), tmp_path / "slip").folder
    study = study_in(folder)
    assert study is not None
    assert study.answer is SlipAnswer
    assert plot(folder, out=tmp_path / "slip.png").read_bytes() == b"10.0: stands, 25.0: slid"
    with pytest.raises(InvalidInputError, match="a study of slip is drawn as 'steps', not as 'lines'"):
        plot(folder, out=tmp_path / "slip.png", kind="lines", overwrite=True)
    page = report(folder, out=tmp_path / "slip.html").read_text()
    assert "What every tilt came to" in page
    (verdict,) = verify_study(folder, study)
    assert verdict.agrees
    assert verdict.rows == 2
    changed = (folder / "slip.json").read_text().replace('"slid"', '"fell"')
    (folder / "slip.json").write_text(changed)
    (verdict,) = verify_study(folder, study)
    assert [(one.entry, one.stored, one.now) for one in verdict.entries] == [("points.1.outcome", "fell", "slid")]
