"""Random scenes for the tests of symmetries, and how far two states are apart. SI units, angles in rad."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st
from numpy.typing import NDArray

from blocksim.verification.case import Setting
from blocksim.verification.scene import SteppedScene
from tests.sizes import in_all

EXPLICIT, RIGID = "explicit", "nonsmooth"
GRAVITY = 9.81
BEFORE_CHAOS = 0.05  # s: stacks have begun to topple and slide; impacts do not yet multiply round-off
RIGID_TIME = 0.02  # s
RIGID_STEP = 1e-4  # s
ROUND_OFF = 1e-9  # m: what V19 allows before impacts; measured for springs: 2e-11 in 20 random stacks
NUDGE = 1e-13  # m
CORNER = 0.03  # m, from the centre of a block
SCALE = 0.01  # of the stiffness
SIZES = ("width", "height")

Body = dict[str, float]


class Stack(NamedTuple):
    """Blocks on top of each other, and what they are made of."""

    bodies: tuple[Body, ...]
    restitution: float
    friction: float
    ground_friction: float


@st.composite
def stacks(draw: st.DrawFn, most: int = 5) -> Stack:
    """Stack two to `most` blocks of any sizes, each up to 0.6 widths beside the one below: most will topple."""
    bodies: list[Body] = []
    x = top = 0.0
    for _ in range(draw(st.integers(2, most))):
        width, height = (draw(st.floats(0.01, 0.05)) for _ in SIZES)
        bodies.append({"x": x, "y": top + height / 2, "width": width, "height": height, "length": 0.05})
        top += height
        x += 1e-3 * draw(st.integers(-600, 600)) * width
    return Stack(tuple(bodies), draw(st.floats(0.0, 0.9)), draw(st.floats(0.1, 0.9)), draw(st.floats(0.1, 0.9)))


def some(quick: int, long: int) -> Callable[[Any], Any]:
    """Give a test the number of its random examples: a few, and many in the long tier."""
    return pytest.mark.parametrize(
        "examples", [quick, pytest.param(in_all(long), marks=pytest.mark.long, id=f"{long}")]
    )


def for_all(strategy: st.SearchStrategy[Any], examples: int, check: Callable[[Any], None]) -> None:
    """Check a property for random examples, the same ones every time."""
    limits = settings(max_examples=examples, suppress_health_check=list(HealthCheck))
    limits(given(strategy)(check))()


def start(
    stack: Stack, bodies: Sequence[Mapping[str, object]], scheme: str, *, gravity: float = GRAVITY
) -> SteppedScene:
    """Start blocks made as those of a stack; impulses are solved to round-off."""
    time = {"velocity_tolerance": 1e-12} if scheme == RIGID else {}
    return Setting(scheme=scheme, rigid_step=RIGID_STEP).start(
        bodies,
        restitution=stack.restitution,
        friction=stack.friction,
        ground_friction=stack.ground_friction,
        gravity=gravity,
        contact={"stiffness_scale": SCALE} if scheme == EXPLICIT else {},
        time=time,
    )


def ending(stack: Stack, bodies: Sequence[Body], scheme: str) -> NDArray[np.float64]:
    """Return the state before chaos, a row a body."""
    return start(stack, bodies, scheme).to_time(time_of(scheme)).state()


def time_of(scheme: str) -> float:
    return RIGID_TIME if scheme == RIGID else BEFORE_CHAOS


def allowed(stack: Stack, scheme: str) -> float:
    """Return how far (m) states may be apart before chaos.

    Springs: round-off, and what becomes of it: as far as the same stack comes with every block moved by some 0.1 pm at
    the start, a thousand times what a double at 1 m resolves. Rigid contacts are gone through one after the other and
    positions once a step, so the order decides in which step a point of a face lifts off. One step h sooner or later
    changes a velocity by less than g h, and n blocks above each other by n times that.
    """
    if scheme == RIGID:
        return len(stack.bodies) * GRAVITY * RIGID_STEP * RIGID_TIME
    moved = [{**body, "x": body["x"] + (-1) ** i * (i + 1) * NUDGE} for i, body in enumerate(stack.bodies)]
    return ROUND_OFF + apart(ending(stack, stack.bodies, scheme), ending(stack, moved, scheme))


def apart(one: NDArray[np.float64], two: NDArray[np.float64]) -> float:
    """Return how far (m) centres or corners of two states are apart at most."""
    differences = np.abs(one - two)
    return float(max(differences[:, :2].max(), CORNER * differences[:, 2].max()))
