"""Corners of blocks as kernels have them, of polygons and of rectangles beside them."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from blocksim.kernels.common.arrays import ALL, OUTLINE
from blocksim.kernels.common.tolerances import CONE_TOLERANCE
from blocksim.kernels.explicit.sides import UPPER
from blocksim.scenario import Scenario, scenario_from_mapping
from blocksim.scenario.geometry import centre_outline, least_width, regular
from blocksim.world.bodies import body_records, cone_of, corner_rows, layout_of
from blocksim.world.build import SceneStack, build_stacks, member
from blocksim.world.nonsmooth import NONSMOOTH, build_nonsmooth
from blocksim.world.step import bounds_of

TRIANGLE = [[0.0, 0.0], [0.4, 0.0], [0.0, 0.3]]


def scenario(*, ground: dict[str, object] | None = None, **blocks: dict[str, object]) -> Scenario:
    """Return blocks high up and apart; a triangle, a brick and a hexagon, two of each, unless told."""
    tables = blocks or {
        "triangle": {"outline": TRIANGLE, "depth": 0.1},
        "brick": {"width": 0.2, "height": 0.1, "length": 0.1},
        "hexagon": {"sides": 6, "radius": 0.2, "depth": 0.1},
    }
    return scenario_from_mapping(
        {
            "schema": 1,
            "name": "shapes",
            "materials": {"stone": {"density": 2000.0, "young_modulus": 1e9, "poisson_ratio": 0.2}},
            "blocks": {name: {**table, "material": "stone"} for name, table in tables.items()},
            "bodies": [{"block": name, "x": float(i), "y": 2.0} for i, name in enumerate([*tables, *tables])],
            "time": {"scheme": "nonsmooth", "end": 1.0},
            **({} if ground is None else {"ground": ground}),
        }
    )


def test_every_shape_is_in_the_table_once_with_outward_normals() -> None:
    world = build_nonsmooth(scenario()).world
    assert world.corners.size == 3 * 6 + 4  # each block has room for the corners of the hexagon
    assert world.bodies.first_corner.tolist() == [0, 6, 12] * 2 + [18]
    assert world.bodies.corner_count.tolist() == [3, 4, 6] * 2 + [4]
    assert world.bodies.faces[:6].tolist() == [OUTLINE, ALL, OUTLINE] * 2
    for body in world.bodies[:6]:
        own = world.corners[body.first_corner : body.first_corner + body.corner_count]
        heights = np.stack([own.nx, own.ny], axis=-1) @ np.stack([own.x, own.y])
        assert (heights <= own.distance[:, np.newaxis] + 1e-15).all()
        assert body.inner_radius == own.distance.min()
        assert np.hypot(own.nx, own.ny) == pytest.approx(1.0, abs=1e-15)
        assert 2.0 * own.half == pytest.approx(np.hypot(own.x - np.roll(own.x, -1), own.y - np.roll(own.y, -1)))


def test_ground_has_corners_from_the_lower_left_one_on() -> None:
    """The upper face of a piece, and of the half-plane, has the same number in both schemes."""
    profile: dict[str, object] = {"profile": [[-1.0, 0.5], [0.0, 0.0], [3.0, 0.0]]}
    world = build_nonsmooth(scenario(ground=profile)).world
    for body in world.bodies[6:]:
        own = world.corners[body.first_corner : body.first_corner + body.corner_count]
        assert own.x.tolist() == [-body.half_x, body.half_x, body.half_x, -body.half_x]
        assert own.y.tolist() == [-body.half_y, -body.half_y, body.half_y, body.half_y]
        upper = own[UPPER]
        assert (upper.nx, upper.ny, upper.distance, upper.half) == (0.0, 1.0, body.half_y, body.half_x)


@pytest.mark.parametrize("outline", [TRIANGLE, regular(16, 0.1), [[0, 0], [1, 0], [1.01, 0.02], [0.5, 0.3], [0, 0.1]]])
def test_other_faces_are_as_far_as_is_told_along_a_face(outline: list[list[float]]) -> None:
    rows = np.array(corner_rows(centre_outline([(x, y) for x, y in outline])))
    for k, (x, y, nx, ny, distance, half, middle, clear, far, *_) in enumerate(rows):
        assert nx * y - ny * x == pytest.approx(middle - half)
        others = np.delete(rows, k, axis=0)
        for end, depth in itertools.product(np.linspace(0.0, 1.0, 9) * half, (0.0, 0.01 * half)):
            for along in (middle - half + end, middle + half - end):
                place = (distance - depth) * np.array([nx, ny]) + along * np.array([-ny, nx])
                least = (others[:, 4] - others[:, 2:4] @ place).min()
                assert least >= clear * end - depth - 1e-12
                beyond = np.delete(rows, [k, k - 1, (k + 1) % len(rows)], axis=0)
                assert np.all(beyond[:, 4] - beyond[:, 2:4] @ place >= far - depth - 1e-12)
        assert clear > 0.0


def test_least_width_is_the_least_height_over_a_face() -> None:
    assert least_width(tuple((x, y) for x, y in TRIANGLE)) == pytest.approx(0.24, rel=1e-14)  # over the hypotenuse
    assert least_width(regular(6, 0.2)) == pytest.approx(math.sqrt(3.0) * 0.2, rel=1e-14)


def test_steps_are_bounded_by_the_least_width_of_a_polygon() -> None:
    layout = layout_of(scenario(sliver={"outline": [[0.0, 0.0], [1.0, 1.0], [0.98, 1.02]], "depth": 0.1}))
    (bounds,) = bounds_of([layout], body_records([layout]))
    assert bounds.smallest == pytest.approx(0.028, rel=0.02)


def test_members_of_a_stack_have_corners_of_their_own() -> None:
    """Of one shape where they have equally many corners; rectangles are in a stack without any."""
    wedges = [scenario(wedge={"outline": [[0.0, 0.0], [0.4, 0.0], [0.1, h]], "depth": 0.1}) for h in (0.2, 0.3)]
    hexagon = scenario(hexagon={"sides": 6, "radius": 0.2, "depth": 0.1})
    brick = scenario(brick={"width": 0.2, "height": 0.1, "length": 0.1})
    stacks = [one for one in build_stacks([*wedges, hexagon, brick], NONSMOOTH) if isinstance(one, SceneStack)]
    assert [stack.numbers for stack in stacks] == [[0, 1], [2], [3]]
    assert stacks[-1].scenes.world.corners is None
    for m, wedge in enumerate(wedges):
        alone = build_nonsmooth(wedge).world.corners
        assert member(stacks[0].scenes, m).world.corners.tobytes() == alone.tobytes()


def test_faces_of_blunt_and_sharp_shapes_are_parallel_within_less_than_those_of_rectangles() -> None:
    def even(sides: int) -> tuple[tuple[float, float], ...]:
        return tuple((math.cos(2.0 * math.pi * k / sides), math.sin(2.0 * math.pi * k / sides)) for k in range(sides))

    assert cone_of(even(4)) == cone_of(even(6)) == CONE_TOLERANCE
    assert cone_of(even(16)) == pytest.approx(math.sin(math.pi / 16))
    assert cone_of(((0.0, 0.0), (1.0, -0.05), (1.0, 0.05))) == pytest.approx(math.sin(math.atan(0.05)))
