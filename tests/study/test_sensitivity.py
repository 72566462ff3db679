"""Sensitivity of scenarios: a slide whose indices are known, failed runs, outcomes."""

import math
from pathlib import Path

import pytest

from blocksim.errors import InvalidInputError
from blocksim.scenario import Document
from blocksim.study.plan import Values
from blocksim.study.sensitivity import Sensitivity, TooManyFailuresError, sensitivity

SCENARIOS = Path(__file__).parents[2] / "scenarios"
SPEED, FRICTION = "bodies.0.velocity.0", "friction.block_ground"
SOFT = {"contact.stiffness_scale": 0.001}


def found(name: str, vary: dict[str, Values], method: str, samples: int, **values: object) -> Sensitivity:
    document = Document.read(SCENARIOS / f"{name}.toml").with_values({**SOFT, **values})
    return sensitivity(document, vary, method=method, samples=samples)


def moments(low: float, high: float, power: int) -> float:
    """Return the mean of x**power, x uniform."""
    if power == -1:
        return math.log(high / low) / (high - low)
    return float((high ** (power + 1) - low ** (power + 1)) / ((power + 1) * (high - low)))


def test_indices_of_a_slide_are_those_of_its_formula() -> None:
    # x = v^2 / (2 mu g), a product of independent factors A = v^2 and B = 1 / (2 mu g):
    # V = E[A]^2 V[B] + E[B]^2 V[A] + V[A] V[B], and the first two are those of friction and speed alone
    v, mu, g = (0.4, 0.6), (0.3, 0.4), 9.81
    mean_a, var_a = moments(*v, 2), moments(*v, 4) - moments(*v, 2) ** 2
    mean_b = moments(*mu, -1) / (2 * g)
    var_b = moments(*mu, -2) / (2 * g) ** 2 - mean_b**2
    alone = {SPEED: mean_b**2 * var_a, FRICTION: mean_a**2 * var_b}
    variance = sum(alone.values()) + var_a * var_b

    result = found("slide", {SPEED: {"from": v[0], "to": v[1]}, FRICTION: {"from": mu[0], "to": mu[1]}}, "sobol", 128)
    assert (result.runs, result.failed, result.left_out) == (512, 0, 0)
    x = result.outputs[0]
    assert (x.name, x.unit) == ("x of block block", "mm")
    assert x.mean == pytest.approx(1e3 * mean_a * mean_b, rel=0.01)
    assert x.sd == pytest.approx(1e3 * variance**0.5, rel=0.05)
    for index, key in enumerate(result.keys):
        assert abs(x.numbers["S1"][index] - alone[key] / variance) <= x.numbers["± S1"][index]
        total = 1.0 - (variance - alone[key] - var_a * var_b) / variance
        assert abs(x.numbers["ST"][index] - total) <= x.numbers["± ST"][index]


def test_measured_quantities_and_outcome_are_looked_at() -> None:
    vary: dict[str, Values] = {
        "friction.block_block.kinetic": {"from": 0.17, "to": 0.31},
        "structures.0.overlap": {"mean": "10 mm", "sd": "0.3 mm"},
    }
    result = found("three_blocks", vary, "morris", 4)
    names = [output.name for output in result.outputs]
    assert names[:3] == ["x of block 1", "x of block 2", "x of block 3"]
    assert names[-2:] == ["measured outcome 0/-90/-90", "inside all measured ranges"]
    assert not result.outputs[0].numbers
    block_2 = result.outputs[names.index("x of block 2")]
    kinetic, _ = block_2.numbers["mu"]
    assert kinetic < -5.0  # more friction stops it sooner, by millimetres


def test_blocks_of_the_design_with_a_failed_run_are_left_out_and_counted() -> None:
    vary: dict[str, Values] = {
        "friction.block_ground": {"from": 0.3, "to": 0.4},
        "bodies.0.y": ["12.5 mm", "12.5 mm", "12.5 mm", "12.5 mm", "12.5 mm", "12.5 mm", "12.5 mm", "11 mm"],
    }
    result = found("slide", vary, "sobol", 16)
    assert 0 < result.failed < result.runs
    assert 0 < result.left_out < result.blocks == 16
    assert "ground" in result.first_problem
    assert result.outputs[0].numbers


def test_too_many_failures_and_one_block_are_refused() -> None:
    vary: dict[str, Values] = {"bodies.0.y": ["12.5 mm", "11 mm"]}
    with pytest.raises(TooManyFailuresError, match="base samples; no indices can be computed"):
        found("slide", vary, "sobol", 8)
    with pytest.raises(InvalidInputError, match="1 trajectories are too few; at least 2"):
        found("slide", {FRICTION: {"from": 0.3, "to": 0.4}}, "morris", 1)
