"""Blocks on profiles with steps, notches and edges, and at the ends of walls, with rigid contacts."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.scenario import Scenario, scenario_from_mapping
from blocksim.simulation.schemes import build_scene
from blocksim.verification.scene import HEIGHT, WIDTH, Simulation, scenario_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

G = 9.81
TOPPLING = (*range(4, 44, 4), 34, 28, 22, 16, 10, 4)  # m: heights of sixteen blocks, 10 m wide
DEEPEST = 1e-4  # m: of an overlap with the ground, at an impact too


def goodman_bray(friction_angle: float, scheme: str) -> Scenario:
    """Return the sixteen blocks of R. E. Goodman and J. W. Bray, Toppling of rock slopes (1976), on steps of 1 m.

    Every base is 1 m above that of the next block downhill, on planes that dip 30 degrees.
    """
    steps = [[10.0 * x, float(n)] for n in range(16) for x in (n, n + 1)]
    friction = math.tan(math.radians(friction_angle))
    return scenario_from_mapping(
        {
            "schema": 1,
            "name": "goodman_bray",
            "materials": {"rock": {"unit_weight": 25e3, "young_modulus": 1e9, "poisson_ratio": 0.25}},
            "blocks": {f"of_{h}": {"width": 10.0, "height": h, "length": 1.0, "material": "rock"} for h in TOPPLING},
            "bodies": [
                {"block": f"of_{h}", "x": 10.0 * n + 5.0, "y": n + 0.5 * h, "name": f"b{n + 1}"}
                for n, h in enumerate(TOPPLING)
            ],
            "ground": {"tilt": "30 deg", "profile": [*steps, [160.0, 16.0]]},
            "friction": {"block_block": friction, "block_ground": friction},
            "contact": {"restitution": 0.0},
            "time": {"scheme": scheme, "end": 2.0, "stop_at_rest": False},
        }
    )


@pytest.mark.parametrize("scheme", ["explicit", "nonsmooth"])
def test_rock_slope_topples_at_33_degrees_of_friction_and_stands_at_38_6(scheme: str) -> None:
    falls, stands = (Simulation(build_scene(goodman_bray(angle, scheme))).to_time(2.0) for angle in (33.0, 38.6))
    blocks = slice(0, len(TOPPLING))
    assert falls.bodies.x[9] < 95.0 - 2.0  # the tallest, downhill
    assert np.degrees(falls.bodies.angle[9]) > 5.0
    assert np.abs(stands.bodies.vx[blocks]).max() < 1e-3
    # springs give way under the toes, those of half a face by twice as much
    assert np.abs(stands.bodies.angle[blocks]).max() < math.radians(0.75 if scheme == "explicit" else 0.5)


def bare(bodies: list[Mapping[str, object]], **tables: Any) -> Scenario:
    friction = {"block_block": 0.4, "block_ground": 0.4}
    return scenario_of(bodies, **{"contact": {"restitution": 0.0}, "friction": friction, **tables})


def test_blocks_stand_on_and_beside_a_step_without_moving(begin: Callable[..., Simulation]) -> None:
    """The one beside it reaches far below the upper piece, the one on it far behind the riser."""
    step = {"profile": [[-0.3, 0.0], [0.0, 0.0], [0.0, 0.006], [0.3, 0.006]]}
    beside = {"x": -WIDTH / 2, "y": HEIGHT / 2, "velocity": [0.1, 0.0]}  # pushed against both
    run = begin(bare([beside, {"x": WIDTH / 2, "y": 0.006 + HEIGHT / 2}], ground=step)).to_time(0.05)
    assert run.bodies.x[:2] == pytest.approx([-WIDTH / 2, WIDTH / 2], abs=5e-5)
    assert run.bodies.y[:2] == pytest.approx([HEIGHT / 2, 0.006 + HEIGHT / 2], abs=5e-5)


def test_block_turns_over_a_sharp_ridge_without_sinking_into_it(begin: Callable[..., Simulation]) -> None:
    half = 0.03 / math.sqrt(3.0)  # of a ridge of 60 degrees
    ridge = {"profile": [[-0.3, 0.0], [-half, 0.0], [0.0, 0.03], [half, 0.0], [0.3, 0.0]]}
    run = begin(bare([{"x": 0.002, "y": 0.032 + HEIGHT / 2, "angle": math.radians(3.0)}], ground=ridge))
    for k in range(1, 61):  # it meets the flank after 0.15 s, turned by 60 degrees
        assert run.to_time(0.0025 * k).ledger_row()[-1] < DEEPEST
    assert run.bodies.angle[0] < math.radians(-45.0)


def test_block_that_meets_the_end_of_a_wall_stops_there(begin: Callable[..., Simulation]) -> None:
    shelf = [{"from": [0.0, 0.02], "to": [0.1, 0.02]}]
    run = begin(bare([{"x": -0.03, "y": 0.02, "velocity": [1.0, 0.0]}], walls=shelf, gravity=0.0)).to_time(0.03)
    assert run.bodies.x[0] == pytest.approx(-WIDTH / 2, abs=1e-5)
