"""No block passes through what it meets: it rebounds as it should, or the run ends with exit code 76 and names both."""

from collections.abc import Mapping, Sequence
from math import hypot
from typing import Any

import numpy as np
import pytest

from blocksim.errors import ExitCode
from blocksim.scenario import Scenario
from blocksim.scenario.motion import displacement_and_velocity, motion_pieces
from blocksim.simulation import Frames, run_ensemble, simulate
from blocksim.simulation.results import Result
from blocksim.verification.scene import scenario_of

WIDTH, HEIGHT = 0.032, 0.025  # m, of the block that is thrown
LONG = 0.4  # m, of the plate that it is thrown at
GAP = 3e-3  # m
FACE = 0.5  # m, place of the face that it is thrown at
BODIES = {"fixed": "block 2", "free": "block 2", "wall": "a wall", "ground": "the ground", "profile": "the ground"}
stiffnesses = pytest.mark.parametrize("scale", [1.0, 1e-3, 1e-5])


def scene(
    bodies: Sequence[Mapping[str, object]],
    end: float,
    contact: Mapping[str, object],
    time: Mapping[str, object] | None = None,
    **tables: Any,
) -> Scenario:
    """Return a scenario without friction, and without gravity unless that is among the tables."""
    return scenario_of(
        bodies,
        friction={"block_block": 0.0, "block_ground": 0.0},
        contact={"restitution": 1.0, **contact},
        time={"end": end, "stop_at_rest": False, **(time or {})},
        output={"every": end / 40},
        **{"gravity": 0.0, **tables},
    )


def plate(thickness: float = 1e-3, *, fixed: bool = True) -> dict[str, object]:
    """Return a plate whose upper face the block is thrown at."""
    return {"y": FACE - 0.5 * thickness, "width": LONG, "height": thickness, "fixed": fixed}


def thrown(what: str, speed: float, *, thickness: float = 0.01, angle: float = 0.0, **contact: object) -> Scenario:
    """Throw a block down at a plate of some thickness, at a wall that lies flat, or at the ground; elastic."""
    face = 0.0 if what == "ground" else FACE
    radius = 0.5 * (hypot(WIDTH, HEIGHT) if angle else HEIGHT)
    bodies: list[dict[str, object]] = [{"y": face + GAP + radius, "velocity": [0.0, -speed], "angle": angle}]
    tables: dict[str, Any] = {}
    if what in {"fixed", "free"}:
        bodies.append(plate(thickness, fixed=what == "fixed"))
    elif what == "wall":
        tables["walls"] = [{"from": [-LONG, face], "to": [LONG, face]}]
    elif what == "profile":
        tables["ground"] = {"profile": [[-LONG, face], [LONG, face]]}
    return scene(bodies, 0.1 / speed, contact, **tables)


def frames_of(result: Result) -> Frames:
    assert result.held is not None
    return result.held


def stays_or_says(result: Result, other: str, side: float, limit: str = "contact.max_overlap") -> None:
    """Check that block 1 has never been below what it met, or that the run has failed and names both and the limit."""
    y = frames_of(result).y
    assert np.all(y[:, 0] > (y[:, 1] if y.shape[1] > 1 else side))
    if result.status != "finished":
        assert result.summary.exit_code == ExitCode.NUMERICAL_FAILURE
        assert f"an overlap exceeds {limit} (block 1 and {other} by " in result.reason


@pytest.mark.parametrize("what", BODIES)
@stiffnesses
def test_block_rebounds_or_the_run_ends_whatever_its_speed(what: str, scale: float) -> None:
    """A block at 50 m/s could be beyond a plate of 1 mm between two steps, and one at 1 km/s beyond a wall."""
    finished = 0
    for thickness in (1e-3, 1e-1) if what in {"fixed", "free"} else (1e-2,):
        for speed in (1.0, 60.0, 1000.0):
            result = simulate(thrown(what, speed, thickness=thickness, stiffness_scale=scale))
            stays_or_says(result, BODIES[what], 0.0 if what == "ground" else FACE)
            if result.status == "finished":
                share = thickness * LONG / (thickness * LONG + WIDTH * HEIGHT) if what == "free" else 1.0
                assert frames_of(result).vy[-1, 0] == pytest.approx(speed * (2.0 * share - 1.0), abs=0.01 * speed)
                finished += 1
    assert finished > 0 or scale < 1e-3


@pytest.mark.parametrize("limit", [2e-3, 1.0])
@pytest.mark.parametrize("what", ["fixed", "free", "wall"])
def test_limit_of_overlap_that_is_too_large_lets_nothing_through(what: str, limit: float) -> None:
    for speed, scale, angle in ((20.0, 1e-3, 0.0), (20.0, 1e-3, 0.6), (300.0, 1e-5, 0.0), (300.0, 1e-5, 1.2)):
        scenario = thrown(what, speed, thickness=1e-3, angle=angle, max_overlap=limit, stiffness_scale=scale)
        result = simulate(scenario)
        stays_or_says(result, BODIES[what], FACE - 0.2 * HEIGHT)
        if what != "wall":  # which has no other side, so that a block may sink into it by half of its own
            assert "mm, more than half of a side of 1 mm, step " in result.reason


@pytest.mark.parametrize("model", ["kernel", "particles"])
@pytest.mark.parametrize("what", BODIES)
def test_particles_do_not_lose_one_another(model: str, what: str) -> None:
    """Deeper than a boundary reaches they would: with the usual limit a row of discs passes through another."""
    is_thick = what in {"wall", "ground", "profile"}  # so that five percent of a side are more than discs reach
    lost = "0.75 contact.particle_spacing, 0.75 mm, beyond which particles lose one another"
    limit = lost if model == "particles" and is_thick else "contact.max_overlap"
    for speed, scale in ((20.0, 1e-3), (1000.0, 1e-5)):
        contact: dict[str, Any] = {"model": model, "particle_spacing": 1e-3, "stiffness_scale": scale}
        stays_or_says(simulate(thrown(what, speed, **contact)), BODIES[what], 0.0 if what == "ground" else FACE, limit)


@pytest.mark.parametrize("spin", [30.0, 1e4])
@stiffnesses
def test_rod_that_swings_does_not_pass_through_a_plate(spin: float, scale: float) -> None:
    """Its centre rests; only its end is fast."""
    rod = {"y": FACE, "width": 0.2, "height": 1e-3, "spin": spin}
    target = {"x": 0.09, "y": FACE + 0.01, "width": 0.05, "height": 1e-3, "fixed": True}
    result = simulate(scene([rod, target], 0.5 / spin, {"stiffness_scale": scale}))
    assert np.max(frames_of(result).rotation[:, 0]) < 0.15  # where it meets the plate: 0.1
    assert result.status == "finished" or "(block 1 and block 2 by " in result.reason


@pytest.mark.parametrize("gravity", [0.0, 1e-6])
def test_plates_that_are_shaken_strike_a_rigid_block_between_them_and_do_not_pass_through(gravity: float) -> None:
    """Plates of 0.5 mm move by 13 mm in a step of 1 ms, and the block is 2 mm wide."""
    gap, restitution = 4.75e-3, 0.5
    plates = [{"x": x, "y": 0.03, "width": 5e-4, "height": 0.04, "fixed": True} for x in (-6e-3, 6e-3)]
    motion = {"kind": "harmonic", "amplitude": 0.02, "frequency": 100.0, "ramp": 1e-3}
    bodies = [{"y": 0.03, "width": 2e-3, "height": 2e-3}, *plates]
    rigid = {"scheme": "nonsmooth"}
    scenario = scene(bodies, 4e-3, {"restitution": restitution}, rigid, motion=motion, gravity=gravity)
    frames = frames_of(simulate(scenario))
    assert np.max(np.abs(frames.x[:, 0] - frames.x[:, 1:].mean(axis=1))) < gap * (1.0 + 1e-3)
    moved, _ = displacement_and_velocity(motion_pieces(scenario), frames.time)
    met = int(np.argmax(moved > gap))
    pieces = np.linspace(frames.time[met - 1], frames.time[met], 100_001)
    moved, speed = displacement_and_velocity(motion_pieces(scenario), pieces)
    struck = (1.0 + restitution) * float(speed[np.argmax(moved > gap)])
    assert frames.vx[met, 0] == pytest.approx(struck, rel=1e-3)


@pytest.mark.parametrize("speed", [1.0, 1000.0])
def test_forced_step_in_which_a_block_could_pass_ends_the_run(speed: float) -> None:
    bodies: list[dict[str, object]] = [{"y": FACE + 0.05, "velocity": [0.0, -speed]}, plate()]
    result = simulate(scene(bodies, 0.2 / speed, {}, {"step": 1e-3 / speed, "force_step": True}))
    assert result.summary.exit_code == ExitCode.NUMERICAL_FAILURE
    told = "moves too far in one step for its contacts to be detected (the fastest is block 1 with"
    assert f"{told} {speed:.3g}" in result.reason
    safe = number_after("m/s, while", result.reason)
    assert result.reason.endswith(f"while {safe:.3g} m/s are safe: shorten time.step, step 0)")
    for share, is_detected in ((0.99, True), (1.01, False)):
        step = share * safe / speed * result.summary.time_step_s
        again = simulate(scene(bodies, 0.2 / speed, {}, {"step": step, "force_step": True}))
        assert ("moves too far in one step" not in again.reason or again.summary.steps > 0) == is_detected


def number_after(words: str, reason: str) -> float:
    return float(reason.partition(words)[2].split()[0])


RIGID = {"scheme": "nonsmooth"}
SQUEEZED = "an overlap is as deep as one step takes at"


def squeezed(direction: tuple[float, float], speed: float, time: Mapping[str, object]) -> Scenario:
    """Return a block between two of 10 000 times its mass that close in on it, without gravity; elastic."""
    small, big, gap = 0.05, 0.5, 0.05
    far, length = 0.5 * (small + big) + gap, 1e-4 * (big / small) ** 2
    bodies = [
        {
            "x": place * direction[0],
            "y": 5.0 + place * direction[1],
            "velocity": [rate * direction[0], rate * direction[1]],
            "width": size,
            "height": size,
            "length": depth,
        }
        for place, rate, size, depth in (
            (-far, speed, big, 1.0),
            (0.0, 0.0, small, length),
            (far + gap, -speed, big, 1.0),
        )
    ]
    return scene(bodies, 0.1, {"impacts": "sequential"} if "scheme" in time else {}, time)


@pytest.mark.parametrize("direction", [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0)])
def test_light_block_that_heavy_ones_make_faster_than_foreseen_ends_the_run_with_the_step_that_helps(
    direction: tuple[float, float],
) -> None:
    """It gains twice their speed at every blow, up to 141 times: no bound of speed before the start contains that."""
    for speed in (2.0, 8.0):
        scenario = squeezed(direction, speed, RIGID)
        result = simulate(scenario)
        assert (result.status, result.summary.exit_code) == ("failed", ExitCode.NUMERICAL_FAILURE)
        assert result.reason.startswith(SQUEEZED)
        assert "contact.max_overlap" not in result.reason
        assert "(block " in result.reason
        met, safe = number_after(SQUEEZED, result.reason), number_after("while", result.reason)
        assert met > 2.0 * safe > 2.0 * speed
        (end,) = run_ensemble([scenario])
        assert end.outcome.reason == result.reason
        shorter = simulate(squeezed(direction, speed, {**RIGID, "step": number_after("time.step to", result.reason)}))
        place = (frames_of(shorter).x + frames_of(shorter).y) * sum(direction)
        assert shorter.status == "finished"
        assert np.all(np.diff(place, axis=1) > 0.0)


def test_springs_that_a_squeezed_block_compresses_too_far_name_their_limit_as_no_step_changes_it() -> None:
    time: dict[str, object] = {}
    for _ in range(2):
        result = simulate(squeezed((1.0, 0.0), 8.0, time))
        assert result.reason.startswith("an overlap exceeds contact.max_overlap (block 2 and block 3 by 2.5")
        time = {"step": 0.25 * result.summary.time_step_s}


def test_block_that_is_driven_into_the_ground_has_not_fallen() -> None:
    """It falls by 20 mm, is struck and would end 45 mm lower; half of its side is 25 mm."""
    small, big, drop = 0.05, 0.5, 0.02
    bodies: list[dict[str, object]] = [
        {"y": 0.5 * small + drop, "width": small, "height": small, "length": 1e-4 * (big / small) ** 2},
        {"y": small + drop + 0.05 + 0.5 * big, "width": big, "height": big, "length": 1.0, "velocity": [0.0, -0.5]},
    ]
    time: dict[str, object] = {**RIGID}
    for reason in (SQUEEZED, "impacts created more than 5% of the energy in play"):  # the second with a shorter step
        scenario = scene(bodies, 0.2, {}, time, gravity=9.81)
        summary = simulate(scenario).summary
        assert summary.movement is not None
        assert (summary.status, summary.movement.values["outcome"]) == ("failed", None)
        assert summary.reason.startswith(reason)
        (end,) = run_ensemble([scenario])
        assert (end.outcome.reason, end.observables["outcome"]) == (summary.reason, None)
        if reason == SQUEEZED:
            time["step"] = number_after("time.step to", summary.reason)


def test_run_ends_at_the_same_step_whatever_its_outputs_and_says_the_same_in_an_ensemble() -> None:
    """Also where frames are wanted at every step: the overlap is then found at the last step of a compiled call."""
    scenario = thrown("fixed", 60.0, stiffness_scale=1e-3)
    whole = simulate(scenario)
    step = whole.summary.time_step_s
    for every in (step, 7.0 * step, 1.0):
        output = scenario.output.model_copy(update={"every": every})
        result = simulate(scenario.model_copy(update={"output": output}))
        assert result.reason == whole.reason
        assert result.summary.final_state_sha256 == whole.summary.final_state_sha256
    (end,) = run_ensemble([scenario])
    assert end.outcome.reason == whole.reason
    cut = scenario.time.model_copy(update={"end": step * (whole.summary.steps - 1)})  # found at the very last step
    assert simulate(scenario.model_copy(update={"time": cut})).status == "failed"
