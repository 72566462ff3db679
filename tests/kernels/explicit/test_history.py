"""What contacts remember, and what becomes of it when they end or pass to another corner."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from blocksim.kernels.common.arrays import ACTION, zeros
from blocksim.kernels.explicit.history import change_contacts
from blocksim.kernels.explicit.kinematics import has_just_begun, resolve_point
from blocksim.kernels.explicit.models.surface import slot_normal
from blocksim.kernels.explicit.sides import MOST_CORNERS, UPPER, side_normal

if TYPE_CHECKING:
    from blocksim.kernels.common.arrays import Record, World
    from tests.kernels.conftest import Pose

REMEMBERED = ("spring", "depth", "normal_force", "shear_force")
STEP = 1e-6
RIGHT, LOWER = 1, 0  # faces
Contact = tuple[int, int]  # corner and face


def test_normal_of_a_contact_points_from_b_to_a_whoever_owns_the_corner(pose: Pose) -> None:
    world = pose((0.0, 0.01, 0.2), (0.01, 0.025, -0.1))
    blocks, ground = world.pairs[:2]
    assert [(pair.a, pair.b) for pair in (blocks, ground)] == [(0, 1), (0, 2)]
    for face in range(4):
        angle = (face - 1) * np.pi / 2
        assert slot_normal(world, blocks, 1, face) == pytest.approx((np.cos(angle - 0.1), np.sin(angle - 0.1)))
        assert slot_normal(world, blocks, MOST_CORNERS + 1, face) == pytest.approx(
            (-np.cos(angle + 0.2), -np.sin(angle + 0.2))
        )
    assert slot_normal(world, ground, 2, UPPER) == (0.0, 1.0)


def stacked(pose: Pose, *before: Contact) -> World:
    """Return a block on another one that had these contacts, each with numbers of its own to remember."""
    world = pose((0.0, 1.025 - 1e-6, 0.0), (0.0, 1.0, 0.0))
    pair = world.pairs[0]
    assert (pair.a, pair.b, pair.near) == (0, 1, 4)
    pair.active = len(before)
    pair.stiffness = world.interactions[1, 1].normal_stiffness
    world.pairs["normal_left"] = world.pairs["shear_left"] = 5
    for n, (contact, (slot, face)) in enumerate(zip(world.contacts[0], before, strict=False), start=1):
        contact.slot, contact.face = slot, face
        contact.spring, contact.depth, contact.normal_force, contact.shear_force = np.array([1e-7, 1e-6, 50, 5]) * n
    return world


def find(world: World, *now: Contact, closing: float = 0.0) -> Record:
    """Let the pair have these contacts now, 1 um deep, and return what was lost; `closing` m/s."""
    a, b = world.bodies[:2]
    a.vy = -closing
    for point, (slot, face) in zip(world.points, now, strict=False):
        point.slot, point.face, point.depth = slot, face, 1e-6
        own, other, sign = (a, b, 1.0) if slot < MOST_CORNERS else (b, a, -1.0)
        normal = side_normal(other, None, face)
        point.x, point.y = own.x, other.y  # anywhere
        point.nx, point.ny = sign * normal[0], sign * normal[1]
        resolve_point(point, a, b, STEP)
    action = zeros(1, ACTION)[0]
    change_contacts(world, 0, len(now), STEP, action)
    return action


def kept(world: World) -> list[tuple[Contact, int]]:
    """Return corner and face of every contact, and which of the old ones its memory is from; 0: it has none."""
    found = []
    for contact in world.contacts[0, : world.pairs[0].active]:
        numbers = [contact[name] / unit for name, unit in zip(REMEMBERED, (1e-7, 1e-6, 50, 5), strict=True)]
        assert numbers == pytest.approx([numbers[0]] * 4)
        found.append(((int(contact.slot), int(contact.face)), round(numbers[0])))
    return found


def held(world: World, *which: int) -> float:
    """Return what the shear springs of the old contacts held (J)."""
    values = world.interactions[1, 1]
    return float(0.5 * values.shear_ratio * values.normal_stiffness * sum((1e-7 * n) ** 2 for n in which))


ONE, TWO, OTHER = (0, UPPER), (1, UPPER), (0, RIGHT)
OF_B, ALSO_OF_B = (MOST_CORNERS + 2, LOWER), (MOST_CORNERS + 3, LOWER)


@pytest.mark.parametrize(
    ("before", "now", "expected", "broken"),
    [
        ([ONE, TWO], [ONE, TWO], [1, 2], []),
        ([ONE, TWO], [TWO], [2], [1]),
        ([ONE, TWO], [ONE], [1], [2]),
        ([TWO], [ONE, TWO], [0, 1], []),
        ([ONE], [ONE, OF_B], [1, 0], []),
        ([ONE, TWO], [], [], [1, 2]),
        ([ONE], [OTHER], [0], [1]),
        ([ONE, TWO], [OTHER, TWO], [0, 2], [1]),
        ([], [ONE, TWO], [0, 0], []),
    ],
)
def test_contact_continues_only_with_the_same_corner_on_the_same_face(
    pose: Pose, before: list[Contact], now: list[Contact], expected: list[int], broken: list[int]
) -> None:
    world = stacked(pose, *before)
    lost = find(world, *now, closing=2.0)  # those that are new close by more than they are deep
    assert kept(world) == list(zip(now, expected, strict=True))
    assert lost.broken == pytest.approx(held(world, *broken))
    assert world.pairs[0].idle == 4 - len(now)
    for name in ("normal_left", "shear_left"):
        assert world.pairs[name][0] == 0
        assert (world.pairs[name][1:] == 5).all()


@pytest.mark.parametrize(
    ("before", "now", "expected", "broken"),
    [
        ([TWO], [OF_B], [1], []),  # under another corner, of the other block
        ([ONE, TWO], [ONE, OF_B], [1, 2], []),
        ([ONE, TWO], [TWO, OF_B], [2, 1], []),
        ([ONE, TWO], [OF_B, ALSO_OF_B], [1, 2], []),
        ([OTHER], [OF_B], [0], [1]),  # their normals do not agree
        ([OTHER, TWO], [ONE, TWO], [0, 2], [1]),  # the corner itself has changed its face
        ([OTHER, TWO], [ONE], [0], [1, 2]),
    ],
)
def test_contact_deeper_than_it_closed_takes_the_place_of_one_that_has_ended(
    pose: Pose, before: list[Contact], now: list[Contact], expected: list[int], broken: list[int]
) -> None:
    world = stacked(pose, *before)
    lost = find(world, *now)
    assert not has_just_begun(world.points[0])
    assert kept(world) == list(zip(now, expected, strict=True))
    assert lost.broken == pytest.approx(held(world, *broken))


@pytest.mark.parametrize(("closing", "weight"), [(2.0, 1.0), (1.0, 1.5), (0.0, 1.0)])
def test_only_a_contact_that_begins_has_the_weight_of_a_first_step(pose: Pose, closing: float, weight: float) -> None:
    world = stacked(pose, ONE)
    find(world, ONE, TWO, closing=closing)
    one, two = world.points[:2]
    assert (one.weight, one.drawn) == (1.0, 1.0)
    assert two.weight == pytest.approx(weight)
    assert two.drawn == pytest.approx(1.0 if closing == 0.0 else 1.0 / closing)


def test_ended_contact_tallies_half_the_work_of_its_last_step(pose: Pose) -> None:
    world = stacked(pose, ONE)
    world.bodies[0].vx = 0.3
    lost = find(world, closing=2.0)
    values = world.interactions[1, 1]
    stiffness = float(values.shear_ratio * values.normal_stiffness)
    closing, slip = 2.0 * STEP, -0.3 * STEP  # the tangent is the normal turned by a quarter
    dashpots = 50.0 - float(values.normal_stiffness) * 1e-6, 5.0 - stiffness * 1e-7
    assert lost.dashpot == pytest.approx(0.5 * (dashpots[0] * closing + dashpots[1] * slip))
    assert lost.broken == pytest.approx(0.5 * stiffness * 1e-7 * (1e-7 + slip))
