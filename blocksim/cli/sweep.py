"""blocksim sweep: many runs of one scenario."""

import os
from collections.abc import Iterable, Sequence
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer

from blocksim.cli import options
from blocksim.cli.compiling import tell_compilation
from blocksim.cli.dry_run import show_estimate
from blocksim.cli.output import GAP, answer, note, print_json, table_lines, width_of_screen
from blocksim.cli.reporter import reporting, shown
from blocksim.cli.scenario import warn_of_values
from blocksim.cli.vary import with_vary
from blocksim.errors import ExitCode, StoppedEarlyError
from blocksim.scenario import Document
from blocksim.study.executors.ensemble import is_still_running
from blocksim.study.progress import WHOLE, Shard
from blocksim.study.rows import FINISHED, MOVEMENT, Head, heads_of
from blocksim.study.sweep import kernels_for, sweep
from blocksim.study.sweep import merge as merge_shards
from blocksim.study.sweep_table import SweepResult

MOST_ROWS = 40
MOST_FAILURES = 5
MOST_MOVERS = 3
NOT_SHOWN = {"case", "reason", "seconds"}
OUTCOME, MOVER, MOVED, DISPLACEMENT, TURN = MOVEMENT
SHOWN_LAST = (DISPLACEMENT, TURN, MOVER, MOVED)
POSITION = ".x_mm"
NOT_SHOWN_ENDS = ("rotation_deg", "y_mm", "left_mm", "right_mm")


class Executor(StrEnum):
    """What runs the cases."""

    ENSEMBLE = "ensemble"
    PROCESSES = "processes"
    DASK = "dask"


class Mode(StrEnum):
    """How values are combined."""

    GRID = "grid"
    LIST = "list"
    TABLE = "table"
    LHS = "lhs"
    SOBOL = "sobol"
    NORMAL = "normal"


def sweep_command(
    scenario: Annotated[Path | None, typer.Argument(metavar="SCENARIO", help="Scenario file (TOML).")] = None,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            "--vary",
            metavar="KEY=VALUES",
            help="KEY=a,b,c or KEY=from:to:count; for random draws KEY=from:to or KEY=mean+-sd. With :log at the end, "
            "from:to is spaced logarithmically. Repeatable.",
        ),
    ] = None,
    mode: Annotated[
        Mode | None,
        typer.Option(help="All combinations, the k-th value of every key, the scenario's table, or random draws."),
    ] = None,
    samples: Annotated[int | None, typer.Option(metavar="N", help="Number of cases to draw (default: 128).")] = None,
    seed: Annotated[int | None, typer.Option(metavar="S", help="Random seed (default: 0).")] = None,
    settings: options.Settings = None,
    executor: Annotated[
        Executor | None,
        typer.Option(help="ensemble: in this process (default); processes: a case that crashes stops no other."),
    ] = None,
    jobs: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="Threads or processes (default: one per core).")
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Scheduler of a Dask cluster, such as tcp://host:8786.")
    ] = None,
    shard: Annotated[
        str | None, typer.Option(metavar="I/N", help="Run only cases I, I + N, ... (job arrays); then --merge.")
    ] = None,
    merge: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Run nothing; make sweep.csv from the shards in a folder.")
    ] = None,
    allow_missing: Annotated[bool, typer.Option("--allow-missing", help="Merge the cases finished so far.")] = False,
    keep_cases: Annotated[
        bool, typer.Option("--keep-cases", help="Keep a run folder with all frames for every case.")
    ] = False,
    fail_fast: Annotated[bool, typer.Option("--fail-fast", help="Stop at the first case that fails.")] = False,
    retry_failed: Annotated[bool, typer.Option("--retry-failed", help="Run failed cases again.")] = False,
    out: options.SweepFolder = None,
    overwrite: options.Overwrite = False,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Print number of cases, cost and size without running anything.")
    ] = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Run a scenario many times with some keys varied.

    Every case gives a row in sweep.csv. The same command again, also after a kill, runs only the missing cases.

    Example: blocksim sweep scenarios/slide.toml --vary gravity=1.62,9.81
    """
    if merge is not None:
        _tell(_merged(merge, scenario, allow_missing=allow_missing), as_json=as_json, quiet=quiet)
    if scenario is None:
        raise typer.BadParameter("a scenario file is needed, or --merge DIR", param_hint="SCENARIO")
    silent = quiet or as_json
    document = with_vary(
        Document.read(scenario).with_settings(settings or []),
        vary or [],
        None if mode is None else mode.value,
        samples=samples,
        seed=seed,
    )
    if not silent:
        warn_of_values(document.build())
    if dry_run:
        show_estimate(document, jobs, keep_cases=keep_cases, as_json=as_json)
        return
    for kernels in kernels_for(document):
        tell_compilation(kernels, quiet=silent)
    result = _sweep(
        document,
        out=out,
        executor=None if executor is None else executor.value,
        jobs=jobs,
        scheduler=scheduler,
        shard=WHOLE if shard is None else Shard.parse(shard),
        keep_cases=keep_cases,
        fail_fast=fail_fast,
        retry_failed=retry_failed,
        overwrite=overwrite,
        silent=silent,
    )
    _tell(result, as_json=as_json, quiet=quiet)


def _sweep(document: Document, *, silent: bool, **wanted: Any) -> SweepResult:
    """Run a sweep; if stopped early, leave without waiting for a case that takes minutes."""
    try:
        with reporting(short_keys(document), heads_in(document), quiet=silent) as on_row:
            return sweep(document, on_row=on_row, **wanted)
    except StoppedEarlyError as error:
        if is_still_running():
            note(str(error))
            os._exit(error.exit_code)
        raise


def _merged(folder: Path, scenario: Path | None, *, allow_missing: bool) -> SweepResult:
    if scenario is not None:
        raise typer.BadParameter("--merge takes the plan from the folder; leave the scenario out", param_hint="--merge")
    return merge_shards(folder, allow_missing=allow_missing)


def _tell(result: SweepResult, *, as_json: bool, quiet: bool) -> NoReturn:
    """Show the table and leave with the exit code."""
    short = short_names(result.keys)
    if as_json:
        print_json({"folder": str(result.folder), "rows": result.table.to_dict(orient="records")})
    else:
        _show(result, short, quiet=quiet)
    raise typer.Exit(ExitCode.SWEEP_HAS_FAILURES if result.failed else ExitCode.SUCCESS)


def short_keys(document: Document) -> dict[str, str]:
    """Return the varied keys with the shortest ends that tell them apart."""
    plan = document.build().sweep
    return short_names(() if plan is None else tuple(plan.vary))


def heads_in(document: Document) -> dict[str, Head]:
    """Return the columns of the varied keys."""
    plan = document.build().sweep
    return {} if plan is None else {head.key: head for head in heads_of(plan)}


def short_names(keys: Sequence[str]) -> dict[str, str]:
    """Return keys with the shortest ends that tell them apart."""
    return {
        key: next(end for end in _ends(key) if sum(f".{other}".endswith(f".{end}") for other in keys) == 1)
        for key in keys
    }


def _ends(key: str) -> list[str]:
    parts = key.split(".")
    return [".".join(parts[start:]) for start in reversed(range(len(parts)))]


def _show(result: SweepResult, short: dict[str, str], *, quiet: bool) -> None:
    table = result.table
    told = [
        name for name in table.columns if name not in (*NOT_SHOWN, *SHOWN_LAST) and not name.endswith(NOT_SHOWN_ENDS)
    ]
    told += [name for name in SHOWN_LAST if name in table]
    names = [name for name in told if name in short or name == "inside" or _varies(table[name])]
    heads, rows, fitting = _texts(result, names, short)
    if fitting < sum(name not in SHOWN_LAST for name in names):  # the first blocks of many may all stay where they are
        heads, rows, fitting = _texts(result, sorted(names, key=_rank), short)
    answer("\n".join(table_lines(heads[:fitting], [row[:fitting] for row in rows], left=0)))
    if quiet:
        return
    counts = {"row": len(table) - len(rows), "column": len(names) - fitting, "constant column": len(told) - len(names)}
    left_out = [f"{count} {what}{'' if count == 1 else 's'}" for what, count in counts.items() if count]
    if left_out:
        note(f"not shown: {', '.join(left_out)}")
    _tell_movement(result)
    if result.share_inside is not None:
        note(f"{result.share_inside:.0%} of {len(table)} cases are inside all measured ranges")
    _tell_failures(result, short)
    if result.left:
        note(f"{result.left} cases have not been run; rerun the command to finish")
    note(f"table: {result.folder / result.name}")


def _texts(result: SweepResult, names: list[str], short: dict[str, str]) -> tuple[list[str], list[list[str]], int]:
    """Return heads and rows of a table of some columns, and how many of these fit on the screen."""
    heads = [short.get(name, name) for name in names]
    rows = [[shown(value) for value in row] for row in result.table[names].head(MOST_ROWS).itertuples(index=False)]
    return heads, rows, _fitting(heads, rows)


def _rank(name: str) -> tuple[bool, bool]:
    """Return a key that sorts columns of single blocks behind others, and last what a note below the table tells."""
    return name in (MOVER, MOVED), name.endswith(POSITION)


def _tell_movement(result: SweepResult) -> None:
    """Report how often each outcome occurs, and the largest movement of all."""
    table = result.table
    if OUTCOME not in table or table[OUTCOME].isna().all():  # of an earlier version, or all failed
        return
    counts = ", ".join(f"{count} {name}" for name, count in table[OUTCOME].value_counts().items())
    far, turned = table[DISPLACEMENT].max(), table[TURN].max()
    note(f"{counts}; largest displacement {far:.2f} mm, rotation {turned:.2f}° (start to end)")
    if MOVER in table and table[MOVER].notna().any():
        movers = table[MOVER].value_counts()
        first = ", ".join(f"block {name} in {count}" for name, count in movers.head(MOST_MOVERS).items())
        more = f", {len(movers) - MOST_MOVERS} others" if len(movers) > MOST_MOVERS else ""
        note(f"first moved: {first}{more} of {len(table)} cases")


def _tell_failures(result: SweepResult, short: dict[str, str]) -> None:
    """Name the first cases that failed, with their reasons."""
    if not result.failed:
        return
    failed = result.table[result.table["status"] != FINISHED]
    first = failed.iloc[0]["reason"]
    note(f"{result.failed} of {len(result.table)} cases did not finish; the first: {first}")
    for _, row in failed.head(MOST_FAILURES).iterrows():
        values = ", ".join(f"{name} = {shown(row[key])}" for key, name in short.items())
        note(f"  {row['status']}: {values}: {str(row['reason']).splitlines()[0]}")
    if len(failed) > MOST_FAILURES:
        note(f"  and {len(failed) - MOST_FAILURES} more; --retry-failed runs them again")


def _varies(values: Iterable[object]) -> bool:
    """Return True if a column varies: "finished" in all rows does not, nor does a block that stays."""
    told = [f"{value:.2f}" if isinstance(value, float) else str(value) for value in values]
    return len(told) == 1 or len(set(told)) > 1


def _fitting(heads: list[str], rows: list[list[str]]) -> int:
    """Return how many columns fit on the screen, at least one."""
    width, room = 0, width_of_screen()
    for index, column in enumerate(zip(heads, *rows, strict=True)):
        width += max(map(len, column)) + (len(GAP) if index else 0)
        if width > room:
            return max(index, 1)
    return len(heads)
