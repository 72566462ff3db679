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
from blocksim.study.rows import FINISHED, NUMBERS, TABLE, Head, Ranges, blocks_in, quarter_turns
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
    x_mm, rotation_deg = (
        np.stack([members.values(block, quantity) for block in blocks], axis=1) for quantity in ("x", "rotation")
    )
    if max(np.nanmax(np.abs(one), initial=0.0) for one in (x_mm, rotation_deg)) > LARGEST:
        raise InvalidInputError(f"{members.source}: a block has moved too far to be drawn")
    is_cut = finished & ~np.isfinite(x_mm + rotation_deg).all(axis=1)
    if is_cut.any():  # it has neither ended nor failed
        case = table["case"].iloc[int(np.argmax(is_cut))]
        raise InvalidInputError(f"{members.source}: case {case} has finished, but its row lacks positions of blocks")
    path = experiment or (None if scenario.experiment is None else scenario.experiment.table)
    return SweepData(
        title=scenario.description or scenario.name,
        mode="" if scenario.sweep is None else scenario.sweep.mode,
        inputs=_inputs(scenario, table),
        blocks=blocks,
        x_mm=x_mm,
        rotation_deg=rotation_deg,
        finished=finished,
        inside=None if path is None else Ranges.read(path).inside(table).to_numpy(dtype=bool) & finished,
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
    numbers = column.to_list() if column.dtype.kind in NUMBERS else [*map(_number, column)]
    known = np.array([number for number in numbers if number is not None], dtype=np.float64)
    values = known * head.si(1.0)
    if not (np.abs(values) <= LARGEST).all():
        raise InvalidInputError(f"{TABLE}: the column {key} holds values that are not numbers or too large")
    if len(values) == len(numbers):
        typed = Typed(head.unit, head.si(1.0)) if head.unit else None
        vary = scenario.sweep.vary[key] if scenario.sweep is not None else ()
        is_even = isinstance(vary, Normal) or (isinstance(vary, Uniform) and vary.scale == "linear")
        return Input(key, unit_of(scenario, key) or head.si_unit, values, is_even=is_even, typed=typed)
    words = [q.shown(value).strip('"') for value in column]
    levels = tuple(dict.fromkeys(words))
    return Input(key, "", np.array([levels.index(word) for word in words], dtype=np.float64), levels)


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
