"""Lines: final x of the blocks over one input, a column for each value of a second one."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from blocksim.view.paper import OWN, Paper
from blocksim.view.series import MOST_COLUMNS, draw_series
from blocksim.view.sweeps.found import Flags, Floats, FoundSweep, Input
from blocksim.view.sweeps.kind import Kind

MOST_INPUTS = 2


@dataclass(frozen=True)
class Series:
    """Final centres of b blocks in n finished runs that differ in one input only, in the order of its values."""

    label: str  # input and value that all runs of this series share; empty where there is one series only
    values: Floats  # (n,) SI
    x_mm: Floats  # (n, b)


def refusal(sweep: FoundSweep) -> str:
    """Return why a sweep cannot be shown."""
    if len(sweep.inputs) > MOST_INPUTS:
        return f"{len(sweep.inputs)} keys are varied; lines can show one or two"
    if not any(one.is_number for one in sweep.inputs):
        words = next(iter(sweep.inputs))
        return f"the values of {words.key} are not numbers (such as {words.levels[0]!r}); they cannot be an axis"
    return ""


def suits(sweep: FoundSweep) -> bool:
    """Return True if all combinations exist, and the columns for the values of the second input are not too many."""
    if refusal(sweep) or (sweep.is_sampled and len(sweep.inputs) > 1):
        return False
    _, other = _axis_and_other(sweep)
    return other is None or other.count <= MOST_COLUMNS


def draw(sweep: FoundSweep, path: Path, paper: Paper = OWN) -> None:
    """Draw the lines."""
    axis, _ = _axis_and_other(sweep)
    ranges = {block: ends for block in sweep.blocks if (ends := sweep.measured.range_of(block)) is not None}
    key = axis.key, axis.unit
    series = list(series_of(sweep))
    draw_series(series, sweep.blocks, key, path, sweep.title, ranges, typed=axis.typed, paper=paper)


def series_of(sweep: FoundSweep) -> Iterator[Series]:
    """Yield the series of the finished cases, one for each value of the second input of a grid."""
    axis, other = _axis_and_other(sweep)
    groups: list[tuple[str, Flags]] = [("", sweep.finished)]
    if other is not None:
        groups = [
            (f"{other.key} = {other.told(value)}", sweep.finished & (other.values == value))
            for value in np.unique(other.values[sweep.finished])
        ]
    for label, cases in groups:
        order = np.argsort(axis.values[cases], kind="stable")
        yield Series(label, axis.values[cases][order], sweep.x_mm[cases][order])


def _axis_and_other(sweep: FoundSweep) -> tuple[Input, Input | None]:
    """Return the number with the most values, and the other input where both go through all combinations."""
    axis = max((one for one in sweep.inputs if one.is_number), key=lambda one: one.count)
    others = [one for one in sweep.inputs if one is not axis]
    return axis, others[0] if others and sweep.is_grid else None


LINES = Kind("final x over one input, one column per value of a second one", refusal, suits, draw)
