"""Arches, columns, Voronoi walls and rubble: their geometry; wrong keys are in broken/cells.txt."""

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from blocksim.scenario import Model, PlacedBody, Scenario
from blocksim.scenario.events import joint_between
from blocksim.scenario.geometry import area_of, faults
from blocksim.scenario.overlap import overlapping_pairs
from blocksim.scenario.overrides import freeze
from blocksim.scenario.placement import place
from blocksim.scenario.start import impossible_starts
from tests.scenario.conftest import data_of

STONE = {"depth": 0.5, "material": "oak"}


def scenario(**structure: Any) -> Scenario:
    structures = [{"block": "stone", **structure}]
    return Scenario.model_validate(freeze(data_of(blocks={"stone": STONE}, structures=structures, bodies=[])))


def built(**structure: Any) -> tuple[PlacedBody, ...]:
    found = scenario(**structure)
    assert [*impossible_starts(found, lambda: place(found))] == []
    return Model(found).bodies


def corners(body: PlacedBody) -> NDArray[np.float64]:
    return np.asarray(np.array(body.corners) + np.array([body.x, body.y]))


def test_voussoirs_have_their_corners_on_the_circles_and_share_radial_joints() -> None:
    *ring, left, right = built(kind="arch", radius=10, thickness=1, count=27)
    assert [body.fixed for body in (*ring, left, right)] == [False] * 27 + [True] * 2
    area = 27 * 0.5 * (10.5**2 - 9.5**2) * math.sin(math.pi / 27)
    assert sum(area_of(body.outline) for body in ring) == pytest.approx(area)
    centre = np.array([11.0, 1.0])  # abutments are 2 m wide and 1 m high
    radii = np.hypot(*(np.concatenate([corners(body) for body in ring]) - centre).T)
    assert np.minimum(abs(radii - 9.5), abs(radii - 10.5)).max() < 1e-12
    for one, other in pairwise((left, *ring, right)):
        joint = joint_between(one, other)
        assert joint is not None
        assert math.dist(*joint.ends_of_a) == pytest.approx(1.0)


def test_an_arch_by_its_span_has_that_clear_width() -> None:
    *ring, left, right = built(kind="arch", span=4, thickness=0.5, embrace="120 deg", count=9)
    assert len(ring) == 9
    feet = [corners(ring[0]), corners(ring[-1])]
    inner = [
        min(points.tolist(), key=lambda p: (p[1], sign * -p[0])) for points, sign in zip(feet, (1, -1), strict=True)
    ]
    assert inner[1][0] - inner[0][0] == pytest.approx(4.0)
    assert left.y == pytest.approx(right.y)
    assert built(kind="arch", span=4, thickness=0.5, embrace="120 deg", count=9, abutments=False)[0].y < ring[0].y


def test_shear_velocity_grows_with_height_to_its_value_at_the_top() -> None:
    drums = built(kind="column", count=4, height=4, width=1.2, bottom=0.0, shear_velocity=2.0)
    assert [body.vx for body in drums] == pytest.approx([2.0 * body.y / 4.0 for body in drums])
    *ring, left, right = built(kind="arch", radius=4, thickness=1, count=9, velocity=[1, 0], shear_velocity=2)
    assert all(body.vx > 1.0 for body in ring)  # of free blocks only
    assert (left.vx, right.vx) == (0.0, 0.0)


def test_drums_taper_on_straight_sides() -> None:
    drums = built(kind="column", count=4, height=4, width=1.2, top_width=0.8, left=2)
    points = np.concatenate([corners(body) for body in drums])
    assert np.abs(points[:, 0] - 2.6) == pytest.approx(0.6 - 0.05 * points[:, 1])
    assert sorted({round(float(y), 9) for y in points[:, 1]}) == [0, 1, 2, 3, 4]
    assert sum(body.mass for body in drums) == pytest.approx(1000 * 0.5 * 4 * 1.0)


@pytest.mark.parametrize("shape", [{"width": 4, "height": 3}, {"region": [[0, 0], [4, 0], [4, 2], [2, 2]]}])
def test_voronoi_cells_fill_the_region_but_for_small_openings(shape: dict[str, Any]) -> None:
    keys = {"kind": "voronoi", "count": 60, "seed": 3, **shape}
    cells = built(**keys)
    whole = 12.0 if "width" in shape else 6.0
    assert 0.97 * whole < sum(area_of(body.outline) for body in cells) <= whole * (1.0 + 1e-12)
    side = math.sqrt(whole / 60)
    assert min(body.least_width for body in cells) >= 0.1 * side
    assert built(**keys) == cells
    assert built(**{**keys, "seed": 4}) != cells
    assert all(next(faults(body.outline), None) is None for body in cells)


def test_small_cells_are_rejected_and_their_place_is_taken() -> None:
    keys = {"kind": "voronoi", "count": 60, "width": 4, "height": 3, "relax": 0}
    cells = built(**keys, smallest=0.25)
    assert len(cells) < 60
    assert min(body.least_width for body in cells) >= 0.25
    assert sum(area_of(body.outline) for body in cells) > 0.97 * 12.0


def test_rubble_is_apart_and_of_the_sizes_asked_for() -> None:
    keys = {"kind": "rubble", "count": 200, "columns": 10, "smallest": 0.1, "largest": 0.4, "gap": 0.01}
    blocks = built(**keys)
    sizes = np.array([max(math.dist(a, b) for a in body.outline for b in body.outline) for body in blocks])
    assert sizes.max() <= 0.4 * (1.0 + 1e-12)
    assert (sizes < 0.2).mean() > 0.6  # 4 of 5 by the power law; corners need not be at the ends of the long axis
    assert {len(body.outline) for body in blocks} == {4, 5, 6, 7, 8}
    assert list(overlapping_pairs(blocks)) == []
    assert built(**keys) == blocks
    assert built(**{**keys, "seed": 9})[0].outline != blocks[0].outline
