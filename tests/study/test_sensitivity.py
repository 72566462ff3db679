"""Indices of known functions and of scenarios: failed runs, outcomes."""

import math
from collections.abc import Callable, Mapping

import numpy as np
import pytest

from blocksim.scenario import Document
from blocksim.scenario.models.study import Normal, Uniform, Variation
from blocksim.study.plan import Values
from blocksim.study.sensitivity import (
    METHODS,
    Floats,
    Indices,
    ModelOutput,
    Sensitivity,
    TooManyFailuresError,
    indices_of,
    sensitivity,
    settings_at,
)
from tests.study.conftest import SCENARIOS

SOFT = {"contact.stiffness_scale": 0.001}


def found(name: str, vary: dict[str, Values], method: str, samples: int, **values: object) -> Sensitivity:
    document = Document.read(SCENARIOS / f"{name}.toml").with_values({**SOFT, **values})
    return sensitivity(document, vary, method=method, samples=samples)


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
        "bodies.0.y": [*["12.5 mm"] * 7, "11 mm"],
    }
    result = found("slide", vary, "sobol", 16)
    assert 0 < result.failed < result.runs
    assert 0 < result.left_out < result.blocks == 16
    assert "ground" in result.first_problem
    assert result.outputs[0].numbers


def test_too_many_failures_are_refused() -> None:
    vary: dict[str, Values] = {"bodies.0.y": ["12.5 mm", "11 mm"]}
    with pytest.raises(TooManyFailuresError, match="base samples; no indices can be computed"):
        found("slide", vary, "sobol", 8)


Function = Callable[..., Floats]


def indices(method: str, function: Function, vary: Mapping[str, Variation], samples: int, seed: int = 0) -> Indices:
    chosen = METHODS[method]
    points = chosen.points(len(vary), samples, seed)
    rows = [[float(str(value)) for value in row.values()] for row in settings_at(points, vary)]
    return indices_of(ModelOutput("y", "mm", function(*np.array(rows).T)), points, chosen, seed)


def ishigami(x: Floats, y: Floats, z: Floats) -> Floats:
    return np.sin(x) + 7.0 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x)


def assert_within_confidence(found: Indices, column: str, exact: list[float]) -> None:
    for index, (value, half, wanted) in enumerate(
        zip(found.numbers[column], found.numbers[f"± {column}"], exact, strict=True)
    ):
        assert abs(value - wanted) <= half + 1e-6, (column, index, value, half, wanted)
        assert half < 0.12


def test_sobol_indices_of_the_ishigami_function() -> None:
    # V = a^2/8 + b pi^4/5 + b^2 pi^8/18 + 1/2 with a = 7, b = 0.1 (Ishigami and Homma 1990)
    b = 0.1
    first, second = 0.5 * (1 + b * math.pi**4 / 5) ** 2, 7.0**2 / 8
    both = b**2 * math.pi**8 * (1 / 18 - 1 / 50)
    variance = first + second + both
    found = indices("sobol", ishigami, dict.fromkeys("xyz", Uniform(-math.pi, math.pi)), 1024)
    assert found.sd**2 == pytest.approx(variance, rel=0.02)
    assert_within_confidence(found, "S1", [first / variance, second / variance, 0.0])
    assert_within_confidence(found, "ST", [(first + both) / variance, second / variance, both / variance])


def test_morris_effects_of_a_plane_are_its_slopes_over_the_ranges() -> None:
    found = indices("morris", lambda x, y, z: 2.0 * x - 3.0 * y + 0.0 * z, {
        "x": Uniform(0.0, 5.0), "y": Uniform(1.0, 2.0), "z": Uniform(0.0, 1.0)
    }, 8)  # fmt: skip
    assert found.numbers["mu"] == pytest.approx((10.0, -3.0, 0.0), abs=1e-9)
    assert found.numbers["mu*"] == pytest.approx((10.0, 3.0, 0.0), abs=1e-9)
    assert found.numbers["sigma"] == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)


def test_morris_stays_off_the_infinite_ends_of_a_normal_distribution() -> None:
    points = METHODS["morris"].points(1, 8, 0)
    values = [float(str(row["x"])) for row in settings_at(points, {"x": Normal(0.0, 1.0)})]
    assert max(map(abs, values)) == pytest.approx(2.5758, abs=1e-3)  # the 99.5 % quantile


@pytest.mark.parametrize("method", sorted(METHODS))
def test_designs_are_whole_blocks_in_the_unit_cube_which_a_seed_repeats(method: str) -> None:
    for keys in (1, 2, 7):
        points = METHODS[method].points(keys, 5, 0)
        assert points.shape == (5 * (keys + METHODS[method].more_rows), keys)
        assert points.min() >= 0.0
        assert points.max() <= 1.0
    vary = dict.fromkeys("xyz", Uniform(-math.pi, math.pi))
    first, same, other = (indices(method, ishigami, vary, 8, seed) for seed in (0, 0, 7))
    assert first == same
    assert first != other


@pytest.mark.parametrize("method", sorted(METHODS))
def test_result_that_does_not_vary_has_no_indices(method: str) -> None:
    found = indices(method, lambda x, y: 16.0 + 1e-6 * x + 0.0 * y, dict.fromkeys("xy", Uniform(0.0, 1.0)), 4)
    assert found.numbers == {}
