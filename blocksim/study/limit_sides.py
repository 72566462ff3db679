"""Both sides of the brackets of a limit as kept runs, with frames and contacts: what pictures of mechanisms show."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from blocksim.errors import OutputError, StoppedEarlyError
from blocksim.scenario import Scenario
from blocksim.simulation.movement import Manner
from blocksim.simulation.provenance import run_hash
from blocksim.study.criterion import Verdict, falls_before_zero
from blocksim.study.executors.ensemble import INTERRUPTED, run_case
from blocksim.study.limit_plan import LimitPlan
from blocksim.study.limit_search import Change, Number
from blocksim.study.rows import FINISHED, Row
from blocksim.study.sweep_folder import CASES

MOST = 3  # brackets whose sides are kept


class Kept(NamedTuple):
    """A run with frames and contacts: its folder in `cases`, and its row."""

    case: str
    row: Row
    is_fall: bool  # released where it did not come to rest, and seen to move


def keep_sides(
    folder: Path, plan: LimitPlan, changes: list[Change[Verdict]], rows: Mapping[Number, Row]
) -> dict[Number, Kept]:
    """Run both sides of the first brackets once more, into folders of their own, unless they are there.

    Returns folders and rows by value; without those whose run did not finish. The motion is that of the search, so a
    run that ends otherwise could not be written; what does not come to rest before time zero is released then, so that
    there is a run that shows how it falls. Raises OutputError, and StoppedEarlyError on Ctrl-C.
    """
    wanted = [value for change in changes[:MOST] for value in (change.low, change.high)]
    kept: dict[Number, Kept] = {}
    for value in dict.fromkeys(wanted):
        falls = falls_before_zero(rows[value])
        if falls or rows[value]["status"] == FINISHED:
            scenario = _recorded(plan.scenario_at(value), is_released=falls)
            name = run_hash(scenario)
            row = run_case(scenario, folder / CASES / name)
            if row["status"] == INTERRUPTED:
                message = "stopped while the runs beside a limit were kept; rerun the command to finish"
                raise StoppedEarlyError(message)
            if row["status"] != FINISHED and not (falls and "outcome" in row):
                message = f"{row['reason']}; the limit is found, its runs are not kept: rerun the command, or --no-runs"
                raise OutputError(message)
            if row["status"] == FINISHED:
                kept[value] = Kept(name, row, falls and row["outcome"] != Manner.STANDS.value)
    return kept


def _recorded(scenario: Scenario, *, is_released: bool) -> Scenario:
    output = scenario.output.model_copy(update={"contacts": True})
    start = scenario.start.model_copy(update={"release": "always" if is_released else "at rest"})
    time = scenario.time.model_copy(update={"stop_at_rest": False} if is_released else {})  # slow as it may begin
    return scenario.model_copy(update={"output": output, "start": start, "time": time})
