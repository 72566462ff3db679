"""What a check of the run and the ledger find in a world as it is."""

from math import cos, sin

import numpy as np
import pytest

from blocksim.kernels.common.arrays import AT_REST, LEDGER, REACHED, World, zeros
from blocksim.kernels.common.mechanics import potential_energy, renew_rotations
from blocksim.kernels.explicit.broad_phase import rebuild_pairs
from blocksim.kernels.explicit.contact import is_too_deep, pair_forces
from blocksim.kernels.explicit.step import check, contact_summary, tallied
from blocksim.verification.scene import HEIGHT
from tests.conftest import PaperBlock, Start
from tests.kernels.scenes import pose

ON_GROUND = (0.0, 0.5 * HEIGHT - 1e-7, 0.0)
RESTS = {"stop_at_rest": True, "rest_speed": 1e-3, "rest_hold": 1e-3}


def at_rest(pairs: int) -> World:
    """Return a block that does not move and has so many pairs that touch."""
    world = pose(ON_GROUND, time=RESTS)
    world.bodies[0].pairs_before = pairs
    assert world.controls[0].rest_checks > 2
    return world


def test_rest_counts_only_where_it_has_lasted() -> None:
    world = at_rest(pairs=1)
    most = int(world.controls[0].rest_checks)
    assert [check(world, None) for _ in range(most - 1)] == [REACHED] * (most - 1)
    world.bodies[0].vx = 1.0  # pushed once more
    assert check(world, None) == REACHED
    world.bodies[0].vx = 0.0
    assert [check(world, None) for _ in range(most)] == [REACHED] * (most - 1) + [AT_REST]


def test_block_that_touches_nothing_never_rests() -> None:
    world = at_rest(pairs=0)
    assert {check(world, None) for _ in range(2 * int(world.controls[0].rest_checks))} == {REACHED}


def touching(*, depth: float, spring: float = 0.0) -> World:
    """Return two blocks with one contact that has this overlap and shear spring (m)."""
    world = pose((0.0, 1.0, 0.0), (0.0, 1.0 + HEIGHT, 0.0))
    world.pairs[0].active = 1
    world.pairs[0].stiffness = world.interactions[1, 1].normal_stiffness
    contact = world.contacts[0, 0]
    contact.depth, contact.spring = depth, spring
    return world


@pytest.mark.parametrize("small", [0, 1])
def test_smaller_block_of_a_pair_limits_the_overlap(small: int) -> None:
    overlaps = {0.02: False, 0.03: True, 0.07: True}  # of a height; twentieths of the smallest side: 0.025
    for share, is_deep in overlaps.items():
        world = pose((0.0, 1.0, 0.0), (0.0, 1.0 + (0.75 - share) * HEIGHT, 0.0))
        body = world.bodies[small]
        body.half_x = body.half_y = 0.25 * HEIGHT
        body.least_width = 0.5 * HEIGHT
        renew_rotations(world.bodies)
        assert rebuild_pairs(world)
        pair_forces(world, 0, 0.0)
        assert world.pairs[0].active == 2
        assert world.action[0].is_too_deep == is_deep


@pytest.mark.parametrize(("share", "is_deep"), [(0.001, False), (0.9, True)])
def test_bodies_within_one_another_overlap_too_far_where_no_contact_is_found(share: float, *, is_deep: bool) -> None:
    world = pose((0.0, 1.0, 0.0), (0.0, 1.0 + (1.0 - share) * HEIGHT, 0.0))
    assert is_too_deep(world, 0, 0) == is_deep


def test_springs_hold_half_of_force_times_way() -> None:
    world = touching(depth=2e-6, spring=-3e-6)
    pair = world.interactions[world.bodies[0].contact_class, world.bodies[1].contact_class]
    normal, shear, count, deepest = contact_summary(world)
    assert (count, deepest) == (1, 2e-6)
    assert normal == pytest.approx(0.5 * pair.normal_stiffness * 2e-6**2, rel=1e-12)
    assert shear == pytest.approx(0.5 * pair.shear_ratio * pair.normal_stiffness * 3e-6**2, rel=1e-12)


def test_potential_energy_counts_against_gravity_also_on_a_slope(start: Start, paper_block: PaperBlock) -> None:
    scene = start([{"x": 0.5, "y": 1.0}, {"x": -0.2, "y": 2.0}], tilt=0.2)
    expected = sum(paper_block.mass * 9.81 * (sin(0.2) * x + cos(0.2) * y) for x, y in ((0.5, 1.0), (-0.2, 2.0)))
    assert potential_energy(scene.world) == pytest.approx(expected, rel=1e-12)


def test_losses_are_those_of_all_tallies() -> None:
    tallies = zeros(5, LEDGER)
    amounts = np.random.default_rng(0).uniform(0.0, 1.0, (3, 5))
    tallies.dashpot, tallies.friction, tallies.broken = amounts
    assert tallied(tallies) == pytest.approx(tuple(amounts.sum(axis=1)), rel=1e-14)
