"""Frames as text, what comes back and how far it is off; pictures, where their panels and cases are."""

import math
import xml.etree.ElementTree as ET
from base64 import b64decode
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from blocksim.errors import InvalidInputError
from blocksim.scenario import Model, load_scenario
from blocksim.scenario.geometry import regular
from blocksim.simulation.results import EventRecord
from blocksim.study.pictures import read_sweep_data
from blocksim.view.report import player
from blocksim.view.report.player import boundary_particles, pack, pack_frames, scene_data
from blocksim.view.report.subjects import history_of, pictures_of
from blocksim.view.run_data import Support
from blocksim.world.build import build_world
from tests.view.made_up import polygons, toppling
from tests.view.report.folders import SCENARIOS, numbers, write_run, write_sweep


def test_too_many_frames_are_thinned_and_that_is_reported(tmp_path: Path) -> None:
    frames = write_run(tmp_path / "run", count=41)
    packed = pack_frames(frames, most_bytes=5 * 3 * 6 * 4)
    assert packed.kept.tolist() == [0, 10, 20, 30, 40]
    assert numbers(packed.data["time"]) == pytest.approx(frames.time[[0, 10, 20, 30, 40]])
    assert "5 of 41 recorded frames are in this page (evenly thinned)." in packed.notes


def test_frames_that_are_not_finite_are_left_out(tmp_path: Path) -> None:
    frames = write_run(tmp_path / "run", count=4)
    x = frames.x.copy()
    x[3, 1] = np.nan
    assert len(pack_frames(replace(frames, x=x)).kept) == 3
    with pytest.raises(InvalidInputError, match="no frame to draw"):
        pack_frames(replace(frames, x=np.full_like(x, np.nan)))


def test_page_knows_when_blocks_and_walls_are_gone(tmp_path: Path) -> None:
    frames = write_run(tmp_path / "run", "slope", count=5)
    scenario = load_scenario(SCENARIOS / "slope.toml", {"events": [{"when": "rest", "remove": ["wall 1"]}]})
    frames.vx[3:, 1] = np.nan
    happened = EventRecord(event=0, step=10, time_s=float(frames.time[2]), what="", energy_J=0.0)
    kept = np.array([0, 2, 3, 4])
    data = scene_data(frames, Model(scenario), kept, [happened])
    assert data["gone"] == [None, 2, *[None] * (len(frames.names) - 2)]
    assert data["walls_gone"] == [1, *[None] * (len(scenario.walls) - 1)]
    assert scene_data(frames, Model(scenario), kept)["walls_gone"] == [None] * len(scenario.walls)


@pytest.mark.parametrize("model", ["particles", "kernel"])
def test_particles_are_those_of_the_world(model: str) -> None:
    scenario = load_scenario(SCENARIOS / "three_blocks_particles.toml", {"contact.model": model})
    world = build_world(Model(scenario))
    body = world.bodies[0]
    own = world.particles[int(body.first_particle) : int(body.first_particle + body.particle_count)]
    expected = np.unique(np.stack([own.x, own.y], axis=-1).round(9), axis=0)
    drawn = boundary_particles(scenario, 2.0 * float(body.half_x), 2.0 * float(body.half_y))
    assert np.unique(drawn.round(9), axis=0) == pytest.approx(expected)


def test_polygons_are_packed_once_for_each_shape() -> None:
    wedge, hexagon = ((-0.01, -0.01), (0.02, -0.01), (-0.01, 0.02)), regular(6, 0.02)
    packed = pack_frames(polygons(toppling(5, steps=3), wedge, hexagon)).data["outlines"]
    assert [packed["corners"][kind] for kind in packed["which"]][:2] == [
        [[1e3 * x for x in corner] for corner in wedge],
        [[float(f"{1e3 * x:.7g}") for x in corner] for corner in hexagon],
    ]
    assert len(packed["corners"]) == len(packed["upper"]) == len(packed["width"]) == 2
    assert packed["width"][packed["which"][1]] == pytest.approx(20.0 * math.sqrt(3.0))
    (rectangle,) = pack_frames(toppling(5, steps=3)).data["outlines"]["corners"]
    assert rectangle[0] == [-rectangle[2][0], -rectangle[2][1]]


@pytest.mark.parametrize(("most", "kind"), [(1000, "f4"), (10, "u2")])
def test_told_error_is_the_largest_one_and_there_is_none_for_equal_values(
    monkeypatch: pytest.MonkeyPatch, most: int, kind: str
) -> None:
    monkeypatch.setattr(player, "EXACT_VALUES", most)
    for values in (np.random.default_rng(1).normal(0.0, 100.0, (50, 7)), np.full((30, 2), 4.5)):
        part, error = pack(values)
        assert part["type"] == kind
        assert np.abs(numbers(part) - values.ravel()).max() == pytest.approx(error)
        assert error <= 0.5 * np.ptp(values) / 65_535 * (1.0 + 1e-9)


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
