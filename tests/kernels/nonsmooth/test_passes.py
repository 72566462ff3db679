"""What a substep solves, against dense matrices: complementarity, Coulomb's cone, momentum, least change of energy."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from blocksim.kernels.common.arrays import INTERACTION, zeros
from blocksim.kernels.nonsmooth.cone import shear_limit
from blocksim.kernels.nonsmooth.motion import kick
from blocksim.kernels.nonsmooth.passes import FIRST_VELOCITY, POSITION, WARM, sweep
from blocksim.kernels.nonsmooth.step import substep
from blocksim.world.sag import soft_contact
from tests.kernels.nonsmooth.references import Dense, dense, least_change
from tests.kernels.nonsmooth.scenes import Block, after_substep, collided, pile, posed, velocities

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from blocksim.kernels.nonsmooth.arrays import Nonsmooth

G = 9.81
H = 1e-3  # s, a substep
SMOOTH: dict[str, Any] = {"friction": 0.0, "ground_friction": 0.0}
EXACT: dict[str, Any] = {"velocity_tolerance": 1e-11, "velocity_sweeps": 10_000, "substeps": 1, "restitution": 0.0}
ROUND_OFF = 1e-8  # m/s: Gauss and Seidel approach slowly


@pytest.fixture(scope="module")
def size(pace: int) -> tuple[int, int]:
    """Return how many columns and constraints of blocks are solved."""
    return (4, 3) if pace == 1 else (2, 2)


def unpushed(scene: Nonsmooth) -> NDArray[np.float64]:
    """Return the velocities that a whole kick of gravity alone would leave."""
    found = velocities(scene.contacts.before)
    found[scene.contacts.states.inverse_mass > 0.0, 1] -= G * H
    return found.ravel()


def slips(scene: Nonsmooth, all_of: Dense) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the velocities at the points along their normals, and those of constraints along their tangents (m/s)."""
    now = velocities(scene.contacts.states).ravel()
    return all_of.normals @ now, all_of.tangents @ now


@pytest.mark.parametrize("seed", range(4))
def test_impulses_without_friction_change_the_energy_least(seed: int, size: tuple[int, int]) -> None:
    """Velocities that satisfy all contacts and differ least from those without: there is one such set only."""
    scene = after_substep(pile(np.random.default_rng(seed), *size), **SMOOTH, **EXACT)
    all_of, free = dense(scene), unpushed(scene)
    least = all_of.targets[all_of.counts]
    expected = least_change(free, all_of.normals[all_of.counts], least, all_of.inverse_mass)
    assert velocities(scene.contacts.states).ravel() == pytest.approx(expected, abs=ROUND_OFF)
    assert np.abs(expected - free).max() > 0.1
    assert np.all(all_of.shears == 0.0)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("friction", [0.0, 0.3, 1.0])
def test_impulses_push_only_where_blocks_do_not_part(seed: int, friction: float, size: tuple[int, int]) -> None:
    blocks = pile(np.random.default_rng(seed), *size)
    scene = after_substep(blocks, friction=friction, ground_friction=friction, **EXACT)
    all_of = dense(scene)
    rates, _ = slips(scene, all_of)
    rest = (rates - all_of.targets)[all_of.counts]
    impulses = all_of.impulses[all_of.counts]
    mass = 1.0 / float(all_of.inverse_mass[0])
    assert all_of.impulses.min() >= 0.0
    assert np.all(all_of.impulses[~all_of.counts] == 0.0)
    assert rest.min() > -ROUND_OFF
    assert np.minimum(impulses / mass, rest).max() < ROUND_OFF
    assert np.any(impulses > 0.0)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("friction", [0.1, 0.5])
def test_friction_stops_all_slip_or_resists_it_with_all_it_has(
    seed: int, friction: float, size: tuple[int, int]
) -> None:
    scene = after_substep(pile(np.random.default_rng(seed), *size), friction=friction, ground_friction=0.7, **EXACT)
    all_of = dense(scene)
    _, slip = slips(scene, all_of)
    limit = all_of.friction * all_of.impulses.reshape(-1, 2).sum(axis=1)
    assert np.all(np.abs(all_of.shears) <= limit * (1.0 + 1e-9))
    pressed = limit > 0.0
    is_at_limit = np.abs(all_of.shears) > limit * (1.0 - 1e-6)
    assert np.abs(slip[pressed & ~is_at_limit]).max(initial=0.0) < ROUND_OFF
    assert (slip * all_of.shears)[pressed & is_at_limit].max(initial=0.0) < ROUND_OFF * limit.max()
    assert np.any(pressed & is_at_limit)


def two_blocks(seed: int) -> list[Block]:
    """Return two blocks in flight that meet with two points of a face."""
    vx, spin, other = np.random.default_rng(seed).normal(size=3) * (1.0, 8.0, 8.0)
    return [Block(0.0, 1.0, 1e-3, vx, 0.3, spin), Block(0.007, 1.025, -1e-3, 0.0, -0.9, other)]


@pytest.mark.parametrize("seed", range(4))
def test_one_contact_is_solved_exactly_at_once(seed: int) -> None:
    """Both normals in the first sweep, and friction to the slip that they leave: effective masses are right."""
    once = {**EXACT, "velocity_sweeps": 1, "gravity": 0.0}
    scene = after_substep(two_blocks(seed), **SMOOTH, **once)
    all_of, free = dense(scene), velocities(scene.contacts.before).ravel()
    expected = least_change(free, all_of.normals, all_of.targets, all_of.inverse_mass)
    assert velocities(scene.contacts.states).ravel() == pytest.approx(expected, abs=1e-10)
    scene = after_substep(two_blocks(seed), friction=100.0, **once)
    all_of = dense(scene)
    _, slip = slips(scene, all_of)
    assert slip == pytest.approx([0.0], abs=1e-12)
    assert np.all(all_of.shears != 0.0)


@pytest.mark.parametrize("seed", range(4))
def test_friction_is_within_the_cone_after_any_sweep(seed: int, size: tuple[int, int]) -> None:
    blocks = pile(np.random.default_rng(seed), *size)
    for sweeps in (1, 2, 3):
        scene = after_substep(blocks, friction=0.3, ground_friction=0.3, **{**EXACT, "velocity_sweeps": sweeps})
        all_of = dense(scene)
        limit = 0.3 * all_of.impulses.reshape(-1, 2).sum(axis=1)
        assert np.all(np.abs(all_of.shears) <= limit * (1.0 + 1e-12))
        assert np.any(all_of.shears != 0.0)


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("is_first", [True, False])
def test_velocities_change_by_gravity_and_by_the_impulses_that_are_kept(
    seed: int, is_first: bool, size: tuple[int, int]
) -> None:
    """Whatever tolerance they are solved to: impulses and velocities belong together, spins and supports too."""
    blocks = pile(np.random.default_rng(seed), *size)
    scene = collided(posed(blocks, velocity_sweeps=2, substeps=4, step=4 * H))
    before = velocities(scene.contacts.states)
    for number in range(4):
        substep(scene, 0, number, is_first, scene.contacts.impact_lanes)
        expected = before.ravel() + dense(scene).pushed()
        share = 0.5 if is_first and number == 0 else 1.0
        expected[1:-3:3] -= share * G * H
        before = velocities(scene.contacts.states)
        assert before.ravel() == pytest.approx(expected, abs=1e-13)
    assert np.all(before[-1] == 0.0)


def test_second_substep_begins_with_the_impulses_of_the_first(size: tuple[int, int]) -> None:
    scene = collided(posed(pile(np.random.default_rng(3), *size), substeps=2, step=2 * H))
    substep(scene, 0, 0, False, scene.contacts.impact_lanes)
    pushed = dense(scene).pushed()
    start = velocities(scene.contacts.states)
    kick(scene.contacts.states, scene.contacts.before, 0, len(start) - 1, 1.0, 0.0, -G * H)
    sweep(scene.contacts, WARM, scene.world.team, 0)
    expected = start.ravel() + pushed
    expected[1:-3:3] -= G * H
    warm = velocities(scene.contacts.states).ravel()
    assert warm == pytest.approx(expected, abs=1e-13)
    assert np.abs(pushed).max() > 0.1


def soft_row(gap: float, rate: float, tilt: float = 1e-4) -> tuple[Nonsmooth, Dense]:
    """Return one block over the ground after the position pass, at rest before."""
    lowest = math.sin(tilt) * 0.016 + math.cos(tilt) * 0.0125
    fast = Block(5.0, 1.0, vx=10.0)  # so that contacts are looked for far enough
    scene = collided(posed([Block(0.0, lowest + gap, tilt, vy=rate), fast], substeps=1, gravity=0.0))
    sweep(scene.contacts, POSITION, scene.world.team, 0)
    return scene, dense(scene)


@pytest.mark.parametrize("gap", [-3e-5, -1e-6, 2e-7, 6e-5])
@pytest.mark.parametrize("rate", [0.1, 0.0, -0.05, -1.0])
def test_position_pass_holds_soft_contacts_and_lets_gaps_just_close(gap: float, rate: float) -> None:
    """0 <= impulse complementary to J v + b s + gamma impulse >= 0, both points of a face at once."""
    scene, all_of = soft_row(gap, rate)
    soft = soft_contact(H)
    closed = all_of.gaps <= 0.0
    masses = np.diag(all_of.normals * all_of.inverse_mass @ all_of.normals.T)
    bias = np.where(closed, soft.bias, 1.0 / H)
    rates = all_of.normals @ velocities(scene.contacts.states).ravel()
    rest = rates + bias * all_of.gaps + np.where(closed, soft.softness, 0.0) * masses * all_of.impulses
    assert all_of.impulses.min() >= 0.0
    assert rest.min() > -1e-12
    assert np.abs(rest * all_of.impulses).max() < 1e-12 * (1.0 + all_of.impulses.max())
    assert np.any(all_of.impulses > 0.0) or rate > 0.0 or rate * H > -abs(gap)
    assert np.all(all_of.shears == 0.0)  # friction is no affair of the position pass


def test_round_off_of_a_gap_does_not_choose_between_the_rules() -> None:
    """What a pass has just closed is open by 1e-20 m or deep by it, as sums happen to be rounded."""
    scenes = [soft_row(gap, -0.05, 0.0)[0] for gap in (-1e-16, 1e-16)]
    deep, open_ = (velocities(scene.contacts.states)[0] for scene in scenes)
    assert deep == pytest.approx(open_, abs=1e-11)
    for scene in scenes:
        sweep(scene.contacts, FIRST_VELOCITY, scene.world.team, 0)
    assert [dense(scene).impulses.min() > 0.0 for scene in scenes] == [True, True]


def test_gap_that_stays_open_and_parts_that_leave_are_not_pulled() -> None:
    for gap, rate in ((3e-4, 0.0), (-1e-6, 1.0)):
        scene, all_of = soft_row(gap, rate)
        assert np.all(all_of.impulses == 0.0)
        assert velocities(scene.contacts.states)[0].tolist() == [0.0, rate, 0.0]


@given(static=st.floats(0.0, 1.0), less=st.floats(0.0, 1.0), normal=st.floats(1e-3, 2.0), needed=st.floats(0.0, 3.0))
def test_static_friction_holds_what_it_can_and_else_friction_is_kinetic(
    static: float, less: float, normal: float, needed: float
) -> None:
    material = zeros(1, INTERACTION)[0]
    material.static_friction, material.kinetic_friction, material.transition_speed = static, less * static, 1e-3
    limit = shear_limit(material, normal, needed, 5.0)
    assert less * static * normal <= limit <= static * normal
    if needed <= static * normal:
        assert limit >= needed
    elif (needed - static * normal) * 5.0 > 0.05:  # m/s, slides fast
        assert limit == pytest.approx(less * static * normal, abs=1e-12)


@pytest.mark.parametrize("friction", [0.05, 0.3, 1.5])
def test_block_that_slides_off_a_block_takes_from_it_what_it_gives(friction: float) -> None:
    """Equal and opposite: momentum and moment of momentum of two free blocks are kept by a contact with friction."""
    blocks = [Block(0.0, 1.0, 0.01, 0.3, 0.2, 4.0), Block(0.004, 1.0248, -0.02, -0.4, -0.6, -3.0)]
    scene = posed(blocks, friction=friction, gravity=0.0, **EXACT)
    before = velocities(scene.contacts.states)
    scene = collided(scene)
    substep(scene, 0, 0, False, scene.contacts.impact_lanes)
    after = velocities(scene.contacts.states)
    bodies: Any = scene.world.bodies[:2]
    gained = (after - before)[:2]
    assert np.abs(gained).min() > 1e-3
    assert bodies.mass @ gained[:, :2] == pytest.approx([0.0, 0.0], abs=1e-15)
    moment = bodies.mass * (bodies.x * gained[:, 1] - bodies.y * gained[:, 0]) + bodies.inertia * gained[:, 2]
    assert float(moment.sum()) == pytest.approx(0.0, abs=1e-15)


def test_tallies_have_what_impulses_take_from_blocks_that_meet_without_gravity() -> None:
    blocks = pile(np.random.default_rng(1), 4, 2)  # some colour has a pack of more than one
    scene = collided(posed(blocks, gravity=0.0, **{**EXACT, "velocity_sweeps": 3}))
    bodies: Any = scene.world.bodies[:-1]

    def kinetic() -> float:
        vx, vy, spin = velocities(scene.contacts.states)[:-1].T
        return float(0.5 * (bodies.mass * (vx**2 + vy**2) + bodies.inertia * spin**2).sum())

    before = kinetic()
    substep(scene, 0, 0, False, scene.contacts.impact_lanes)
    tallies = scene.contacts.tallies
    taken = float(tallies.impacts.sum() + tallies.friction.sum())
    assert before - kinetic() == pytest.approx(taken, rel=1e-12)
    assert tallies.impacts.sum() > 0.1 * before
    all_of = dense(scene)
    _, slip = slips(scene, all_of)
    then = all_of.tangents @ velocities(scene.contacts.before).ravel()
    assert float(tallies.friction.sum()) == pytest.approx(float(-0.5 * all_of.shears @ (slip + then)), rel=1e-9)
