"""Capacities of actuators: peak, bound of statics, directions, and how slow a run was."""

from typing import Any

import pytest

import blocksim
from blocksim.scenario import Scenario, scenario_from_mapping
from blocksim.study.capacity import bound_of

WIDTH, HEIGHT = 0.1, 0.2  # m
WEIGHT = 1000 * WIDTH * HEIGHT * 0.1 * 9.81  # N
THERE_AND_BACK = {  # at rest at zero, where a block that goes on is struck by its other edge
    "kind": "table",
    "times": [0.0, 2.0, 4.0, 6.0, 8.0, 10.0],
    "displacements": [0.0, 0.005, 0.0, 0.0, -0.005, 0.0],
}
CYCLES = {"kind": "cycles", "amplitudes": ["5 mm"], "rate": "5 mm/s"}


def rocked(path: dict[str, Any], **tables: Any) -> Scenario:
    """Return a slender block that an actuator pushes at its head."""
    data: dict[str, Any] = {
        "schema": 1,
        "name": "a",
        "materials": {"oak": {"density": 1000, "young_modulus": 1e9, "poisson_ratio": 0.3}},
        "blocks": {"b": {"width": WIDTH, "height": HEIGHT, "length": 0.1, "material": "oak"}},
        "bodies": [{"block": "b", "name": "b", "x": 0.0, "y": 0.5 * HEIGHT}],
        "friction": {"block_ground": 2.0},
        "contact": {"restitution": 0.0},
        "start": {"settle": True},
        "time": {"scheme": "nonsmooth", "stop_at_rest": False},
        "output": {"every": "5 ms"},
        "actuators": [{"name": "jack", "body": "b", "point": [0, 0.5 * HEIGHT], "displacement": path}],
    }
    return scenario_from_mapping({**data, **tables})


def test_a_rocking_block_has_the_peak_of_statics_in_both_directions() -> None:
    """W b/2h; where it is pushed farther it falls as W (b/2 - x/2) does, x at half of the height."""
    answer = blocksim.capacity(blocksim.run(rocked(THERE_AND_BACK)))
    push, pull = answer.all
    assert (push.sense, pull.sense) == ("push", "pull")
    for one, sign in ((push, 1.0), (pull, -1.0)):
        assert one.bound == pytest.approx(0.5 * WEIGHT * WIDTH / HEIGHT, rel=1e-6)
        assert one.peak == pytest.approx(one.bound, rel=0.01)
        assert 0.0 < sign * one.displacement < 1e-3
        assert not one.exceeds
    assert answer.to_frame()["peak"].tolist() == [push.peak, pull.peak]
    picture = answer.plot("capacity")._repr_png_()
    assert picture is not None
    assert picture.startswith(b"\x89PNG")


def test_statics_bounds_push_and_pull_of_a_lopsided_block_by_its_own_edges() -> None:
    """A triangle with its right angle below: its centroid is a third of the width from one edge."""
    wedge = {"outline": [[0, 0], [0.1, 0], [0, 0.2]], "depth": 0.1, "material": "oak"}
    jacks = [{"body": "b", "point": [-0.033, 0.0], "displacement": CYCLES}]
    bodies = [{"block": "b", "name": "b", "x": 0.0, "y": 0.2 / 3}]
    scenario = rocked(CYCLES, blocks={"b": wedge}, bodies=bodies, actuators=jacks)
    (jack,) = scenario.actuators
    weight, arm = 0.5 * WEIGHT, 0.2 / 3
    assert bound_of(scenario, jack, 1.0) == pytest.approx(weight * (0.2 / 3) / arm, rel=1e-6)
    assert bound_of(scenario, jack, -1.0) == pytest.approx(weight * (0.1 / 3) / arm, rel=1e-6)


def test_softening_is_where_the_force_has_fallen_to_0_8_of_the_peak() -> None:
    """A block that turns by t carries W (b/2 cos t - h/2 sin t) / (h cos t + b/2 sin t) at its head."""
    answer = blocksim.capacity(blocksim.run(rocked({"kind": "ramp", "to": "20 mm", "rate": "5 mm/s"})))
    (one,) = answer.all
    lever = 1.0 / WIDTH + 0.8 * 0.5 * WIDTH / HEIGHT**2  # for small angles
    assert one.fallen == pytest.approx(0.2 / lever, rel=0.02)
    assert answer.warnings == ()


def test_an_actuator_keeps_its_own_record_beside_a_probe_of_another_name() -> None:
    probes = [{"kind": "actuator", "actuator": "jack", "name": "fine", "every": "1 ms"}]
    result = blocksim.run(rocked({"kind": "ramp", "to": "1 mm", "rate": "5 mm/s"}, probes=probes))
    assert {*result.probes} == {"fine", "jack"}
    assert [one.actuator for one in blocksim.capacity(result).all] == ["jack"]


def test_a_run_that_is_not_slow_is_warned_of() -> None:
    answer = blocksim.capacity(blocksim.run(rocked({"kind": "ramp", "to": "30 mm", "rate": "500 mm/s"})))
    assert "a lower rate is nearer to statics" in answer.warnings[0]


def test_a_jolt_above_the_bound_of_statics_is_warned_of() -> None:
    """A block that passes zero at speed is struck by its other edge."""
    answer = blocksim.capacity(blocksim.run(rocked(CYCLES)))
    assert [one.exceeds for one in answer.all] == [False, True]
    assert "pull has its peak" in answer.warnings[-1]


def test_the_bound_of_statics_is_there_whatever_blocks_weigh() -> None:
    """A block a thousand times as large in all directions, 10^5 times as dense."""
    large = {"b": {"width": 1e3 * WIDTH, "height": 1e3 * HEIGHT, "length": 100.0, "material": "oak"}}
    bodies = [{"block": "b", "name": "b", "x": 0.0, "y": 0.5e3 * HEIGHT}]
    jacks = [{"body": "b", "point": [0, 0.5e3 * HEIGHT], "displacement": CYCLES}]
    dense = {"oak": {"density": 1e8, "young_modulus": 1e9, "poisson_ratio": 0.3}}
    scenario = rocked(CYCLES, blocks=large, bodies=bodies, actuators=jacks, materials=dense)
    assert bound_of(scenario, scenario.actuators[0], 1.0) == pytest.approx(0.5e14 * WEIGHT * WIDTH / HEIGHT, rel=1e-6)


def test_dashpots_that_carry_a_part_of_the_force_are_warned_of() -> None:
    springs = {"time": {"scheme": "explicit", "stop_at_rest": False}, "output": {"every": "0.2 ms"}}
    shares = []
    for restitution in (0.0, 0.9):
        contact = {"restitution": restitution, "stiffness_scale": 1e-3}
        path = {"kind": "ramp", "to": "1 mm", "rate": "50 mm/s"}
        answer = blocksim.capacity(blocksim.run(rocked(path, contact=contact, **springs)))
        shares.append(answer.all[0].dashpot_share)
        assert any("dashpots of contacts" in text for text in answer.warnings) == (shares[-1] > 0.01)
    assert shares[0] > 0.1
    assert 0.0 < shares[1] < 0.01


def test_a_curve_that_still_rises_at_its_end_is_warned_of() -> None:
    springs = {"time": {"scheme": "explicit", "stop_at_rest": False}}
    soft = {"contact": {"restitution": 0.0, "stiffness_scale": 1e-4}}
    answer = blocksim.capacity(
        blocksim.run(rocked({"kind": "ramp", "to": "0.2 mm", "rate": "0.1 mm/s"}, **springs, **soft))
    )
    assert any("still rises" in text for text in answer.warnings)
    assert answer.all[0].stiffness > 0.0
