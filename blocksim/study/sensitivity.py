"""Sensitivity of positions and outcomes to inputs that are distributed as stated."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from blocksim.analysis.experiment import QUANTITIES, ExperimentTable, load_table
from blocksim.errors import BlocksimError, ExitCode, InvalidInputError
from blocksim.scenario import Document, Sweep
from blocksim.scenario.models.variation import Normal, Variation
from blocksim.silence import silent
from blocksim.simulation.table import Columns
from blocksim.study.executors.ensemble import Member, run_members
from blocksim.study.plan import Variations, varied
from blocksim.study.rows import are_inside, quarter_turns, ranges_of, values_at
from blocksim.study.sampling import drawn, open_interval
from blocksim.study.sensitivity_methods import Floats, Method

if TYPE_CHECKING:
    import pandas as pd

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
    positions = _positions(finals) if table is None else _measured(finals, table)
    outcomes = [quarter_turns(final["rotation_deg"]) for final in finals]
    wanted, name = _class(finals[0]["block"], outcomes, table)
    hits = np.array([outcome == wanted for outcome in outcomes], dtype=np.float64)
    found = [*positions, Output(f"{name} {_written(wanted)}", INDICATOR, hits)]
    return found if table is None else [*found, _inside(finals, table)]


def _positions(finals: Sequence[Columns]) -> list[Output]:
    values = np.array([final["x_mm"] for final in finals])
    names = finals[0]["block"][:MOST_BLOCKS]
    return [Output(f"x of block {block}", "mm", values[:, index]) for index, block in enumerate(names)]


def _measured(finals: Sequence[Columns], table: ExperimentTable) -> list[Output]:
    ranges = ranges_of(table)
    values = np.array([values_at(final, ranges) for final in finals])
    return [
        Output(f"{row.quantity} of block {row.block}", QUANTITIES[row.quantity].unit, values[:, index])
        for index, row in enumerate(table.summaries())
    ]


def _class(
    blocks: Sequence[str], outcomes: Sequence[tuple[int, ...]], table: ExperimentTable | None
) -> tuple[tuple[int, ...], str]:
    """Return the measured class where the rotations of all blocks are measured, else the most frequent one."""
    measured = {} if table is None else {one.block: one.mean for one in table.summaries() if one.quantity == "rotation"}
    if set(blocks) <= set(measured):
        return quarter_turns([measured[block] for block in blocks]), "measured outcome"
    return Counter(outcomes).most_common(1)[0][0], "most frequent outcome"


def _written(outcome: tuple[int, ...]) -> str:
    """Write a class for people: the turned blocks of many, or all rotations of a few."""
    if len(outcome) <= MOST_BLOCKS:
        return "/".join(f"{angle}" for angle in outcome)
    turned = sum(angle != 0 for angle in outcome)
    return f"({turned} of {len(outcome)} blocks turned)"


def _inside(finals: Sequence[Columns], table: ExperimentTable) -> Output:
    ranges = ranges_of(table)
    hits = [are_inside(values_at(final, ranges), ranges) for final in finals]
    return Output("inside all measured ranges", INDICATOR, np.array(hits, dtype=np.float64))


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


def sampled_plan(document: Document, given: Variations, option: str, nothing: str) -> Sweep:
    """Return the distributions that are given to an option, or those of the document where none are.

    Raises ScenarioError for mistakes in them, and InvalidInputError with the message `nothing` where there are none.
    """
    plan = varied(document, given, option, MODE) if given.tables else document.build().sweep
    if plan is None or not plan.is_sampled:
        raise InvalidInputError(nothing)
    return plan


def sensitivity(
    document: Document,
    plan: Sweep,
    method: Method,
    *,
    samples: int | None = None,
    seed: int = 0,
    on_member: OnMember = silent,
) -> Sensitivity:
    """Run a design of `samples` blocks over the distributions of a plan, and return the indices of every output.

    Designs need whole blocks (trajectories, base samples): one with a failed run is left out and counted, so the
    indices are those of inputs that can be simulated. Raises TooManyFailuresError where more than half are left out,
    UnavailableError without the extra `study`, InvalidInputError for too few samples, and what reading the experiment
    table raises.
    """
    base = document.build()
    table = None if base.experiment is None else load_table(base.experiment.table)
    count = method.samples if samples is None else samples
    if count < LEAST_BLOCKS:
        raise InvalidInputError(f"{count} {method.sample_word} are too few; at least {LEAST_BLOCKS} are needed")
    points = method.points(len(plan.vary), count, seed)
    members = []
    for member in run_members(document, settings_at(points, plan.vary)):
        members.append(member)
        on_member(len(members), len(points))
    return _analysed(members, points, plan, method, table, seed)


def settings_at(points: Floats, vary: Mapping[str, Variation]) -> Iterator[dict[str, object]]:
    """Yield the values of the keys at points of the unit cube, shape (runs, keys)."""
    columns = [drawn(values, _places(values, points[:, index])) for index, values in enumerate(vary.values())]
    return (dict(zip(vary, row, strict=True)) for row in zip(*columns, strict=True))


def _places(values: Variation, places: Floats) -> Floats:
    """Return where in the unit interval a design's places lie: not at the infinite ends of a normal distribution."""
    return TAIL + (1.0 - 2.0 * TAIL) * places if isinstance(values, Normal) else open_interval(places)


def _analysed(
    members: list[Member], points: Floats, plan: Sweep, method: Method, table: ExperimentTable | None, seed: int
) -> Sensitivity:
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
    found = tuple(indices_of(output, points[kept], method, seed) for output in outputs_of(finals, table))
    return Sensitivity(
        method=method,
        keys=tuple(plan.vary),
        outputs=found,
        runs=len(members),
        failed=len(problems),
        first_problem=problems[0] if problems else "",
        blocks=len(whole),
        left_out=int(np.sum(~whole)),
    )


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
