"""Distributions given beside a scenario, as options of a command or arguments of a function, checked as [sweep] is."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from blocksim.scenario import Document, Sweep
from blocksim.study.plan import Values, with_sweep


@dataclass(frozen=True)
class Variations:
    """What is said of each key, as a [sweep] table has it, and the text in which a person said it."""

    tables: Mapping[str, Values]
    texts: Mapping[str, str]

    @classmethod
    def of(cls, tables: Mapping[str, Values]) -> "Variations":
        """Take tables such as {"contact.restitution": {"from": 0.2, "to": 0.4}} from Python."""
        return cls(tables, {key: f"{key}={values}" for key, values in tables.items()})


def varied(document: Document, given: Variations, option: str, mode: str) -> Sweep:
    """Return the distributions, checked against the scenario.

    Raises ScenarioError that shows each mistake in the text given to `option`.
    """
    labelled = with_sweep(document, given.tables, mode, given.texts)
    overrides = [
        replace(one, label=one.label.replace("--vary", option, 1)) if one.path[:1] == ("sweep",) else one
        for one in labelled.overrides
    ]
    sweep = replace(labelled, overrides=tuple(overrides)).build().sweep
    assert sweep is not None  # noqa: S101 - it was just put there
    return sweep
