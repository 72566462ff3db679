"""What the indices are about: positions of blocks, and whether the outcome is of a class."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from blocksim.analysis.experiment import QUANTITIES, ExperimentTable
from blocksim.simulation.table import Columns
from blocksim.study.sensitivity.methods.method import Floats
from blocksim.study.targets import are_inside, ranges_of, values_at

QUARTER = 90.0  # deg
MOST_BLOCKS = 10
INDICATOR = "share"


@dataclass(frozen=True)
class Output:
    """One result of every run, shape (runs,): mm or degrees, or 1 and 0 where `unit` is "share"."""

    name: str
    unit: str
    values: Floats


def outputs_of(finals: Sequence[Columns], table: ExperimentTable | None) -> list[Output]:
    """Return every measured quantity (without a table: x of the first blocks), and indicators of the outcome."""
    positions = _positions(finals) if table is None else _measured(finals, table)
    wanted, name = _class(finals, table)
    hits = np.array([outcome_of(final) == wanted for final in finals], dtype=np.float64)
    found = [*positions, Output(f"{name} {_told(wanted)}", INDICATOR, hits)]
    return found if table is None else [*found, _inside(finals, table)]


def _positions(finals: Sequence[Columns]) -> list[Output]:
    values = np.array([final["x_mm"] for final in finals])
    names = finals[0]["block"][:MOST_BLOCKS]
    return [Output(f"x of block {block}", "mm", values[:, index]) for index, block in enumerate(names)]


def _measured(finals: Sequence[Columns], table: ExperimentTable) -> list[Output]:
    values = np.array([values_at(final, ranges_of(table)) for final in finals])
    return [
        Output(f"{row.quantity} of block {row.block}", QUANTITIES[row.quantity].unit, values[:, index])
        for index, row in enumerate(table.summaries())
    ]


def outcome_of(final: Columns) -> tuple[int, ...]:
    """Return the class of an outcome: the rotations of all blocks, in degrees, rounded to quarters of a turn."""
    return tuple(round(rotation / QUARTER) * int(QUARTER) for rotation in final["rotation_deg"])


def _class(finals: Sequence[Columns], table: ExperimentTable | None) -> tuple[tuple[int, ...], str]:
    """Return the measured class where the rotations of all blocks are measured, else the most frequent one."""
    measured = {} if table is None else {one.block: one.mean for one in table.summaries() if one.quantity == "rotation"}
    blocks = finals[0]["block"]
    if set(blocks) <= set(measured):
        return outcome_of({"rotation_deg": [measured[block] for block in blocks]}), "measured outcome"
    return Counter(map(outcome_of, finals)).most_common(1)[0][0], "most frequent outcome"


def _told(outcome: tuple[int, ...]) -> str:
    """Write a class for people: the turned blocks of many, or all rotations of a few."""
    if len(outcome) <= MOST_BLOCKS:
        return "/".join(f"{angle}" for angle in outcome)
    turned = sum(angle != 0 for angle in outcome)
    return f"({turned} of {len(outcome)} blocks turned)"


def _inside(finals: Sequence[Columns], table: ExperimentTable) -> Output:
    ranges = ranges_of(table)
    hits = [are_inside(values_at(final, ranges), ranges) for final in finals]
    return Output("inside all measured ranges", INDICATOR, np.array(hits, dtype=np.float64))
