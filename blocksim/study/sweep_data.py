"""A sweep, read back from its folder as pictures need it."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from blocksim.analysis.compare import limits, prediction_half_width
from blocksim.analysis.experiment import ExperimentTable, load_table
from blocksim.analysis.members import Members
from blocksim.errors import InvalidInputError
from blocksim.scenario import Scenario, load_stored
from blocksim.scenario import quantities as q
from blocksim.scenario.keys import field_of, si_unit
from blocksim.scenario.models.variation import Normal, Uniform
from blocksim.study.rows import FINISHED, TABLE, Head, Ranges, blocks_in, quarter_turns
from blocksim.study.sweep_folder import PLAN
from blocksim.study.sweep_table import read_sweep
from blocksim.view.sweeps.data import Input, Measured, SweepData, Typed

if TYPE_CHECKING:
    import pandas as pd

Floats = NDArray[np.float64]
LARGEST = 1e30  # of inputs (SI) and of places (mm) that are drawn


def read_sweep_data(folder: Path, experiment: Path | None = None) -> SweepData:
    """Return what a sweep's folder holds, beside the scenario's experiment or another table.

    Raises InputMissingError or InvalidInputError: where files are missing or damaged, no case has finished, or the
    table measures what the sweep does not have.
    """
    table = read_sweep(folder).table
    scenario = load_stored(folder / PLAN)
    blocks = blocks_in(map(str, table.columns))
    finished = (table["status"] == FINISHED).to_numpy(dtype=bool)
    if not blocks or not finished.any():
        message = f"{folder}: no case of this sweep has finished; nothing to draw"
        raise InvalidInputError(message)
    members = Members(table, str(folder / TABLE))
    x_mm, rotation_deg = (_columns(members, quantity) for quantity in ("x", "rotation"))
    _refuse_cut(members, finished & ~np.isfinite(x_mm + rotation_deg).all(axis=1))
    path = experiment or (None if scenario.experiment is None else scenario.experiment.table)
    return SweepData(
        title=scenario.description or scenario.name,
        mode="" if scenario.sweep is None else scenario.sweep.mode,
        inputs=_inputs(scenario, table),
        blocks=blocks,
        x_mm=x_mm,
        rotation_deg=rotation_deg,
        finished=finished,
        inside=None if path is None else _inside(table, Ranges.read(path)) & finished,
        measured=Measured() if path is None else measured_of(load_table(path), blocks),
        manners=tuple(table["outcome"].fillna("").astype(str)) if "outcome" in table.columns else (),
    )


def measured_of(table: ExperimentTable, blocks: tuple[str, ...]) -> Measured:
    """Return repeats and prediction intervals of x (mm), and the measured class where all rotations are measured."""
    means = {row.block: row.mean for row in table.summaries() if row.quantity == "rotation"}
    turned = quarter_turns([means[block] for block in blocks if block in means])
    rows = [row for row in table.summaries() if row.quantity == "x" and row.block in blocks]
    return Measured(
        x_mm={row.block: table.values(row.block, "x").to_numpy(dtype=float) for row in rows},
        limits_mm={row.block: limits("x", row.mean, row.minimum, row.maximum) for row in rows},
        prediction_mm={
            row.block: (row.mean - half, row.mean + half)
            for row in rows
            if (half := prediction_half_width(row.s, row.n)) > 0.0
        },
        outcome=turned if len(turned) == len(blocks) else None,
    )


def _columns(members: Members, quantity: str) -> Floats:
    """Return one quantity of all blocks, (count, b); NaN where a member has none. Raises InvalidInputError."""
    found = np.stack([members.values(block, quantity) for block in blocks_in(map(str, members.table.columns))], axis=1)
    if np.nanmax(np.abs(found), initial=0.0) > LARGEST:
        raise InvalidInputError(f"{members.source}: a block has moved too far to be drawn")
    return found


def _refuse_cut(members: Members, cut: NDArray[np.bool_]) -> None:
    """Raise InvalidInputError where the row of a finished case is not whole; it has neither ended nor failed."""
    if cut.any():
        case = members.table["case"].iloc[int(np.argmax(cut))]
        raise InvalidInputError(f"{members.source}: case {case} has finished, but its row lacks positions of blocks")


def _inside(table: "pd.DataFrame", ranges: Ranges) -> NDArray[np.bool_]:
    return np.array(ranges.inside(table), dtype=np.bool_)


def _inputs(scenario: Scenario, table: "pd.DataFrame") -> tuple[Input, ...]:
    """Return the keys that take more than one value, or the first where none does."""
    vary = {} if scenario.sweep is None else scenario.sweep.vary
    heads = [head for name in table.columns if (head := Head.read(str(name))).key in vary]
    missing = [key for key in vary if key not in {head.key for head in heads}]
    if missing or not heads:
        message = f"{TABLE} has no column {missing[0]}" if missing else f"{PLAN} varies no key"
        raise InvalidInputError(f"{message}; table and plan do not belong together")
    inputs = [_input(scenario, head, table[str(head)]) for head in heads]
    varied = [one for one in inputs if one.count > 1]
    return tuple(varied or inputs[:1])


def _input(scenario: Scenario, head: Head, column: "pd.Series") -> Input:
    key = head.key
    numbers = [None if (number := _number(value)) is None else head.si(number) for value in column]
    if not all(number is None or abs(number) <= LARGEST for number in numbers):
        raise InvalidInputError(f"{TABLE}: the column {key} holds values that are not numbers or too large")
    if all(number is not None for number in numbers):
        typed = Typed(head.unit, head.si(1.0)) if head.unit else None
        values = np.array(numbers, dtype=np.float64)
        unit = unit_of(scenario, key) or head.si_unit
        return Input(key, unit, values, is_even=_is_even(scenario, key), typed=typed)
    words = [q.shown(value).strip('"') for value in column]
    levels = tuple(dict.fromkeys(words))
    return Input(key, "", np.array([levels.index(word) for word in words], dtype=np.float64), levels)


def _is_even(scenario: Scenario, key: str) -> bool:
    """Return True if values are drawn from a distribution that is not over decades."""
    values = None if scenario.sweep is None else scenario.sweep.vary[key]
    return isinstance(values, Normal) or (isinstance(values, Uniform) and values.scale == "linear")


def _number(value: object) -> float | None:
    """Return a value in SI, None for a word; in the table of a sweep it stands as it was given."""
    try:
        return float(str(value))
    except ValueError:
        pass
    try:
        return q.parse_quantity(str(value), q.NUMBER)[0]
    except ValueError:
        return None


def unit_of(scenario: Scenario, key: str) -> str:
    """Return the SI unit of a key's values, empty for plain numbers."""
    field = field_of(key, scenario)
    return "" if field is None else si_unit(field)
