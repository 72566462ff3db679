"""Pictures of probes, and their part of a report."""

from pathlib import Path

import numpy as np
import pytest

from blocksim.errors import InvalidInputError
from blocksim.simulation import simulate_into
from blocksim.view.report.page import page_text
from blocksim.view.report.subjects import read_folder, run_subject
from blocksim.view.time_panels import draw_probes, panels_of
from tests.golden import Golden
from tests.simulation.test_probes import scene
from tests.view.study_drawings import probe


def test_a_moving_support_is_taken_off_the_motion_of_a_point() -> None:
    still = probe("point")
    still.columns["relative_dx"][:], still.columns["relative_dy"][:] = still["dx"], still["dy"]
    assert [*panels_of(still)[0].lines] == ["dx", "dy"]
    assert [*panels_of(probe("point"))[0].lines] == ["relative dx", "relative dy"]


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
