"""Loads against closed forms of statics: a dam under water, a block on a tilting table; both schemes."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import pytest

from blocksim.scenario import load_scenario, scenario_from_mapping
from blocksim.simulation import simulate
from blocksim.study.criterion import Stability
from blocksim.study.limit import limit

if TYPE_CHECKING:
    from pathlib import Path

WATER, CONCRETE = 9810.0, 2400.0 * 9.81  # N/m3
HEIGHT = 10.0  # m
TURNS_OVER = math.sqrt(WATER / (3.0 * CONCRETE))  # of the height: 0.3727
FRICTION = 0.5
SLIDES = WATER / (2.0 * FRICTION * CONCRETE)


def block(scheme: str, width: float, height: float, friction: float, **changes: Any) -> dict[str, Any]:
    return {
        "schema": 1,
        "name": "block",
        "materials": {"concrete": {"density": 2400.0, "young_modulus": "20 GPa", "poisson_ratio": 0.2}},
        "blocks": {"b": {"width": width, "height": height, "length": 1.0, "material": "concrete"}},
        "bodies": [{"block": "b", "x": 0.0, "y": 0.5 * height}],
        "friction": {"block_ground": friction},
        "contact": {"restitution": 0.0, "stiffness_scale": 0.01},
        "time": {"scheme": scheme, "end": 2.0},
        "start": {"settle": True},
        **changes,
    }


LONG = pytest.mark.long  # the other scheme shows the same load, and the other load the same scheme


@pytest.mark.parametrize(
    ("scheme", "friction", "ratio"),
    [
        ("explicit", 2.0, TURNS_OVER),
        ("nonsmooth", FRICTION, SLIDES),
        pytest.param("nonsmooth", 2.0, TURNS_OVER, marks=LONG),
        pytest.param("explicit", FRICTION, SLIDES, marks=LONG),
    ],
)
def test_a_dam_turns_over_and_slides_at_its_base_of_statics(
    tmp_path: Path, scheme: str, friction: float, ratio: float
) -> None:
    water = {"kind": "pressure", "body": "1", "face": "left", "water_level": HEIGHT, "unit_weight": WATER}
    dam = block(scheme, 4.0, HEIGHT, friction, loads=[water])
    width = ratio * HEIGHT
    within = {"blocks.b.width": {"from": 0.99 * width, "to": 1.01 * width, "count": 2}}
    (change,) = limit(dam, within, tolerance=0.03, out=tmp_path / "limit", jobs=1, keep_runs=False).limits
    assert (change.below, change.above) == (Stability.FALLS, Stability.STANDS)


LOW = ((0.1, 0.05), math.degrees(math.atan(0.38)))
SLENDER = ((0.02, 0.1), math.degrees(math.atan(0.2)))


@pytest.mark.parametrize(
    ("scheme", "size", "critical"),
    [
        ("explicit", *LOW),
        ("nonsmooth", *LOW),
        ("nonsmooth", *SLENDER),
        pytest.param("explicit", *SLENDER, marks=LONG),
    ],
)
def test_a_block_on_a_tilting_table_moves_at_its_angle_of_statics(
    scheme: str, size: tuple[float, float], critical: float
) -> None:
    before, rate, after = 0.3, 0.1, 0.22  # degrees, degrees a second, degrees
    tilts = {"from": f"{critical - before} deg", "to": f"{critical + 1.0} deg", "rate": f"{rate} deg/s"}
    scenario = scenario_from_mapping(
        block(
            scheme,
            *size,
            0.38,
            loads=[{"kind": "gravity", **tilts}],
            ground={"tilt": f"{critical - before} deg"},
            contact={"restitution": 0.0, "stiffness_scale": 0.001},
            time={"scheme": scheme, "end": (before + after) / rate},
            output={"every": 0.02},
        )
    )
    frames = simulate(scenario).frames
    way = abs(frames.x[:, 0] - frames.x[0, 0]) + size[1] * abs(frames.rotation[:, 0])
    moved = float(frames.time[way > 1e-3][0])
    assert critical - before + rate * moved == pytest.approx(critical, abs=0.2)


def test_the_shipped_dam_stands_until_its_base_is_too_narrow() -> None:
    stands = simulate(load_scenario("scenarios/dam.toml"))
    assert stands.summary.reason == "at rest"
    assert stands.summary.simulated_time_s > 4.0
    narrow = simulate(load_scenario("scenarios/dam.toml", ["blocks.dam.width=3.65 m"])).summary.movement
    assert narrow is not None
    assert narrow.outcome in {"rocking", "fell"}  # it turns over at the end
    assert narrow.moves_on
    assert narrow.first_moved_s is not None
    assert 3.9 < narrow.first_moved_s < 6.0  # as the level comes near the crest


def test_water_on_the_battered_back_of_a_dam_adds_its_weight(tmp_path: Path) -> None:
    """Thrust gamma H^2/2 over the friction of its weight and of the water above the back: where it slides."""
    width, lean = 6.0, 2.0  # m, of the base, and the foot of the back beyond its crest
    outline = [[0.0, 0.0], [width, 0.0], [width, HEIGHT], [lean, HEIGHT]]
    water = {"kind": "pressure", "body": "1", "face": "left", "water_level": HEIGHT, "unit_weight": WATER}
    dam = block("nonsmooth", 1.0, HEIGHT, 1.0, loads=[water])
    area = (width - 0.5 * lean) * HEIGHT
    below = HEIGHT * (width**2 / 2.0 - lean**2 / 6.0) / area  # from the corner at the back to the centroid
    dam["blocks"] = {"b": {"outline": outline, "depth": 1.0, "material": "concrete"}}
    rise = (0.5 * width * HEIGHT**2 - lean * HEIGHT**2 / 3.0) / area
    dam["bodies"] = [{"block": "b", "x": below, "y": rise}]
    slides = 0.5 * WATER * HEIGHT**2 / (CONCRETE * area + 0.5 * WATER * HEIGHT * lean)
    within = {"friction.block_ground": {"from": 0.99 * slides, "to": 1.01 * slides, "count": 2}}
    (change,) = limit(dam, within, tolerance=0.03, out=tmp_path / "limit", jobs=1, keep_runs=False).limits
    assert (change.below, change.above) == (Stability.FALLS, Stability.STANDS)
