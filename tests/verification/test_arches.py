"""Arches of voussoirs: least thickness and tilt beside limit analysis, and forces at the joints of one on springs."""

import csv
import math
from typing import Any

import numpy as np
import pytest

from blocksim.scenario import Model, load_scenario
from blocksim.simulation import simulate
from blocksim.simulation.schemes import build
from blocksim.statics.blockwork import Blockwork
from blocksim.statics.joint_forces import joint_forces
from blocksim.statics.programme import Programme
from blocksim.verification.arches import COCCHETTI_RIZZI, HEAD, VOUSSOIRS, least_thickness
from blocksim.verification.scene import SteppedScene
from tests.simulation.conftest import SCENARIOS

RADIUS = 10.0  # m, mean
FALLS, STANDS = 0.02, 2e-3  # m/s: of the fastest voussoir after a second
LEAST = [(0.4, 0.10672), (0.325, 0.17821)]  # of thickness over mean radius
PULL = 0.37361  # along the ground over weight, under which the arch of tilting_arch.toml falls


def after_a_second(name: str, **values: Any) -> tuple[SteppedScene, float]:
    """Return a shipped arch on its way, at the step it takes by itself, and the speed (m/s) of its fastest block."""
    scenario = load_scenario(SCENARIOS / f"{name}.toml", {"time.step": "auto", **values})
    run = SteppedScene(build(Model(scenario))).to_time(1.0)
    return run, float(np.hypot(run.bodies.vx, run.bodies.vy).max())


@pytest.mark.parametrize(("friction", "least"), LEAST)
def test_least_thickness_of_a_semicircular_arch_is_that_of_limit_analysis(friction: float, least: float) -> None:
    """27 voussoirs, thickness over mean radius; below a friction of 0.396 their joints slide."""
    frictions = {"block_block": friction, "block_ground": friction}
    thin, thick = (
        after_a_second("arch", friction=frictions, **{"structures.0.thickness": share * least * RADIUS})[1]
        for share in (0.99, 1.01)
    )
    assert thin > FALLS
    assert thick < STANDS


def test_arch_on_a_tilting_table_falls_at_20_49_degrees_in_three_parts() -> None:
    """Seven voussoirs over 157.5 degrees; four hinges: three parts of the arch turn, in turn one way and the other."""
    below, above = (
        after_a_second("tilting_arch", **{"ground.tilt": f"{math.atan(share * PULL)} rad"}) for share in (0.99, 1.01)
    )
    assert below[1] < STANDS
    assert above[1] > FALLS
    spins = above[0].to_time(1.5).bodies.spin[:7]
    assert 1 + np.count_nonzero(np.abs(np.diff(spins)) > 0.1 * np.abs(spins).max()) == 3


def test_limit_analysis_of_a_ring_is_that_of_cocchetti_and_rizzi() -> None:
    for friction, least in COCCHETTI_RIZZI:
        assert least_thickness(friction, None) == pytest.approx(least, abs=2e-5)
    (weakest, _), (kink, plateau), _ = COCCHETTI_RIZZI
    assert least_thickness(weakest - 5e-5, None) is None
    slides = least_thickness(kink - 1e-3, None)
    assert slides is not None
    assert slides > plateau + 5e-4


def test_the_table_beside_the_picture_is_what_limit_analysis_gives() -> None:
    text = (SCENARIOS / "published" / "arch_thickness.csv").read_text(encoding="utf-8")
    assert text.startswith(HEAD)
    rows = list(csv.reader(text[len(HEAD) :].splitlines()))
    for name, count in (("limit analysis of that ring", None), (f"the same of {VOUSSOIRS} voussoirs", VOUSSOIRS)):
        curve = [row for row in rows if row[2] == name]
        assert len(curve) > 20
        for over, share, _ in curve[2::9]:
            least = least_thickness(float(over), count)
            assert least is not None
            assert float(share) == pytest.approx(RADIUS * least, abs=1e-4)


def test_joints_of_an_arch_about_to_fall_on_a_tilting_table_press_where_statics_has_them() -> None:
    """Seven voussoirs on springs at 0.999 of the pull under which they fall: four joints press at a corner."""
    arch, level = SCENARIOS / "tilting_arch.toml", {"time.scheme": "nonsmooth"}
    blocks = Blockwork.of(Model(load_scenario(arch, {**level, "ground.tilt": "0 deg"})))
    found = Programme(blocks).greatest(blocks.forces, -blocks.horizontal)  # to the left
    assert found is not None
    assert found.factor == pytest.approx(PULL, abs=5e-6)
    joints = {frozenset((one.one, one.other)): one for one in joint_forces(blocks, found)}
    assert np.count_nonzero([one.margin_m < 1e-3 for one in joints.values()]) == 4
    values = {"ground.tilt": f"{math.atan(0.999 * PULL)} rad", "start.settle": True, "output.contacts": True}
    frames = simulate(load_scenario(arch, {**values, "time": {"end": 0.1, "scheme": "explicit"}})).frames
    assert frames.contacts is not None
    rows = frames.contacts.at(0)
    free = set(blocks.names)
    for pair in {(int(row["body_a"]), int(row["body_b"])) for row in rows}:
        points = rows[(rows["body_a"] == pair[0]) & (rows["body_b"] == pair[1])]
        places = np.column_stack([points["x"], points["y"]])
        names = [frames.names[number] for number in pair]
        joint = joints[frozenset(name if name in free else None for name in names)]
        press = points["normal_force"]
        assert press @ places / press.sum() == pytest.approx([joint.x_m, joint.y_m], abs=0.015)  # 1 % of a joint
