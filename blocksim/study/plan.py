"""What a sweep varies, and the scenario of each of its cases."""

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

from blocksim.errors import BlocksimError, InvalidInputError
from blocksim.scenario import Document, Scenario
from blocksim.scenario.models.study import Sweep
from blocksim.scenario.overrides import Override, frozen
from blocksim.scenario.quantities import shown
from blocksim.simulation.provenance import run_hash

MOST_CASES = 20_000
Values = Iterable[object] | Mapping[str, object]  # a list, or { from, to, count }


@dataclass(frozen=True)
class Case:
    """One member of a sweep: the values of its keys, and its scenario or the reason why it has none."""

    settings: dict[str, object]
    scenario: Scenario | None
    problem: str = ""
    name: str = ""  # hash of its run


def with_sweep(
    document: Document,
    vary: Mapping[str, Values] | None,
    mode: str | None = None,
    labels: Mapping[str, str] | None = None,
) -> Document:
    """Return the document with another [sweep] table; mistakes in it are shown at the text that `labels` has for a key.

    Without `vary`, the document keeps the keys of its own table.
    """
    present = document.data.get("sweep")
    table = dict(present) if isinstance(present, Mapping) and not vary else {}
    overrides = list(document.overrides)
    for key, values in (vary or {}).items():
        table[key] = frozen(values) if isinstance(values, Mapping) else tuple(_plain(value) for value in values)
        text = (labels or {}).get(key, f"{key}={shown(table[key])}")
        overrides.append(Override(f"--vary {text}" if labels else "vary", text, ("sweep", key)))
    if mode is not None and table:
        table["mode"] = mode
        overrides.append(Override("--mode" if labels is not None else "mode", mode, ("sweep", "mode")))
    data = {**document.data, "sweep": table} if table else document.data
    return replace(document, data=data, overrides=tuple(overrides))


def _plain(value: object) -> object:
    """Return the Python number in a number of numpy's."""
    return value.item() if hasattr(value, "item") else value


def cases_of(document: Document, sweep: Sweep) -> "Cases":
    """Return all cases of a sweep. Raises InvalidInputError where they are too many or none can be simulated."""
    cases = Cases(document, sweep)
    if len(cases) > MOST_CASES:
        message = f"{len(cases)} cases are too many for one sweep; at most {MOST_CASES} are possible"
        raise InvalidInputError(message)
    if all(case.scenario is None for case in cases):  # looks no farther than to the first that can
        message = f"none of the {len(cases)} cases can be simulated; the first: {next(iter(cases)).problem}"
        raise InvalidInputError(message)
    return cases


@dataclass(frozen=True)
class Cases:
    """All cases of a sweep, in order; a scenario is made when it is asked for, and never kept."""

    document: Document
    sweep: Sweep

    def __len__(self) -> int:
        """Return how many cases there are."""
        counts = [len(values) for values in self.sweep.vary.values()]
        return math.prod(counts) if self.sweep.mode == "grid" else counts[0]

    def __iter__(self) -> Iterator[Case]:
        """Make one case after the other."""
        return map(self.case, self.settings())

    @property
    def keys(self) -> tuple[str, ...]:
        """The dotted keys that vary."""
        return tuple(self.sweep.vary)

    def settings(self) -> Iterator[dict[str, object]]:
        """Yield the values of every case, which costs next to nothing."""
        return combinations(self.sweep)

    def case(self, settings: dict[str, object]) -> Case:
        """Return the case with these values; mistakes that only show in the combination are kept in it."""
        return _case(self.document, settings)


def combinations(sweep: Sweep) -> Iterator[dict[str, object]]:
    """Return the values of every case: all combinations (`grid`) or the k-th value of every key (`list`)."""
    columns = sweep.vary.values()
    rows = itertools.product(*columns) if sweep.mode == "grid" else zip(*columns, strict=True)
    return (dict(zip(sweep.vary, row, strict=True)) for row in rows)


def _case(document: Document, values: dict[str, object]) -> Case:
    """Return the case with these values; mistakes that only show in the combination are kept in it."""
    try:
        scenario = document.with_values(values).build().model_copy(update={"sweep": None})
    except BlocksimError as error:
        return Case(values, None, problem=str(error).splitlines()[0])
    return Case(values, scenario, name=run_hash(scenario))
