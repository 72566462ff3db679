"""Sensitivity of positions and outcomes to inputs that are distributed as stated: Morris and Sobol."""

import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.analysis.experiment import QUANTITIES, ExperimentTable, load_table
from blocksim.errors import BlocksimError, ExitCode, InvalidInputError
from blocksim.extras import load_module
from blocksim.options import Option, silent, takes
from blocksim.scenario import Scenario, Source, document_of
from blocksim.scenario.models.study import Normal, Variation
from blocksim.simulation import schemes, trajectory
from blocksim.study import pictures, plan as plans, rows
from blocksim.study.answer import Overview, UnstoredResult
from blocksim.study.executors.ensemble import run_members
from blocksim.view import studies
from blocksim.view.style import Paper

if TYPE_CHECKING:
    import pandas as pd


Floats = NDArray[np.float64]
PURPOSE = "sensitivity"
LEVELS = 4
MOST_POINTS = 3000  # of the pool: all their distances are kept in memory
RESAMPLES = 500


@dataclass(frozen=True)
class Method:
    """A design of runs in blocks, and the numbers that come from the results of whole blocks.

    `columns` are the names of the numbers of every key, with those of SALib and what they mean. A block has a run a key
    and `more_rows`; blocks do not depend on one another, so some may be left out. `points` (keys, blocks, seed) gives
    the design, shape (blocks * rows, keys), in [0, 1].
    """

    name: str
    samples: int
    sample_word: str
    more_rows: int
    points: Callable[[int, int, int], Floats]
    columns: Mapping[str, tuple[str, str]]

    def numbers(self, points: Floats, results: Floats, seed: int) -> dict[str, tuple[float, ...]]:
        """Return the columns, a number a key, from the results at the points of whole blocks."""
        problem, analyse = unit_cube(points.shape[1]), load_module(f"SALib.analyze.{self.name}", PURPOSE).analyze
        if self.name == "morris":
            found = analyse(problem, points, results, num_levels=LEVELS, num_resamples=RESAMPLES, seed=seed)
        else:  # SALib takes 0 for no seed
            found = analyse(problem, results, calc_second_order=False, num_resamples=RESAMPLES, seed=seed + 1)
        return {
            column: tuple(np.asarray(found[name], dtype=np.float64).tolist())
            for column, (name, _) in self.columns.items()
        }


def unit_cube(keys: int) -> dict[str, object]:
    """Return what SALib calls a problem."""
    return {"num_vars": keys, "names": [f"u{i}" for i in range(keys)], "bounds": [[0.0, 1.0]] * keys}


def _morris_points(keys: int, blocks: int, seed: int) -> Floats:
    """Return random trajectories of which each is the farthest from those before.

    The distance of two is the sum over all pairs of their points; squares are added up.
    """
    sample = load_module("SALib.sample.morris", PURPOSE).sample
    pool = max(blocks, min(10 * blocks, MOST_POINTS // (keys + 1)))  # random trajectories for one that is kept
    flat = np.asarray(sample(unit_cube(keys), pool, num_levels=LEVELS, seed=seed), dtype=np.float64)
    squares = np.sum(flat**2, axis=1)
    apart = np.sqrt(np.maximum(squares[:, None] + squares - 2.0 * flat @ flat.T, 0.0))
    distances = apart.reshape(pool, keys + 1, pool, keys + 1).sum(axis=(1, 3))
    np.fill_diagonal(distances, 0.0)
    chosen = [int(np.argmax(distances.max(axis=1)))]
    while len(chosen) < blocks:
        sums = np.sum(distances[chosen] ** 2, axis=0)
        sums[chosen] = -1.0
        chosen.append(int(np.argmax(np.round(sums, 9))))  # equal sums are equal on every machine
    return flat.reshape(pool, keys + 1, keys)[chosen].reshape(-1, keys)


def _sobol_points(keys: int, blocks: int, seed: int) -> Floats:
    sample = load_module("SALib.sample.sobol", PURPOSE).sample
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # no power of two: less even, and right anyway
        points = sample(unit_cube(keys), blocks, calc_second_order=False, seed=seed)
    return np.asarray(points, dtype=np.float64)


METHODS = {
    "morris": Method(
        name="morris",
        samples=16,
        sample_word="trajectories",
        more_rows=1,
        points=_morris_points,
        columns={
            "mu*": ("mu_star", "mean size of the change per whole range of the key"),
            "±": ("mu_star_conf", "half-width of the 95 % interval of mu*, bootstrapped"),
            "mu": ("mu", "mean change per whole range, with its sign"),
            "sigma": ("sigma", "standard deviation of the changes: curvature, or interaction with other keys"),
        },
    ),
    "sobol": Method(
        name="sobol",
        samples=128,
        sample_word="base samples",
        more_rows=2,
        points=_sobol_points,
        columns={
            "S1": ("S1", "share of the variance that is removed when the key is known"),
            "± S1": ("S1_conf", "half-width of the 95 % interval of S1, bootstrapped"),
            "ST": ("ST", "share of the variance that remains when all other keys are known"),
            "± ST": ("ST_conf", "half-width of the 95 % interval of ST, bootstrapped"),
        },
    ),
}
VARY = "--vary"
MODE = "sobol"
MOST_BLOCKS = 10
INDICATOR = "share"
TAIL = 0.005  # of a normal distribution is left out at either end, for methods that go to the ends of the unit cube
LEAST_VARIATION = {"mm": 0.01, "deg": 0.01, INDICATOR: 0.0}  # standard deviations below are no answer to anything
LEAST_BLOCKS = 2
LEAST_SHARE = 0.5  # of the blocks of a design have to be whole
OnMember = Callable[[int, int], None]


class ModelOutput(NamedTuple):
    """One result of every run, shape (runs,): mm or degrees, or 1 and 0 where `unit` is "share"."""

    name: str
    unit: str
    values: Floats


def outputs_of(finals: Sequence[trajectory.Columns], table: ExperimentTable | None) -> list[ModelOutput]:
    """Return every measured quantity (without a table: x of the first blocks), and indicators of the outcome."""
    blocks = finals[0]["block"]
    outcomes = [rows.quarter_turns(final["rotation_deg"]) for final in finals]
    inside: dict[str, list[bool]] = {}
    means: dict[str, float] = {}
    if table is None:
        places = np.array([final["x_mm"] for final in finals])
        found = [ModelOutput(f"x of block {name}", "mm", places[:, k]) for k, name in enumerate(blocks[:MOST_BLOCKS])]
    else:
        ranges, summaries = rows.ranges_of(table), table.summaries()
        values = [rows.values_at(final, ranges) for final in finals]
        found = [
            ModelOutput(f"{row.quantity} of block {row.block}", QUANTITIES[row.quantity].unit, column)
            for row, column in zip(summaries, np.array(values).T, strict=True)
        ]
        means = {row.block: row.mean for row in summaries if row.quantity == "rotation"}
        are_in = [all(one.holds(value) for one, value in zip(ranges, row, strict=True)) for row in values]
        inside = {"inside all measured ranges": are_in}
    if set(blocks) <= set(means):
        name, wanted = "measured outcome", rows.quarter_turns([means[block] for block in blocks])
    else:
        name, wanted = "most frequent outcome", Counter(outcomes).most_common(1)[0][0]
    turned = f"({sum(angle != 0 for angle in wanted)} of {len(wanted)} blocks turned)"
    shown = "/".join(map(str, wanted)) if len(wanted) <= MOST_BLOCKS else turned
    indicators = {f"{name} {shown}": [outcome == wanted for outcome in outcomes], **inside}
    return found + [ModelOutput(name, INDICATOR, np.array(hits, dtype=np.float64)) for name, hits in indicators.items()]


class TooManyFailuresError(BlocksimError):
    """So many runs failed that the indices of the others would mean little."""

    exit_code = ExitCode.NUMERICAL_FAILURE


@dataclass(frozen=True)
class Indices:
    """The numbers of one output, by column of the method and in the order of the keys; none where it hardly varies."""

    name: str
    unit: str
    mean: float
    sd: float
    numbers: Mapping[str, tuple[float, ...]]


@dataclass(frozen=True, repr=False)
class Sensitivity(UnstoredResult):
    """Indices of all outputs; `left_out` of `blocks` blocks of the design had failed runs in them."""

    what = "a study of sensitivity"
    picture = pictures.TORNADO
    caption = "Sensitivity indices"
    scenario: Scenario
    method: Method
    keys: tuple[str, ...]
    outputs: tuple[Indices, ...]
    runs: int
    failed: int
    first_problem: str
    blocks: int
    left_out: int

    def records(self) -> list[dict[str, object]]:
        """Return one row per output that varies and key: output, unit, key, and the columns of the method."""
        return [
            {"output": output.name, "unit": output.unit, "key": key}
            | {column: values[index] for column, values in output.numbers.items()}
            for output in self.outputs
            if output.numbers
            for index, key in enumerate(self.keys)
        ]

    def to_frame(self) -> "pd.DataFrame":
        """Return the same rows as a pandas table."""
        import pandas as pd

        return pd.DataFrame(self.records())

    def to_dict(self) -> dict[str, object]:
        """Return plain values for JSON."""
        return {
            "method": self.method.name,
            "meaning": {column: meaning for column, (_, meaning) in self.method.columns.items()},
            "keys": list(self.keys),
            "runs": self.runs,
            "failed": self.failed,
            self.method.sample_word.replace(" ", "_"): self.blocks,
            "left_out": self.left_out,
            "outputs": [
                {"output": one.name, "unit": one.unit, "mean": one.mean, "sd": one.sd, "varies": bool(one.numbers)}
                for one in self.outputs
            ],
            "indices": self.records(),
        }

    @property
    def remarks(self) -> list[str]:
        """What the columns mean, which outputs are constant, and what failed."""
        lines = [f"{column}: {meaning}" for column, (_, meaning) in self.method.columns.items()]
        still = [one.name for one in self.outputs if not one.numbers]
        if still:
            lines.append(f"does not vary: {', '.join(still)}")
        if self.failed:
            lines.append(
                f"{self.failed} of {self.runs} runs failed; {self.left_out} of {self.blocks} "
                f"{self.method.sample_word} are left out for it. The first: {self.first_problem}"
            )
        return lines

    def overview(self) -> Overview:
        """Return the indices, the most important key of every output first."""
        rows: list[tuple[str | float, ...]] = []
        for output in self.outputs:
            columns = list(output.numbers.values())
            order = sorted(range(len(self.keys) if columns else 0), key=lambda i: -abs(columns[0][i]))
            rows += [(output.name, output.unit, self.keys[i], *(column[i] for column in columns)) for i in order]
        design = f"{self.blocks} {self.method.sample_word}"
        return Overview(
            f"{self.name}: {self.method.name}, {design}, {self.runs} runs",
            ("output", "unit", "key", *self.method.columns),
            rows,
            left=3,
            digits=3,
            notes=self.remarks,
            summary=[("method", f"{self.method.name}, {design}"), ("runs", str(self.runs))],
        )

    def draw(self, path: Path, title: str, paper: Paper) -> None:
        """Draw bars of the indices.

        Raises InvalidInputError for an unknown format, too small a page and where no output varies, OutputError.
        """
        rows = self.records()
        if not rows:
            raise InvalidInputError(f"{self.name}: no result varies; nothing to draw")
        shown = next(one for one in pictures.METHODS if one.value in self.method.columns)
        studies.draw_tornado(pictures.bars_of(rows, shown), shown.labels, path, title=title, paper=paper)


@dataclass(frozen=True)
class SensitivityOptions:
    """Which inputs vary, and the design of the runs."""

    vary: Annotated[
        Mapping[str, plans.Values] | None,
        plans.variations_option(
            "An input and its distribution: KEY=FROM:TO, KEY=MEAN+-SD or KEY=a,b,c. Repeatable. "
            "Default: the distributions of [sweep].",
            "KEY=FROM:TO",
            'The distribution of each dotted key, as {"gravity": {"from": 9.7, "to": 9.9}}, {mean, sd} or a '
            "list (default: those of [sweep]).",
            forms=plans.SPREAD,
        ),
    ] = None
    _: KW_ONLY
    method: Annotated[
        str,
        Option(
            "Elementary effects, or shares of the variance.",
            python="morris (elementary effects) or sobol (shares of the variance).",
            choices=tuple(METHODS),
        ),
    ] = "morris"
    samples: Annotated[
        int | None,
        Option(
            "Morris: trajectories of k + 1 runs for k keys (default: 16); Sobol: base samples of k + 2 runs "
            "(default: 128).",
            metavar="N",
        ),
    ] = None
    seed: Annotated[int, Option("Random seed.", metavar="S", least=0)] = 0
    on_start: Callable[[str], None] = silent
    on_member: OnMember = silent


@takes(SensitivityOptions)
def sensitivity(scenario: Source, options: SensitivityOptions) -> Sensitivity:
    """Return Morris or Sobol indices of the run-outs and of the outcome.

    Designs need whole blocks (trajectories, base samples): one with a failed run is left out and counted, so the
    indices are those of inputs that can be simulated. `on_start` is called with the set of kernels, `on_member` with
    how many runs have ended and how many there are. Raises ScenarioError, TooManyFailuresError where more than half of
    the blocks are left out, UnavailableError without the extra `study`, InvalidInputError where nothing is varied, the
    method is unknown or samples are too few, and what reading the experiment table raises.

    >>> blocks = load("scenarios/three_blocks_nonsmooth.toml", {"time.end": 0.1})
    >>> ends = {"from": 0.2, "to": 0.4}
    >>> sensitivity(blocks, {"friction.block_block": ends, "friction.block_ground": ends}, method="morris", samples=4)
    <Sensitivity of three_blocks_nonsmooth: morris, 4 trajectories, 12 runs>
    """
    if options.method not in METHODS:
        raise InvalidInputError(f"unknown method {options.method!r}; choose one of {', '.join(METHODS)}")
    document, method = document_of(scenario), METHODS[options.method]
    vary, is_typed = options.vary, isinstance(options.vary, plans.Variations)
    plan = plans.distributions_of(document, plans.Variations.of(vary or {}), VARY if is_typed else "vary", MODE)
    if plan is None:
        form = f"{VARY} KEY=FROM:TO" if is_typed else "vary={key: {'from': a, 'to': b}}"
        raise InvalidInputError(f"nothing to vary: give {form}, or a [sweep] table with distributions")
    document = document.without_sweep()
    base = document.build()
    options.on_start(schemes.kernels_of(base))
    table = None if base.experiment is None else load_table(base.experiment.table)
    count = method.samples if options.samples is None else options.samples
    if count < LEAST_BLOCKS:
        raise InvalidInputError(f"{count} {method.sample_word} are too few; at least {LEAST_BLOCKS} are needed")
    points = method.points(len(plan.vary), count, options.seed)
    members = []
    for member in run_members(document, settings_at(points, plan.vary)):
        members.append(member)
        options.on_member(len(members), len(points))
    size = len(plan.vary) + method.more_rows
    has_final = np.array([member.final is not None for member in members])
    whole = np.asarray(np.all(has_final.reshape(-1, size), axis=1))
    problems = [member.problem for member in members if member.final is None]
    if whole.sum() < max(LEAST_BLOCKS, LEAST_SHARE * len(whole)):
        raise TooManyFailuresError(
            f"{len(problems)} of {len(members)} runs failed, in {np.sum(~whole)} of {len(whole)} {method.sample_word}; "
            f"no indices can be computed. The first: {problems[0]}"
        )
    kept = np.repeat(whole, size)
    finals = [member.final for member, is_kept in zip(members, kept, strict=True) if is_kept and member.final]
    return Sensitivity(
        scenario=base,
        method=method,
        keys=tuple(plan.vary),
        outputs=tuple(indices_of(output, points[kept], method, options.seed) for output in outputs_of(finals, table)),
        runs=len(members),
        failed=len(problems),
        first_problem=problems[0] if problems else "",
        blocks=len(whole),
        left_out=int(np.sum(~whole)),
    )


def settings_at(points: Floats, vary: Mapping[str, Variation]) -> Iterator[dict[str, object]]:
    """Yield the values of the keys at points of the unit cube, shape (runs, keys)."""
    columns = []
    for values, places in zip(vary.values(), points.T, strict=True):
        # not at the infinite ends of a normal distribution
        inner = TAIL + (1.0 - 2.0 * TAIL) * places if isinstance(values, Normal) else plans.open_interval(places)
        columns.append(plans.draw_values(values, inner))
    return (dict(zip(vary, row, strict=True)) for row in zip(*columns, strict=True))


def indices_of(output: ModelOutput, points: Floats, method: Method, seed: int) -> Indices:
    """Return the indices of one output of a design's runs."""
    name, unit, values = output
    sd = float(np.std(values))
    numbers = method.numbers(points, values, seed) if sd > LEAST_VARIATION[unit] else {}
    return Indices(name, unit, float(np.mean(values)), sd, numbers)
