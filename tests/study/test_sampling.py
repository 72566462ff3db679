"""Drawn values: the distributions, and the points of every mode."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from blocksim.scenario import Document, Sweep
from blocksim.scenario.models.study import Normal, Uniform
from blocksim.study.plan import design_of, draw_values, open_interval, remarks
from tests.study.plans import OVERLAP, RATIO, SCALE, TILT, sweep_of

MIDDLES = (np.arange(10_000) + 0.5) / 10_000


def numbers(values: Normal | Uniform) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    return np.array(draw_values(values, MIDDLES), dtype=float)


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


def test_values_on_a_logarithmic_scale_fill_every_decade_evenly(nominal: Document) -> None:
    values = numbers(Uniform(0.001, 10.0, "log"))
    assert np.histogram(np.log10(values), bins=4, range=(-3.0, 1.0))[0].tolist() == [2500] * 4
    sweep = sweep_of(nominal, "grid", {SCALE: {"from": 0.001, "to": 1, "count": 4, "scale": "log"}})
    assert column(sweep, SCALE) == [0.001, 0.01, 0.1, 1.0]


def test_places_at_the_very_ends_give_finite_values() -> None:
    low, high = draw_values(Normal(0.0, 1.0), open_interval(np.array([0.0, 1.0])))
    assert -9.0 < float(str(low)) < -8.0
    assert 8.0 < float(str(high)) < 9.0


UNIT = {"from": 1, "to": 2}  # minus 1: the places themselves
SAMPLED = ("lhs", "sobol", "normal")


def column(sweep: Sweep, key: str) -> list[object]:
    return [row[key] for row in design_of(sweep)]


def places(document: Document, mode: str, samples: int, seed: int = 0) -> NDArray[np.float64]:
    """Return where in the unit square a mode puts its samples."""
    sweep = sweep_of(document, mode, {RATIO: UNIT, SCALE: UNIT}, samples=samples, seed=seed)
    return np.array([[row[RATIO], row[SCALE]] for row in design_of(sweep)], dtype=float) - 1.0


def correlation(points: NDArray[np.float64]) -> float:
    one, other = (points - points.mean(axis=0)).T
    return float(np.sum(one * other) / math.sqrt(np.sum(one * one) * np.sum(other * other)))


@pytest.mark.parametrize("samples", [1, 7, 100])
def test_a_latin_hypercube_has_one_value_in_every_interval(nominal: Document, samples: int) -> None:
    strata = np.floor(places(nominal, "lhs", samples) * samples).astype(int)
    assert [sorted(keys) for keys in strata.T] == [list(range(samples))] * 2


def test_the_columns_of_a_latin_hypercube_are_not_in_step(nominal: Document) -> None:
    assert abs(correlation(places(nominal, "lhs", 1000))) < 4 / math.sqrt(1000)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_first_two_sobol_dimensions_are_a_net(nominal: Document, seed: int) -> None:
    """A (0, 6, 2) net in base 2: every cell of 1/64 of the square, however long, has exactly one of 64 points."""
    points = places(nominal, "sobol", 64, seed)
    for bits in range(7):
        cells = np.floor(points * [2**bits, 2 ** (6 - bits)]).astype(int)
        assert len({(x, y) for x, y in cells}) == 64


def test_sobol_points_beyond_one_chunk_continue_the_sequence_and_unbalanced_numbers_are_reported(
    nominal: Document,
) -> None:
    long = places(nominal, "sobol", 5000)
    assert np.array_equal(long[:100], places(nominal, "sobol", 100))
    cells = np.floor(long[:4096] * 64).astype(int)
    assert len({(x, y) for x, y in cells}) == 4096
    drawn = [
        sweep_of(nominal, mode, {SCALE: UNIT}, samples=n) for mode, n in (("sobol", 100), ("sobol", 64), ("lhs", 100))
    ]
    assert [remarks(one) for one in drawn] == [["100 Sobol points are not balanced; 64 or 128 are"], [], []]


def test_independent_draws_are_uniform_and_uncorrelated(nominal: Document) -> None:
    n = 20_000
    points = places(nominal, "normal", n)
    assert np.abs(points.mean(axis=0) - 0.5).max() < 4 * math.sqrt(1 / 12 / n)
    assert abs(correlation(points)) < 4 / math.sqrt(n)
    ranks = np.sort(points[:, 0])
    assert np.abs(ranks - (np.arange(n) + 0.5) / n).max() < 1.95 / math.sqrt(n)  # Kolmogorov-Smirnov, 0.1 %


@pytest.mark.parametrize("mode", SAMPLED)
def test_the_same_seed_draws_the_same_and_another_does_not(nominal: Document, mode: str) -> None:
    one, same, other = (
        column(sweep_of(nominal, mode, {SCALE: UNIT}, samples=16, seed=seed), SCALE) for seed in (5, 5, 6)
    )
    assert one == same
    assert not set(one) & set(other)


FIRST = {  # from seed 0; another machine, or another version of scipy, has to draw the same
    "lhs": [(0.00997806719025, "0.0150627503951 rad"), (0.0096485136897, "0.00568704708097 rad")],
    "sobol": [(0.0100960435651, "0.00999242410775 rad"), (0.00948605085194, "0.00825796093011 rad")],
    "normal": [(0.00990748846648, "0.000488649724667 rad"), (0.0103717729413, "0.0135480266426 rad")],
}


@pytest.mark.parametrize("mode", SAMPLED)
def test_the_values_of_a_seed_stay_the_same_for_good(nominal: Document, mode: str) -> None:
    vary = {OVERLAP: {"mean": "10 mm", "sd": "0.3 mm"}, TILT: {"from": "0 deg", "to": "1 deg"}}
    design = design_of(sweep_of(nominal, mode, vary, samples=4))
    assert [tuple(row.values()) for row in (design[0], design[1])] == FIRST[mode]


@pytest.mark.parametrize("mode", SAMPLED)
def test_other_keys_their_order_and_more_samples_leave_values_as_they_are(nominal: Document, mode: str) -> None:
    """Sobol points have a dimension for each key: only a range added at the end leaves the others."""
    alone = column(sweep_of(nominal, mode, {SCALE: UNIT}, samples=16), SCALE)
    more = {RATIO: UNIT, TILT: ["0 deg", "1 deg"], SCALE: UNIT}
    among = {SCALE: UNIT, RATIO: UNIT} if mode == "sobol" else more
    assert column(sweep_of(nominal, mode, among, samples=16), SCALE) == alone
    if mode != "lhs":  # more samples begin with the same ones
        assert column(sweep_of(nominal, mode, {SCALE: UNIT}, samples=40), SCALE)[:16] == alone
    quoted = sweep_of(nominal, mode, {'contact."stiffness_scale"': UNIT}, samples=16)
    assert column(quoted, 'contact."stiffness_scale"') == alone


@pytest.mark.parametrize("mode", SAMPLED)
def test_levels_are_equally_likely(nominal: Document, mode: str) -> None:
    drawn = column(sweep_of(nominal, mode, {"time.scheme": ["explicit", "nonsmooth"]}, samples=1024), "time.scheme")
    spread = 4 * math.sqrt(1024) / 2 if mode == "normal" else 0
    assert abs(drawn.count("explicit") - 512) <= spread
    assert drawn.count("explicit") + drawn.count("nonsmooth") == 1024
