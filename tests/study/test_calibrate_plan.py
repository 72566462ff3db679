"""Priors of what is fitted, and the scatter of inputs about it."""

import numpy as np
import pytest

from blocksim.scenario import Sweep
from blocksim.scenario.models.study import Normal, Uniform
from blocksim.study.calibrate_plan import FRESH, Prior, centre_on_fit, members_of, prior_of

FRICTION = Prior("friction.block_block.kinetic", 0.17, 0.31)
OVERLAP = Prior("structures.0.overlap", 9.5, 10.5, "mm")
SCALE = Prior("contact.stiffness_scale", 1e-3, 1.0, log=True)


def test_values_are_rounded_to_what_matters() -> None:
    assert FRICTION.value(0.192345678) == 0.1923
    assert OVERLAP.value(10.123456) == "10.123 mm"
    assert SCALE.value(0.00123456) == 0.001235


@pytest.mark.parametrize("prior", [FRICTION, OVERLAP, SCALE, Prior("gravity", 9.8149, 9.81507)])
def test_rounding_never_leaves_the_bounds(prior: Prior) -> None:
    for share in (0.0, 1e-9, 0.3, 1.0 - 1e-9, 1.0):
        assert prior.low <= prior.number(prior.value(prior.at(share))) <= prior.high


def test_logarithmic_priors_have_their_middle_in_the_logarithm() -> None:
    assert SCALE.at(0.5) == pytest.approx(10**-1.5)
    assert FRICTION.at(0.5) == pytest.approx(0.24)


def test_values_at_a_bound_are_noticed() -> None:
    assert FRICTION.lies_at_bound(0.17)
    assert FRICTION.lies_at_bound(0.3093)
    assert not FRICTION.lies_at_bound(0.172)
    assert SCALE.lies_at_bound(0.00105)
    assert not SCALE.lies_at_bound(0.01)


@pytest.mark.parametrize(
    ("written", "table", "expected"),
    [
        (0.17, Uniform(0.17, 0.31), Prior("key", 0.17, 0.31)),
        ("9.5 mm", Uniform(0.0095, 0.0105), Prior("key", 9.5, 10.5, "mm")),
        ("1e-2 m", Uniform(0.01, 0.02), Prior("key", 0.01, 0.02, "m")),
        ("18 deg", Uniform(0.3141592653589793, 0.4, angle=True), Prior("key", 18.0, 22.9183118052, "deg")),
    ],
)
def test_prior_keeps_the_unit_of_its_lower_end(written: object, table: Uniform, expected: Prior) -> None:
    assert prior_of("key", table, written) == expected


SCATTERED, KINETIC = "structures.0.overlap", "friction.block_block.kinetic"


def scatter(**tables: object) -> Sweep:
    keys = {"overlap": SCATTERED, "kinetic": KINETIC}
    return Sweep.model_validate({"mode": "sobol", **{keys[name]: table for name, table in tables.items()}})


NORMAL = scatter(overlap={"mean": "10 mm", "sd": "0.3 mm"}, kinetic={"from": 0.18, "to": 0.2})


def test_every_trial_has_the_same_points() -> None:
    one, other = (list(members_of(NORMAL, {"contact.restitution": e}, 16, 5)) for e in (0.2, 0.3))
    assert [row[SCATTERED] for row in one] == [row[SCATTERED] for row in other]
    assert len({row[SCATTERED] for row in one}) == 16
    assert {row["contact.restitution"] for row in other} == {0.3}


def test_fitted_key_scatters_about_its_fitted_value() -> None:
    rows = list(members_of(NORMAL, {KINETIC: 0.25}, 256, 5))
    values = np.array([float(str(row[KINETIC])) for row in rows])
    assert values.mean() == pytest.approx(0.25, abs=1e-4)
    assert 0.24 <= values.min() < 0.241
    assert 0.259 < values.max() <= 0.26
    assert len(rows[0]) == 2


def test_fitted_key_may_be_written_with_other_quotes_and_needs_no_scatter() -> None:
    rows = list(members_of(NORMAL, {'friction."block_block".kinetic': 0.25}, 4, 5))
    assert all(len(row) == 2 for row in rows)
    assert list(members_of(None, {KINETIC: 0.2}, 2, 0)) == [{KINETIC: 0.2}, {KINETIC: 0.2}]


@pytest.mark.parametrize(
    ("distribution", "drawn", "fitted", "expected"),
    [
        (Normal(0.01, 0.0003), 0.0103, "11 mm", 0.0113),
        (Uniform(0.2, 0.4), 0.25, 0.5, 0.45),
        (Uniform(0.01, 1.0, "log"), 1.0, 0.5, 5.0),
        (Normal(0.1, 0.02, angle=True), "0.12 rad", "0.3 rad", "0.32 rad"),
    ],
)
def test_scatter_is_moved_to_the_fitted_value(
    distribution: Normal | Uniform, drawn: object, fitted: object, expected: object
) -> None:
    moved = centre_on_fit(distribution, drawn, fitted)
    if isinstance(expected, str):
        assert isinstance(moved, str)
        assert float(moved.removesuffix(" rad")) == pytest.approx(0.32)
    else:
        assert moved == pytest.approx(expected)


def test_fresh_members_are_others_of_the_same_distribution() -> None:
    tried = [float(str(row[SCATTERED])) for row in members_of(NORMAL, {}, 64, 5)]
    fresh = [float(str(row[SCATTERED])) for row in members_of(NORMAL, {}, 4096, 5, FRESH)]
    assert not set(tried) & set(fresh)
    assert np.mean(fresh) == pytest.approx(0.01, abs=3 * 0.0003 / 64)
    assert np.std(fresh) == pytest.approx(0.0003, rel=0.05)
