"""An observable is one entry: added while the program runs, it is found wherever the others are."""

import json
from pathlib import Path

import pandas as pd
import pytest

from blocksim.scenario import load_stored
from blocksim.simulation.observables import OBSERVABLES, Observable
from blocksim.study.executors.ensemble import run_case
from tests.cli.conftest import SOFT, Command

EDGE = 0.1  # m: of a table on which the block slides
OVERHANG = Observable(
    "overhang_mm",
    lambda ends: 1e3 * (ends.motion[:, 0] + ends.shapes.reach - EDGE).max(axis=1),
    "mm",
    title="greatest overhang",
    word="overhang",
)


def test_an_added_observable_is_found_everywhere(blocksim: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(OBSERVABLES, OVERHANG.name, OVERHANG)
    scenario = ("scenarios/slide.toml", *SOFT, "--set", "time.end=0.1")
    run = blocksim("run", *scenario, "--set", "ground.tilt=30deg", "--out", "run")
    value = json.loads(Path("run/run.json").read_text())["movement"]["overhang_mm"]
    assert f"greatest overhang {value:.2f}" in run.err.replace("\n", " ")

    swept = blocksim("sweep", *scenario, "--vary", "ground.tilt=0deg,30deg", "--out", "sweep")
    assert "overhang_mm" in swept.out
    table = pd.read_csv("sweep/sweep.csv")
    assert table["overhang_mm"][1] == value  # of the same run, in an ensemble
    assert run_case(load_stored(Path("run/scenario.toml")), Path("run"))["overhang_mm"] == value  # of a kept case

    middle = f"{table['overhang_mm'].mean()} mm"
    limit = ("--vary", "ground.tilt=0deg:30deg:2", "--stands", f"overhang > {middle}", "--to", "50%", "--no-runs")
    assert "stands up to" in blocksim("limit", *scenario, *limit, "--out", "limit").out
    assert "overhang_mm" in pd.read_csv("limit/limit.csv")
    fails = ("--intensity", "ground.tilt=1deg,30deg", "--fails", f"overhang < {middle}", "--samples", 2)
    scatter = ("--scatter", "friction.block_ground=0.3:0.4")
    fragility = blocksim("fragility", *scenario, *fails, *scatter, "--out", "fragility")
    assert fragility.code in (0, 1), fragility.err
    assert pd.read_csv("fragility/fragility.csv")["failures"].tolist() == [0, 2]

    assert blocksim("report", "run", "sweep", "--out", "report.html").code == 0
    page = Path("report.html").read_text()
    assert "greatest overhang" in page
    columns = page.replace(", ", ",").replace(": ", ":")
    assert '"name":"overhang_mm","label":"greatest overhang (mm)"' in columns  # of the table; the label is an axis's
