"""Blocks that touch one another share their energy; nobody else's impacts change it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from blocksim.kernels.nonsmooth.arrays import FAR
from blocksim.kernels.nonsmooth.contact_groups import find_contact_groups
from tests.kernels.nonsmooth.scenes import Block, after_substep, collided, listed_constraints, posed, velocities

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from blocksim.kernels.nonsmooth.arrays import Nonsmooth

HALF = 0.0125  # m, of a height
VALUES: dict[str, Any] = {"gravity": 0.0, "velocity_sweeps": 10_000, "substeps": 1, "restitution_threshold": 1e-4}


def knots(seed: int, count: int, size: int) -> list[Block]:
    """Return groups of two or three blocks each, that meet one another and the ground far from all others."""
    random = np.random.default_rng(seed)
    found = []
    for k in range(count):
        tilt = random.uniform(-0.02, 0.02, 3)
        for j, (x, y) in enumerate([(0.0, 3 * HALF), (-0.017, HALF), (0.017, HALF)][:size]):
            vx, vy, spin = random.normal(size=3) * (1.0, 0.5, 20.0)
            found.append(Block(1.0 * k + x, y + 4e-4, tilt[j], vx, vy - 1.5, spin))
    return found


def kinetic(scene: Nonsmooth) -> NDArray[np.float64]:
    """Return the kinetic energy (J) of every block."""
    bodies: Any = scene.world.bodies[:-1]
    vx, vy, spin = velocities(scene.contacts.states)[:-1].T
    return np.asarray(0.5 * (bodies.mass * (vx**2 + vy**2) + bodies.inertia * spin**2))


@pytest.mark.parametrize("restitution", [0.3, 0.8, 1.0])
@pytest.mark.parametrize("friction", [0.0, 1.0])
def test_no_group_of_blocks_that_touch_gains_energy(restitution: float, friction: float, pace: int) -> None:
    values = {"restitution": restitution, "friction": friction, "ground_friction": friction, **VALUES}
    changed = 0
    count, size = (3, 3) if pace == 1 else (1, 2)
    for seed in range(4 if pace == 1 else 2):
        blocks = knots(seed, count, size)
        before = kinetic(posed(blocks, **values)).reshape(-1, size).sum(axis=1)
        after = kinetic(after_substep(blocks, **values)).reshape(-1, size).sum(axis=1)
        assert np.all(after <= before * (1.0 + 1e-6))
        changed += int(np.count_nonzero(np.abs(after - before) > 1e-9 * before))
        if friction == 0.0 and restitution == 1.0:
            assert after == pytest.approx(before, rel=1e-3)  # points struck by others in the substep are stopped
    assert changed > 0 or (friction == 0.0 and restitution == 1.0)


@pytest.mark.parametrize("restitution", [0.6, 1.0])
def test_impacts_elsewhere_do_not_change_a_group(restitution: float, pace: int) -> None:
    """A group that would gain energy and one that would not, solved at once: each is as alone."""
    values = {"restitution": restitution, "friction": 2.0, "ground_friction": 2.0, "velocity_tolerance": 1e-9, **VALUES}
    count, size = (3, 3) if pace == 1 else (2, 2)
    for seed in range(3 if pace == 1 else 1):
        blocks = knots(seed, count, size)
        together = velocities(after_substep(blocks, **values).contacts.states)[:-1].reshape(count, size, 3)
        for k in range(count):
            alone = velocities(after_substep(blocks[size * k : size * k + size], **values).contacts.states)[:-1]
            apart = np.abs(together[k] - alone) * (1.0, 1.0, 0.02)  # m/s
            assert apart.max() < 1e-5  # all are gone through until the last one is solved


def test_block_that_stands_keeps_its_impulses_while_another_lands() -> None:
    blocks = [Block(0.0, HALF), Block(1.0, HALF + 1e-5, vy=-1.0)]
    scene = after_substep(blocks, restitution=0.9, substeps=2)
    assert float(scene.contacts.states.vy[1]) > 0.8
    packs: Any = scene.contacts.packs[: scene.contacts.stepping[0].pack_count]
    pressing = packs["normal_one"][:, 0] + packs["normal_two"][:, 0]
    weight = float(scene.world.bodies.mass[0]) * 9.81 * 0.5e-3
    assert float(pressing[packs["a"][:, 0] == 0].sum()) == pytest.approx(weight, rel=1e-6)


def aimed(seed: int, count: int) -> Nonsmooth:
    """Return blocks some of which touch others, with targets of the velocity pass given at random."""
    random = np.random.default_rng(seed)
    places = random.uniform(0.0, (0.3, 0.3, 6.0), (count, 3)).tolist()
    blocks = [Block(x, y, angle, fixed=bool(random.uniform() < 0.15)) for x, y, angle in places]
    scene = collided(posed(blocks, restitution=0.9))
    packs: Any = scene.contacts.packs[: scene.contacts.stepping[0].pack_count]
    for name in ("target_one", "target_two"):
        packs[name] = random.choice([-FAR, -0.1, 0.0, 0.2], p=[0.5, 0.25, 0.2, 0.05], size=packs[name].shape)
    return scene


@pytest.mark.parametrize("seed", range(4))
def test_contact_groups_are_the_free_blocks_joined_by_points_that_count(seed: int) -> None:
    scene = aimed(seed, 40)
    count = scene.world.bodies.size
    free = scene.contacts.states.inverse_mass > 0.0
    joined, struck = [], np.zeros(count, dtype=bool)
    for pack in scene.contacts.packs[: scene.contacts.stepping[0].pack_count]:
        for lane in range(pack["count"]):
            a, b = int(pack.a[lane]), int(pack.b[lane])
            target = max(pack.target_one[lane], pack.target_two[lane])
            if target > -FAR and free[a] and free[b]:
                joined.append((a, b))
            struck[[i for i in (a, b) if free[i]]] |= target > 0.0
    one, two = np.array(joined).T
    _, labels = connected_components(coo_array((np.ones(len(one)), (one, two)), shape=(count, count)), directed=False)
    find_contact_groups(scene.contacts)
    impacts: Any = scene.contacts.impacts
    assert len(set(zip(labels.tolist(), impacts.root.tolist(), strict=True))) == len(set(labels.tolist()))
    assert len(set(impacts.root.tolist())) == len(set(labels.tolist()))
    hit = {int(label) for label in labels[struck]}
    assert impacts.is_hit[free].astype(bool).tolist() == [int(label) in hit for label in labels[free]]
    assert 0 < len(hit) < len(set(labels[free].tolist()))
    assert listed_constraints(scene).size > len(joined)
