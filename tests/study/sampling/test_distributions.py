"""Values drawn have the distribution that was asked for."""

import math

import numpy as np
import pytest

from blocksim.scenario import Document
from blocksim.scenario.models.variation import Normal, Uniform
from blocksim.study.sampling import design_of, drawn, open_interval
from tests.study.sampling.plans import OVERLAP, SCALE, sweep_of

MIDDLES = (np.arange(10_000) + 0.5) / 10_000


def numbers(values: Normal | Uniform) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    return np.array(drawn(values, MIDDLES), dtype=float)


def test_normal_values_have_mean_and_standard_deviation() -> None:
    values = numbers(Normal(0.01, 0.0003))
    assert values.mean() == pytest.approx(0.01, rel=1e-9)
    assert values.std() == pytest.approx(0.0003, rel=1e-3)
    assert np.mean(values < 0.01 + 0.0003) == pytest.approx(0.8413447, abs=1e-4)


def test_independent_normal_draws_scatter_as_such_draws_do(nominal: Document) -> None:
    n = 4000
    sweep = sweep_of(nominal, "normal", {OVERLAP: {"mean": "10 mm", "sd": "0.3 mm"}}, samples=n)
    values = np.array([row[OVERLAP] for row in design_of(sweep)], dtype=float)
    assert abs(values.mean() - 0.01) < 4 * 0.0003 / math.sqrt(n)
    assert abs(values.std(ddof=1) - 0.0003) < 4 * 0.0003 / math.sqrt(2 * n)


@pytest.mark.parametrize(("low", "high"), [(0.5, math.inf), (-math.inf, 0.5), (-1.0, 2.0), (4.0, 5.0)])
def test_truncated_values_stay_inside_and_keep_the_shape(low: float, high: float) -> None:
    """Inside the bounds the distribution function is that of the normal one, scaled (Phi by the error function)."""

    def phi(z: float) -> float:
        return 0.5 * math.erfc(-z / math.sqrt(2.0))

    values = numbers(Normal(0.0, 1.0, low, high))
    assert values.min() >= low
    assert values.max() <= high
    share = [(phi(z) - phi(low)) / (phi(high) - phi(low)) for z in values[::500].tolist()]
    assert share == pytest.approx(MIDDLES[::500], abs=1e-9)


def test_uniform_values_fill_their_interval_evenly() -> None:
    values = numbers(Uniform(2.0, 6.0))
    assert np.histogram(values, bins=8, range=(2.0, 6.0))[0].tolist() == [1250] * 8


def test_values_on_a_logarithmic_scale_fill_every_decade_evenly() -> None:
    values = numbers(Uniform(0.001, 10.0, "log"))
    assert np.histogram(np.log10(values), bins=4, range=(-3.0, 1.0))[0].tolist() == [2500] * 4


def test_angles_keep_their_unit_and_numbers_twelve_digits() -> None:
    assert drawn(Uniform(0.0, 1.0, angle=True), np.array([1 / 3])) == ["0.333333333333 rad"]
    assert drawn(Normal(1.0, 0.1), np.array([0.5])) == [1.0]


def test_places_at_the_very_ends_give_finite_values() -> None:
    low, high = drawn(Normal(0.0, 1.0), open_interval(np.array([0.0, 1.0])))
    assert -9.0 < float(str(low)) < -8.0
    assert 8.0 < float(str(high)) < 9.0


def test_ranges_on_a_logarithmic_scale_are_evenly_spaced_there(nominal: Document) -> None:
    sweep = sweep_of(nominal, "grid", {SCALE: {"from": 0.001, "to": 1, "count": 4, "scale": "log"}})
    assert [row[SCALE] for row in design_of(sweep)] == [0.001, 0.01, 0.1, 1.0]
