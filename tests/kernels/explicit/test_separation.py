"""Two bodies that do not touch: the gap between them, and that no contact begins unseen."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import assume, given, strategies as st

from blocksim.kernels.common.integrate import renew_rotations
from blocksim.kernels.common.shapes import separation
from blocksim.kernels.explicit.broad_phase import idle_candidates
from blocksim.kernels.explicit.models import contact_points
from blocksim.kernels.explicit.persistent_forces import CHANGED, UNTOUCHED, begins_contact, persistent_forces
from blocksim.kernels.explicit.sides import MOST_CORNERS
from blocksim.verification.scene import HEIGHT, WIDTH

if TYPE_CHECKING:
    from tests.kernels.conftest import Pose

STEP = 1e-6
places = st.floats(-0.05, 0.05)
angles = st.floats(-4.0, 4.0)


@pytest.mark.parametrize("axis", [0, 1, 2, 3, 16, 17, 18, 19])
@given(x=places, y=places, one=angles, two=angles, seed=st.integers(0, 1000))
def test_no_contact_begins_unseen(
    *, pose: Pose, axis: int, x: float, y: float, one: float, two: float, seed: int
) -> None:
    world = pose((x, 1.0 + y, one), (0.0, 1.0, two))
    assume(world.clock[0].pair_count > 0)
    skin, random = float(world.controls[0].skin), np.random.default_rng(seed)
    for body in world.bodies[:2]:
        body.x += random.uniform(-0.2, 0.2) * skin
        body.y += random.uniform(-0.2, 0.2) * skin
        body.angle += random.uniform(-0.2, 0.2) * skin / float(body.radius)
    renew_rotations(world.bodies)
    pair = world.pairs[0]
    pair.axis = axis  # whichever was the best one last
    result, _ = persistent_forces(world, 0, STEP, world.particles)
    assert result in {CHANGED, UNTOUCHED}
    if contact_points(world, 0) > 0:
        assert result == CHANGED
    elif separation(*world.bodies[:2]) > 0.0:
        assert result == UNTOUCHED


@given(y=st.floats(0.0, 0.02), angle=angles, down=st.floats(-0.4, 0.4))
@pytest.mark.parametrize("axis", [0, 1])
def test_no_contact_with_the_ground_begins_unseen(pose: Pose, axis: int, y: float, angle: float, down: float) -> None:
    world = pose((0.2, y, angle))
    assume(world.clock[0].pair_count > 0)
    world.bodies[0].y += down * float(world.controls[0].skin)
    world.pairs[0].axis = axis
    result, _ = persistent_forces(world, 0, STEP, world.particles)
    assert result == (CHANGED if contact_points(world, 0) > 0 else UNTOUCHED)


@given(x=st.floats(-0.03, 0.03), depth=st.floats(1e-7, 1e-5), known=st.integers(0, 15), duplicates=st.integers(0, 15))
def test_contact_begins_where_a_corner_that_is_neither_known_nor_a_duplicate_is_inside(
    pose: Pose, x: float, depth: float, known: int, duplicates: int
) -> None:
    world = pose((x, 1.0 + HEIGHT - depth, 0.0), (0.0, 1.0, 0.0))
    pair, near = world.pairs[0], world.candidates[0]
    candidates = near[: pair.near].tolist()
    inside = [k for k in candidates if (k in {0, 1, 18, 19}) and abs(x) < WIDTH and is_over(k, x)]
    listed = [k for n, k in enumerate(candidates) if known >> n & 1][:2]
    marked = [k for n, k in enumerate(candidates) if duplicates >> n & 1 and k not in listed]
    pair.active, pair.duplicates = len(listed), sum(1 << k for k in marked)
    world.contacts[0].slot[: len(listed)] = listed
    a, b = world.bodies[:2]
    begins = begins_contact(world, 0, a, b, None)
    assert begins == any(k not in listed and k not in marked for k in inside)
    assert idle_candidates(pair) == len(candidates) - len(listed) - len(marked)


def is_over(slot: int, shift: float) -> bool:
    """Return True if a corner at the joint of a block, shifted by so much, and the one below lies inside the other."""
    is_left = slot in {0, 19}
    assume(abs(shift) > 1e-9)
    return (shift > 0.0) == (is_left == (slot < MOST_CORNERS))
