"""Rigid blocks in motion: closed forms, energy, cuts of steps, supports, edges, impacts and groups that touch."""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from blocksim.kernels.common.arrays import NOT_FINITE, OVERLAP_LIMIT
from blocksim.kernels.nonsmooth.arrays import FAR, Nonsmooth
from blocksim.kernels.nonsmooth.cuts import set_length
from blocksim.kernels.nonsmooth.impact_rounds import find_contact_groups
from blocksim.kernels.nonsmooth.passes import solve_two
from blocksim.verification.scene import HEIGHT, WIDTH, CaseScene, SteppedScene, scenario_of
from tests.kernels.scenes import Block, after_substep, begin, collided, listed_constraints, posed, single

G = 9.81
ON_GROUND = HEIGHT / 2


@pytest.mark.parametrize("lane", [None, 0], ids=["four", "single"])
def test_two_points_are_solved_exactly(lane: int | None) -> None:
    random = np.random.default_rng(0)
    for _ in range(2000):
        root = random.normal(size=(2, 2))
        k = root @ root.T + 0.01 * np.eye(2)
        q = random.normal(size=2)
        x = np.array(solve_two(lane, k[0, 0], k[0, 1], k[1, 1], q[0], q[1]))
        rest = k @ x + q
        assert x.min() >= 0.0
        assert rest.min() >= -1e-9
        assert abs(x * rest).max() < 1e-9 * (1.0 + abs(x).max())


def test_static_friction_holds_what_kinetic_friction_does_not_stop() -> None:
    slope, time = math.radians(20.0), 0.1
    friction = {"static": 0.45, "kinetic": 0.2, "transition_speed": 0.001}
    values: dict[str, Any] = {"restitution": 0.0, "ground_friction": friction, "velocity_tolerance": 1e-5}
    assert abs(single([{"y": ON_GROUND}], tilt=slope, **values).to_time(time).bodies.x[0]) < 1e-4
    slides = single([{"y": ON_GROUND, "velocity": [-0.3, 0.0]}], tilt=slope, **values).to_time(time)
    expected = 0.3 + time * G * (math.sin(slope) - 0.2 * math.cos(slope))
    assert abs(slides.bodies.vx[0]) == pytest.approx(expected, rel=0.01)


def test_edges_of_pieces_of_ground() -> None:
    tables: dict[str, Any] = {
        "contact": {"restitution": 0.0},
        "friction": {"block_block": 0.31, "block_ground": 0.38},
        "time": {"stop_at_rest": False},
        "ground": {"profile": [[-0.5, 0.0], [0.0, 0.0], [0.0, -0.06], [0.5, -0.06]]},
    }
    run = begin(scenario_of([{"x": 0.004, "y": ON_GROUND}], **tables), substeps=1).to_time(0.1)
    # as the explicit scheme has it: turned about the edge of a step
    assert run.bodies.x[0] == pytest.approx(12.285e-3, abs=1e-4)
    assert math.degrees(run.bodies.angle[0]) == pytest.approx(-47.69, abs=0.3)


@pytest.mark.parametrize(("most", "status"), [(1e-6, OVERLAP_LIMIT), (2e-6, 0)])
def test_overlap_beyond_the_limit_stops_the_run(most: float, status: int) -> None:
    assert single([{"y": ON_GROUND}], restitution=0.0, contact={"max_overlap": most}).to_time(0.05).code == status


def test_state_that_is_not_finite_stops_the_run() -> None:
    run = single([{"y": 0.1}]).to_step(3)
    run.world.bodies.spin[0] = np.nan
    run.scene.contacts.states.vy[0] = np.nan
    assert run.to_step(10).code == NOT_FINITE


SMOOTH: dict[str, Any] = {"friction": 0.0, "ground_friction": 0.0}
HOPPING = {"x": 1.0, "y": ON_GROUND + 2e-3, "velocity": [0.0, -0.3]}  # at most every 30 ms


def cut_steps(run: SteppedScene, count: int) -> int:
    """Go on for some steps; return how many of them were cut."""
    stepping = run.scene.contacts.stepping[0]
    return sum(int(run.to_step(run.steps + 1) is run and stepping.cuts > 0) for _ in range(count))


@pytest.mark.parametrize("start", [0.5e-4, 1.0e-4, 1.7e-4, 2.9e-4])
def test_impact_happens_at_its_time_to_a_64th_of_a_step(start: float) -> None:
    run = single([{"y": ON_GROUND + start, "velocity": [0.0, -1.0]}], restitution=0.8, gravity=0.0, **SMOOTH)
    run.to_time(3e-3)
    assert run.bodies.y[0] == pytest.approx(ON_GROUND + 0.8 * (run.time - start), abs=run.step / 64.0)


def test_flight_is_a_parabola_though_steps_are_cut() -> None:
    run = single([{"y": 1.0, "velocity": [1.0, 2.0], "spin": 3.0}, HOPPING], restitution=0.9)
    assert cut_steps(run, 200) > 2
    t = run.time
    exact = [t, 1.0 + 2.0 * t - 0.5 * G * t * t, 3.0 * t, 1.0, 2.0 - G * t, 3.0]
    assert run.state()[0] == pytest.approx(exact, abs=1e-9)


def test_velocity_of_a_block_that_rolls_does_not_depend_on_lengths_that_are_not_taken() -> None:
    found = []
    for lengths in ((0.3,), (0.7, 0.3), (0.1, 0.9, 0.3)):
        tilted = {"y": 0.5 * (np.sin(0.1) * WIDTH + np.cos(0.1) * HEIGHT), "angle": 0.1}
        run = CaseScene(
            [tilted], restitution=0.0, ground_friction=5.0, time={"scheme": "nonsmooth", "end": 1.0}
        ).start()
        run.to_step(30)
        assert isinstance(run.scene, Nonsmooth)
        for share in lengths:
            set_length(run.scene, share * run.step)
        state = run.scene.contacts.states[0]
        found.append((float(state.vx), float(state.vy), float(state.spin)))
    assert abs(found[0][2]) > 0.1
    assert found[1] == pytest.approx(found[0], rel=1e-12)
    assert found[2] == pytest.approx(found[0], rel=1e-12)


@pytest.mark.parametrize("count", [1, 2, 3, 13])
def test_steps_are_cut_where_impacts_are_sequential_however_many_blocks_there_are(count: int) -> None:
    crowd = [{**HOPPING, "x": 0.1 * k} for k in range(count)]
    for restitution in (0.5, 0.9):
        for impacts, is_cut in (("sequential", True), ("simultaneous", False)):
            run = single(crowd, restitution=restitution, contact={"impacts": impacts})
            assert (cut_steps(run, 100) > 0) is is_cut


FREQUENCY = 2.0  # 1/s
RAMP = 0.5  # s
LYING = {"y": HEIGHT / 2}


def shaken(acceleration: float, *bodies: dict[str, Any], direction: str = "0 deg", **tables: Any) -> Any:
    """Return blocks on a table with this greatest acceleration (m/s2)."""
    amplitude = acceleration / (2.0 * np.pi * FREQUENCY) ** 2
    motion = {"kind": "harmonic", "amplitude": amplitude, "frequency": FREQUENCY, "ramp": RAMP, "direction": direction}
    more = {"friction": {"block_block": 0.31, "block_ground": 0.38}, "contact": {"restitution": 0.0}}
    return scenario_of(bodies or [LYING], motion=motion, **{**more, "time": {"stop_at_rest": False}, **tables})


def table(run: SteppedScene) -> float:
    """Return how far (m) the support has gone along x."""
    return float(run.world.bodies.x[-1])


@pytest.mark.parametrize("substeps", [1, 4])
def test_block_rides_along_below_the_friction_limit(substeps: int, pace: int) -> None:
    run = begin(shaken(0.9 * 0.38 * G), substeps=substeps, velocity_tolerance=1e-9).to_time(1.3 / pace)
    assert abs(table(run)) > (0.005 if pace == 1 else 1e-5)
    # drifts know the friction of the substep before: they lag by acceleration times substep squared, and add up to that
    assert run.bodies.x[0] == pytest.approx(table(run), abs=0.38 * G * (1e-3 / substeps) ** 2)
    assert run.bodies.vx[0] == pytest.approx(float(run.world.bodies.vx[-1]), abs=1e-6)
    assert run.residual() < 1e-12


@pytest.mark.parametrize("angle", [0.0, 0.5])
def test_elastic_block_comes_back_to_where_it_fell_from(angle: float) -> None:
    height = math.sin(angle) * WIDTH / 2 + math.cos(angle) * HEIGHT / 2 + 0.05
    run = single([{"y": height, "angle": angle}], restitution=1.0, **SMOOTH)
    start = run.mechanical
    assert run.to_time(0.5).mechanical == pytest.approx(start, rel=1e-9)  # 1 to 2 % lost with J v+ = -e J v-
    assert run.residual() < 1e-12


@pytest.mark.parametrize("impacts", ["simultaneous", "sequential"])
@pytest.mark.parametrize("share", [-0.5, 0.5])
def test_block_under_a_constant_force_bounces_as_under_other_gravity(share: float, impacts: str) -> None:
    restitution, drop = 0.8, 0.05
    contact = {"impacts": impacts, "restitution": restitution}
    blocks = [{"y": HEIGHT / 2 + drop}]
    weight = G * float(begin(scenario_of(blocks)).bodies.mass[0])
    load = {
        "kind": "force",
        "body": "1",
        "magnitude": abs(share) * weight,
        "direction": f"{90 if share > 0 else -90} deg",
    }
    run = begin(scenario_of(blocks, contact=contact, loads=[load]), end=1.0)
    pull = (1.0 - share) * G
    fall = math.sqrt(2.0 * drop / pull)
    run.to_time((1.0 + restitution) * fall)
    assert run.residual() < 1e-12
    if impacts == "sequential":  # an impact in the middle of a substep shifts the others by as much
        assert run.bodies.y[0] - HEIGHT / 2 == pytest.approx(restitution**2 * drop, rel=2e-4)
        assert run.to_time((1.0 + 2.0 * restitution + restitution**2) * fall).bodies.y[0] - HEIGHT / 2 == pytest.approx(
            restitution**4 * drop, rel=4e-4
        )


def row(gap: float) -> list[dict[str, Any]]:
    """Return five blocks in a row (m between them), of which the first meets the second within a substep."""
    blocks: list[dict[str, Any]] = [{"x": i * (WIDTH + gap), "y": 0.2} for i in range(5)]
    blocks[0] |= {"x": -1.3e-4, "velocity": [1.0, 0.0]}
    return blocks


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


def struck_in_a_row(widths: Sequence[float], gap: float, e: float, end: float) -> NDArray[np.float64]:
    """Return the speeds after the impacts, two bodies at a time, of a row whose first brick comes at 1 m/s."""
    speeds: NDArray[np.float64] = np.eye(len(widths))[0]
    ways, masses = np.zeros(len(widths)), np.array(widths)
    time = 0.0
    while True:
        closing = speeds[:-1] - speeds[1:]
        room = gap + np.diff(ways)
        times = np.divide(room, closing, out=np.full(closing.shape, np.inf), where=closing > 1e-9)
        first = int(np.argmin(times))
        if time + times[first] > end:
            return speeds
        time += times[first]
        ways += times[first] * speeds
        one, two = masses[first : first + 2]
        speeds[first : first + 2] += (1.0 + e) * closing[first] / (one + two) * np.array([-two, one])


ROWS: dict[str, tuple[float, ...]] = {
    "light second": (0.1, 0.05, 0.2, 0.08, 0.1),
    "ever lighter": (0.169, 0.122, 0.086, 0.049, 0.101),
    "light between heavy": (0.15, 0.03, 0.15, 0.03, 0.15),
}


def assert_row_is_struck(widths: Sequence[float], restitution: float, gap: float, setting: str = "") -> None:
    """Assert that a blow at 1 m/s goes from brick to brick, and that none turns."""
    sign = -1.0 if setting == "mirrored" else 1.0
    centres = np.cumsum(widths) - 0.5 * np.array(widths) + gap * np.arange(len(widths))
    bodies: list[dict[str, Any]] = []
    for width, place, speed in zip(widths, sign * centres, np.eye(len(widths))[0], strict=True):
        x, y, sides, velocity = place, 0.05, (width, 0.1), [sign * speed, 0.0]
        if setting == "upright":
            x, y, sides, velocity = 0.0, 5.0 + place, (0.1, width), [0.0, speed]
        shape: dict[str, Any] = {"width": sides[0], "height": sides[1]}
        if setting == "outlines":
            u, v = 0.5 * sides[0], 0.5 * sides[1]
            shape = {"outline": [[-u, -v], [u, -v], [u, v], [-u, v]]}
        bodies.append({"x": x, "y": y, "velocity": velocity, **shape})
    idle = [{"x": 50.0 + k, "y": HEIGHT / 2} for k in range(9 if setting == "in a crowd" else 0)]
    gravity = 0.0 if setting == "upright" else G
    run = single([*bodies, *idle], restitution=restitution, gravity=gravity, step=5e-4, **SMOOTH).to_time(0.15)
    moving = run.bodies[: len(widths)]
    expected = struck_in_a_row(widths, gap, restitution, run.time)
    speeds = moving.vy if setting == "upright" else sign * moving.vx
    assert moving.mass @ speeds == pytest.approx(moving.mass @ expected, rel=1e-9)
    if setting != "in a crowd":  # where steps are not cut, impacts that are not one may share a substep
        assert speeds == pytest.approx(expected, abs=1e-8)
    assert np.abs(run.bodies.angle).max() < 1e-9
    assert run.residual() < 1e-9


@pytest.mark.parametrize("setting", ["", "mirrored", "upright", "outlines", "in a crowd"])
@pytest.mark.parametrize("restitution", [0.9, 0.95, 1.0])
@pytest.mark.parametrize("row", ROWS)
def test_frontal_blow_goes_from_brick_to_brick_and_turns_none(row: str, restitution: float, setting: str) -> None:
    """Gravity lets unequal bricks sink by unequal 1e-7 m, so that their corners do not meet at once."""
    for gap in (1e-3, 1.3e-3, 1.7e-3):
        assert_row_is_struck(ROWS[row], restitution, gap, setting)


@pytest.mark.parametrize("gap", [1e-3, 1.3e-3, 1.7e-3, 2e-3])
def test_frontal_blow_turns_no_brick_where_impacts_do_not_go_in_rounds(gap: float) -> None:
    assert_row_is_struck(ROWS["light second"], 0.5, gap)


def test_contacts_report_the_impulses_of_all_rounds() -> None:
    blocks = row(0.0)
    blocks[0]["x"] = -0.9995e-3  # so late in the step that it is not cut at the impact
    run = single(blocks, restitution=1.0, gravity=0.0, step=1e-3, substeps=1, **SMOOTH)
    before = run.bodies.vx.copy()
    run.to_step(1)
    constraints = run.scene.contacts.constraints[: run.scene.contacts.stepping[0].constraint_count]
    impulses = constraints["nx"] * (constraints["normal_one"] + constraints["normal_two"])
    assert np.count_nonzero(impulses) == 4  # one after the other, within this substep
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


def first_impact(run: SteppedScene) -> tuple[float, float]:
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
