"""Arches of voussoirs: least thickness and tilt beside limit analysis, rigid and on springs, and forces at the joints.

Limit analysis is a linear programme here: each joint carries what is beyond it with a force inside the joint and inside
the friction cone. At the limit that is one state only: it has hinges where the force is at a corner, and slips where
friction is used up.
"""

from __future__ import annotations

import csv
import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pytest
from scipy.optimize import linprog

from blocksim.scenario import Document, load_scenario
from blocksim.scenario.geometry import area_of, centroid
from blocksim.simulation import simulate
from blocksim.simulation.schemes import build_scene
from blocksim.study.criterion import Stability
from blocksim.study.limit import limit, limit_curve
from blocksim.study.run_folder import read_run
from blocksim.study.sweep_folder import CASES
from blocksim.verification.arches import COCCHETTI_RIZZI, HEAD, VOUSSOIRS, least_thickness
from blocksim.verification.scene import Simulation
from tests.simulation.conftest import SCENARIOS

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from blocksim.simulation.trajectory import Frames
    from blocksim.study.limit_answer import LimitAnswer

RADIUS = 10.0  # m, mean
FALLS, STANDS = 0.02, 2e-3  # m/s: of the fastest voussoir after a second
LEAST = [(0.4, 0.10672), (0.375, 0.12597), (0.35, 0.15118), (0.325, 0.17821)]  # of thickness over mean radius
HINGE, SLIP = 0.99, 0.999  # of half a joint from its middle, and of the friction that a joint has
PULL = 0.37361  # along the ground over weight, under which the arch of tilting_arch.toml falls


def after_a_second(name: str, **values: Any) -> tuple[Simulation, float]:
    """Return a shipped arch on its way, at the step it takes by itself, and the speed (m/s) of its fastest block."""
    scenario = load_scenario(SCENARIOS / f"{name}.toml", {"time.step": "auto", **values})
    run = Simulation(build_scene(scenario)).to_time(1.0)
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
        for over, share, _ in curve[2::9]:
            least = least_thickness(float(over), count)
            assert least is not None
            assert float(share) == pytest.approx(RADIUS * least, abs=1e-4)


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


@pytest.mark.long
def test_every_point_of_the_picture_is_within_a_percent_of_limit_analysis(tmp_path: Path) -> None:
    limits_over([0.3125, 0.325, 0.3375, 0.35, 0.3625, 0.375, 0.3875, 0.4, 0.45, 0.5], tmp_path / "curve")


def voussoir(ends: tuple[float, float], thickness: float) -> list[tuple[float, float]]:
    """Return the corners of a voussoir between two angles (rad) from the right, on the circles."""
    inner, outer = RADIUS - 0.5 * thickness, RADIUS + 0.5 * thickness
    places = ((inner, ends[0]), (outer, ends[0]), (outer, ends[1]), (inner, ends[1]))
    return [(radius * math.cos(angle), radius * math.sin(angle)) for radius, angle in places]


class Joints(NamedTuple):
    """Forces at all joints from the right: places over half a joint from its middle, and shares of friction used."""

    places: NDArray[np.float64]
    used: NDArray[np.float64]

    def named(self) -> tuple[dict[int, float], list[int]]:
        """Return the joints that are hinges, -1 at the intrados and 1 at the extrados, and those that slip."""
        hinges = {int(n): float(np.sign(self.places[n])) for n in np.flatnonzero(np.abs(self.places) > HINGE)}
        return hinges, np.flatnonzero(self.used > SLIP).tolist()


def limit_analysis(
    count: int, thickness: float, embrace: float, friction: float, *, pulls: bool
) -> tuple[float, Joints]:
    """Return the largest pull to the left over weight that an arch carries (0 without), and its joints then."""
    inner, outer = RADIUS - 0.5 * thickness, RADIUS + 0.5 * thickness
    angles = np.linspace(0.5 * (math.pi - embrace), 0.5 * (math.pi + embrace), count + 1)
    shapes = [voussoir(ends, thickness) for ends in pairwise(angles.tolist())]
    areas = np.array([area_of(shape) for shape in shapes])
    moments = areas[:, None] * np.array([centroid(shape) for shape in shapes])
    weight = np.concatenate([[0.0], np.cumsum(areas)])
    at_x, at_y = np.concatenate([np.zeros((1, 2)), np.cumsum(moments, axis=0)]).T
    c, s, one, none = np.cos(angles), np.sin(angles), np.ones(count + 1), np.zeros(count + 1)
    # rows: a joint; columns: force and moment about the centre at the right springing, share of the weight, constant
    across = np.column_stack([one, none, none, -weight, none])
    up = np.column_stack([none, one, none, none, -weight])
    moment = np.column_stack([none, none, one, at_y, -at_x])
    normal = c[:, None] * up - s[:, None] * across
    shear = c[:, None] * across + s[:, None] * up
    needs = np.vstack(
        [inner * normal - moment, moment - outer * normal, shear - friction * normal, -shear - friction * normal]
    )
    free = (None, None)
    bounds = [free, free, free, free if pulls else (0.0, 0.0)]
    found = linprog([0.0, 0.0, 0.0, -1.0], A_ub=needs[:, :4], b_ub=-needs[:, 4], bounds=bounds).x
    carried = [rows[:, :4] @ found + rows[:, 4] for rows in (normal, shear, moment)]
    places = (carried[2] / carried[0] - RADIUS) / (0.5 * thickness)
    return float(found[3]), Joints(places, np.abs(carried[1]) / (friction * carried[0]))


def joints_of(frames: Frames, count: int, friction: float) -> Joints:
    """Return the joints of an arch in the first frame of a run; its abutments come last."""
    assert frames.contacts is not None
    rows = frames.contacts.at(0)
    x, y = frames.x[0, :count], frames.y[0, :count]  # on a circle about the centre
    middle = np.linalg.lstsq(np.column_stack([2.0 * x, 2.0 * y, np.ones(count)]), x**2 + y**2)[0][:2]
    found = []
    for pair in sorted({(int(row["body_a"]), int(row["body_b"])) for row in rows}):
        points = rows[(rows["body_a"] == pair[0]) & (rows["body_b"] == pair[1])]
        force, away = points["normal_force"], np.column_stack([points["x"], points["y"]]) - middle
        normal, shear = force.sum(), abs(points["shear_force"].sum())
        sides = np.sign(np.hypot(*away.T) - RADIUS)
        angle = math.atan2(*(force @ away)[::-1])
        found.append((angle, float(force @ sides) / normal, shear / (friction * normal)))
    return Joints(*np.array(sorted(found)).T[1:])


def assert_same(found: Joints, expected: Joints) -> None:
    assert found.named() == expected.named()
    assert found.places == pytest.approx(expected.places, abs=0.02)
    assert found.used == pytest.approx(expected.used, abs=0.01)


def on_springs(friction: float, **values: object) -> dict[str, Any]:
    """Return values with which the arches that ship begin at rest, on springs."""
    frictions = {"block_block": friction, "block_ground": friction}
    time = {"end": 0.1, "scheme": "explicit"}
    return {"time": time, "start.settle": True, "friction": frictions, "output": {"contacts": True}, **values}


def at_least_thickness(friction: float) -> tuple[float, Joints]:
    """Return the least thickness (m), and the joints at it."""
    share = least_thickness(friction)
    assert share is not None
    return RADIUS * share, limit_analysis(27, RADIUS * share * (1.0 + 1e-6), math.pi, friction, pulls=False)[1]


@pytest.mark.parametrize(
    ("friction", "hinges", "slips"), [pytest.param(0.4, 6, 0, marks=pytest.mark.long), (0.35, 4, 2)]
)
def test_arch_just_thick_enough_has_hinges_and_slips_where_limit_analysis_has_them(
    friction: float, hinges: int, slips: int
) -> None:
    """Beside the crown and 57 degrees from it; at the springings hinges, or slips where friction is below 0.396."""
    least, expected = at_least_thickness(friction)
    assert [len(one) for one in expected.named()] == [hinges, slips]
    values = on_springs(friction, **{"structures.0.thickness": 1.003 * least})
    run = simulate(load_scenario(SCENARIOS / "arch.toml", values))
    assert_same(joints_of(run.frames, 27, friction), expected)


def test_arch_about_to_fall_on_a_tilting_table_has_four_hinges_where_limit_analysis_has_them() -> None:
    pull, expected = limit_analysis(7, 1.5, math.radians(157.5), 0.75, pulls=True)
    assert pull == pytest.approx(PULL, abs=5e-6)
    assert list(expected.named()[0].values()) == [-1.0, 1.0, -1.0, 1.0]
    values = on_springs(0.75, **{"ground.tilt": f"{math.atan(0.999 * pull)} rad"})
    run = simulate(load_scenario(SCENARIOS / "tilting_arch.toml", values))
    assert_same(joints_of(run.frames, 7, 0.75), expected)


def searched(name: str, friction: float, vary: dict[str, Any], folder: Path) -> LimitAnswer:
    """Return what `limit` finds for an arch on springs, from two values."""
    document = Document.read(SCENARIOS / f"{name}.toml").with_values(on_springs(friction))
    ((key, ends),) = vary.items()
    return limit(document, {key: {**ends, "count": 2}}, tolerance=0.01, jobs=1, out=folder)


@pytest.mark.long
def test_limit_on_springs_finds_the_least_thickness_and_what_stands_above_it(tmp_path: Path) -> None:
    least, expected = at_least_thickness(0.35)
    ends = {"from": "1.4 m", "to": "1.6 m"}
    found = searched("arch", 0.35, {"structures.0.thickness": ends}, tmp_path / "limit")
    (change,) = found.limits
    assert (change.below, change.above) == (Stability.FALLS, Stability.STANDS)
    assert 0.99 * least < change.low < change.high < 1.01 * least
    stands = read_run(found.folder / CASES / found.case_folders[change.high])
    assert_same(joints_of(stands.frames, 27, 0.35), expected)
