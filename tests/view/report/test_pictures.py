"""Pictures in a report: where their panels and cases are, and that the same run gives the same bytes."""

import xml.etree.ElementTree as ET
from base64 import b64decode
from pathlib import Path

import numpy as np
import pytest

from blocksim.study.pictures import read_sweep_data
from blocksim.view.report.subjects import history_of, pictures_of
from blocksim.view.run_data import Support
from tests.view.made_up import toppling
from tests.view.report.folders import write_sweep


def test_histories_are_small_the_same_each_time_and_say_where_their_panels_are() -> None:
    frames = toppling(3)
    source, panels = history_of(frames, Support(), None)
    assert source == history_of(frames, Support(), None)[0]
    assert len(source) < 150_000
    svg = b64decode(source.partition("base64,")[2])
    assert ET.fromstring(svg).tag.endswith("svg")  # noqa: S314 - our own file
    assert [panel["name"] for panel in panels] == ["x", "y", "rotation", "energy", "contacts"]
    tops = [panel["place"][1] for panel in panels]
    assert tops == sorted(tops)
    low, high = panels[0]["values"]
    assert low < 1e3 * frames.x.min() < 1e3 * frames.x.max() < high


def test_cases_of_a_map_are_where_their_inputs_are(tmp_path: Path) -> None:
    write_sweep(tmp_path / "sweep", kept=0, planned=True)
    pictures = pictures_of(read_sweep_data(tmp_path / "sweep"))
    assert pictures[0]["label"] == "map of contact.restitution over block_block.kinetic"
    assert [one["label"] for one in pictures[1:]] == ["lines", "matrix", "histogram"]
    data = pictures[0]["data"]
    assert data["column"] == [0] * 6
    assert np.array(data["x"]) == pytest.approx(np.tile([1.0, 3.0, 5.0], 2) / 6.0, abs=1e-3)  # a grid of three by two
    assert np.array(data["y"]) == pytest.approx(np.repeat([0.25, 0.75], 3), abs=1e-3)
    assert len(data["panels"]) == 2
    assert [one["data"] for one in pictures[1:]] == [None] * 3
