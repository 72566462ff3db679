"""What does not depend on the point of view: mirror, place, numbers, moving frame, and scale of a random scene."""

from typing import Any

import numpy as np
import pytest
from hypothesis import assume, strategies as st

from blocksim.scenario import Model, scenario_from_mapping
from blocksim.simulation.schemes import build
from blocksim.verification.scene import SteppedScene
from tests.symmetries.scenes import (
    BEFORE_CHAOS,
    EXPLICIT,
    RIGID,
    RIGID_STEP,
    ROUND_OFF,
    Body,
    Stack,
    allowed,
    apart,
    ending,
    for_all,
    some,
    stacks,
    start,
)

MIRROR = np.array([-1.0, 1.0, -1.0, -1.0, 1.0, -1.0])  # x, y, angle, vx, vy, spin
SCHEMES = pytest.mark.parametrize("scheme", [EXPLICIT, RIGID])
FAR_UP = 5.0  # m above the ground
APPROACH = 20.0  # m/s for each metre between the blocks
# Springs: round-off. Rigid contacts: round-off may have blocks meet, or part, one step sooner or later, and by then
# they have come nearer by the speed of the farthest (0.16 m away) times a step; once for each, as they meet in turn.
SAME_COLLISION = {EXPLICIT: ROUND_OFF, RIGID: APPROACH * 0.16 * RIGID_STEP}  # m


@SCHEMES
@some(4, 150)
@pytest.mark.parametrize("view", ["mirror", "elsewhere", "numbers"])
def test_stack_moves_the_same_seen_in_a_mirror_elsewhere_and_under_other_numbers(
    scheme: str, view: str, examples: int
) -> None:
    def check(scene: tuple[Stack, float, int]) -> None:
        stack, place, seed = scene
        order = np.arange(len(stack.bodies))
        if view == "numbers":
            order = np.random.default_rng(seed).permutation(order)
        sides = MIRROR if view == "mirror" else np.ones(6)
        shift = place if view == "elsewhere" else 0.0
        bodies = [{**stack.bodies[i], "x": sides[0] * stack.bodies[i]["x"] + shift} for i in order]
        seen = ending(stack, bodies, scheme)[np.argsort(order)]
        seen[:, 0] -= shift
        assert apart(ending(stack, stack.bodies, scheme), sides * seen) <= allowed(stack, scheme)

    for_all(st.tuples(stacks(), st.floats(-10.0, 10.0), st.integers(0, 1000)), examples, check)


def flying(stack: Stack, seed: int) -> list[Body]:
    """Return the blocks of a stack far above the ground, turned, spinning and on their way towards each other."""
    rng = np.random.default_rng(seed)
    bodies: list[Body] = []
    for number, body in enumerate(stack.bodies):
        place = {
            "x": 0.08 * number,
            "y": FAR_UP + float(rng.uniform(-0.01, 0.01)),
            "angle": float(rng.uniform(-1.5, 1.5)),
        }
        bodies.append({**body, **place, "spin": float(rng.uniform(-5.0, 5.0))})
    return bodies


def thrown(bodies: list[Body], vx: float, vy: float) -> list[dict[str, object]]:
    """Return bodies that close in on the first one, seen from a frame that moves with -vx, -vy."""
    return [{**body, "velocity": [vx - APPROACH * body["x"], vy]} for body in bodies]


@SCHEMES
@some(4, 150)
def test_collisions_are_the_same_in_a_moving_frame(scheme: str, examples: int) -> None:
    def check(scene: tuple[Stack, int, float, float]) -> None:
        stack, seed, vx, vy = scene
        bodies = flying(stack, seed)
        ends = [
            start(stack, thrown(bodies, *frame), scheme, gravity=0.0).to_time(BEFORE_CHAOS)
            for frame in ((0.0, 0.0), (vx, vy))
        ]
        # Springs see approaches from a gap on that follows from the greatest speed of the scene (choose_stride), and
        # whoever is struck just before he lands, within 0.1 ms, goes by whether he was seen: frames with one gap.
        gaps = [float(end.world.controls[0]["approach"]) for end in ends]
        assume(scheme == RIGID or gaps[0] == gaps[1])
        rest, moving = (end.state() for end in ends)
        kinetic = [float(end.bodies["spin"][0]) for end in ends]
        assume(kinetic[0] != bodies[0]["spin"])  # they have met
        moving -= np.array([vx * ends[1].time, vy * ends[1].time, 0.0, vx, vy, 0.0])
        assert apart(rest, moving) <= len(bodies) * SAME_COLLISION[scheme]

    for_all(st.tuples(stacks(3), st.integers(0, 1000), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0)), examples, check)


def loose_wall(size: float) -> list[dict[str, object]]:
    """Return three courses of three blocks, none of which touches another as yet or falls at the same time."""
    return [
        {
            "block": "block",
            "x": size * (1.02 * i + 0.45 * (j % 2) + 0.003 * i * j),
            "y": size * (0.5 * (j + 0.5) + 1e-3 * (j + 1) * (1.0 + 0.13 * i + 0.29 * j)),
        }
        for j in range(3)
        for i in range(3)
    ]


def leaning_column(size: float) -> list[dict[str, object]]:
    """Return three hexagons above one another, each beyond the middle of the one below."""
    return [
        {"block": "block", "x": size * (i * 0.65), "y": size * ((np.sqrt(3.0) + 1e-4) * (i + 0.5))} for i in range(3)
    ]


HERTZ = {"law": "hertz-mindlin", "contact_radius": 0.05}
PARTICLES = {"model": "particles", "particle_spacing": 0.05}
KERNEL = {"model": "kernel", "particle_spacing": 0.1, "smoothing_length": 0.15}
SCENES: dict[str, tuple[Any, str, dict[str, Any], float, int]] = {
    "wall": (loose_wall, EXPLICIT, {}, 0.2, 1000),
    "hertz": (loose_wall, EXPLICIT, HERTZ, 0.2, 3000),
    "particles": (loose_wall, EXPLICIT, PARTICLES, 0.2, 400),
    "kernel": (loose_wall, EXPLICIT, KERNEL, 0.2, 400),
    "hexagons": (leaning_column, EXPLICIT, {}, 0.2, 3000),
    "rigid wall": (loose_wall, RIGID, {}, 0.2, 35),  # as long as impacts have not multiplied round-off
    "rigid wall with rebounds": (loose_wall, RIGID, {"impacts": "sequential"}, 0.6, 18),
    "rigid hexagons": (leaning_column, RIGID, {}, 0.6, 100),
}


@pytest.mark.parametrize("name", SCENES)
def test_no_size_of_blocks_is_special(name: str) -> None:
    """From 0.1 mm to 1 km, the last block thrown; stiffness, speeds and times as Froude's similarity has them.

    Lengths by 4^k, times by 2^k: powers of two change no digit.
    """
    place, scheme, contact, restitution, steps = SCENES[name]

    def states(size: float) -> Any:
        time = float(np.sqrt(size))
        friction = {"static": 0.4, "kinetic": 0.3, "transition_speed": 5e-3 * time}
        rigid = {"step": 2e-3 * time, "velocity_tolerance": 1e-9 * time, "restitution_threshold": 0.01 * time}
        corners = [[size * np.cos(k * np.pi / 3), size * np.sin(k * np.pi / 3)] for k in range(6)]
        is_wall = place is loose_wall
        shape = (
            {"width": size, "height": 0.5 * size, "length": size} if is_wall else {"outline": corners, "depth": size}
        )
        bodies = place(size)
        bodies[-1] |= {"velocity": [time, 0.0], "spin": 0.3 / time}
        lengths = {key: size * value if isinstance(value, float) else value for key, value in contact.items()}
        rest = {"rest_speed": 1e-4 * time, "rest_hold": 0.05 * time}
        tables = {
            "schema": 1,
            "name": "scaled",
            "materials": {"any": {"density": 2700.0, "young_modulus": 69e6 * size, "poisson_ratio": 0.3}},
            "blocks": {"block": {**shape, "material": "any"}},
            "bodies": bodies,
            "friction": {"block_block": friction, "block_ground": friction},
            "contact": {"restitution": restitution, **lengths},
            "time": {"end": 10.0 * time, **rest, **({"scheme": RIGID, **rigid} if scheme == RIGID else {})},
        }
        run = SteppedScene(build(Model(scenario_from_mapping(tables))))
        units = np.array([size, size, 1.0, size / time, size / time, 1.0 / time])
        return run.to_step(steps).state() / units

    usual = states(0.1)
    assert np.ptp(usual[:, 3]) > 0.3  # the thrown block moves on, others do not
    for size in (1e-4, 1e-2, 10.0, 1e3):
        np.testing.assert_allclose(states(size), usual, atol=1e-9)
    if place is loose_wall and contact is not HERTZ:  # roots of other degrees, centroids: not to the last bit
        for power in (-5, 2, 7):
            np.testing.assert_array_equal(states(0.1 * 4.0**power), usual)
