"""Contacts of polygons that continue: what is quicker than the search says the same."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.kernels.explicit.persistent_forces import is_nearer_than_beside, stays_on
from blocksim.kernels.explicit.sides import into_world, next_number, number_before
from blocksim.kernels.explicit.sliver_axes import is_sliver, meets_along
from blocksim.verification.scene import CaseScene

if TYPE_CHECKING:
    from blocksim.verification.scene import Simulation

TRIES = 4000
HEXAGON = [[np.cos(angle), np.sin(angle)] for angle in np.arange(6) * np.pi / 3.0]
WEDGE = [[-1.0, -0.2], [1.0, -0.2], [-0.8, 0.9]]
QUADRANGLE = [[-1.0, -0.5], [1.2, -0.7], [0.6, 0.8], [-0.9, 0.4]]


def of_two(one: list[list[float]], two: list[list[float]]) -> Simulation:
    return CaseScene([{"y": 1.0, "outline": one}, {"y": 5.0, "outline": two}], gravity=0.0).start()


PAIRS = pytest.mark.parametrize(("one", "two"), [(HEXAGON, HEXAGON), (WEDGE, HEXAGON), (QUADRANGLE, WEDGE)])


def turn_to(owner: Any, angle: float) -> None:
    owner.angle, owner.cos, owner.sin = angle, np.cos(angle), np.sin(angle)


def put(owner: Any, number: int, touched: Any, x: float, y: float, table: Any) -> None:
    """Move the corner of a number to (x, y) from the centre of `touched`."""
    corner = table[owner.first_corner + number]
    ox, oy = into_world(owner, corner.x, corner.y)
    owner.x, owner.y = touched.x + x - ox, touched.y + y - oy


@PAIRS
def test_corner_that_the_face_beside_cannot_take_stays_on_its_face(
    one: list[list[float]], two: list[list[float]]
) -> None:
    """Random corners near the ends of faces: no other face may be found for any that are told to stay."""
    world = of_two(one, two).world
    touched, owner, table = world.bodies[0], world.bodies[1], world.corners
    random = np.random.default_rng(20)
    told = 0
    for _ in range(TRIES):
        face, number = int(random.integers(len(one))), int(random.integers(len(two)))
        side: Any = table[touched.first_corner + face]
        depth, end = 10.0 ** random.uniform(-7.0, -2.0), random.choice([-1.0, 1.0]) * 10.0 ** random.uniform(-7.0, -1.0)
        turn = random.uniform(-0.3, 0.3) if random.random() < 0.5 else 1e-3 * random.standard_normal()
        corner: Any = table[owner.first_corner + number]
        facing = np.arctan2(-side.ny, -side.nx) - np.arctan2(corner.ny, corner.nx) + turn
        turn_to(owner, facing)
        is_last = random.random() < 0.5
        along = side.middle + (1.0 if is_last else -1.0) * (side.half - end)
        x = (side.distance - depth) * side.nx - along * side.ny
        y = (side.distance - depth) * side.ny + along * side.nx
        put(owner, number, touched, x, y, table)
        beside = next_number(touched, table, face) if is_last else number_before(touched, table, face)
        way = 10.0 ** random.uniform(-8.0, -2.0)
        if is_nearer_than_beside(owner, number, touched, face, beside, x, y, depth, way, end, table):
            told += 1
            assert stays_on(face, owner, number, touched, way, table)
    assert told > TRIES // 20


@PAIRS
def test_two_faces_that_meet_along_an_interval_are_no_sliver(one: list[list[float]], two: list[list[float]]) -> None:
    """Random corners on faces nearly parallel to their own, beyond the ends too: most that are no sliver are told."""
    world = of_two(one, two).world
    touched, owner, table = world.bodies[0], world.bodies[1], world.corners
    random = np.random.default_rng(21)
    told = slivers = 0
    for _ in range(TRIES):
        face, own = int(random.integers(len(one))), int(random.integers(len(two)))
        side: Any = table[touched.first_corner + face]
        meets: Any = table[owner.first_corner + own]
        turn = random.choice([-1.0, 1.0]) * 10.0 ** random.uniform(-9.0, -2.0)
        turn_to(owner, np.arctan2(-side.ny, -side.nx) - np.arctan2(meets.ny, meets.nx) + turn)
        number = own if random.random() < 0.5 else next_number(owner, table, own)
        depth, end = 10.0 ** random.uniform(-4.0, -1.0), random.choice([-1.0, 1.0]) * 10.0 ** random.uniform(-5.0, 0.0)
        along = random.choice([-1.0, 1.0]) * (side.half - end)
        place = along + side.middle
        x = (side.distance - depth) * side.nx - place * side.ny
        y = (side.distance - depth) * side.ny + place * side.nx
        put(owner, number, touched, x, y, table)
        is_short = is_sliver(owner, touched, table)
        slivers += is_short
        if meets_along(owner, number, touched, side, side.nx, side.ny, along, depth, table):
            told += 1
            assert not is_short
    assert slivers > TRIES // 20
    assert told > TRIES // 5
