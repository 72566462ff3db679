"""Members of ensembles end as they would alone, to the last bit; how far blocks have moved, how, which first."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pytest

from blocksim.bench.harness import pushed_wall
from blocksim.errors import ExitCode
from blocksim.scenario import Model, PlacedBody, Scenario, load_scenario, scenario_from_mapping
from blocksim.simulation import ensemble, simulate
from blocksim.simulation.ensemble import EnsembleEnd, MemberEnd, MemberFailure, run_ensemble, run_in_batches
from blocksim.simulation.loop import STOPPED
from blocksim.simulation.observables import AT_REST, Movement, MovingSupport, Response, Watch
from blocksim.simulation.schemes import build_stacks
from blocksim.world import build, memory
from blocksim.world.build import SceneStack
from blocksim.world.memory import SceneTooLargeError, scene_size
from blocksim.world.step import SkinTooSmallError, StepError
from tests.golden import Golden
from tests.simulation.conftest import SCENARIOS

WALL = {"stiffness_scale": 1e-3}
SOFT = {"contact.stiffness_scale": 1e-3, "contact.restitution": 0.2, "time.end": 0.3}


def collapses(*changes: dict[str, Any]) -> list[Scenario]:
    return [load_scenario(SCENARIOS / "three_blocks_nominal.toml", {**SOFT, **change}) for change in changes]


def assert_same(end: EnsembleEnd, scenario: Scenario) -> None:
    alone = simulate(scenario)
    assert isinstance(end, MemberEnd)
    assert alone.final.equals(end.final)
    assert alone.summary.energy_J == end.ledger
    assert end.convergence == (alone.summary.convergence and alone.summary.convergence.model_dump())
    assert repr(alone.columns) == repr(end.columns)
    assert alone.summary.movement is not None
    assert end.observables.items() <= alone.summary.movement.row.items()  # one that ran alone lacks peaks
    assert (alone.summary.status, alone.summary.reason) == (end.outcome.status, end.outcome.reason)
    assert alone.summary.simulated_time_s == end.seconds == end.frames.time[-1]
    assert np.array_equal(alone.frames.x[-1:], end.frames.x)
    assert all(np.array_equal(alone.frames.energy[name][-1:], end.frames.energy[name]) for name in end.frames.energy)


def test_the_number_of_threads_and_the_size_of_batches_change_no_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    scenarios = collapses(*({"friction.block_block": 0.2 + 0.01 * k, "time.end": 0.05} for k in range(7)))
    one = [end.columns for end in run_ensemble(scenarios, threads=1)]
    monkeypatch.setattr(ensemble, "BATCH", 3)
    monkeypatch.setattr(ensemble, "CHUNK", 1)
    assert [end.columns for end in run_ensemble(scenarios, threads=4)] == one
    monkeypatch.setattr(build, "MOST_BYTES", 2 * scene_size(4, 16, 8).bytes)
    stacks = [len(stack.numbers) for stack in build_stacks([*map(Model, scenarios)]) if isinstance(stack, SceneStack)]
    assert stacks == [2, 2, 2, 1]  # no more memory than a stack may take
    assert [end.columns for end in run_ensemble(scenarios)] == one


def test_a_batch_of_everything_has_the_bits_of_runs_of_their_own() -> None:
    """Both schemes, all laws, all supports, fixed, driven and large blocks, starts at rest, events; one or several."""
    brick = {"block": "brick", "x": 0.3, "y": 0.1, "name": "one"}
    rigid: dict[str, Any] = {"time.scheme": "nonsmooth"}
    profile = {"ground": {"profile": [[0.0, 0.0], [0.1, 0.0], [0.3, -0.1]]}}
    shaken = {"motion": {"kind": "harmonic", "amplitude": 0.002, "frequency": 5.0}}
    jerk = {"motion": {"kind": "pulse", "shape": "rectangular", "duration": 1.0, "amplitude": 1.0}}
    steady = {"structures": [{"kind": "stack", "block": "brick", "count": 2}]}
    settled = {**steady, "start": {"settle": True}}
    driven = {"bodies": [{**brick, "motion": {"kind": "ramp", "distance": 0.3, "speed": 1.0}}]}
    eventful = {"bodies": [brick], "events": [{"at": 0.01, "fix": ["one"]}, {"at": 0.02, "remove": ["one"]}]}
    kinds: tuple[dict[str, Any], ...] = (
        {},
        {"contact.restitution": 0.0},
        {"contact.stiffness_scale": 2e-3, "time.end": 0.01},
        {"structures": [{"kind": "staircase", "block": "brick", "count": 4, "overlap": 0.011}]},
        rigid,
        {**rigid, "time.step": 5e-4, "contact.restitution": 0.6},
        {**rigid, "time.velocity_tolerance": 1e-5},
        {"contact.law": "hertz-mindlin", "contact.stiffness_scale": 0.01},
        {"bodies": [{**brick, "fixed": True}]},
        {"bodies": [{**brick, "velocity": [0.3, -0.2], "spin": 2.0}]},
        {"walls": [{"from": [0.15, 0.2], "to": [0.15, 0.0]}]},
        *({**scheme, **kind} for scheme in ({}, rigid) for kind in (profile, shaken, driven, eventful)),
    )
    release = {"ground.tilt": "50 deg", "start.release": "always"}
    settling = ({**settled, **release}, {**rigid, **settled}, {**rigid, **settled, **jerk})
    scenarios = [
        one
        for friction, some in ((0.25, (*kinds, *settling)), (0.35, kinds[:7]))
        for kind in some
        for one in collapses({"time.end": 0.03, "friction.block_block": friction, **kind})
    ]
    for end, scenario in zip(run_ensemble(scenarios, threads=2), scenarios, strict=True):
        assert_same(end, scenario)


@pytest.mark.parametrize("scheme", ["explicit", "nonsmooth"])
def test_a_pair_list_that_fills_up_on_the_way_changes_no_bit(scheme: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scenarios = [pushed_wall(4, 5, contact=WALL, time={"scheme": scheme, "end": end}) for end in (0.05, 0.06)]
    monkeypatch.setattr(build, "PAIRS_PER_BODY", 1)
    ends = run_ensemble(scenarios)
    monkeypatch.undo()
    for end, scenario in zip(ends, scenarios, strict=True):
        assert_same(end, scenario)


def test_members_that_cannot_be_built_or_fail_do_so_in_their_place_and_the_others_go_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    quick = {"time.end": 0.01}
    scenarios = collapses(
        quick,
        {**quick, "time.step": 1e-2},
        {**quick, "contact.skin": 4e-6},
        {**quick, "time.scheme": "nonsmooth"},
        {"time.end": 1.0, "time.scheme": "nonsmooth", "time.step": 1.0},
        {**quick, "contact.max_overlap": 1e-9},
        {**quick, "contact.restitution": 0.1},
    )
    ends = [end for batch in run_in_batches(scenarios) for end in batch]
    errors = [type(end.error) if isinstance(end, MemberFailure) else None for end in ends]
    assert errors == [None, StepError, SkinTooSmallError, None, StepError, None, None]
    assert [end.outcome.status == "failed" for end in ends] == [False, True, True, False, True, True, False]
    assert "largest safe step" in ends[1].outcome.reason
    assert "max_overlap" in ends[5].outcome.reason
    assert ends[1].outcome.exit_code == ExitCode.INVALID_INPUT
    for number in (0, 3, 5, 6):
        assert_same(ends[number], scenarios[number])
    with pytest.raises(StepError):
        run_ensemble(scenarios)
    monkeypatch.setattr(memory, "available_bytes", lambda: 1000)
    (end,) = next(run_in_batches(scenarios[:1]))
    assert isinstance(end, MemberFailure)
    assert isinstance(end.error, SceneTooLargeError)


TOPPLES: dict[str, Any] = {
    "schema": 1,
    "name": "topples",
    "materials": {"stone": {"density": 2500, "young_modulus": 3e10, "poisson_ratio": 0.2}},
    "blocks": {"b": {"width": 0.02, "height": 0.1, "length": 0.02, "material": "stone"}},
    "bodies": [{"block": "b", "x": 0, "y": 0.05}],
    "ground": {"tilt": "15 deg"},
    "friction": {"block_ground": 1.0},
    "contact": {"stiffness_scale": 1e-5},
    "time": {"end": 1},
}


@pytest.mark.parametrize(
    ("most", "status", "outcome"),
    [(5e-4, "finished", "fell"), (2.5e-4, "failed", None), (5e-3, "finished", "fell")],
    ids=["overlap where it lands", "overlap where it begins to turn", "no overlap"],
)
def test_a_run_that_an_overlap_ends_fell_where_it_had_fallen_and_else_has_no_outcome(
    most: float, status: str, outcome: str | None
) -> None:
    scenario = scenario_from_mapping({**TOPPLES, "contact": {"stiffness_scale": 1e-5, "max_overlap": most}})
    summary = simulate(scenario).summary
    assert summary.movement is not None
    assert (summary.status, summary.movement.values["outcome"]) == (status, outcome)
    is_stopped = summary.reason.startswith(STOPPED)
    assert is_stopped == any("stopped after the fall" in text for text in summary.warnings) == (most == 5e-4)
    assert_same(run_ensemble([scenario])[0], scenario)


def test_batches_take_no_more_scenarios_than_they_run(monkeypatch: pytest.MonkeyPatch) -> None:
    taken: list[int] = []

    def endless() -> Iterator[Scenario]:
        scenario = collapses({"time.end": 1e-3})[0]
        while True:
            taken.append(len(taken))
            yield scenario

    batches = run_in_batches(endless(), most=3)
    assert taken == []
    assert [len(next(batches)), len(next(batches))] == [3, 3]
    assert len(taken) <= 7
    monkeypatch.setattr(ensemble, "MOST_BODIES", 6)  # three a member
    assert len(next(run_in_batches(endless()))) == 2


def test_no_scenarios_give_no_ends_and_less_than_one_thread_or_member_is_refused() -> None:
    assert run_ensemble([]) == []
    for threads in (0, -1):
        with pytest.raises(ValueError, match=f"threads must be at least 1, not {threads}"):
            run_ensemble([], threads=threads)
    with pytest.raises(ValueError, match="members must be at least 1, not 0"):
        run_in_batches([], most=0)


SHIPPED = SCENARIOS / "three_blocks_nominal.toml"
FALLING = {"contact.stiffness_scale": 0.001, "time.end": 0.2, "output.every": 0.005}
both = pytest.mark.parametrize("scheme", ["explicit", "nonsmooth"])
PLACED = Model(load_scenario(SHIPPED)).bodies  # 32 mm wide, 50 mm high


def frame(**changes: float) -> np.ndarray:
    """Return a frame in which block 2 is off its start: dx, dy (mm), turn (degrees)."""
    motion = np.zeros((6, 3))
    motion[0], motion[1] = [body.x for body in PLACED], [body.y for body in PLACED]
    motion[:3, 1] += (changes.get("dx", 0.0) / 1e3, changes.get("dy", 0.0) / 1e3, np.radians(changes.get("turn", 0.0)))
    return motion


def seen(
    frames: Sequence[tuple[np.ndarray, float]],
    placed: Sequence[PlacedBody] = PLACED,
    support: MovingSupport = AT_REST,
    velocity: float = 0.0,
) -> Movement:
    """Return what a run has come to that had these frames, at these times (s)."""
    watch = Watch([placed], [support])
    for motion, time in frames:
        watch.follow([0], motion[None], [time])
    found = Movement.of(watch, frames[-1][0], (velocity, 0.0), frames[-1][1])
    assert found is not None
    return found


def ended(**end: float) -> Movement:
    return seen([(frame(), 0.0), (frame(**end), 0.1)])


def moving(speed: float = 0.0, spin: float = 0.0, support: float = 0.0) -> Movement:
    """Return what is told of a frame in which block 2 goes on at a speed (m/s) and a spin (rad/s)."""
    motion = frame()
    motion[3] = support
    motion[3, 1], motion[5, 1] = speed, spin
    return seen([(motion, 0.6)], velocity=support)


FIXED = tuple(body._replace(fixed=True) for body in PLACED)
AWAY = frame(dx=100.0, turn=100.0)
AWAY[0, 2] += 1e-4  # block 3, by 0.1 mm
TURNS = ((0.0, 0.0), (0.1, 0.1), (0.2, 12.0), (0.3, -5.0), (0.4, 0.0))
MOVEMENTS = {
    **{f"by {dx} mm": ended(dx=dx) for dx in (0.31, 0.33)},  # a hundredth of 32 mm is 0.32 mm
    **{f"by {turn} degrees": ended(turn=turn) for turn in (0.5, 0.7, -46.0)},  # half a diagonal is 29.7 mm
    **{f"up by {dy} mm": ended(dy=dy) for dy in (-15.0, -17.0, 17.0)},
    "back": seen([(frame(turn=turn), time) for time, turn in TURNS]),
    "fixed ones": seen([(frame(), 0.0), (AWAY, 100.0)], FIXED),
    "a fixed one, another by 0.1 mm": seen([(frame(), 0.0), (AWAY, 100.0)], (PLACED[0], FIXED[1], PLACED[2])),
    "at rest": moving(),
    **{f"at {speed} m/s": moving(speed) for speed in (0.005, 0.006)},  # 0.32 mm in a tenth of 0.6 s: 0.0053 m/s
    "riding on the table": moving(0.2, support=0.2),
    "turning": moving(spin=0.2),  # corners, half a diagonal from the centre
}


def test_movements_are_told_as_they_were_read(golden: Golden) -> None:
    texts = {name: ", ".join(f"{key} {value}" for key, value in one.values.items()) for name, one in MOVEMENTS.items()}
    golden("\n".join(f"{name}: {text}" for name, text in texts.items()), rules=["digits"])


def both_ways(scenarios: Sequence[Scenario]) -> list[Movement]:
    """Return how runs have moved, and assert that members of an ensemble say the same."""
    found = []
    for scenario, member in zip(scenarios, run_ensemble(scenarios, threads=1, peaks=True), strict=True):
        run = simulate(scenario)
        assert run.summary.movement is not None
        assert run.summary.movement.row == member.observables
        assert run.columns == member.columns
        found.append(run.summary.movement)
    return found


def rocking(spin: float = 2.0, **time: object) -> Scenario:
    """Return a block of 20 mm by 60 mm that starts to turn about its left corner (rad/s), and falls back."""
    block = {"block": "slab", "x": 0.0, "y": 0.03, "velocity": [-0.03 * spin, 0.01 * spin], "spin": spin}
    changes = {
        "blocks.slab": {"width": 0.02, "height": 0.06, "length": 0.05, "material": "aluminium"},
        "bodies": [block, {**block, "x": 1.0, "velocity": [0.0, 0.0], "spin": 0.0}],
        "structures": [],
        "friction.block_ground": 0.6,
        "contact.restitution": 0.0,
        **{f"time.{key}": value for key, value in time.items()},
    }
    return load_scenario(SHIPPED, {**FALLING, "output.every": 0.01, **changes})


def test_members_that_rock_back_are_told_from_those_that_stand() -> None:
    found = both_ways([rocking(), rocking(step=2e-6), rocking(end=0.005), rocking(spin=4.5, end=0.2)])
    # the last ones are caught on their way, the first of them long before it would be seen to go on
    assert [one.outcome for one in found] == [Response.ROCKED, Response.ROCKED, Response.SLID, Response.ROCKING]
    assert all(one.largest_rotation_deg > 0.5 for one in found)


def on_a_table(scheme: str, **motion: object) -> Scenario:
    """Return a block on a table that shakes by 6 mm, on which its friction holds it or does not."""
    friction = motion.pop("friction", 2.0)
    changes = {
        "blocks.brick.upright": "height",
        "bodies": [{"block": "brick", "x": 0.0, "y": 0.0125, "name": "1"}],
        "structures": [],
        "motion": {"kind": "harmonic", "amplitude": 0.006, "frequency": 5.0, "ramp": 0.05, **motion},
        "friction.block_ground": friction,
        "contact.stiffness_scale": 0.001,
        "time.scheme": scheme,
        "time.stop_at_rest": False,
        "time.end": 0.28,
        "output.every": 0.005,
    }
    return load_scenario(SHIPPED, changes)


@both
def test_what_rides_on_a_moving_table_has_not_moved(scheme: str) -> None:
    held, slides = on_a_table(scheme), on_a_table(scheme, friction=0.1)
    lifted = on_a_table(scheme, direction="90 deg", amplitude=0.03, frequency=1.0, ramp=0.2)
    found = both_ways([held, slides, lifted])
    assert [one.outcome for one in found] == ["stands", "slid", "stands"]
    for scenario, one in zip((held, slides, lifted), found, strict=True):
        assert np.hypot(*MovingSupport(Model(scenario)).way(0.28)) > 3e-3
        assert one.displacement_mm <= one.largest_displacement_mm + 1e-9
        assert (one.largest_displacement_mm > 0.25) == (one.outcome == "slid")


def test_removed_block_stays_where_it_was_on_the_table() -> None:
    support = MovingSupport(Model(on_a_table("explicit")))
    frames = [(frame(), 0.0)]
    for time in (0.14, 0.28):
        rides = frame()
        rides[0] += support.way(min(time, 0.14))[0]
        rides[3] = np.nan if time > 0.14 else 0.0
        frames.append((rides, time))
    assert abs(support.way(0.28)[0] - support.way(0.14)[0]) > 1e-3
    assert seen(frames, support=support).outcome == "stands"
