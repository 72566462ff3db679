"""What a substep solves: complementarity, Coulomb's cone, momentum, restitution; kicks and drifts of single bodies."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.random import Generator
from numpy.typing import NDArray

from blocksim.kernels.common.tolerances import LATE, MOST_ROUNDS
from blocksim.kernels.nonsmooth.arrays import AWAY, FAR, TALLY_PACKS, Nonsmooth
from blocksim.kernels.nonsmooth.passes import FIRST_VELOCITY, POSITION, VELOCITY, range_of_thread, sweep, velocity_pass
from blocksim.kernels.nonsmooth.step import bodies_of_thread, substep
from blocksim.verification.scene import WIDTH
from blocksim.world.sag import soft_contact
from tests.kernels.references import Dense, dense
from tests.kernels.scenes import Block, after_substep, collided, pile, posed, single, velocities

G = 9.81
H = 1e-3  # s, a substep
SMOOTH: dict[str, Any] = {"friction": 0.0, "ground_friction": 0.0}
EXACT: dict[str, Any] = {"velocity_tolerance": 1e-11, "velocity_sweeps": 10_000, "substeps": 1, "restitution": 0.0}
ROUND_OFF = 1e-8  # m/s: Gauss and Seidel approach slowly


@pytest.fixture(scope="module")
def size(pace: int) -> tuple[int, int]:
    """Return how many columns and constraints of blocks are solved."""
    return (4, 3) if pace == 1 else (2, 2)


def slips(scene: Nonsmooth, all_of: Dense) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the velocities at the points along their normals, and those of constraints along their tangents (m/s)."""
    now = velocities(scene.contacts.states).ravel()
    return all_of.normals @ now, all_of.tangents @ now


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("friction", [0.1, 0.5])
def test_friction_stops_all_slip_or_resists_it_with_all_it_has(
    seed: int, friction: float, size: tuple[int, int]
) -> None:
    """And is within the cone after any sweep."""
    blocks = pile(np.random.default_rng(seed), *size)

    def after(sweeps: int) -> tuple[Nonsmooth, Dense, NDArray[np.float64]]:
        values = {**EXACT, "velocity_sweeps": sweeps}
        scene = after_substep(blocks, friction=friction, ground_friction=0.7, **values)
        all_of = dense(scene)
        limit = all_of.friction * all_of.impulses.reshape(-1, 2).sum(axis=1)
        assert np.all(np.abs(all_of.shears) <= limit * (1.0 + 1e-9))
        return scene, all_of, limit

    for sweeps in (1, 2, 3):
        after(sweeps)
    scene, all_of, limit = after(EXACT["velocity_sweeps"])
    _, slip = slips(scene, all_of)
    pressed = limit > 0.0
    is_at_limit = np.abs(all_of.shears) > limit * (1.0 - 1e-6)
    assert np.abs(slip[pressed & ~is_at_limit]).max(initial=0.0) < ROUND_OFF
    assert (slip * all_of.shears)[pressed & is_at_limit].max(initial=0.0) < ROUND_OFF * limit.max()
    assert np.any(pressed & is_at_limit)


def two_blocks(seed: int) -> list[Block]:
    """Return two blocks in flight that meet with two points of a face."""
    vx, spin, other = np.random.default_rng(seed).normal(size=3) * (1.0, 8.0, 8.0)
    return [Block(0.0, 1.0, 1e-3, vx, 0.3, spin), Block(0.007, 1.025, -1e-3, 0.0, -0.9, other)]


@pytest.mark.parametrize("seed", range(2))
def test_one_contact_is_solved_exactly_at_once(seed: int) -> None:
    """Both normals in the first sweep, and friction to the slip that they leave: effective masses are right."""
    once = {**EXACT, "velocity_sweeps": 1, "gravity": 0.0}
    scene = after_substep(two_blocks(seed), **SMOOTH, **once)
    all_of = dense(scene)
    rest = slips(scene, all_of)[0] - all_of.targets
    assert min(all_of.impulses.min(), rest.min()) > -1e-10
    assert np.minimum(all_of.impulses, rest) == pytest.approx(0.0, abs=1e-10)
    assert all_of.impulses.max() > 0.0
    scene = after_substep(two_blocks(seed), friction=100.0, **once)
    all_of = dense(scene)
    _, slip = slips(scene, all_of)
    assert slip == pytest.approx([0.0], abs=1e-12)
    assert np.all(all_of.shears != 0.0)


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


HALF = 0.0125  # m, of a height
SLIPPERY: dict[str, Any] = {"friction": 0.0, "ground_friction": 0.0, "substeps": 1, "velocity_tolerance": 1e-11}
RESTITUTIONS = [0.0, 0.5, 0.8, 1.0]


def lowest(angle: float) -> float:
    """Return how far (m) the lowest corner is below the centre."""
    return math.sin(abs(angle)) * 0.016 + math.cos(angle) * HALF


@pytest.mark.parametrize("restitution", RESTITUTIONS)
@pytest.mark.parametrize("angle", [0.0, 0.3, -1.0])
@pytest.mark.parametrize("others", [0, 2])  # impacts of one or two blocks go in rounds, weak ones of three do not
def test_impact_reverses_the_approach_of_the_point_by_its_restitution(
    restitution: float, angle: float, others: int
) -> None:
    """Without gravity exactly: flat, or on a corner, in the plane of the ground or that of a fixed block."""
    far = [Block(3.0 + k, 3.0) for k in range(others)]
    for floor in ([], [Block(0.0, -HALF + 0.5, width=0.2, fixed=True)]):
        level = 0.5 if floor else 0.0
        block = Block(0.004, level + lowest(angle) + 1e-5, angle, 0.3, -0.9, 4.0 * (angle != 0.0))
        scene = after_substep([block, *floor, *far], restitution=restitution, gravity=0.0, **SLIPPERY)
        all_of = dense(scene)
        after = all_of.normals @ velocities(scene.contacts.states).ravel()
        before = all_of.normals @ velocities(scene.contacts.before).ravel()
        if restitution > (0.5 if far else 0.0):  # in rounds: their velocities before are no longer kept
            rest = [[0.0] * 3] * (1 + len(floor) + len(far))
            before = all_of.normals @ np.array([[0.3, -0.9, block.spin], *rest]).ravel()
        is_met = all_of.gaps < FAR / 2
        assert after[is_met] == pytest.approx(-restitution * before[is_met], abs=1e-9)
        assert before[is_met].max() < -0.5


@pytest.mark.parametrize("others", [0, 2])  # in rounds, and not
def test_point_that_parts_beside_one_that_meets_is_not_made_to_rebound(others: int) -> None:
    """A heel comes down while the toe is lifted, out of an overlap: the blow takes from that, and nothing gives."""
    block = Block(0.0, HALF - 1e-3, vx=0.2, vy=-0.25, spin=-45.0)
    far = [Block(3.0 + k, 3.0) for k in range(others)]
    scene = after_substep([block, *far], restitution=0.4, gravity=0.0, **SLIPPERY)
    all_of = dense(scene)
    before = all_of.normals @ np.array([block.vx, block.vy, block.spin, *[0.0] * 3 * (1 + others)])
    after = all_of.normals @ velocities(scene.contacts.states).ravel()
    heel, toe = np.argmin(before), np.argmax(before)
    assert before[toe] > 0.3
    assert after[heel] == pytest.approx(-0.4 * before[heel], abs=1e-9)
    assert all_of.impulses[toe] == 0.0
    assert velocities(scene.contacts.states)[0, 0] == pytest.approx(0.2, abs=1e-12)


def test_point_that_is_still_open_beside_one_in_touch_is_not_slowed_down() -> None:
    """A block turns about one corner; the other will meet the ground in the next substep, and not in this one."""
    angle, x = 0.02, 0.016 * math.cos(0.02) - HALF * math.sin(0.02)
    spin = -angle / (1.5 * H)
    block = Block(0.0, lowest(angle) - 1e-9, angle, lowest(angle) * -spin, x * spin, spin)
    scene = after_substep([block], restitution=0.0, gravity=0.0, **SLIPPERY)
    assert dense(scene).gaps.max() < FAR / 2  # both are looked at
    assert velocities(scene.contacts.states)[0].tolist() == pytest.approx([block.vx, block.vy, spin], abs=1e-6)


@pytest.mark.parametrize("restitution", [0.4, 0.9])
def test_blocks_that_meet_side_by_side_in_flight_fall_on(restitution: float) -> None:
    blocks = [{"x": -0.02, "y": 1.0, "velocity": [1.0, 0.0]}, {"x": 0.02, "y": 1.0, "velocity": [-1.0, 0.0]}]
    run = single(blocks, restitution=restitution, friction=0.0).to_step(20)
    assert run.bodies.y == pytest.approx([1.0 - 0.5 * G * 0.02**2] * 2, abs=1e-9)
    assert run.bodies.vx == pytest.approx([-restitution, restitution], abs=1e-6)


FEW = 250  # sweeps, of 1000 that are allowed and that it took where they swung
TALL = ((0.0, 0.0), (0.02, 0.0), (0.01, 0.05))  # m, a triangle
SETTING: dict[str, Any] = {
    "velocity_tolerance": 1e-9,
    "velocity_sweeps": 1000,
    "substeps": 1,
    "restitution": 0.0,
    "gravity": 0.0,
}


def on_a_corner(random: Generator, outline: tuple[tuple[float, float], ...]) -> Block:
    """Return a body of 20 x 60 mm, or with an outline, with its lowest corner on the ground and any motion."""
    angle = random.uniform(0.1, 1.4) * random.choice([-1.0, 1.0])
    corners = np.array(outline or [(-0.01, -0.03), (0.01, -0.03), (0.01, 0.03), (-0.01, 0.03)])
    corners = corners - corners.mean(axis=0)
    heights = math.sin(angle) * corners[:, 0] + math.cos(angle) * corners[:, 1]
    vx, vy, spin = random.normal(size=3) * (3.0, 0.3, 15.0)
    return Block(0.0, -heights.min() - 1e-9, angle, vx, vy, spin, width=0.02, height=0.06, outline=outline)


def solved(body: Block, friction: float) -> tuple[Nonsmooth, bool]:
    """Return a scene of a body after a substep, and whether its sweeps were late."""
    scene = after_substep([body], friction=friction, ground_friction=friction, **SETTING)
    return scene, bool(scene.contacts.stepping[0].sweeps > LATE)


@pytest.mark.parametrize("outline", [(), TALL], ids=["rectangle", "triangle"])
@pytest.mark.parametrize("friction", [1.6, 4.0])
def test_sweeps_end_and_obey_coulomb_where_friction_couples_strongly(
    outline: tuple[tuple[float, float], ...], friction: float
) -> None:
    random = np.random.default_rng(5)
    sliding = 0
    for _ in range(60):
        scene, is_late = solved(on_a_corner(random, outline), friction)
        if not scene.contacts.stepping[0].pack_count:
            continue
        assert scene.contacts.stepping[0].sweeps < FEW
        all_of = dense(scene)
        now = velocities(scene.contacts.states).ravel()
        counts = all_of.counts
        normal, shear, slip = all_of.impulses.sum(), float(all_of.shears[0]), float((all_of.tangents @ now)[0])
        rates = (all_of.normals @ now - all_of.targets)[counts]
        assert all_of.impulses.min() >= 0.0
        assert rates.min(initial=0.0) > -1e-7
        assert abs(shear) <= friction * normal + 1e-9
        if normal > 0.0 and abs(slip) > 1e-6:
            sliding += is_late
            assert shear == pytest.approx(-math.copysign(friction * normal, slip), abs=1e-8)
    assert sliding > 4


def dominoes(seed: int) -> list[dict[str, Any]]:
    """Return tall blocks on the ground, some of them tilted, that move towards one another (m, m/s, rad/s)."""
    random, bodies, right = np.random.default_rng(seed), [], 0.0
    for _ in range(6):
        width, height = random.uniform(0.006, 0.02), random.uniform(0.02, 0.06)
        tilt = random.uniform(-0.25, 0.25) * (random.random() < 0.4)
        half = 0.5 * (width * math.cos(tilt) + height * abs(math.sin(tilt)))
        low = 0.5 * (width * abs(math.sin(tilt)) + height * math.cos(tilt))
        speed, spin = float(random.normal(0.0, 0.3)), float(random.normal(0.0, 6.0))
        pose = {"x": right + half, "y": low + 1e-6, "angle": tilt, "velocity": [speed, 0.0], "spin": spin}
        bodies.append({**pose, "width": width, "height": height})
        right += 2.0 * half + random.uniform(0.001, 0.02)
    return bodies


@pytest.mark.parametrize("static", [1.0, 1.3])
@pytest.mark.parametrize(("friction", "sweeps"), [(0.4, 1000), (1.5, 1000), (5.0, 1000), (5.0, 60), (8.0, 1000)])
@pytest.mark.parametrize("seed", range(4))
def test_whole_runs_obey_coulomb_keep_what_they_apply_and_add_up(
    seed: int, friction: float, sweeps: int, static: float
) -> None:
    """After every step, solved or not: within the cone, and velocities change by the impulses that are kept."""
    both = {"static": static * friction, "kinetic": friction}
    law: Any = friction if static == 1.0 else both
    run = single(
        dominoes(seed), friction=law, ground_friction=law, restitution=0.0, velocity_sweeps=sweeps, step=2.5e-4
    )
    for step in range(1, 400):
        run.to_step(step)
        assert isinstance(run.scene, Nonsmooth)
        contacts = run.scene.contacts
        listed = contacts.constraints[: int(contacts.stepping[0].constraint_count)].view(np.ndarray)
        normals, near = listed["normal_one"] + listed["normal_two"], listed["reach"] != AWAY
        assert np.all((np.abs(listed["shear"]) <= static * friction * normals * (1.0 + 1e-12))[near])
        changes = velocities(contacts.states) - velocities(contacts.before)
        changes[:-1, 1] += float(contacts.stepping[0].substep) * G
        assert momentum_of_impulses(contacts, listed[near]) == pytest.approx(changes[:, :2], abs=1e-12)
    assert run.residual() < 1e-9


def momentum_of_impulses(contacts: Any, listed: Any) -> NDArray[np.float64]:
    """Return by how much the impulses that are kept change the velocities of all bodies (m/s)."""
    normals = listed["normal_one"] + listed["normal_two"]
    pushes = np.stack(
        [
            listed["nx"] * normals - listed["ny"] * listed["shear"],
            listed["ny"] * normals + listed["nx"] * listed["shear"],
        ],
        axis=-1,
    )
    total = np.zeros((contacts.states.size, 2))
    np.add.at(total, listed["a"], pushes)
    np.subtract.at(total, listed["b"], pushes)
    return np.asarray(total * contacts.states["inverse_mass"][:, None])


def test_passes_that_end_unsolved_are_counted_with_what_they_leave() -> None:
    blocks = pile(np.random.default_rng(0), 2, 2)
    found = {
        sweeps: after_substep(blocks, velocity_tolerance=1e-6, velocity_sweeps=sweeps).contacts.stepping[0]
        for sweeps in (3, 1000)
    }
    assert (found[3].passes, found[3].unsolved) == (1, 1)
    assert found[3].residual == found[3].worst_residual > 1e-6
    assert (found[1000].passes, found[1000].unsolved, found[1000].worst_residual) == (1, 0, 0.0)
    assert 0.0 <= found[1000].residual <= 1e-6


def test_impacts_that_go_on_after_all_rounds_are_counted() -> None:
    blocks: list[dict[str, Any]] = [{"x": i * WIDTH, "y": 0.2} for i in range(MOST_ROUNDS + 10)]
    blocks[0] |= {"x": -1.3e-4, "velocity": [1.0, 0.0]}
    for count, ends in ((MOST_ROUNDS // 2, 0), (MOST_ROUNDS + 10, 1)):
        run = single(blocks[:count], restitution=1.0, gravity=0.0, friction=0.0).to_step(4)
        assert isinstance(run.scene, Nonsmooth)
        assert run.scene.contacts.stepping[0].cut_rounds == ends


@pytest.mark.parametrize("size", [1, 2, 3, 5])
@pytest.mark.parametrize("count", [0, 1, 3, 4, 7, 23, 64])
def test_threads_divide_packs_in_whole_tallies_and_leave_none_out(size: int, count: int) -> None:
    begin, end = 8, 8 + count
    ranges = [range_of_thread(begin, end, k, size) for k in range(size)]
    assert [m for first, last in ranges for m in range(first, last)] == list(range(begin, end))
    assert all((first - begin) % TALLY_PACKS == 0 for first, last in ranges if first < last)
    scene = posed([Block(0.1 * i, 1.0) for i in range(7)])
    assert [i for k in range(size) for i in range(*bodies_of_thread(scene.contacts, k, size))] == list(range(7))


def test_velocity_pass_ends_at_its_tolerance_or_after_its_sweeps() -> None:
    blocks = pile(np.random.default_rng(0), 2, 2)
    sweeps = {}
    for tolerance in (0.1, 1e-3, 1e-6):
        scene = after_substep(blocks, velocity_tolerance=tolerance)
        sweeps[tolerance] = int(scene.contacts.stepping[0].sweeps)
        before = velocities(scene.contacts.states)
        velocity_pass(scene.contacts, scene.world.team, 0, VELOCITY, 1e3)  # one more sweep
        assert (
            np.abs(velocities(scene.contacts.states) - before)[:, :2].max() <= 4.0 * tolerance
        )  # constraints of a body
        assert scene.contacts.stepping[0].sweeps == sweeps[tolerance] + 1
    assert sweeps[0.1] < sweeps[1e-3] < sweeps[1e-6]
    assert after_substep(blocks, velocity_tolerance=1e-6, velocity_sweeps=3).contacts.stepping[0].sweeps == 3
