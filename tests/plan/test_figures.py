"""The plan of the package decays by no figure that it was improved by."""

import pytest

from tests.plan.figures import measure, read_ceilings, read_package

FOUND = measure(read_package())


@pytest.mark.parametrize(("name", "ceiling"), read_ceilings().items())
def test_no_figure_of_the_plan_is_above_its_ceiling(name: str, ceiling: float) -> None:
    assert FOUND[name] <= ceiling
