"""Keys that rigid contacts do not have: a choice among springs is then a mistake."""

from collections.abc import Iterator

from blocksim.scenario.findings import Finding
from blocksim.scenario.models.contact import Contact
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.models.stepping import Nonsmooth
from blocksim.scenario.quantities import shown

CHOICES = ("model", "law")


def unfit_choices(scenario: Scenario) -> Iterator[Finding]:
    """Find contact model and force law that the non-smooth scheme does not have.

    Numbers of springs and dashpots are not refused, so that a scenario can be run by both schemes; they have no effect.
    """
    if not isinstance(scenario.time, Nonsmooth):
        return
    for name in CHOICES:
        chosen = getattr(scenario.contact, name)
        usual = Contact.model_fields[name].default
        if chosen != usual:
            message = f'{shown(chosen)} needs springs, time.scheme = "explicit"; here contacts are rigid'
            yield Finding(("contact", name), message, relation=True)
