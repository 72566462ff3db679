"""Arches of voussoirs: least thickness and tilt, bracketed within a percent, rigid and on springs; limit analysis."""

from __future__ import annotations

import csv
import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.scenario import load_scenario
from blocksim.scenario.geometry import centre_outline
from blocksim.simulation import simulate
from blocksim.simulation.rest_state import SettleError
from blocksim.simulation.schemes import build_scene
from blocksim.study.limit import limit_curve
from blocksim.verification.arches import COCCHETTI_RIZZI, HEAD, VOUSSOIRS, least_thickness
from blocksim.verification.scene import Simulation
from tests.kernels.scenes import Block, posed
from tests.simulation.conftest import SCENARIOS

if TYPE_CHECKING:
    from pathlib import Path

    from blocksim.scenario import Scenario
    from blocksim.scenario.geometry import Corners

RADIUS = 10.0  # m, mean
STEP = 2.5e-4  # s: contacts give way by 1.5 mm at four times as long a step, and friction holds an arch by less
FALLS, STANDS = 0.02, 2e-3  # m/s: of the fastest voussoir after a second


def voussoir(ends: tuple[float, float], thickness: float) -> list[tuple[float, float]]:
    """Return the corners of a voussoir between two angles (rad) from the right, on the circles."""
    inner, outer = RADIUS - 0.5 * thickness, RADIUS + 0.5 * thickness
    places = ((inner, ends[0]), (outer, ends[0]), (outer, ends[1]), (inner, ends[1]))
    return [(radius * math.cos(angle), radius * math.sin(angle)) for radius, angle in places]


def abutment(angle: float, thickness: float) -> list[tuple[float, float]]:
    """Return the corners of a block that carries an arch at an angle (rad), beyond the joint there."""
    along = np.array([math.cos(angle), math.sin(angle)])
    away = np.array([math.sin(angle), -math.cos(angle)]) * (1.0 if angle < math.pi / 2 else -1.0)
    places = ((-1, 0), (-1, 0.2), (1, 0.2), (1, 0))
    return [tuple(RADIUS * along + u * thickness * along + v * RADIUS * away) for u, v in places]


def block(corners: list[tuple[float, float]], *, fixed: bool = False) -> Block:
    """Return a block with corners at some places, above all ground."""
    outline: Corners = centre_outline(corners)
    first = min(outline, key=lambda one: math.hypot(one[0] - outline[0][0], one[1] - outline[0][1]))
    x, y = corners[0][0] - first[0], corners[0][1] - first[1]
    return Block(x, y + 2.0 * RADIUS, fixed=fixed, outline=outline)


def arch(count: int, thickness: float, embrace: float, **values: Any) -> Simulation:
    """Return an arch under way on two fixed abutments."""
    begin = 0.5 * (math.pi - embrace)
    angles = np.linspace(begin, begin + embrace, count + 1).tolist()
    stones = [block(voussoir(ends, thickness)) for ends in pairwise(angles)]
    feet = [block(abutment(angle, thickness), fixed=True) for angle in (angles[0], angles[-1])]
    return Simulation(posed([*stones, *feet], restitution=0.0, step=STEP, **values))


def fastest(run: Simulation) -> float:
    """Return the speed (m/s) of the fastest voussoir after a second."""
    run.to_time(1.0)
    return float(np.hypot(run.bodies.vx, run.bodies.vy).max())


LEAST = [(0.4, 0.10672), (0.375, 0.12597), (0.35, 0.15118), (0.325, 0.17821)]  # of thickness over mean radius


def at_its_own_step(friction: float, thickness: float) -> Simulation:
    """Return the arch of `arch.toml` under way, of a thickness (m), with the automatic step."""
    arch = {"kind": "arch", "block": "voussoir", "radius": RADIUS, "thickness": thickness, "count": 27}
    frictions = {"block_block": friction, "block_ground": friction}
    values: Any = {"time.step": "auto", "friction": frictions, "structures": [arch]}
    return Simulation(build_scene(load_scenario(SCENARIOS / "arch.toml", values)))


@pytest.mark.parametrize(("friction", "least"), LEAST)
def test_automatic_step_is_short_enough_for_the_least_thickness(friction: float, least: float) -> None:
    assert fastest(at_its_own_step(friction, 0.99 * least * RADIUS)) > FALLS
    assert fastest(at_its_own_step(friction, 1.01 * least * RADIUS)) < STANDS


def on_springs(friction: float, thickness: float) -> Scenario:
    """Return the arch of `arch.toml`, of a thickness (m), settled on springs of full stiffness."""
    arch = {"kind": "arch", "block": "voussoir", "radius": RADIUS, "thickness": thickness, "count": 27}
    frictions = {"block_block": friction, "block_ground": friction}
    time = {"end": 1.0, "stop_at_rest": False}
    values: Any = {"time": time, "start": {"settle": True}, "friction": frictions, "structures": [arch]}
    return load_scenario(SCENARIOS / "arch.toml", values)


@pytest.mark.long
@pytest.mark.parametrize(("friction", "least"), LEAST)
def test_least_thickness_of_an_arch_settled_on_springs_is_that_of_limit_analysis(friction: float, least: float) -> None:
    with pytest.raises(SettleError, match="does not come to rest"):
        simulate(on_springs(friction, 0.99 * least * RADIUS))
    stands = simulate(on_springs(friction, 1.01 * least * RADIUS))
    assert np.hypot(stands.frames.vx, stands.frames.vy).max() < STANDS


@pytest.mark.parametrize(("friction", "least"), LEAST)
def test_least_thickness_of_a_semicircular_arch_is_that_of_limit_analysis(friction: float, least: float) -> None:
    """27 voussoirs, thickness over mean radius; below a friction of 0.396 their joints slide."""
    for share, stands in ((0.99, False), (1.01, True)):
        speed = fastest(arch(27, share * least * RADIUS, math.pi, friction=friction))
        assert speed < STANDS if stands else speed > FALLS


@pytest.mark.parametrize(("share", "stands"), [(0.99, True), (1.01, False)])
def test_arch_on_a_tilting_table_falls_at_20_49_degrees(share: float, stands: bool) -> None:
    """Seven voussoirs over 157.5 degrees: tan = 0.37361."""
    tilt = math.atan(share * 0.37361)
    run = arch(7, 1.5, math.radians(157.5), friction=0.75, tilt=tilt)
    speed = fastest(run)
    assert speed < STANDS if stands else speed > FALLS
    if not stands:  # four hinges: three parts of the arch turn, in turn one way and the other
        spins = run.to_time(1.5).bodies.spin[:7]
        parts = 1 + np.count_nonzero(np.abs(np.diff(spins)) > 0.1 * np.abs(spins).max())
        assert parts == 3


@pytest.mark.parametrize(("friction", "least"), LEAST)
def test_limit_analysis_of_voussoirs_gives_the_thicknesses_that_others_found(friction: float, least: float) -> None:
    assert least_thickness(friction) == pytest.approx(least, abs=6e-6)


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
        for over, limit, _ in curve[2::9]:
            least = least_thickness(float(over), count)
            assert least is not None
            assert float(limit) == pytest.approx(RADIUS * least, abs=1e-4)


def limits_over(frictions: list[float], out: Path) -> None:
    """Assert that `limit` finds the thicknesses of limit analysis, all brackets within a percent of it."""
    found = limit_curve(
        SCENARIOS / "arch.toml",
        {"structures.0.thickness": {"from": "1 m", "to": "2.1 m"}},
        {"friction.block_block": frictions},
        stands="outcome == stands",
        tolerance=0.01,
        jobs=1,
        out=out,
    )
    assert list(found.searches) == frictions
    for friction, search in found.searches.items():
        (change,) = search.limits
        least = least_thickness(friction)
        assert least is not None
        assert change.above.value == "stands"
        assert 0.99 * RADIUS * least < change.low < change.high < 1.01 * RADIUS * least


def test_limit_finds_the_least_thickness_where_joints_slide(tmp_path: Path) -> None:
    limits_over([0.35], tmp_path / "curve")


@pytest.mark.long
def test_every_point_of_the_picture_is_within_a_percent_of_limit_analysis(tmp_path: Path) -> None:
    limits_over([0.3125, 0.325, 0.3375, 0.35, 0.3625, 0.375, 0.3875, 0.4, 0.45, 0.5], tmp_path / "curve")
