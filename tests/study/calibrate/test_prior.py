"""Priors: values that are tried stay within them, and are written as a person wrote the range."""

import pytest

from blocksim.scenario.models.variation import Uniform
from blocksim.study.calibrate_plan import Prior, prior_of, si_number

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


def test_si_number_of_values_with_and_without_unit() -> None:
    assert si_number("10.12 mm") == 0.01012
    assert si_number(0.1923) == 0.1923
