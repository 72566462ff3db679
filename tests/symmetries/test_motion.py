"""What does not depend on the point of view: mirror, place, numbers, moving frame, and scale of a random scene."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, strategies as st

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
    scaled,
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
@some(6, 150)
def test_mirrored_stack_moves_as_the_mirror_image(scheme: str, examples: int) -> None:
    def check(stack: Stack) -> None:
        mirrored = ending(stack, [{**body, "x": -body["x"]} for body in stack.bodies], scheme) * MIRROR
        assert apart(ending(stack, stack.bodies, scheme), mirrored) <= allowed(stack, scheme)

    for_all(stacks(), examples, check)


@SCHEMES
@some(6, 150)
def test_stack_moves_the_same_elsewhere(scheme: str, examples: int) -> None:
    def check(scene: tuple[Stack, float]) -> None:
        stack, shift = scene
        moved = ending(stack, [{**body, "x": body["x"] + shift} for body in stack.bodies], scheme)
        moved[:, 0] -= shift
        assert apart(ending(stack, stack.bodies, scheme), moved) <= allowed(stack, scheme)

    for_all(st.tuples(stacks(), st.floats(-10.0, 10.0)), examples, check)


@SCHEMES
@some(6, 150)
def test_order_of_bodies_does_not_matter(scheme: str, examples: int) -> None:
    def check(scene: tuple[Stack, int]) -> None:
        stack, seed = scene
        order = np.random.default_rng(seed).permutation(len(stack.bodies))
        renamed = ending(stack, [stack.bodies[i] for i in order], scheme)[np.argsort(order)]
        assert apart(ending(stack, stack.bodies, scheme), renamed) <= allowed(stack, scheme)

    for_all(st.tuples(stacks(), st.integers(0, 1000)), examples, check)


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
@some(6, 150)
def test_collisions_are_the_same_in_a_moving_frame(scheme: str, examples: int) -> None:
    def check(scene: tuple[Stack, int, float, float]) -> None:
        stack, seed, vx, vy = scene
        bodies = flying(stack, seed)
        ends = [
            start(stack, thrown(bodies, *frame), scheme, gravity=0.0).to_time(BEFORE_CHAOS)  # type: ignore[arg-type]
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


@some(6, 150)
def test_larger_stack_moves_alike_to_the_last_bit(examples: int) -> None:
    """Lengths by 4^k, times by 2^k: powers of two change no digit."""

    def check(scene: tuple[Stack, int]) -> None:
        stack, power = scene
        length, time = 4.0**power, 2.0**power
        one, two = scaled(stack, 1.0, EXPLICIT), scaled(stack, length, EXPLICIT)
        assert two.step == one.step * time
        units = np.array([length, length, 1.0, length / time, length / time, 1.0 / time])
        for steps in (1, 1000, round(0.1 / one.step)):
            np.testing.assert_array_equal(two.to_step(steps).state() / units, one.to_step(steps).state())

    for_all(st.tuples(stacks(), st.integers(-8, 10).filter(bool)), examples, check)


@some(6, 150)
def test_larger_stack_of_rigid_contacts_moves_alike(examples: int) -> None:
    """A tie between faces is decided by 1e-7 m at any scale, so some points lift off a step sooner."""

    def check(scene: tuple[Stack, int]) -> None:
        stack, power = scene
        length = 4.0**power
        one, two = (scaled(stack, size, RIGID).to_step(200).state() for size in (1.0, length))
        assert apart(two / np.array([length, length, 1.0, 1.0, 1.0, 1.0]), one) <= allowed(stack, RIGID)

    for_all(st.tuples(stacks(), st.integers(-2, 4).filter(bool)), examples, check)
