"""The cases of a sweep: which values go together, and the scenario of each."""

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from blocksim.errors import BlocksimError
from blocksim.scenario import Document, Scenario
from blocksim.simulation.provenance import run_hash

Values = Mapping[str, object]


@dataclass(frozen=True)
class Case:
    """One member of a sweep: its values, and its scenario or the reason why it has none."""

    number: int
    values: dict[str, object]
    scenario: Scenario | None
    problem: str = ""

    @property
    def name(self) -> str:
        """Folder name of the case: the hash of its run, or its number where it has no scenario."""
        return run_hash(self.scenario) if self.scenario is not None else f"invalid-{self.number}"


def combinations(vary: Mapping[str, tuple[object, ...]], mode: str) -> Iterator[dict[str, object]]:
    """Return the values of every case: all combinations (`grid`) or the k-th value of every key (`list`)."""
    rows = itertools.product(*vary.values()) if mode == "grid" else zip(*vary.values(), strict=True)
    return (dict(zip(vary, row, strict=True)) for row in rows)


def build_case(document: Document, number: int, values: dict[str, object]) -> Case:
    """Return the case with these values; mistakes that only show in the combination are kept in it."""
    try:
        return Case(number, values, document.with_values(values).build())
    except BlocksimError as error:
        return Case(number, values, None, str(error).splitlines()[0])
