"""blocksim sweep: many runs of one scenario, and what it shows: the estimate of --dry-run, and the table."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from blocksim.cli import command_line, output, prepare, progress
from blocksim.errors import ExitCode
from blocksim.options import Option
from blocksim.scenario import Document, Model
from blocksim.simulation.observables import DISPLACEMENT, END_SPEED, FIRST_MOVED, FIRST_MOVER, MOVES_ON, OUTCOME, TURN
from blocksim.study import manifest, plan, rows, sweep
from blocksim.view.sweeps.data import short_names

MOST_ROWS = 40
MOST_FAILURES = 5
MOST_MOVERS = 3
NOT_SHOWN = {"case", "reason", "seconds", END_SPEED, MOVES_ON}
SHOWN_LAST = (DISPLACEMENT, TURN, FIRST_MOVER, FIRST_MOVED)
POSITION = ".x_mm"
NOT_SHOWN_ENDS = ("rotation_deg", "y_mm", "left_mm", "right_mm")


def sweep_command(
    *,
    scenario: Annotated[Path | None, Option("Scenario file (TOML).", metavar="SCENARIO", is_argument=True)] = None,
    settings: command_line.Settings = None,
    options: sweep.SweepOptions,
    merged: Annotated[
        Path | None,
        Option("Run nothing; make sweep.csv from the shards in a folder.", flags=("--merge",), metavar="DIR"),
    ] = None,
    allow_missing: Annotated[bool, Option("Merge the cases finished so far.")] = False,
    dry_run: prepare.DryRun = False,
    screen: command_line.Screen,
) -> command_line.Report:
    """Run a scenario many times with some keys varied.

    Every case gives a row in sweep.csv. The same command again, also after a kill, runs only the missing cases.

    Example: blocksim sweep scenarios/slide.toml --vary gravity=1.62,9.81
    """
    if merged is not None:
        if scenario is not None:
            message = "--merge takes the plan from the folder; leave the scenario out"
            raise typer.BadParameter(message, param_hint="--merge")
        return _table_report(sweep.merge(merged, allow_missing=allow_missing))
    if scenario is None:
        raise typer.BadParameter("a scenario file is needed, or --merge DIR", param_hint="SCENARIO")
    document = options.document(Document.read(scenario).with_settings(settings or []))
    base = Model(document)
    prepare.warn_of_values([base], screen)
    for text in rows.check_experiment(base):
        screen.note(f"warning: {text}")
    if dry_run:
        return prepare.estimate_report(plan.estimate(document, keep_cases=options.keep_cases), options.jobs, screen)
    for kernels in sweep.kernels_for(document):
        prepare.announce_compilation(kernels, quiet=screen.silent)
    heads = () if base.scenario.sweep is None else rows.heads_of(base.scenario.sweep)
    with progress.exit_on_stop(), progress.case_progress(heads, quiet=screen.silent) as on_row:
        result = sweep.run_sweep(document, replace(options, on_row=on_row))
    return _table_report(result)


def _table_report(result: manifest.SweepResult) -> command_line.Report:
    """Return the columns that vary as far as they fit on the screen, outcomes, failures and what is left to do."""
    table = result.table
    short = dict(zip(result.keys, short_names(result.keys), strict=True))
    columns = [
        name for name in table.columns if name not in (*NOT_SHOWN, *SHOWN_LAST) and not name.endswith(NOT_SHOWN_ENDS)
    ]
    columns += [name for name in SHOWN_LAST if name in table]
    # "finished" in all rows does not vary, nor does a block that stays
    texts = {name: {f"{one:.2f}" if isinstance(one, float) else str(one) for one in table[name]} for name in columns}
    names = [name for name in columns if name in (*short, "inside") or len(table) == 1 or len(texts[name]) > 1]
    heads, entries, fitting = _texts(result, names, short)
    if fitting < sum(name not in SHOWN_LAST for name in names):  # the first blocks of many may all stay where they are
        # columns of single blocks behind others, and last what a note below the table tells
        names.sort(key=lambda name: (name in (FIRST_MOVER, FIRST_MOVED), name.endswith(POSITION)))
        heads, entries, fitting = _texts(result, names, short)
    counts = {
        "row": len(table) - len(entries),
        "column": len(names) - fitting,
        "constant column": len(columns) - len(names),
    }
    left_out = [f"{count} {what}{'' if count == 1 else 's'}" for what, count in counts.items() if count]
    notes = [f"not shown: {', '.join(left_out)}"] if left_out else []
    notes += _movement_lines(result)
    if result.share_inside is not None:
        notes.append(f"{result.share_inside:.0%} of {len(table)} cases are inside all measured ranges")
    notes += _failure_lines(result, short)
    if result.missing:
        notes.append(f"{result.missing} cases have not been run; rerun the command to finish")
    return command_line.Report(
        output.table_lines(heads[:fitting], [row[:fitting] for row in entries], left=0),
        {"folder": str(result.folder), "rows": table.to_dict(orient="records")},
        [*notes, f"table: {result.folder / result.name}"],
        code=ExitCode.SWEEP_HAS_FAILURES if result.failed else ExitCode.SUCCESS,
    )


def _texts(
    result: manifest.SweepResult, names: list[str], short: dict[str, str]
) -> tuple[list[str], list[list[str]], int]:
    """Return heads and rows of a table of some columns, and how many of these fit on the screen, at least one."""
    heads = [short.get(name, name) for name in names]
    first = result.table[names].head(MOST_ROWS).itertuples(index=False)
    entries = [[progress.cell_text(value) for value in row] for row in first]
    width, fitting = -len(output.GAP), 0
    for column in zip(heads, *entries, strict=True):
        width += len(output.GAP) + max(map(len, column))
        if width > output.width_of_screen():
            break
        fitting += 1
    return heads, entries, max(fitting, 1)


def _movement_lines(result: manifest.SweepResult) -> Iterator[str]:
    """Yield how often each outcome occurs, and the largest movement of all."""
    table = result.table
    if OUTCOME not in table or table[OUTCOME].isna().all():  # all failed
        return
    counts = ", ".join(f"{count} {name}" for name, count in table[OUTCOME].value_counts().items())
    far, turned = table[DISPLACEMENT].max(), table[TURN].max()
    yield f"{counts}; largest displacement {far:.2f} mm, rotation {turned:.2f}° (start to end)"
    moving = int(table[MOVES_ON].isin([True, "True"]).sum()) if MOVES_ON in table else 0
    if moving:
        yield f"{moving} of {len(table)} cases were still moving at the end; increase time.end to see where they end"
    if FIRST_MOVER in table and table[FIRST_MOVER].notna().any():
        movers = table[FIRST_MOVER].value_counts()
        first = ", ".join(f"block {name} in {count}" for name, count in movers.head(MOST_MOVERS).items())
        more = f", {len(movers) - MOST_MOVERS} others" if len(movers) > MOST_MOVERS else ""
        yield f"first to move: {first}{more} of {len(table)} cases"


def _failure_lines(result: manifest.SweepResult, short: dict[str, str]) -> Iterator[str]:
    """Yield the first cases that failed, with their reasons."""
    if not result.failed:
        return
    failed = result.table[result.table["status"] != rows.FINISHED]
    yield f"{result.failed} of {len(result.table)} cases did not finish; the first: {failed.iloc[0]['reason']}"
    for _, row in failed.head(MOST_FAILURES).iterrows():
        values = ", ".join(f"{name} = {progress.cell_text(row[key])}" for key, name in short.items())
        yield f"  {row['status']}: {values}: {str(row['reason']).splitlines()[0]}"
    if len(failed) > MOST_FAILURES:
        yield f"  and {len(failed) - MOST_FAILURES} more; --retry-failed runs them again"
