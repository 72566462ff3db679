"""Forces at the joints of arches settled on springs, just before they fall, beside those of limit analysis.

Limit analysis is a linear programme here: each joint carries what is beyond it with a force inside the joint and inside
the friction cone. At the limit that is one state only: it has hinges where the force is at a corner, and slips where
friction is used up.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pytest
from scipy.optimize import linprog

from blocksim.scenario import Document, load_scenario
from blocksim.scenario.geometry import area_of, centroid
from blocksim.simulation import simulate
from blocksim.study.criterion import Stability
from blocksim.study.limit import limit
from blocksim.study.run_folder import read_run
from blocksim.study.sweep_folder import CASES
from blocksim.verification.arches import least_thickness
from tests.simulation.conftest import SCENARIOS
from tests.verification.test_arches import RADIUS, voussoir

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from blocksim.simulation.trajectory import Frames
    from blocksim.study.limit_answer import LimitAnswer

HINGE, SLIP = 0.99, 0.999  # of half a joint from its middle, and of the friction that a joint has
PULL = 0.37361  # along the ground over weight, under which the arch of tilting_arch.toml falls


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


@pytest.mark.parametrize(("friction", "hinges", "slips"), [(0.4, 6, 0), (0.35, 4, 2)])
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


@pytest.mark.long
def test_limit_on_springs_finds_the_tilt_at_which_an_arch_falls(tmp_path: Path) -> None:
    found = searched("tilting_arch", 0.75, {"ground.tilt": {"from": "20 deg", "to": "21 deg"}}, tmp_path / "limit")
    (change,) = found.limits
    assert (change.below, change.above) == (Stability.STANDS, Stability.FALLS)
    low, high = (math.tan(math.radians(degrees)) for degrees in (change.low, change.high))
    assert 0.99 * PULL < low < high < 1.01 * PULL
