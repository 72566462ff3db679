"""What `blocksim limit --over` shows: a limit at each value of another key."""

import textwrap
from pathlib import Path
from typing import NoReturn

import typer

from blocksim.cli.limit_give import warn_of_give
from blocksim.cli.output import answer, note, print_json, table_lines, width_of_screen
from blocksim.cli.progress import leaving_unfinished_cases
from blocksim.errors import ExitCode
from blocksim.study.executors import Execution
from blocksim.study.limit_curve import CurvePlan, CurveResult, find_curve
from blocksim.study.limit_result import LimitResult


def show_curve(
    plan: CurvePlan,
    execution: Execution,
    out: Path | None,
    *,
    overwrite: bool,
    stiffer: bool | None,
    as_json: bool,
    quiet: bool,
) -> NoReturn:
    """Search, print the limits and leave with the exit code: 1 where some value has no change."""

    def tell(value: float, search: LimitResult) -> None:
        if not (quiet or as_json):
            note(f"{plan.head.key} = {plan.shown(value)}: {search.runs} runs, {search.run} of them now")

    with leaving_unfinished_cases():
        found = find_curve(plan, execution, out=out, overwrite=overwrite, stiffer=stiffer, on_limit=tell)
    if as_json:
        print_json({"folder": str(found.folder), **found.to_dict()})
    else:
        answer("\n".join(_lines(found)))
    if not (quiet or as_json):
        warn_of_give(found.searches.values(), as_given=stiffer is False)
        note(f"limits: {found.folder / 'limits.csv'}; picture: blocksim plot {found.folder}")
    raise typer.Exit(ExitCode.SUCCESS if all(one.changes for one in found.searches.values()) else ExitCode.OUTSIDE)


def _lines(found: CurveResult) -> list[str]:
    plan = found.plan
    unit, key = plan.one.unit, plan.one.key
    rows: list[list[str]] = []
    for value, search in found.searches.items():
        shown = plan.shown(value)
        rows += [
            [shown, f"{one.low:.7g}", f"{one.high:.7g}", one.below.value, one.above.value] for one in search.changes
        ]
        if not search.changes:
            verdict = next(iter(search.verdicts.values())).value
            rows.append([shown, "–", "–", verdict, verdict])
    heads = (plan.head.key, f"from {unit}".rstrip(), f"to {unit}".rstrip(), "below", "above")
    title = f'{key} over {plan.head.key}: stands means "{plan.one.criterion.text}"'
    return [*textwrap.wrap(title, width_of_screen()), "", *table_lines(heads, rows, left=1)]
