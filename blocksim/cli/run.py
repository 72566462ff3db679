"""blocksim run: simulate one scenario."""

import math
import os
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Annotated

import typer

from blocksim.cli import command_line, compare, output, prepare, progress
from blocksim.options import Option
from blocksim.simulation import Result, files, loop, observables, rest_state, safety, trajectory
from blocksim.simulation.run import RunCallbacks
from blocksim.study import compare as judgement, rows, run

MOST_ROWS = 40  # of the final table on the screen; of a longer one the first FIRST_ROWS are shown
FIRST_ROWS = 10
INTERRUPTED = "interrupted"
MOST_BASES = 6  # of structures whose factors of safety are on the screen
IDLE = 1e3  # factors beyond are those of round-off


def run_command(
    context: typer.Context,
    source: prepare.ScenarioInput,
    options: run.RunOptions,
    screen: command_line.Screen,
    *,
    live: Annotated[bool, Option("Show the run while it computes, on a page of the loopback address.")] = False,
) -> None:
    """Simulate a scenario and print the final positions.

    If the scenario names an experiment, the table has the measured ranges. A finished run is not repeated but shown.
    --live prints the address of a page with the report's player, which follows the run and closes with it.
    Ctrl-C, SIGTERM, SIGHUP, SIGQUIT, SIGUSR1 and --wall-time stop a run; --resume continues it with bit-identical
    results.

    Example: blocksim run scenarios/three_blocks.toml --set time.end=0.1
    """
    if options.resume and options.overwrite:
        raise typer.BadParameter(
            "cannot be combined with --overwrite, which discards existing results", param_hint="--resume"
        )

    def start(kernels: str) -> None:
        count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        if options.threads > count:  # all wait for one another at every step
            plural = "s" if count > 1 else ""
            output.note(f"warning: {options.threads} threads on {count} core{plural}: oversubscribed, use {count}")
        prepare.announce_compilation(kernels, quiet=screen.silent)

    listener = RunCallbacks(on_start=start) if screen.silent else RunCallbacks(output.note, start)
    with source.built() as ready, progress.run_progress(quiet=screen.silent) as on_progress:
        shown = prepare.warn_of_values([ready], screen)
        out = options.out or files.default_folder(ready)
        if context.obj is not None:  # imports and compiling are waited for too
            over = time.monotonic() - context.obj
            options = replace(options, precautions=replace(options.precautions, time_over=over))
        with _page(Path(out)) if live else nullcontext():
            try:
                result = run.run(ready, replace(options, out=out, on_progress=on_progress, listener=listener))
            except rest_state.SettleError as error:
                held = ' --set "start.hold=[]"' * bool(ready.scenario.start.hold)
                raise rest_state.SettleError(
                    f"{error}; --set start.settle=false{held} runs it from where it is placed"
                ) from None
    # SIGHUP reports that the terminal is lost
    with nullcontext() if result.status == rows.FINISHED else suppress(OSError):
        screen.show(_report(result, shown))
    raise typer.Exit(result.summary.exit_code)


@contextmanager
def _page(folder: Path) -> Iterator[None]:
    """Show a run while it computes; the address is a note, also beside --quiet."""
    from blocksim.study import live

    with live.beside_run(folder) as address:
        output.note(f"live: {address or 'warning: the page does not answer'}")
        yield


def _report(result: Result, shown: Sequence[str]) -> command_line.Report:
    """Return the final table, with the measured ranges if the scenario names an experiment.

    Warnings that were `shown` before the run are not repeated.
    """
    endings = {name: trajectory.rows_of(table) for name, table in result.endings.items()}
    summary = result.summary.model_dump()
    is_whole = result.status == rows.FINISHED
    return command_line.Report(
        _answer_lines(result),
        {"folder": str(result.folder), "final": trajectory.rows_of(result.columns), **endings, "summary": summary},
        before=_end_lines(result, shown),
        notes=[f"results: {result.folder}"] if is_whole else [],
        always=() if is_whole else _way_on(result),
        code=result.summary.exit_code,
    )


def _way_on(result: Result) -> Iterator[str]:
    """Yield why a run did not finish, and what can be done with it."""
    yield f"{result.name}: {result.status}: {result.reason}; partial results are in {result.folder}"
    step = result.summary.last_checkpoint
    if result.status == INTERRUPTED:
        yield f"continue with --resume (checkpoint at step {step})"
    else:
        yield "no checkpoint saved" if step is None else f"last good checkpoint at step {step}"


def _answer_lines(result: Result) -> list[str]:
    """Return the lines of the final table; of a long one the first, as all are in the run's folder."""
    if result.experiment is not None and result.status == rows.FINISHED:
        comparison = judgement.compare_run(result)
        return [*compare.comparison_table(comparison), *compare.verdict_lines(comparison)]
    blocks, *values = (result.columns[name] for name in ("block", "x_mm", "y_mm", "rotation_deg"))
    count = len(blocks)
    shown = count if count <= MOST_ROWS else FIRST_ROWS
    cells = [(block, *map(output.number, row)) for block, *row in islice(zip(blocks, *values, strict=True), shown)]
    lines = output.table_lines(("block", "x mm", "y mm", "rotation °"), cells) if cells else []
    more = [] if shown == count else [f"... and {count - shown} more blocks in final.csv"]
    lines += more
    for table in result.endings.values():  # of the systems beside the blocks
        titles = [name.replace("_", " ") for name in table]
        columns = [
            [output.number(cell) if isinstance(cell, float) else cell for cell in column] for column in table.values()
        ]
        lines += ["", *output.table_lines(titles, list(zip(*columns, strict=True)))]
    return lines


def _joint_lines(states: Mapping[str, safety.Safety]) -> Iterator[str]:
    """Yield the factors of safety at the bases of structures that anything pushes: at the end, or as they settled."""
    bases = {row.structure: (state, row) for state, one in states.items() for row in one.joints if row.joint == 0}
    pushed = [one for one in bases.values() if min(one[1].sliding or math.inf, one[1].overturning or math.inf) < IDLE]
    for state, row in pushed[:MOST_BASES]:
        ways = []
        for way in ("sliding", "overturning"):
            active = getattr(row, f"active_{way}")
            more = "" if active is None else f" (active {_factor(active)})"
            ways.append(f"{way} {_factor(getattr(row, way))}{more}")
        yield f"{row.structure} base{'' if state == 'end' else f', {state}'}: {', '.join(ways)}"
    if len(pushed) > MOST_BASES:
        yield f"... and {len(pushed) - MOST_BASES} more structures in joints.csv"
    if pushed:
        yield "  factors of safety mobilised by the forces of the run"
    if any(row.active_sliding is not None for _, row in pushed):
        yield "  near 1 they are no alarm for a wall at rest, which stands under any thrust"
        yield "  from the active one to that which overturns it"


def _factor(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}" if value < IDLE else f"> {IDLE:g}"


def _end_lines(result: Result, shown: Sequence[str]) -> Iterator[str]:
    """Yield how a run went, and a line that separates this from the answer."""
    summary = result.summary
    yield f"{result.name}: {result.status} ({result.reason}) at {summary.simulated_time_s:.3f} s of simulated time"
    yield (
        f"{summary.steps} steps of {summary.time_step_s:.2e} s in {summary.solver_seconds:.2f} s; "
        f"relative energy error {summary.energy_J.relative_residual:.0e}"
    )
    if summary.settled is not None:
        far = f"{output.number(summary.settled.largest_displacement_mm)} mm (block {summary.settled.displaced_block})"
        settled = "settled before time zero in" if summary.settled.at_rest else "no equilibrium: released after"
        yield f"{settled} {summary.settled.steps} steps; largest displacement {far}"
    yield from (f"{one.time_s:.3f} s: {one.what}" for one in summary.events)
    moved = summary.movement
    if moved is not None:  # what moved, how far on the way and first: blocks may end nearer
        told = dict(moved.lines(output.number))
        outcome, first = told.pop(observables.OUTCOME), told.pop(observables.FIRST, "")
        outcome += " (stopped: overlap)" * summary.reason.startswith(loop.STOPPED)
        yield f"{outcome}: {', '.join(map(' '.join, told.items()))}" + (
            f"\n{observables.FIRST}: {first}" if first else ""
        )
    if moved is not None and summary.reason != loop.REST.reason and moved.fastest_m_s > result.scenario.time.rest_speed:
        yield f"not at rest: block {moved.fastest_block} at {moved.fastest_m_s:.2g} m/s"
    yield from _joint_lines(summary.joints)
    yield from (f"warning: {text}" for text in summary.warnings if text not in shown)
    yield ""
