"""Pictures of probes, and their part of a report."""

from pathlib import Path

import numpy as np
import pytest

from blocksim.errors import InvalidInputError
from blocksim.simulation import simulate_into
from blocksim.simulation.instruments import COLUMNS, ENERGY, ProbeSeries, series_of
from blocksim.view.report.page import page_text
from blocksim.view.report.subjects import read_folder, run_subject
from blocksim.view.time_panels import draw_probes, panels_of
from tests.simulation.test_probes import scene

LEDGER = ("kinetic", "potential", "friction")


def made_up(kind: str, name: str, count: int = 5) -> ProbeSeries:
    columns = dict.fromkeys(LEDGER, "J") if kind == ENERGY else COLUMNS[kind]
    rows = [(step, [1e3 * (step + 1.0) * (place + 1) for place in range(len(columns))]) for step in range(count)]
    return series_of(name, kind, columns, rows, 0.1)


def test_every_kind_of_probe_is_drawn_in_units_of_its_own(tmp_path: Path) -> None:
    probes = {kind: made_up(kind, kind) for kind in (*COLUMNS, "energy")}
    draw_probes(probes, tmp_path / "all.svg", "run: probes")
    texts = (tmp_path / "all.svg").read_text(encoding="utf-8")
    for label in (
        "force (kN)",
        "share of friction",
        "displacement (mm)",
        "joint (mm)",
        "energy (kJ)",
        "opening at first end",
    ):
        assert f"<!-- {label} -->" in texts
    draw_probes(probes, tmp_path / "one.svg", names=("joint",))
    assert "force" not in (tmp_path / "one.svg").read_text(encoding="utf-8")


def test_the_force_of_an_impact_does_not_hide_the_others() -> None:
    series = made_up("force", "base", 200)
    series.columns["fx"][:], series.columns["fy"][:] = 1.0, -20.0
    series.columns["fy"][77] = -5000.0
    panel, *_ = panels_of(series)
    assert panel.limits == pytest.approx((-30.0 - 0.08 * 31.0, 1.0 + 0.08 * 31.0))
    assert panel.note.endswith("largest: 5e+03 N")
    series.columns["fy"][77] = -50.0
    assert panels_of(series)[0].limits is None


def test_a_moving_support_is_taken_off_the_motion_of_a_point() -> None:
    still = made_up("point", "p")
    still.columns["relative_dx"][:], still.columns["relative_dy"][:] = still["dx"], still["dy"]
    assert [*panels_of(still)[0].lines] == ["dx", "dy"]
    assert [*panels_of(made_up("point", "p"))[0].lines] == ["relative dx", "relative dy"]


@pytest.mark.parametrize(
    ("probes", "names", "message"),
    [
        ({}, (), "no samples of probes"),
        ({"a": made_up("joint", "a", 0)}, (), "no samples of probes"),
        (
            {"base": made_up("force", "base")},
            ("bass",),
            "--probe bass: no such probe in this run, did you mean 'base'?",
        ),
        ({f"p{k}": made_up("point", f"p{k}") for k in range(5)}, (), "15 panels are too many"),
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
