"""Sensitivity of positions and outcomes to inputs that are distributed as stated."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from typing import TYPE_CHECKING, Annotated

import numpy as np

from blocksim.analysis.experiment import QUANTITIES, ExperimentTable, load_table
from blocksim.errors import BlocksimError, ExitCode, InvalidInputError
from blocksim.options import Option, takes
from blocksim.scenario import Document, Source, Sweep, document_of
from blocksim.scenario.models.variation import Normal, Variation
from blocksim.silence import silent
from blocksim.simulation.compilation import kernels_of
from blocksim.simulation.table import Columns
from blocksim.study.executors.ensemble import run_members
from blocksim.study.plan import Values, Variations, varied
from blocksim.study.rows import are_inside, quarter_turns, ranges_of, values_at
from blocksim.study.sampling import drawn, open_interval
from blocksim.study.sensitivity_methods import METHODS, Floats, Method
from blocksim.study.vary import SPREAD, variations_option

if TYPE_CHECKING:
    import pandas as pd

VARY = "--vary"
MODE = "sobol"
MOST_BLOCKS = 10
INDICATOR = "share"
TAIL = 0.005  # of a normal distribution is left out at either end, for methods that go to the ends of the unit cube
LEAST_VARIATION = {"mm": 0.01, "deg": 0.01, INDICATOR: 0.0}  # standard deviations below are no answer to anything
LEAST_BLOCKS = 2
LEAST_SHARE = 0.5  # of the blocks of a design have to be whole
OnMember = Callable[[int, int], None]


@dataclass(frozen=True)
class Output:
    """One result of every run, shape (runs,): mm or degrees, or 1 and 0 where `unit` is "share"."""

    name: str
    unit: str
    values: Floats


def outputs_of(finals: Sequence[Columns], table: ExperimentTable | None) -> list[Output]:
    """Return every measured quantity (without a table: x of the first blocks), and indicators of the outcome."""
    blocks = finals[0]["block"]
    outcomes = [quarter_turns(final["rotation_deg"]) for final in finals]
    are_in: list[bool] = []
    means: dict[str, float] = {}
    if table is None:
        places = np.array([final["x_mm"] for final in finals])
        found = [Output(f"x of block {name}", "mm", places[:, k]) for k, name in enumerate(blocks[:MOST_BLOCKS])]
    else:
        ranges, summaries = ranges_of(table), table.summaries()
        values = [values_at(final, ranges) for final in finals]
        found = [
            Output(f"{row.quantity} of block {row.block}", QUANTITIES[row.quantity].unit, column)
            for row, column in zip(summaries, np.array(values).T, strict=True)
        ]
        means = {row.block: row.mean for row in summaries if row.quantity == "rotation"}
        are_in = [are_inside(row, ranges) for row in values]
    if set(blocks) <= set(means):
        name, wanted = "measured outcome", quarter_turns([means[block] for block in blocks])
    else:
        name, wanted = "most frequent outcome", Counter(outcomes).most_common(1)[0][0]
    if len(wanted) <= MOST_BLOCKS:
        shown = "/".join(map(str, wanted))
    else:
        shown = f"({sum(angle != 0 for angle in wanted)} of {len(wanted)} blocks turned)"
    hits = np.array([outcome == wanted for outcome in outcomes], dtype=np.float64)
    found.append(Output(f"{name} {shown}", INDICATOR, hits))
    if table is not None:
        found.append(Output("inside all measured ranges", INDICATOR, np.array(are_in, dtype=np.float64)))
    return found


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

    @property
    def varies(self) -> bool:
        """Return True if there is a variation to be explained."""
        return bool(self.numbers)


@dataclass(frozen=True)
class Sensitivity:
    """Indices of all outputs; `left_out` of `blocks` blocks of the design had failed runs in them."""

    method: Method
    keys: tuple[str, ...]
    outputs: tuple[Indices, ...]
    runs: int
    failed: int
    first_problem: str
    blocks: int
    left_out: int

    def records(self) -> Iterator[dict[str, object]]:
        """Yield one row per output that varies and key: output, unit, key, and the columns of the method."""
        for output in self.outputs:
            for index, key in enumerate(self.keys if output.varies else ()):
                numbers = {column: values[index] for column, values in output.numbers.items()}
                yield {"output": output.name, "unit": output.unit, "key": key, **numbers}

    def to_frame(self) -> "pd.DataFrame":
        """Return the same rows as a pandas table."""
        import pandas as pd

        return pd.DataFrame(list(self.records()))

    def to_dict(self) -> dict[str, object]:
        """Return plain values for JSON."""
        return {
            "method": self.method.name,
            "meaning": dict(self.method.columns),
            "keys": list(self.keys),
            "runs": self.runs,
            "failed": self.failed,
            self.method.sample_word.replace(" ", "_"): self.blocks,
            "left_out": self.left_out,
            "outputs": [
                {"output": one.name, "unit": one.unit, "mean": one.mean, "sd": one.sd, "varies": one.varies}
                for one in self.outputs
            ],
            "indices": list(self.records()),
        }


@dataclass(frozen=True)
class SensitivityOptions:
    """Which inputs vary, and the design of the runs."""

    vary: Annotated[
        Mapping[str, Values] | None,
        variations_option(
            "An input and its distribution: KEY=FROM:TO, KEY=MEAN+-SD or KEY=a,b,c. Repeatable. "
            "Default: the distributions of [sweep].",
            "KEY=FROM:TO",
            'The distribution of each dotted key, as {"gravity": {"from": 9.7, "to": 9.9}}, {mean, sd} or a '
            "list (default: those of [sweep]).",
            forms=SPREAD,
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
    """
    if options.method not in METHODS:
        raise InvalidInputError(f"unknown method {options.method!r}; choose one of {', '.join(METHODS)}")
    document, method = document_of(scenario), METHODS[options.method]
    plan = _sampled_plan(document, options.vary)
    document = document.without_sweep()
    base = document.build()
    options.on_start(kernels_of(base))
    table = None if base.experiment is None else load_table(base.experiment.table)
    count = method.samples if options.samples is None else options.samples
    if count < LEAST_BLOCKS:
        raise InvalidInputError(f"{count} {method.sample_word} are too few; at least {LEAST_BLOCKS} are needed")
    points = method.points(len(plan.vary), count, options.seed)
    members = []
    for member in run_members(document, settings_at(points, plan.vary)):
        members.append(member)
        options.on_member(len(members), len(points))
    rows = method.rows_of_block(len(plan.vary))
    has_final = np.array([member.final is not None for member in members])
    whole = np.asarray(np.all(has_final.reshape(-1, rows), axis=1))
    problems = [member.problem for member in members if member.final is None]
    if whole.sum() < max(LEAST_BLOCKS, LEAST_SHARE * len(whole)):
        raise TooManyFailuresError(
            f"{len(problems)} of {len(members)} runs failed, in {np.sum(~whole)} of {len(whole)} {method.sample_word}; "
            f"no indices can be computed. The first: {problems[0]}"
        )
    kept = np.repeat(whole, rows)
    finals = [member.final for member, is_kept in zip(members, kept, strict=True) if is_kept and member.final]
    return Sensitivity(
        method=method,
        keys=tuple(plan.vary),
        outputs=tuple(indices_of(output, points[kept], method, options.seed) for output in outputs_of(finals, table)),
        runs=len(members),
        failed=len(problems),
        first_problem=problems[0] if problems else "",
        blocks=len(whole),
        left_out=int(np.sum(~whole)),
    )


def _sampled_plan(document: Document, vary: Mapping[str, Values] | None) -> Sweep:
    """Return the distributions that are given, or those of the document where none are.

    Raises ScenarioError for mistakes in them, and InvalidInputError where there are none.
    """
    is_typed = isinstance(vary, Variations)
    if vary:
        plan: Sweep | None = varied(document, Variations.of(vary), VARY if is_typed else "vary", MODE)
    else:
        plan = document.build().sweep
    if plan is None or not plan.is_sampled:
        given = f"{VARY} KEY=FROM:TO" if is_typed else "vary={key: {'from': a, 'to': b}}"
        raise InvalidInputError(f"nothing to vary: give {given}, or a [sweep] table with distributions")
    return plan


def settings_at(points: Floats, vary: Mapping[str, Variation]) -> Iterator[dict[str, object]]:
    """Yield the values of the keys at points of the unit cube, shape (runs, keys)."""
    columns = []
    for values, places in zip(vary.values(), points.T, strict=True):
        # not at the infinite ends of a normal distribution
        inner = TAIL + (1.0 - 2.0 * TAIL) * places if isinstance(values, Normal) else open_interval(places)
        columns.append(drawn(values, inner))
    return (dict(zip(vary, row, strict=True)) for row in zip(*columns, strict=True))


def indices_of(output: Output, points: Floats, method: Method, seed: int) -> Indices:
    """Return the indices of one output of a design's runs."""
    sd = float(np.std(output.values))
    varies = sd > LEAST_VARIATION[output.unit]
    numbers = method.numbers(points, output.values, seed) if varies else {}
    return Indices(
        name=output.name,
        unit=output.unit,
        mean=float(np.mean(output.values)),
        sd=sd,
        numbers={column: tuple(values.tolist()) for column, values in numbers.items()},
    )
