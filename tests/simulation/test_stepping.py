"""A scene stepped from Python goes as a run does, from a moment on too, and says where it cannot."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from blocksim import Simulation, load
from blocksim.errors import InvalidInputError
from blocksim.scenario import Scenario
from blocksim.simulation import loop, simulate
from blocksim.simulation.instruments import MOTION

ROOT = Path(__file__).parent.parent.parent
SCENES: dict[str, dict[str, Any]] = {
    "slide": {"contact.stiffness_scale": 0.01},
    "three_blocks": {"contact.stiffness_scale": 0.001, "time.end": 0.2, "output.every": 0.05},
    "three_blocks_nonsmooth": {"time.end": 0.3},
    "bounce": {"time.end": 0.2},
}


def scene(name: str) -> Scenario:
    return load(ROOT / "scenarios" / f"{name}.toml", SCENES[name])


def state(one: Simulation) -> list[list[float]]:
    return [one.bodies[name].tolist() for name in MOTION]


@pytest.mark.parametrize("name", SCENES)
def test_steps_of_any_number_end_where_a_run_does_to_the_same_bits(name: str) -> None:
    run = simulate(scene(name))
    one = Simulation(scene(name)).advance(steps=17)
    kept = one.copy()
    one.advance(steps=50).restore(kept)
    assert one.steps == 17
    one.advance(to=run.summary.simulated_time_s)
    assert one.steps == run.summary.steps
    for quantity in ("x", "y", "angle"):
        assert one.bodies[quantity].tolist() == getattr(run.frames, quantity)[-1].tolist()
    assert one.status == ("at rest" if run.summary.reason == "at rest" else "under way")
    assert one.energy() == run.summary.energy_J
    assert one.status == one.advance(steps=100).status


def test_events_happen_at_their_steps_and_again_after_a_moment_before_them() -> None:
    name = "three_blocks_nonsmooth"
    fixed = load(ROOT / "scenarios" / f"{name}.toml", {**SCENES[name], "events": [{"at": 0.05, "fix": ["2"]}]})
    run, one = simulate(fixed), Simulation(fixed).advance(to=0.02)
    kept = one.copy()
    for _ in range(2):
        one.restore(kept).advance(to=0.3)
        assert [event.step for event in one.events] == [event.step for event in run.summary.events]
        assert one.bodies.x.tolist() == run.frames.x[-1].tolist()


def test_a_moment_that_was_changed_goes_on_from_there_and_its_energy_is_booked() -> None:
    for name in ("slide", "bounce"):
        one = Simulation(scene(name)).advance(to=0.05)
        before, kept = one.energy(), one.copy()
        kept.bodies.vx[0] += 0.3
        kept.bodies.y[0] += 0.1
        after = one.restore(kept).energy()
        assert one.bodies.vx[0] == kept.bodies.vx[0]
        brought = after.kinetic + after.potential - before.kinetic - before.potential
        assert after.events == pytest.approx(-brought, abs=2e-3 * brought)  # springs that let go bring the rest
        assert one.advance(to=0.1).energy().relative_residual < 1e-3
        falls = 0.5 * 9.81 * 0.05**2
        assert one.bodies.y[0] == pytest.approx(kept.bodies.y[0] + 0.05 * kept.bodies.vy[0] - falls, abs=1e-4)


def test_what_cannot_be_restored_is_refused_and_changes_nothing() -> None:
    path = ROOT / "scenarios" / "three_blocks_nonsmooth.toml"
    one = Simulation(load(path, {"events": [{"at": 0.002, "fix": ["1"]}]})).advance(to=0.01)
    before, moved, lost = state(one), one.copy(), one.copy()
    moved.bodies.x[0] += 0.01
    lost.bodies.vy[1] = np.nan
    for moment, words in ((moved, "body 1 is not free"), (lost, r"body 2: .* finite")):
        with pytest.raises(InvalidInputError, match=words):
            one.restore(moment)
    other = Simulation(one.model.varied({"friction.block_block": 0.2}))
    for stranger in (other.copy(), Simulation(scene("slide")).copy(), one):
        with pytest.raises(InvalidInputError, match="same scenario"):
            one.restore(stranger)  # type: ignore[arg-type]
    for time in (np.nan, np.inf):
        with pytest.raises(ValueError, match="finite"):
            one.advance(to=time)
    with pytest.raises(TypeError, match="integer"):
        one.advance(steps=2.7)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="read-only"):
        one.bodies.x[1] = 0.0
    with pytest.raises(ValueError, match="before the present"):
        one.advance(to=0.0)
    assert state(one) == before
    one = Simulation(scene("three_blocks")).advance(steps=10)
    before, sunk = state(one), one.copy()
    sunk.bodies.y[1] -= 0.01
    with pytest.raises(loop.SteppingError, match="block 1 and block 2"):
        one.restore(sunk)
    assert state(one) == before
    assert one.advance(steps=10).steps == 20


STRUCK: dict[str, Any] = {  # by a heavy block without loss: impacts create energy meanwhile
    "schema": 1,
    "name": "struck",
    "materials": {
        name: {"density": density, "young_modulus": 1e9, "poisson_ratio": 0.3}
        for name, density in (("light", 2000.0), ("heavy", 20000.0))
    },
    "blocks": {name: {"width": 0.1, "height": 0.1, "length": 0.1, "material": name} for name in ("light", "heavy")},
    "bodies": [
        *({"block": "light", "x": 0.0, "y": 0.05 + 0.1 * level} for level in range(5)),
        {"block": "heavy", "x": 0.02, "y": 0.555, "velocity": [0.0, -1.0], "angle": "3 deg"},
    ],
    "time": {"scheme": "nonsmooth", "end": 0.5, "stop_at_rest": False},
    "contact": {"restitution": {"block_block": 1.0, "block_ground": 1.0}},
}


def test_where_calls_end_does_not_decide_whether_a_scene_goes_on() -> None:
    one, other = Simulation(STRUCK).advance(steps=9).advance(steps=1), Simulation(STRUCK).advance(steps=10)
    assert one.energy().impacts < -0.05 * one.energy().in_play
    assert state(one) == state(other)


@pytest.mark.parametrize("scheme", ["explicit", "nonsmooth"])
def test_threads_change_no_bit_of_steps_and_moments(scheme: str) -> None:
    row = [{"block": "light", "x": 0.15 * number, "y": 0.06} for number in range(250)]
    contact = {"stiffness_scale": 0.001} if scheme == "explicit" else {}
    many = {**STRUCK, "bodies": row, "time": {"scheme": scheme, "end": 0.5}, "contact": contact}
    alone, team = (Simulation(many, threads=threads) for threads in (1, 2))
    for one in (alone, team):
        moment = one.advance(steps=10).copy()
        moment.bodies.y[7] += 0.01
        one.restore(moment).advance(steps=10)
    assert state(alone) == state(team)


def test_contacts_of_a_rigid_block_that_was_put_elsewhere_press_no_more() -> None:
    stack = {**STRUCK, "bodies": STRUCK["bodies"][:2]}
    one = Simulation(stack).advance(steps=20)
    moment = one.copy()
    moment.bodies.x[1] += 1.0
    moment.bodies.y[1] += 0.2
    contacts = one.restore(moment).contacts()
    assert contacts[(contacts.body_a == "2") | (contacts.body_b == "2")].normal_force.sum() == 0.0
    assert one.advance(steps=20).energy().relative_residual < 1e-9


def test_beside_soil_velocities_can_be_changed_and_places_cannot() -> None:
    sand = {"density": 1800.0, "young_modulus": 1e6, "poisson_ratio": 0.3, "friction_angle": "30 deg"}
    corners = [[-0.2, 0.0], [-0.05, 0.0], [-0.05, 0.15], [-0.2, 0.15]]
    one = Simulation(
        {
            **STRUCK,
            "materials": {**STRUCK["materials"], "sand": sand},
            "bodies": STRUCK["bodies"][:1],
            "walls": [{"from": [-0.2, 0.5], "to": [-0.2, 0.0]}],
            "soils": [{"name": "backfill", "material": "sand", "outline": corners, "spacing": 0.0125}],
            "time": {"end": 0.1},
            "contact": {"stiffness_scale": 0.01},
        }
    ).advance(steps=10)
    moved, pushed = one.copy(), one.copy()
    moved.bodies.x[0] -= 0.002
    with pytest.raises(InvalidInputError, match="beside soil"):
        one.restore(moved)
    pushed.bodies.vx[0] += 0.1
    kinetic, events = one.energy().kinetic, one.energy().events
    ledger = one.restore(pushed).energy()
    assert events - ledger.events == pytest.approx(ledger.kinetic - kinetic)


def test_probes_are_those_of_a_run_also_after_going_back() -> None:
    probes = [{"kind": "point", "name": "corner", "body": "3", "at": ["16 mm", "25 mm"]}]
    watched = load(ROOT / "scenarios" / "three_blocks_nonsmooth.toml", {"time.end": 0.1, "probes": probes})
    run, one = simulate(watched), Simulation(watched).advance(to=0.03)
    kept = one.copy()
    one.advance(to=0.06).restore(kept).advance(to=0.1)
    (expected,), (series,) = run.probes.values(), one.probes.values()
    assert series.step.tolist() == expected.step.tolist()
    assert series["dx"].tolist() == expected["dx"].tolist()


def test_a_scene_that_fails_says_which_block_and_when() -> None:
    one = Simulation(scene("slide"))
    kept = one.copy()
    kept.bodies.vy[0] = -300.0
    with pytest.raises(loop.SteppingError, match=r"block block.*step"):
        one.restore(kept).advance(to=0.1)


def test_contacts_carry_the_weight_of_a_block_that_slides() -> None:
    one = Simulation(scene("slide")).advance(to=0.05)
    contacts = one.contacts()
    weight = 9.81 * 0.1089
    assert contacts.normal_force.sum() == pytest.approx(weight, rel=0.02)
    assert set(contacts.body_a) | set(contacts.body_b) == {"block", ""}
