"""Blocks that slide over flush joints of others with rigid contacts: nothing but Coulomb's friction slows them down."""

from collections.abc import Mapping
from math import cos, radians, sin

import pytest

from blocksim.verification.scene import CaseScene

SIDE, WIDTH, HEIGHT = 0.5, 0.4, 0.2  # m: of the floor's blocks and of the slider
FRICTION, SPEED, TIME = 0.02, 1.0, 0.6  # -, m/s, s: it passes two joints
PATH = SPEED * TIME - 0.5 * FRICTION * 9.81 * TIME**2  # m
RECTANGLES = {"floor": {"width": SIDE, "height": SIDE}, "slider": {"width": WIDTH, "height": HEIGHT}}
OUTLINES = {
    name: {"outline": [[x * size["width"], y * size["height"]] for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]}
    for name, size in RECTANGLES.items()
}


def slide(
    shapes: Mapping[str, Mapping[str, object]] = RECTANGLES,
    *,
    fixed: bool = True,
    sense: float = 1.0,
    angle: float = 0.0,
    step_height: float = 0.0,
) -> tuple[float, float]:
    """Return how far a block slides over a floor of four blocks (m), and by how much it turns (rad).

    One with an angle is guided and slides on its corner. The two last blocks are higher by `step_height` (m).
    """
    floor = [
        {**shapes["floor"], "x": sense * k * SIDE, "y": 0.5 * SIDE + (step_height if k > 1 else 0.0), "fixed": fixed}
        for k in range(4)
    ]
    above = 0.5 * (WIDTH * sin(abs(angle)) + HEIGHT * cos(angle))
    guide = {"guide": "no rotation", "angle": angle} if angle else {}
    slider = {**shapes["slider"], "y": SIDE + above, "velocity": [sense * SPEED, 0.0], **guide}
    scene = CaseScene(
        [*floor, slider], restitution=0.0, friction=FRICTION, ground_friction=0.9, time={"scheme": "nonsmooth"}
    )
    body = scene.start().to_time(TIME).bodies[4]
    return sense * float(body.x), float(body.angle) - angle


@pytest.mark.parametrize("shapes", [RECTANGLES, OUTLINES], ids=["rectangles", "outlines"])
@pytest.mark.parametrize("fixed", [True, False], ids=["fixed", "free"])
def test_block_slides_over_flush_joints_as_over_one_face(
    shapes: Mapping[str, Mapping[str, object]], fixed: bool
) -> None:
    x, turn = slide(shapes, fixed=fixed)
    assert x == pytest.approx(PATH, abs=2e-5)
    assert turn == pytest.approx(0.0, abs=1e-5)


def test_block_slides_over_flush_joints_to_the_left_too() -> None:
    assert slide(sense=-1.0)[0] == pytest.approx(PATH, abs=2e-5)


@pytest.mark.parametrize("degrees", [5.0, 20.0, 45.0])
def test_corner_slides_over_flush_joints(degrees: float) -> None:
    assert slide(angle=radians(degrees))[0] == pytest.approx(PATH, abs=2e-5)


def test_low_step_is_climbed_and_a_higher_one_stops_the_block() -> None:
    """The limit is 0.2 % of the inner radius (0.1 m) of the slider, and twice the overlap of 0.03 mm."""
    assert slide(step_height=1.5e-4)[0] == pytest.approx(PATH, abs=1e-4)
    assert slide(step_height=5e-4)[0] < 0.56  # its right side is at the step where x is 0.55 m
