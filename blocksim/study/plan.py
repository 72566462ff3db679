"""What a sweep varies, the scenario of each of its cases, and what they will cost."""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import islice
from statistics import fmean

import numpy as np

from blocksim.errors import BlocksimError, InvalidInputError, ScenarioError
from blocksim.scenario import Document, Scenario, Sweep, scenario_hash
from blocksim.scenario.check import mistakes_of_value
from blocksim.scenario.findings import Finding
from blocksim.scenario.keys import parse_key
from blocksim.scenario.models.motions import TABLED
from blocksim.scenario.models.variation import Normal, Variation, written
from blocksim.scenario.overrides import Override, frozen, with_value
from blocksim.scenario.quantities import shown
from blocksim.simulation.provenance import run_hash
from blocksim.study.design import Design, MadeOnDemand, Settings, read_columns, refuse_wrong_values
from blocksim.study.rows import Head, check_experiment, heads_of
from blocksim.study.sampling import design_of, remarks

MOST_CASES = 1_000_000
TABLE = "table"  # last part of keys that name a file
MOST_LOOKED_AT = 1_000
"""Cases that are built in search of one that can be simulated, before anything runs."""
Values = Iterable[object] | Mapping[str, object]  # a list, { from, to, count }, { from, to } or { mean, sd }
LOOKED_AT = 32
"""Cases that are built to estimate all of them."""
SMALL_FILES = 12_000
"""Bytes of the files beside run.h5 in the folder of a case."""
ROW, ROW_OF_BLOCK = 570, 230
"""Bytes of a case in manifest and table, and more for each block; three blocks and three keys take 1.25 kB."""


@dataclass(frozen=True)
class Case:
    """One member of a sweep: the values of its keys, and its scenario or the reason why it has none."""

    settings: Settings
    scenario: Scenario | None
    problem: str = ""
    name: str = ""  # hash of its run


@dataclass(frozen=True)
class Cases(MadeOnDemand[Case]):
    """All cases of a sweep; each is made when it is asked for, and none is kept."""

    document: Document
    design: Design
    heads: tuple[Head, ...]  # of the varied keys in the table

    def __len__(self) -> int:
        """Return the number of cases."""
        return len(self.design)

    def row(self, number: int) -> Case:
        """Return one case."""
        values = self.design[number]
        try:
            scenario = self.document.with_values(values).build()
        except BlocksimError as error:  # mistakes that only show in the combination
            return Case(values, None, problem=str(error).splitlines()[0])
        return Case(values, scenario, name=run_hash(scenario))


def _plain(value: object) -> object:
    """Return a number of numpy's as Python has it."""
    return value.item() if hasattr(value, "item") else value


def with_sweep(
    document: Document,
    vary: Mapping[str, Values] | None,
    mode: str | None = None,
    *,
    samples: int | None = None,
    seed: int | None = None,
) -> Document:
    """Return the document with another [sweep] table; mistakes in it are shown at the texts of Variations.

    Without `vary`, the document keeps the keys of its own table. Where the mode is "table", the file is read and its
    columns take its place as lists. Raises ScenarioError, InputMissingError or InvalidInputError for a wrong table.
    """
    present = document.data.get("sweep")
    table = dict(present) if isinstance(present, Mapping) and not vary else {}
    overrides = list(document.overrides)
    for key, values in (vary or {}).items():
        table[key] = frozen(values) if isinstance(values, Mapping) else tuple(map(_plain, values))
        text = vary.texts[key] if isinstance(vary, Variations) else f"{key}={shown(table[key])}"
        label = f"--vary {text}" if isinstance(vary, Variations) else "vary"
        overrides.append(Override(label, text, ("sweep", key)))
    own = {"mode": mode, "samples": samples, "seed": seed}
    for name, value in own.items():
        if value is not None and table:
            table[name] = value
            label = f"--{name}" if isinstance(vary, Variations) else name
            overrides.append(Override(label, f"{name}={value}", ("sweep", name)))
    data = {**document.data, "sweep": table} if table else document.data
    return _with_table_read(replace(document, data=data, overrides=tuple(overrides)))


def _with_table_read(document: Document) -> Document:
    """Put the columns of a table of cases into the document, as lists."""
    present = document.data.get("sweep")
    if not isinstance(present, Mapping) or present.get("mode") != "table":
        return document
    sweep = document.build().sweep
    if sweep is None or sweep.table is None:
        return document
    columns = read_columns(sweep.table)
    refuse_wrong_values(document, columns)
    lists = {column.key: tuple(column.values) for column in columns}
    return replace(document, data={**document.data, "sweep": {"mode": "list", **lists}})


def cases_of(document: Document, sweep: Sweep) -> Cases:
    """Return all cases of a sweep, which are made one by one.

    Raises InvalidInputError where they are too many or none can be simulated, ScenarioError where a distribution
    gave a value that its key cannot have.
    """
    design = design_of(sweep)
    if len(design) > MOST_CASES:
        message = f"{len(design)} cases are too many for one sweep; at most {MOST_CASES} are allowed"
        raise InvalidInputError(message)
    refuse_wrong_draws(document, sweep, design)
    cases = Cases(_for_cases(document), design, heads_of(sweep))
    looked_at = min(len(cases), MOST_LOOKED_AT)
    if all(case.scenario is None for case in islice(cases, looked_at)):
        which = f"none of the {len(cases)} cases" if looked_at == len(cases) else f"none of the first {looked_at} cases"
        message = f"{which} can be simulated; the first: {cases[0].problem}"
        raise InvalidInputError(message)
    return cases


def _for_cases(document: Document) -> Document:
    """Return the document that cases are made from: no sweep, and tables found, or read, once for all of them."""
    scenario = document.build()
    data = document.without_sweep().data
    if scenario.experiment is not None:
        data = {**data, "experiment": {"table": scenario.experiment.table}}
    if isinstance(scenario.motion, TABLED):
        data, _ = with_value(data, ("motion", "table"), scenario.motion.table)
    return replace(document, data=data)


def refuse_wrong_draws(document: Document, sweep: Sweep, design: Design) -> None:
    """Try the least and the greatest value that was drawn from each normal distribution."""
    findings = []
    for key, values in sweep.vary.items():
        if not isinstance(values, Normal):
            continue
        drawn = [float(str(value).removesuffix(" rad")) for value in design.columns[key]]
        for end in (min(drawn), max(drawn)):
            mistakes = mistakes_of_value(document.data, document.folder, key, written(end, angle=values.angle))
            for message in dict.fromkeys(one.message for one in mistakes):  # one number may set two keys
                text = f"drawn: {message}; cut the distribution with from and to"
                findings.append(Finding(("sweep", key), text))
    if findings:
        raise ScenarioError([document.problem(finding) for finding in findings])


def table_digests(document: Document, vary: Mapping[str, Variation]) -> dict[str, list[str]]:
    """Return a hash of what a scenario with each of the files is that varied keys name, by key and in order.

    A plan that is named by the paths alone would take rows of one record for those of another one of the same name.
    """
    bare = document.without_sweep()
    digests: dict[str, list[str]] = {}
    for key, values in vary.items():
        for value in values if parse_key(key)[-1] == TABLE and isinstance(values, tuple) else ():
            digest = ""
            with suppress(BlocksimError):  # the case says so
                digest = scenario_hash(bare.with_values({key: value}).build())
            digests.setdefault(key, []).append(digest)
    return digests


@dataclass(frozen=True)
class Variations(Mapping[str, Values]):
    """What is said of each key, as a [sweep] table has it, and the text in which a person said it."""

    tables: Mapping[str, Values]
    texts: Mapping[str, str]

    @classmethod
    def of(cls, tables: Mapping[str, Values]) -> "Variations":
        """Take tables such as {"contact.restitution": {"from": 0.2, "to": 0.4}} from Python, or what is typed."""
        if isinstance(tables, cls):
            return tables
        return cls(tables, {key: f"{key}={values}" for key, values in tables.items()})

    def __getitem__(self, key: str) -> Values:
        """Return what is said of a key."""
        return self.tables[key]

    def __iter__(self) -> Iterator[str]:
        """Yield the keys."""
        return iter(self.tables)

    def __len__(self) -> int:
        """Return the number of keys."""
        return len(self.tables)


def varied(document: Document, given: Variations, option: str, mode: str) -> Sweep:
    """Return the distributions, checked against the scenario.

    Raises ScenarioError that shows each mistake in the text given to `option`.
    """
    labelled = with_sweep(document, given, mode)
    overrides = [
        replace(one, label=one.label.replace("--vary", option, 1)) if one.path[:1] == ("sweep",) else one
        for one in labelled.overrides
    ]
    sweep = replace(labelled, overrides=tuple(overrides)).build().sweep
    assert sweep is not None  # noqa: S101 - it was just put there
    return sweep


@dataclass(frozen=True)
class Estimate:
    """Cases of a sweep and what they cost, from the steps of some of them and the measured speed of a step."""

    cases: int
    looked_at: int
    impossible: int  # of those looked at
    reason: str  # why the first impossible one is
    seconds: float  # of solving all cases on one core, at most: as if none came to rest before its end
    bytes: int  # of all that the sweep writes, at most
    memory: int  # bytes of one process that runs a case, of the largest case looked at
    stop_at_rest: int  # cases of those looked at that end before, where they come to rest
    remarks: tuple[str, ...]


def estimate(document: Document, *, keep_cases: bool = False) -> Estimate:
    """Return what the sweep of a document comes to, with all frames of every case or without; nothing is written.

    Raises what building the document, its plan or a scene raises, InvalidInputError where nothing is varied.
    """
    from blocksim.world.describe import describe  # noqa: PLC0415 - the solver, which reading a sweep does not need

    base = document.build()
    if base.sweep is None:
        message = "nothing to vary: give --vary KEY=VALUES, or a [sweep] table in the scenario"
        raise InvalidInputError(message)
    check_experiment(base)
    cases = cases_of(document, base.sweep)
    if len(cases) > LOOKED_AT:  # a random choice: evenly spaced ones may meet one value of a key only
        drawn = np.random.default_rng(0).choice(len(cases), LOOKED_AT, replace=False)
        chosen = [cases[number] for number in sorted(drawn.tolist())]
    else:
        chosen = list(cases)
    described = [describe(case.scenario) for case in chosen if case.scenario is not None]
    problems = [case.problem for case in chosen if case.scenario is None]
    share = len(described) / len(chosen)
    rows = [ROW + ROW_OF_BLOCK * len(one.bodies) + keep_cases * (one.bytes + SMALL_FILES) for one in described]
    return Estimate(
        cases=len(cases),
        looked_at=len(chosen),
        impossible=len(problems),
        reason=problems[0] if problems else "",
        seconds=share * len(cases) * fmean([one.seconds for one in described] or [0.0]),
        bytes=round(share * len(cases) * fmean(rows or [0.0])),
        memory=max((one.memory for one in described), default=0),
        stop_at_rest=sum(case.scenario.time.stop_at_rest for case in chosen if case.scenario is not None),
        remarks=tuple(remarks(base.sweep)),
    )
