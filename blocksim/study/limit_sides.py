"""Both sides of the brackets of a limit as kept runs, with frames and contacts: what pictures of mechanisms show."""

from collections.abc import Mapping
from pathlib import Path

from blocksim.errors import OutputError, StoppedEarlyError
from blocksim.scenario import Scenario
from blocksim.simulation.provenance import run_hash
from blocksim.study.criterion import Verdict
from blocksim.study.executors.ensemble import INTERRUPTED, run_case
from blocksim.study.limit_plan import LimitPlan
from blocksim.study.limit_search import Change, Number
from blocksim.study.rows import FINISHED, Row
from blocksim.study.sweep_folder import CASES

MOST = 3  # brackets whose sides are kept


def keep_sides(
    folder: Path, plan: LimitPlan, changes: list[Change[Verdict]], rows: Mapping[Number, Row]
) -> dict[Number, str]:
    """Run both sides of the first brackets once more, into folders of their own, unless they are there.

    Returns the names of the folders by value; without those whose run did not finish. The motion is that of the search,
    so a run that ends otherwise could not be written. Raises OutputError then, and StoppedEarlyError on Ctrl-C.
    """
    wanted = [value for change in changes[:MOST] for value in (change.low, change.high)]
    kept: dict[Number, str] = {}
    for value in dict.fromkeys(wanted):
        if rows[value]["status"] == FINISHED:
            scenario = _with_contacts(plan.scenario_at(value))
            name = run_hash(scenario)
            row = run_case(scenario, folder / CASES / name)
            if row["status"] == INTERRUPTED:
                message = "stopped while the runs beside a limit were kept; rerun the command to finish"
                raise StoppedEarlyError(message)
            if row["status"] != FINISHED:
                message = f"{row['reason']}; the limit is found, its runs are not kept: rerun the command, or --no-runs"
                raise OutputError(message)
            kept[value] = name
    return kept


def _with_contacts(scenario: Scenario) -> Scenario:
    return scenario.model_copy(update={"output": scenario.output.model_copy(update={"contacts": True})})
