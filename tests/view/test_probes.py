"""Pictures of probes, and their part of a report."""

from pathlib import Path

import numpy as np
import pytest

from blocksim.errors import InvalidInputError
from blocksim.simulation import instruments, simulate_into
from blocksim.view import run_data
from blocksim.view.report.page import page_text
from blocksim.view.report.subjects import read_folder, run_subject
from blocksim.view.time_panels import draw_probes, panels_of, probe_picture
from tests.golden import Golden
from tests.simulation.test_actuators import pushed
from tests.simulation.test_probes import scene
from tests.view.study_drawings import probe


def test_a_moving_support_is_taken_off_the_motion_of_a_point() -> None:
    still = probe("point")
    still.columns["relative_dx"][:], still.columns["relative_dy"][:] = still["dx"], still["dy"]
    assert [*panels_of(still)[0].lines] == ["dx", "dy"]
    assert [*panels_of(probe("point"))[0].lines] == ["relative dx", "relative dy"]


@pytest.mark.parametrize("kind", instruments.COLUMNS)
def test_every_kind_of_probe_has_a_picture(kind: str) -> None:
    assert all(len(panel.lines) > 0 for panel in panels_of(probe(kind)))
    assert probe_picture(probe(kind)).startswith(b"\x89PNG")


def test_an_actuator_pushes_as_its_record_says() -> None:
    """Its arrow in pictures, between two samples."""
    scenario, record = pushed("nonsmooth"), probe("actuator")
    (jack,) = run_data.support_of(scenario, (), {"jack": record}).loads
    assert jack.values(np.array([0.15])) == pytest.approx(0.5 * (record["force"][1] + record["force"][2]))
    assert run_data.support_of(scenario).loads == ()


def test_what_cannot_be_drawn_is_told(golden: Golden) -> None:
    many, said = {f"p{k}": probe("point") for k in range(5)}, []
    for probes, names in (({}, ()), ({"a": probe("joint", 0)}, ()), ({"base": probe("force")}, ("bass",)), (many, ())):
        with pytest.raises(InvalidInputError) as caught:
            draw_probes(probes, Path("p.png"), names=names)
        said.append(str(caught.value))
    golden("\n".join(said))


def test_a_report_shows_the_probes_of_a_run(tmp_path: Path) -> None:
    probes = [{"kind": "force", "on": "supports", "name": "base"}]
    simulate_into(scene("nonsmooth", probes, 0.02), tmp_path / "run")
    stored = read_folder(tmp_path / "run")
    text = page_text([run_subject("a", stored)], title="", version="0")
    assert "base: force, 3 samples to 0.02 s, in probe-base.csv" in text
    assert 'src="data:image/png;base64,iVBOR' in text
    assert np.isfinite(stored.probes["base"]["fy"]).all()
