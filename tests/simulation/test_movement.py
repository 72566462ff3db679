"""How far blocks have moved, in what way, and which first."""

import math
from collections.abc import Sequence

import numpy as np
import pytest

from blocksim.scenario import PlacedBody, Scenario, load_scenario, place_bodies
from blocksim.simulation import simulate
from blocksim.simulation.ensemble import run_ensemble
from blocksim.simulation.observables import AT_REST, Movement, MovingSupport, Response, Watch
from tests.simulation.conftest import SCENARIOS

SHIPPED = SCENARIOS / "three_blocks_nominal.toml"
FALLING = {"contact.stiffness_scale": 0.001, "time.end": 0.2, "output.every": 0.005}
both = pytest.mark.parametrize("scheme", ["explicit", "nonsmooth"])
PLACED = place_bodies(load_scenario(SHIPPED))  # 32 mm wide, 50 mm high


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


@pytest.mark.parametrize(
    ("end", "manner"),
    [
        ({"dx": 0.31}, Response.STANDS),  # a hundredth of 32 mm is 0.32 mm
        ({"dx": 0.33}, Response.SLID),
        ({"turn": 0.5}, Response.STANDS),  # half a diagonal is 29.7 mm
        ({"turn": 0.7}, Response.SLID),
        ({"turn": -46.0}, Response.FELL),
        ({"dy": -15.0}, Response.SLID),
        ({"dy": -17.0}, Response.FELL),
        ({"dy": 17.0}, Response.SLID),
    ],
)
def test_manner_follows_from_the_end(end: dict[str, float], manner: Response) -> None:
    assert seen([(frame(), 0.0), (frame(**end), 0.1)]).outcome == manner


def test_block_that_comes_back_has_rocked_and_its_largest_turn_is_kept() -> None:
    turns = ((0.0, 0.0), (0.1, 0.1), (0.2, 12.0), (0.3, -5.0), (0.4, 0.0))
    found = seen([(frame(turn=turn), time) for time, turn in turns])
    assert (found.outcome, found.rotated_block, found.first_mover) == ("rocked back", "2", "2")
    assert (found.first_moved_s, found.largest_rotation_deg) == (0.2, pytest.approx(12.0))


def test_fixed_and_driven_blocks_are_not_the_ones_that_moved() -> None:
    fixed = tuple(body._replace(fixed=True) for body in PLACED)
    frames = [(frame(), 0.0), (frame(dx=100.0, turn=100.0), 100.0)]
    found = seen(frames, fixed)
    assert (found.outcome, found.first_mover) == ("stands", None)
    frames[1][0][0, 2] += 1e-4
    found = seen(frames, (PLACED[0], fixed[1], PLACED[2]))
    assert (found.displaced_block, found.largest_rotation_deg) == ("3", 0.0)
    assert found.largest_displacement_mm == pytest.approx(0.1)


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


@pytest.mark.parametrize(
    ("speed", "spin", "support", "fastest", "moves_on"),
    [
        (0.0, 0.0, 0.0, 0.0, False),
        (0.005, 0.0, 0.0, 0.005, False),  # 0.3 mm in a tenth of 0.6 s; a hundredth of 32 mm is 0.32 mm
        (0.006, 0.0, 0.0, 0.006, True),
        (0.2, 0.0, 0.2, 0.0, False),  # it rides on the table
        (0.0, 0.2, 0.0, 0.1 * math.hypot(0.032, 0.05), True),  # its corners, half a diagonal from the centre
    ],
)
def test_a_block_moves_on_that_would_soon_have_left_its_place(
    speed: float, spin: float, support: float, fastest: float, *, moves_on: bool
) -> None:
    motion = frame()
    motion[3] = support
    motion[3, 1], motion[5, 1] = speed, spin
    found = seen([(motion, 0.6)], velocity=support)
    assert found.fastest_m_s == pytest.approx(fastest, rel=1e-5)
    assert found.moves_on is moves_on


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
        assert np.hypot(*MovingSupport(scenario).way(0.28)) > 3e-3
        assert one.displacement_mm <= one.largest_displacement_mm + 1e-9
        assert (one.largest_displacement_mm > 0.25) == (one.outcome == "slid")


def test_removed_block_stays_where_it_was_on_the_table() -> None:
    support = MovingSupport(on_a_table("explicit"))
    frames = [(frame(), 0.0)]
    for time in (0.14, 0.28):
        rides = frame()
        rides[0] += support.way(min(time, 0.14))[0]
        rides[3] = np.nan if time > 0.14 else 0.0
        frames.append((rides, time))
    assert abs(support.way(0.28)[0] - support.way(0.14)[0]) > 1e-3
    assert seen(frames, support=support).outcome == "stands"
