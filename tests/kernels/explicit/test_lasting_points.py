"""Contact points of polygons that last under Hertz's law: what is quicker than the search finds the same."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.kernels.explicit.contact import SEARCH, lasting_points
from blocksim.kernels.explicit.models import contact_points
from blocksim.kernels.explicit.slivers import points_of_sliver
from blocksim.verification.scene import Scene

if TYPE_CHECKING:
    from blocksim.kernels.common.arrays import World

Outline = list[list[float]]
TRIES = 400
RADIUS = 0.02  # m
HEXAGON = [[RADIUS * np.cos(angle), RADIUS * np.sin(angle)] for angle in np.arange(6) * np.pi / 3.0]
WEDGE = [[-0.03, -0.01], [0.03, -0.01], [0.0, 0.02]]
HIGH = {id(HEXAGON): RADIUS * np.sqrt(0.75), id(WEDGE): 0.01}  # m, of the centre over the face below


def on_one_another(above: Outline, x: float, deep: float, law: str) -> tuple[World, int]:
    """Return a polygon that overlaps the upper face of a hexagon by `deep` (m), and the number of their pair."""
    y = 1.0 + HIGH[id(HEXAGON)] + HIGH[id(above)] + deep
    bodies = [{"y": 1.0, "outline": HEXAGON}, {"x": x, "y": y, "outline": above}]

    def lower(world: World) -> None:
        world.bodies[1].y -= 2.0 * deep

    world = Scene(bodies, gravity=0.0, contact={"law": law, "stiffness_scale": 0.01}).start(lower).world
    pairs: Any = world.pairs[: int(world.clock[0].pair_count)]
    return world, int(np.flatnonzero((pairs.a == 0) & (pairs.b == 1))[0])


def moved(body: Any, random: np.random.Generator, deep: float) -> None:
    """Move a body by about its overlap, and turn it so that the ends of the interval differ by as much, or more."""
    body.x += random.normal() * deep
    body.y += 0.3 * random.normal() * deep
    body.angle += random.normal() * random.choice([0.01, 0.2, 0.5, 3.0]) * deep / RADIUS
    body.cos, body.sin = np.cos(body.angle), np.sin(body.angle)


def found(world: World, count: int) -> list[tuple[float, ...]]:
    """Return what the search says of the points, to the last bit."""
    names = ("slot", "face", "x", "y", "nx", "ny", "depth", "beside")
    return [tuple(float(world.points[i][name]) for name in names) for i in range(count)]


@pytest.mark.parametrize(("above", "flush"), [(HEXAGON, 0.0), (WEDGE, 0.02)], ids=["hexagon", "wedge"])
def test_points_that_last_are_those_of_the_search(above: Outline, flush: float) -> None:
    """Blocks tilt and are shifted, from where corners are flush by less than they overlap: some come or go."""
    random = np.random.default_rng(3)
    lasting = changing = 0
    for _ in range(TRIES):
        deep = 10.0 ** random.uniform(-7.0, -3.5)
        x = flush + random.normal() * deep if random.random() < 0.5 else random.uniform(-0.01, 0.01)
        world, p = on_one_another(above, x, deep, "hertz-mindlin")
        moved(world.bodies[1], random, deep)
        count = lasting_points(world, p, world.corners)
        quick = found(world, max(count, 0))
        searched = points_of_sliver(world, p, contact_points(world, p), world.corners)
        if count == SEARCH:
            changing += 1
        else:
            lasting += 1
            assert world.pairs[p].is_sliver == 0
            assert quick == found(world, searched)
    assert min(lasting, changing) > TRIES // 8


def test_points_of_a_law_with_one_stiffness_are_searched() -> None:
    """It has no use for them: persistent_pairs.py deals with what lasts, so that here something has changed."""
    for law, lasts in (("linear", False), ("hertz-mindlin", True)):
        world, p = on_one_another(HEXAGON, 0.003, 1e-6, law)
        assert (lasting_points(world, p, world.corners) == SEARCH) is not lasts
