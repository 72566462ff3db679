"""Impacts of rigid blocks: energy, momentum, and groups of blocks that touch."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from blocksim.kernels.nonsmooth.arrays import FAR
from blocksim.kernels.nonsmooth.contact_groups import find_contact_groups
from blocksim.verification.scene import HEIGHT, WIDTH, Simulation
from tests.kernels.scenes import Block, after_substep, collided, listed_constraints, posed, single, velocities

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from blocksim.kernels.nonsmooth.arrays import Nonsmooth


SMOOTH: dict[str, Any] = {"friction": 0.0, "ground_friction": 0.0}


@pytest.mark.parametrize("angle", [0.0, 0.5])
def test_elastic_block_comes_back_to_where_it_fell_from(angle: float) -> None:
    height = math.sin(angle) * WIDTH / 2 + math.cos(angle) * HEIGHT / 2 + 0.05
    run = single([{"y": height, "angle": angle}], restitution=1.0, **SMOOTH)
    start = run.mechanical
    assert run.to_time(0.5).mechanical == pytest.approx(start, rel=1e-9)  # 1 to 2 % lost with J v+ = -e J v-
    assert run.residual() < 1e-12


def row(gap: float) -> list[dict[str, Any]]:
    """Return five blocks in a row (m between them), of which the first meets the second within a substep."""
    blocks: list[dict[str, Any]] = [{"x": i * (WIDTH + gap), "y": 0.2} for i in range(5)]
    blocks[0] |= {"x": -1.3e-4, "velocity": [1.0, 0.0]}
    return blocks


@pytest.mark.parametrize("has_cuts", [0, 1])  # in rounds of one substep, or in steps that are cut
@pytest.mark.parametrize(("gap", "within"), [(1e-4, 1e-6), (1e-5, 1e-3)])
def test_row_of_blocks_apart_passes_a_blow_on(gap: float, within: float, has_cuts: int) -> None:
    run = single(row(gap), restitution=1.0, gravity=0.0, **SMOOTH)
    run.scene.contacts.stepping[0].has_cuts = has_cuts
    run.to_time(0.02)
    assert run.bodies.vx == pytest.approx([0.0, 0.0, 0.0, 0.0, 1.0], abs=within)


def test_long_row_passes_a_blow_on() -> None:
    blocks: list[dict[str, Any]] = [{"x": i * WIDTH, "y": 0.2} for i in range(20)]
    blocks[0] |= {"x": -1.3e-4, "velocity": [1.0, 0.0]}
    run = single(blocks, restitution=1.0, gravity=0.0, friction=0.0).to_step(4)
    assert run.bodies.vx == pytest.approx([*[0.0] * 19, 1.0], abs=0.02)


@pytest.mark.parametrize("gap", [0.0, 1e-9, 1e-6])
@pytest.mark.parametrize(("count", "incoming"), [(3, 1), (7, 1), (5, 2)])
def test_blocks_that_touch_are_struck_one_after_the_other(count: int, incoming: int, gap: float) -> None:
    """As many leave a row of blocks that stand on the ground (m between them) as come in at 1 m/s."""
    blocks: list[dict[str, Any]] = [{"x": i * WIDTH - 1e-3, "y": HEIGHT / 2} for i in range(count)]
    for i, block in enumerate(blocks):
        block["velocity"] = [1.0 if i < incoming else 0.0, 0.0]
        block["x"] += 0.0 if i < incoming else (i - incoming + 1) * gap + 1e-3
    run = single(blocks, restitution=1.0, **SMOOTH).to_time(0.01)
    expected = [0.0] * (count - incoming) + [1.0] * incoming
    assert run.bodies.vx == pytest.approx(expected, abs=1e-3)  # the tolerance of the velocity pass
    assert run.bodies.vx.sum() == pytest.approx(incoming, abs=1e-9)
    assert run.kinetic <= 0.5 * run.bodies.mass[0] * incoming * (1.0 + 1e-9)


def test_contacts_report_the_impulses_of_all_rounds() -> None:
    run = single(row(1e-4), restitution=1.0, gravity=0.0, substeps=1, **SMOOTH)
    run.scene.contacts.stepping[0].has_cuts = 0  # it would be in an interval each
    before = run.bodies.vx.copy()
    run.to_step(1)
    constraints = run.scene.contacts.constraints[: run.scene.contacts.stepping[0].constraint_count]
    impulses = constraints["nx"] * (constraints["normal_one"] + constraints["normal_two"])
    assert np.count_nonzero(impulses) == 3  # one after the other, within this substep
    gained = np.zeros(len(before) + 1)  # of momentum (kg m/s); the ground is the last
    np.add.at(gained, constraints["a"], impulses)
    np.add.at(gained, constraints["b"], -impulses)
    assert gained[:-1] == pytest.approx(run.bodies.mass * (run.bodies.vx - before), abs=1e-12)


def thrown(random: np.random.Generator) -> dict[str, Any]:
    """Return a block that is about to meet the ground with a corner."""
    angle = float(random.uniform(-1.5, 1.5))
    height = abs(math.sin(angle)) * WIDTH / 2 + abs(math.cos(angle)) * HEIGHT / 2 + 1e-4
    velocity = [float(1.5 * random.normal()), -1.0]
    return {"y": height, "angle": angle, "velocity": velocity, "spin": float(10.0 * random.normal())}


def first_impact(run: Simulation) -> tuple[float, float]:
    """Step until a block has met the ground; return its upward momentum (m/s) and what energy it gained."""
    speed, energy = float(run.bodies.vy[0]), run.kinetic
    while run.steps < 50 and run.bodies.vy[0] == speed:
        run.to_step(run.steps + 1)
    return float(run.bodies.vy[0]), run.kinetic / energy - 1.0


@pytest.mark.parametrize("friction", [0.3, 1.0, 3.0])
def test_rebound_that_would_gain_energy_keeps_it_and_grows_with_restitution(friction: float) -> None:
    random = np.random.default_rng(3)
    restrained = 0
    for _ in range(20):
        body = thrown(random)
        values: dict[str, Any] = {"gravity": 0.0, "step": 2e-4, "substeps": 1, "ground_friction": friction}
        elastic = first_impact(single([body], restitution=1.0, **values))
        assert elastic[1] < 1e-9
        if abs(elastic[1]) < 1e-9:
            found = [first_impact(single([body], restitution=e, **values)) for e in (0.1, 0.3, 0.5, 0.7, 0.8, 0.9)]
            for (slower, _), (faster, _) in pairwise([*found, elastic]):
                assert faster > slower - 1e-12  # m/s, of 1; a share of two solutions with a bend between fell by 2e-4
            restrained += 1
    assert restrained > 0  # the throws are such that Newton's law alone would create energy


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
