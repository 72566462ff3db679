"""Student's quantiles against an independent implementation."""

import pytest
from scipy import stats

from blocksim.analysis.student import central_probability, quantile


@pytest.mark.parametrize("degrees", [1, 2, 3, 4, 5, 6, 9, 30, 101])
@pytest.mark.parametrize("probability", [0.001, 0.3, 0.5, 0.75, 0.975, 0.9995])
def test_quantile_agrees_with_scipy(degrees: int, probability: float) -> None:
    expected = float(stats.t.ppf(probability, degrees))
    assert quantile(probability, degrees) == pytest.approx(expected, rel=1e-11, abs=1e-12)


@pytest.mark.parametrize("degrees", [1, 2, 5, 8])
def test_probability_agrees_with_scipy(degrees: int) -> None:
    expected = float(stats.t.cdf(1.7, degrees) - stats.t.cdf(-1.7, degrees))
    assert central_probability(1.7, degrees) == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize(("probability", "degrees"), [(0.0, 5), (1.0, 5), (0.975, 0)])
def test_quantile_without_meaning_is_refused(probability: float, degrees: int) -> None:
    with pytest.raises(ValueError, match="degree of freedom"):
        quantile(probability, degrees)
