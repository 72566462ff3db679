"""What a sweep varies: values that are typed, given or drawn, the scenario of each case, what all will cost."""

import functools
import hashlib
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import fmean
from typing import cast

import numpy as np
from numpy.typing import NDArray

from blocksim.errors import BlocksimError, InvalidInputError, Problem, ScenarioError
from blocksim.extras import load_module
from blocksim.options import Option
from blocksim.scenario import Document, Model, Scenario, Sweep, overrides, units
from blocksim.scenario.check import MAX_VARIED, trial_of, variation_fault
from blocksim.scenario.input_files import NUMBER, TableCell, raise_problems, read_table
from blocksim.scenario.mistakes import Mistake
from blocksim.scenario.models.motion import TABLED
from blocksim.scenario.models.study import SIGNIFICANT, Normal, Uniform, Variation, toml_number
from blocksim.simulation.provenance import run_hash
from blocksim.study.rows import Head, check_experiment, heads_of

Settings = dict[str, object]  # dotted key and value of everything that one case sets
LARGEST_FILE = 20_000_000  # bytes
MOST_TRIED = 50  # different values of a column that are tried by themselves, beside its least and its greatest number
HEAD = re.compile(r"(?P<key>.*?)\s*(?:\[(?P<unit>[^\]]*)\])?")
WHOLE = re.compile(r"[+-]?[0-9]{1,18}")


@dataclass(frozen=True)
class Design:
    """The settings of cases, made from one column of values a key; each when it is asked for, and none is kept.

    The k-th case has the k-th value of every key, or, in a grid, every value comes with all values of the others; the
    last key changes fastest.
    """

    columns: Mapping[str, Sequence[object]]
    is_grid: bool = False

    def __len__(self) -> int:
        """Return the number of cases; where these are no combinations, all columns are equally long."""
        lengths = [len(column) for column in self.columns.values()]
        return math.prod(lengths) if self.is_grid else lengths[0]

    def __getitem__(self, number: int) -> Settings:
        number, settings = range(len(self))[number], {}
        for key, column in reversed(list(self.columns.items())):
            number, place = divmod(number, len(column)) if self.is_grid else (number, number)
            settings[key] = column[place]
        return {key: settings[key] for key in self.columns}

    def __iter__(self) -> Iterator[Settings]:
        return map(self.__getitem__, range(len(self)))


def levels_of(values: Variation) -> tuple[object, ...]:
    """Return the values of a list; a distribution, which no mode without samples accepts, has none to list."""
    return values if isinstance(values, tuple) else ()


@dataclass(frozen=True)
class CaseColumn:
    """One column: the key that it varies, its head, and cell and value of every row."""

    key: str
    head: TableCell
    cells: Sequence[TableCell]
    values: Sequence[object]


def read_columns(path: Path) -> list[CaseColumn]:
    """Read the columns of a table. Raises InputMissingError or InvalidInputError with the lines of all mistakes."""
    rows = read_table(path, limit=LARGEST_FILE)
    heads = rows.heads
    problems = list(rows.problems)
    if not rows.rows and not problems:
        problems.append(rows.header.problem("no row follows the header; every row is one case"))
    if len(heads) > MAX_VARIED:
        problems.append(rows.header.problem(f"{len(heads)} columns are too many; at most {MAX_VARIED} can be varied"))
    columns = [_column(head, [row[head.text] for row in rows.rows], problems) for head in heads]
    keys = [column.key for column in columns]
    problems += [c.head.problem("key given twice") for i, c in enumerate(columns) if c.key in keys[:i]]
    if problems:
        raise_problems(problems)
    return columns


def _column(head: TableCell, cells: Sequence[TableCell], problems: list[Problem]) -> CaseColumn:
    found = HEAD.fullmatch(head.text)
    key, unit = (head.text, None) if found is None else (found["key"], found["unit"])
    complaint = variation_fault(key)
    if unit is not None and not complaint:
        try:
            units.parse_quantity(f"1 {unit}", units.LENGTH)
        except ValueError as error:
            complaint = str(error)
    if complaint:
        problems.append(head.problem(complaint))
        return CaseColumn(key, head, cells, ())
    values = []
    for cell in cells:
        try:
            values.append(_cell_value(cell, unit))
        except ValueError as error:
            problems.append(cell.problem(str(error)))
    return CaseColumn(key, head, cells, values)


def _cell_value(cell: TableCell, unit: str | None) -> object:
    """Return a cell as a scenario takes it; raises ValueError with a message for the user."""
    if not cell.text:
        raise ValueError("this cell is empty")
    if unit is not None:
        cell.number()
        return f"{cell.text} {unit}"
    if WHOLE.fullmatch(cell.text):
        return int(cell.text)
    return cell.number() if NUMBER.fullmatch(cell.text) else _word(cell.text)


@functools.lru_cache(maxsize=1024)
def _word(text: str) -> object:
    value = overrides.parse_value(text)
    kinds: dict[type, str] = {list: "list", dict: "table"}
    if type(value) in kinds:
        raise ValueError(f"a cell holds one value, not a {kinds[type(value)]}")
    return value


def refuse_wrong_values(document: Document, columns: Iterable[CaseColumn]) -> None:
    """Try the values of each column by themselves; raises InvalidInputError with the cells of all wrong ones.

    Tried are the first different values, and the ends of all numbers.
    """
    problems: list[Problem] = []
    tried = trial_of(document.data, document.folder)
    for column in columns:
        path = overrides.parse_key(column.key)
        places = {value: index for index, value in reversed(list(enumerate(column.values)))}
        numbers = [(cell.number(), index) for index, cell in enumerate(column.cells) if NUMBER.fullmatch(cell.text)]
        ends = [min(numbers)[1], max(numbers)[1]] if numbers else []
        findings = [
            (index, finding)
            for index in dict.fromkeys((*sorted(places.values())[:MOST_TRIED], *ends))
            for finding in tried(path, column.values[index], ("sweep", column.key))
        ]
        of_key = next((column.head.problem(one.message) for _, one in findings if one.at == "key"), None)
        problems += [of_key] if of_key else [column.cells[index].problem(one.message) for index, one in findings]
    if problems:
        raise_problems(list(dict.fromkeys(problems)))


Places = NDArray[np.float64]  # numbers u with 0 < u < 1, shape (samples,)
LEAST = 2.0**-54  # places stay this far away from 0, and one rounding from 1: the normal distribution is infinite there
WORD_BYTES = 4
DIMENSIONS = 128
"""Dimensions that are scrambled, however few are used: so those in use do not depend on how many they are."""
BITS = 30
CHUNK = 4096  # points made at a time; a power of two


def draw_values(values: Variation, places: Places) -> Sequence[object]:
    """Return the value at each place: numbers in SI, angles as texts in rad, levels as they were written."""
    if isinstance(values, tuple):  # equally likely levels
        return [values[index] for index in np.minimum(places * len(values), len(values) - 1).astype(int).tolist()]
    low, high = values.low, values.high
    digits = (float(f"{number:.{SIGNIFICANT - 1}e}") for number in quantile(values, places).tolist())
    numbers = (min(max(number, low), high) for number in digits)
    return [toml_number(number, angle=values.angle) for number in numbers]


def quantile(values: Uniform | Normal, places: Places) -> Places:
    """Invert a distribution: uniform in the values or their logarithms, or normal and cut at its bounds."""
    if isinstance(values, Uniform):
        if values.scale == "log":
            return np.asarray(values.low * np.exp(places * np.log(values.high / values.low)))
        return values.low + places * (values.high - values.low)
    stats = load_module("scipy.stats", "sampled sweeps")
    low, high = ((bound - values.mean) / values.sd for bound in (values.low, values.high))
    if np.isinf(low) and np.isinf(high):
        return np.asarray(stats.norm.ppf(places, values.mean, values.sd))
    return np.asarray(stats.truncnorm.ppf(places, low, high, values.mean, values.sd))


def generator(seed: int, text: str) -> np.random.Generator:
    """Return the stream of a seed and a text; streams of different texts are independent of one another."""
    digest = hashlib.sha256(text.encode()).digest()
    words = [int.from_bytes(digest[i : i + WORD_BYTES], "little") for i in range(0, len(digest), WORD_BYTES)]
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, *words])))


def open_interval(places: Places) -> Places:
    """Move places at 0 and 1 inside by less than anybody can see."""
    return np.clip(places, LEAST, 1.0 - 2.0 * LEAST)


def places_of(sweep: Sweep) -> Places:
    """Return a place of every case in the unit cube for every key, shape (keys, samples).

    "lhs": one in each of equally likely intervals, in random order; "normal": independent ones; "sobol": the first
    points of the sequence, in the middles of the finest cells of the net.
    """
    if sweep.mode == "sobol":
        sequence = load_module("scipy.stats.qmc", "sampled sweeps").Sobol(
            DIMENSIONS, scramble=True, bits=BITS, seed=generator(sweep.seed, "sobol")
        )
        size = min(CHUNK, 1 << (sweep.samples - 1).bit_length())
        chunks = [sequence.random(size)[:, : len(sweep.vary)].copy() for _ in range(0, sweep.samples, size)]
        return np.asarray(np.concatenate(chunks)[: sweep.samples].T + 0.5 ** (BITS + 1))
    # a stream for every key, however its quotes are set
    streams = [generator(sweep.seed, overrides.format_key(overrides.parse_key(key))) for key in sweep.vary]
    if sweep.mode == "normal":
        return np.stack([stream.random(sweep.samples) for stream in streams])
    hypercube = load_module("scipy.stats.qmc", "sampled sweeps").LatinHypercube
    return np.stack([hypercube(1, seed=stream).random(sweep.samples)[:, 0] for stream in streams])


def design_of(sweep: Sweep) -> Design:
    """Return the settings of all cases, the same for the same sweep on every machine.

    Raises what reading a table raises, UnavailableError where a sampled mode has no scipy.
    """
    if sweep.mode == "table":
        return Design({column.key: column.values for column in read_columns(sweep.table or Path())})
    if not sweep.is_sampled:
        return Design({key: levels_of(values) for key, values in sweep.vary.items()}, is_grid=sweep.mode == "grid")
    places = open_interval(places_of(sweep))
    return Design(
        {key: draw_values(values, column) for (key, values), column in zip(sweep.vary.items(), places, strict=True)}
    )


def remarks(sweep: Sweep) -> list[str]:
    """Return what whoever chose this sweep may want to know."""
    if sweep.mode == "sobol" and sweep.samples & (sweep.samples - 1):
        below = 1 << (sweep.samples.bit_length() - 1)
        return [f"{sweep.samples} Sobol points are not balanced; {below} or {2 * below} are"]
    return []


MOST_CASES = 1_000_000
MEASURED = "experiment.table"
TABLE = "table"  # last part of keys that name a file
MOST_LOOKED_AT = 1_000  # cases that are built in search of one that can be simulated, before anything runs
Values = Iterable[object] | Mapping[str, object]  # a list, { from, to, count }, { from, to } or { mean, sd }
LOOKED_AT = 32  # cases that are built to estimate all of them
SMALL_FILES = 12_000  # bytes of the files beside run.h5 in the folder of a case
ROW, ROW_OF_BLOCK = 570, 230
"""Bytes of a case in manifest and table, and more for each block; three blocks and three keys take 1.25 kB."""


@dataclass(frozen=True)
class SweepCase:
    """One member of a sweep: the values of its keys, and its model or the reason why it has none."""

    settings: Settings
    model: Model | None
    problem: str = ""
    name: str = ""  # hash of its run

    @classmethod
    def of(cls, base: Model, values: Settings) -> "SweepCase":
        """Vary a model by these values."""
        try:
            model = base.varied(values)
        except BlocksimError as error:  # mistakes that only show in the combination
            return cls(values, None, problem=str(error).splitlines()[0])
        return cls(values, model, name=run_hash(model))


@dataclass(frozen=True)
class Cases:
    """All cases of a sweep; each is made when it is asked for, and none is kept."""

    base: Model  # without what is varied
    design: Design
    heads: tuple[Head, ...]  # of the varied keys in the table

    def __len__(self) -> int:
        """Return the number of cases."""
        return len(self.design)

    def __getitem__(self, number: int) -> SweepCase:
        return SweepCase.of(self.base, self.design[number])

    def __iter__(self) -> Iterator[SweepCase]:
        return map(self.__getitem__, range(len(self)))


def plan_of(base: Model) -> Sweep:
    """Return what is varied. Raises InvalidInputError where that is nothing, and for a table that does not fit."""
    sweep = base.scenario.sweep
    if sweep is None:
        raise InvalidInputError("nothing to vary: give --vary KEY=VALUES, or a [sweep] table in the scenario")
    if MEASURED in sweep.vary:
        raise InvalidInputError(f"{MEASURED} cannot be varied; compare --experiment uses another table")
    check_experiment(base)
    return sweep


def with_sweep(
    document: Document,
    vary: Mapping[str, Values] | None,
    mode: str | None = None,
    *,
    samples: int | None = None,
    seed: int | None = None,
    option: str = "--vary",
) -> Document:
    """Return the document with another [sweep] table; mistakes in it are shown at the texts given to an option.

    Without `vary`, the document keeps the keys of its own table. Where the mode is "table", the file is read and its
    columns take its place as lists. Raises ScenarioError, InputMissingError or InvalidInputError for a wrong table.
    """
    present = document.data.get("sweep")
    table = dict(present) if isinstance(present, Mapping) and not vary else {}
    typed = list(document.overrides)
    for key, values in (vary or {}).items():
        if isinstance(values, Mapping):
            table[key] = overrides.freeze(values)
        else:  # numbers of numpy as Python has them
            table[key] = tuple(one.item() if hasattr(one, "item") else one for one in values)
        text = vary.texts[key] if isinstance(vary, Variations) else f"{key}={units.toml(table[key])}"
        label = f"{option} {text}" if isinstance(vary, Variations) else "vary"
        typed.append(overrides.Override(label, text, ("sweep", key)))
    for name, value in {"mode": mode, "samples": samples, "seed": seed}.items():
        if value is not None and table:
            table[name] = value
            label = f"--{name}" if isinstance(vary, Variations) else name
            typed.append(overrides.Override(label, f"{name}={value}", ("sweep", name)))
    data = {**document.data, "sweep": table} if table else document.data
    document = replace(document, data=data, overrides=tuple(typed))
    if not table or table.get("mode") != "table":
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
        raise InvalidInputError(f"{len(design)} cases are too many for one sweep; at most {MOST_CASES} are allowed")
    refuse_wrong_draws(document, sweep, design)
    # what cases are made from has no sweep, and tables that are found, or read, once for all of them
    bare = document.without_sweep()
    base = Model(replace(bare, data=with_tables(bare.data, document.build())))
    cases = Cases(base, design, heads_of(sweep))
    looked_at = min(len(cases), MOST_LOOKED_AT)
    if all(cases[number].model is None for number in range(looked_at)):
        which = f"none of the {len(cases)} cases" if looked_at == len(cases) else f"none of the first {looked_at} cases"
        raise InvalidInputError(f"{which} can be simulated; the first: {cases[0].problem}")
    return cases


def with_tables(data: Mapping[str, object], scenario: Scenario) -> Mapping[str, object]:
    """Return what a scenario is built from with the tables that it has read in place of their paths."""
    if scenario.experiment is not None:
        data = {**data, "experiment": {"table": scenario.experiment.table}}
    bodies = [(("bodies", number, "motion"), body.motion) for number, body in enumerate(scenario.bodies)]
    for path, motion in ((("motion",), scenario.motion), *bodies):
        if isinstance(motion, TABLED):
            data, _ = overrides.with_value(data, (*path, "table"), motion.table)
    return data


def refuse_wrong_draws(document: Document, sweep: Sweep, design: Design) -> None:
    """Try the least and the greatest value that was drawn from each normal distribution."""
    findings = []
    for key, values in sweep.vary.items():
        if not isinstance(values, Normal):
            continue
        drawn = [float(str(value).removesuffix(" rad")) for value in design.columns[key]]
        tried = trial_of(document.data, document.folder)
        for end in (min(drawn), max(drawn)):
            wrong = tried(overrides.parse_key(key), toml_number(end, angle=values.angle), ("sweep", key))
            for message in dict.fromkeys(one.message for one in wrong):  # one number may set two keys
                text = f"drawn: {message}; cut the distribution with from and to"
                findings.append(Mistake(("sweep", key), text))
    if findings:
        raise ScenarioError([document.problem(finding) for finding in findings])


def table_digests(document: Document, vary: Mapping[str, Variation]) -> dict[str, list[str]]:
    """Return a hash of what a scenario with each of the files is that varied keys name, by key and in order.

    A plan that is named by the paths alone would take rows of one record for those of another one of the same name.
    """
    bare = Model(document.without_sweep())
    digests: dict[str, list[str]] = {}
    for key, values in vary.items():
        for value in values if overrides.parse_key(key)[-1] == TABLE and isinstance(values, tuple) else ():
            digest = ""
            with suppress(BlocksimError):  # the case says so
                digest = bare.varied({key: value}).hash
            digests.setdefault(key, []).append(digest)
    return digests


ENDS = ("from", "to", "count")
LEAST_ENDS = 2
LOG = "log"
PLUS_MINUS = ("+-", "±")
FORMS = "KEY=a,b,c, KEY=from:to:count, KEY=from:to or KEY=mean+-sd (from:to also with :log at the end)"
RANGE = "KEY=from:to (also with :log at the end)"
SPREAD = "KEY=from:to, KEY=mean+-sd or KEY=a,b,c (from:to also with :log at the end)"


class Variations(dict[str, Values]):
    """What is said of each key, as a [sweep] table has it, and the text in which a person said it."""

    def __init__(self, tables: Mapping[str, Values], texts: Mapping[str, str]) -> None:
        """Take both, by key."""
        super().__init__(tables)
        self.texts = texts

    @classmethod
    def of(cls, tables: Mapping[str, Values]) -> "Variations":
        """Take tables such as {"contact.restitution": {"from": 0.2, "to": 0.4}} from Python, or what is typed."""
        if isinstance(tables, cls):
            return tables
        return cls(tables, {key: f"{key}={values}" for key, values in tables.items()})


def variations_option(
    text: str, metavar: str, python: str, flag: str = "--vary", forms: str = FORMS, *, is_repeatable: bool = True
) -> Option:
    """Return an option that gives values to keys, KEY=VALUES, of which there may be several."""

    def read(texts: str | Sequence[str]) -> Variations:
        return read_variations([texts] if isinstance(texts, str) else texts, flag, forms)

    return Option(text, (flag,), metavar, python, read, is_repeatable=is_repeatable, complete="scenario_keys")


def read_variations(texts: Sequence[str], option: str = "--vary", forms: str = FORMS) -> Variations:
    """Return the values of each key in texts such as `key=a,b,c`, `key=from:to:count` or `key=mean+-sd`.

    Raises ScenarioError where a text is none of these `forms`, which are those that the option takes; wrong keys and
    values show when the document is built.
    """
    unread, repeated, parts = [], [], {}
    for text in texts:
        key, equals, values = (part.strip() for part in text.partition("="))
        if not (equals and key and values):
            unread.append(Problem(f"{option} {text}", f"write {forms}"))
        elif key in parts:
            repeated.append(Problem(f"{option} {key}", "given twice; list all its values once"))
        else:
            parts[key] = (text, values)
    if problems := [*unread, *repeated]:
        raise ScenarioError(list(dict.fromkeys(problems)))
    tables = {key: _values(values) for key, (_, values) in parts.items()}
    return Variations(tables, {key: text for key, (text, _) in parts.items()})


def _values(text: str) -> Values:
    sign = next((sign for sign in PLUS_MINUS if sign in text), None)
    if sign is not None:
        mean, _, sd = text.partition(sign)
        return {"mean": _value(mean), "sd": _value(sd)}
    parts = [_value(part) for part in text.split(":")]
    if len(parts) > LEAST_ENDS and parts[-1] == LOG:
        return {**dict(zip(ENDS, parts[:-1], strict=False)), "scale": LOG} if len(parts) <= len(ENDS) + 1 else parts
    if LEAST_ENDS <= len(parts) <= len(ENDS):
        return dict(zip(ENDS, parts, strict=False))
    return [_value(part) for part in text.split(",")]


def _value(text: str) -> object:
    """Return a TOML value, or the bare text, which is checked where it is used."""
    text = text.strip()
    try:
        return overrides.parse_value(text) if text else text
    except overrides.UnfitOverrideError:
        return text


def build_distributions(document: Document, given: Variations, option: str, mode: str) -> Sweep:
    """Return the distributions, checked against the scenario.

    Raises ScenarioError that shows each mistake in the text given to `option`.
    """
    return cast("Sweep", with_sweep(document, given, mode, option=option).build().sweep)  # it was just put there


def distributions_of(document: Document, given: Variations, option: str, mode: str) -> Sweep | None:
    """Return the distributions that are given, else those of the scenario's own [sweep] table; None without any."""
    own = build_distributions(document, given, option, mode) if given else document.build().sweep
    return own if own is not None and (given or own.is_sampled) else None


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
    plan = plan_of(Model(document))
    return estimate_of(cases_of(document, plan), tuple(remarks(plan)), keep_cases=keep_cases)


def estimate_of(cases: Cases, remarks: tuple[str, ...] = (), *, keep_cases: bool = False) -> Estimate:
    """Return what cases come to, with all frames of each or without; nothing is written."""
    from blocksim.world.describe import describe  # noqa: PLC0415 - the solver, which reading a sweep does not need

    numbers = list(range(len(cases)))
    if len(cases) > LOOKED_AT:  # a random choice: evenly spaced ones may meet one value of a key only
        numbers = sorted(np.random.default_rng(0).choice(len(cases), LOOKED_AT, replace=False).tolist())
    chosen = [cases[number] for number in numbers]
    described = [describe(case.model) for case in chosen if case.model is not None]
    problems = [case.problem for case in chosen if case.model is None]
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
        stop_at_rest=sum(case.model.scenario.time.stop_at_rest for case in chosen if case.model is not None),
        remarks=remarks,
    )
