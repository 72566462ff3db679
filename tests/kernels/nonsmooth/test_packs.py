"""Packs of four: every active constraint once, in its colour, and back again; a block is solved as alone."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.kernels.common.simd import WIDTH
from blocksim.kernels.nonsmooth.arrays import AWAY, TOUCHING
from blocksim.kernels.nonsmooth.packs import gather, pack_all, unpack_all
from blocksim.kernels.nonsmooth.step import substep
from tests.kernels.nonsmooth.scenes import (
    Block,
    after_substep,
    collided,
    listed,
    listed_constraints,
    pile,
    posed,
    velocities,
)

if TYPE_CHECKING:
    from blocksim.kernels.nonsmooth.arrays import Nonsmooth

BACK = ("normal_one", "normal_two", "shear")
OF_ROW = ("nx", "ny", "arm_a", "arm_b", "width", "shear_arm_a", "shear_arm_b", "gap_one", "gap_two")


def members(scene: Nonsmooth) -> list[list[int]]:
    """Return the constraints of all packs, without copies."""
    packs = scene.contacts.packs[: scene.contacts.stepping[0].pack_count]
    return [pack.constraint[: pack["count"]].tolist() for pack in packs]


@pytest.mark.parametrize("seed", range(3))
def test_every_constraint_within_the_margin_is_in_one_pack_of_its_colour(seed: int) -> None:
    random = np.random.default_rng(seed)
    scene = listed(posed([Block(*random.uniform(0.0, (0.15, 0.15, 6.0))) for _ in range(25)]))
    constraints: Any = listed_constraints(scene)
    constraints["reach"] = random.integers(3, size=constraints.size)
    gather(scene.contacts, scene.begins)
    packs = members(scene)
    assert sorted(r for pack in packs for r in pack) == np.flatnonzero(constraints.reach != AWAY).tolist()
    assert scene.contacts.stepping[0].active_count == np.count_nonzero(constraints.reach != AWAY)
    for colour in range(scene.contacts.stepping[0].colours):
        first, last = scene.contacts.ends[colour : colour + 2]
        inside = [r for pack in packs[first:last] for r in pack]
        assert all(scene.begins[colour] <= r < scene.begins[colour + 1] for r in inside)
        touching = [constraints.reach[r] == TOUCHING for r in inside]
        assert touching == sorted(touching, reverse=True)  # those that touch first
        left = len(inside) % WIDTH
        sizes = [WIDTH] * (len(inside) // WIDTH) + ([1] * left if left <= 2 else [left])
        assert [len(pack) for pack in packs[first:last]] == sizes
    for pack, inside in zip(scene.contacts.packs, packs, strict=False):
        assert pack.constraint.tolist() == inside + [inside[-1]] * (WIDTH - len(inside))


def test_constraints_are_packed_as_they_are_and_get_their_impulses_back() -> None:
    random = np.random.default_rng(4)
    scene = collided(posed(pile(random, 4, 3)))
    constraints: Any = listed_constraints(scene)
    for name in BACK:
        constraints[name] = random.uniform(size=constraints.size)
    before = constraints.copy()
    count = int(scene.contacts.stepping[0].pack_count)
    pack_all(scene.contacts, 0, count)
    for pack, inside in zip(scene.contacts.packs, members(scene), strict=False):
        for name in (*OF_ROW, *BACK, "bend", "shear_bend", "a", "b"):
            assert pack[name][: len(inside)].tolist() == constraints[name][inside].tolist(), name
    for name in BACK:
        constraints[name] = -1.0
    unpack_all(scene.contacts, 0, count)
    near = constraints.reach != AWAY
    assert 0 < near.sum() < constraints.size
    for name in BACK:
        assert np.array_equal(constraints[name][near], before[name][near])
        assert np.all(constraints[name][~near] == -1.0)


def test_constraints_of_one_pack_have_the_restitution_and_friction_of_their_own_materials() -> None:
    """Blocks that land and slide on the ground, and on fixed blocks, of other materials."""
    landing: dict[str, Any] = {"vy": -1.0, "vx": 3.0}
    blocks = [Block(0.0, 0.0125 + 1e-5, **landing), Block(0.1, 0.0125 + 1e-5, **landing)]
    for x in (0.2, 0.3):
        blocks += [Block(x, 0.0125, fixed=True), Block(x, 0.0375 + 1e-5, **landing)]
    scene = posed(blocks, restitution=0.5, gravity=0.0, friction=0.25, ground_friction=0.5, substeps=1)
    materials: Any = scene.contacts.materials
    on_ground = materials["kinetic_friction"] == 0.5
    materials["restitution"] = np.where(on_ground, 0.125, 0.5)
    scene = collided(scene)
    assert members(scene) == [[0, 1, 2, 3]]
    substep(scene, 0, 0, False, scene.contacts.impact_lanes)
    found = velocities(scene.contacts.states)[[0, 1, 3, 5]]
    assert found[:, 1] == pytest.approx([0.125, 0.125, 0.5, 0.5], abs=1e-9)
    assert found[:, 0] == pytest.approx([3.0 - 0.5 * 1.125] * 2 + [3.0 - 0.25 * 1.5] * 2, abs=1e-9)


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5])
def test_block_beside_others_of_its_pack_has_the_bits_that_it_has_alone(count: int) -> None:
    random = np.random.default_rng(7)
    motions = random.normal(size=(count, 3)) * (1.0, 2e-3, 3.0)
    blocks = [Block(0.2 * i, 0.0126, angle, vx, -1.0, spin) for i, (vx, angle, spin) in enumerate(motions)]
    values: dict[str, Any] = {"restitution": 0.3, "velocity_sweeps": 1}
    far = [Block(50.0, 5.0), Block(60.0, 5.0)]  # so that neither is a scene of one or two, whose impacts go in rounds
    together = velocities(after_substep([*blocks, *far], **values).contacts.states)
    for i, block in enumerate(blocks):
        alone = velocities(after_substep([block, *far], **values).contacts.states)
        assert alone[0].tolist() == together[i].tolist()
        assert alone[0, 1] > 0.0
