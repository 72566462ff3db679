"""The plan of the package decays by no figure that it was improved by."""

from tests.plan.figures import measure, read_ceilings, read_package


def test_no_figure_of_the_plan_is_above_its_ceiling() -> None:
    found = measure(read_package())
    above = {name: found[name] for name, ceiling in read_ceilings().items() if found[name] > ceiling}
    assert above == {}
