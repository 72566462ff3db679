"""Pictures of probes, and their part of a report."""

from pathlib import Path

import numpy as np
import pytest

from blocksim.errors import InvalidInputError
from blocksim.simulation import simulate_into
from blocksim.simulation.instruments import ProbeSeries
from blocksim.view.report.page import page_text
from blocksim.view.report.subjects import read_folder, run_subject
from blocksim.view.time_panels import draw_probes, panels_of
from tests.simulation.test_probes import scene
from tests.view.study_drawings import probe


def test_a_moving_support_is_taken_off_the_motion_of_a_point() -> None:
    still = probe("point")
    still.columns["relative_dx"][:], still.columns["relative_dy"][:] = still["dx"], still["dy"]
    assert [*panels_of(still)[0].lines] == ["dx", "dy"]
    assert [*panels_of(probe("point"))[0].lines] == ["relative dx", "relative dy"]


@pytest.mark.parametrize(
    ("probes", "names", "message"),
    [
        ({}, (), "no samples of probes"),
        ({"a": probe("joint", 0)}, (), "no samples of probes"),
        (
            {"base": probe("force")},
            ("bass",),
            "--probe bass: no such probe in this run, did you mean 'base'?",
        ),
        ({f"p{k}": probe("point") for k in range(5)}, (), "15 panels are too many"),
    ],
)
def test_what_cannot_be_drawn_is_told(
    tmp_path: Path, probes: dict[str, ProbeSeries], names: tuple[str, ...], message: str
) -> None:
    with pytest.raises(InvalidInputError, match=message.replace("?", r"\?")):
        draw_probes(probes, tmp_path / "p.png", names=names)


def test_a_report_shows_the_probes_of_a_run(tmp_path: Path) -> None:
    probes = [{"kind": "force", "on": "supports", "name": "base"}]
    simulate_into(scene("nonsmooth", probes, 0.02), tmp_path / "run")
    stored = read_folder(tmp_path / "run")
    text = page_text([run_subject("a", stored)], title="", version="0")
    assert "base: force, 3 samples to 0.02 s, in probe-base.csv" in text
    assert 'src="data:image/png;base64,iVBOR' in text
    assert np.isfinite(stored.probes["base"]["fy"]).all()
