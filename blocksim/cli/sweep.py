"""blocksim sweep: many runs of one scenario."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer

from blocksim.cli import completion, options
from blocksim.cli.output import print_json
from blocksim.cli.prepare import tell_compilation, warn_of_values
from blocksim.cli.sweep_output import leaving_unfinished_cases, reporting, short_names, show_estimate, show_sweep
from blocksim.cli.vary import with_vary
from blocksim.errors import ExitCode
from blocksim.scenario import Document, Sweep
from blocksim.study.progress import WHOLE, Shard
from blocksim.study.rows import heads_of
from blocksim.study.sweep import kernels_for, sweep
from blocksim.study.sweep import merge as merge_shards
from blocksim.study.sweep_table import SweepResult


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
            autocompletion=completion.scenario_keys,
        ),
    ] = None,
    mode: Annotated[
        Mode | None,
        typer.Option(help="All combinations, the k-th value of every key, the scenario's table, or random draws."),
    ] = None,
    samples: Annotated[int | None, typer.Option(metavar="N", help="Number of cases to draw (default: 128).")] = None,
    seed: Annotated[int | None, typer.Option(metavar="S", help="Random seed (default: 0).")] = None,
    settings: options.Settings = None,
    executor: options.ExecutorName = None,
    jobs: options.Jobs = None,
    scheduler: options.Scheduler = None,
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
    base = document.build()
    if not silent:
        warn_of_values(base)
    if dry_run:
        show_estimate(document, jobs, keep_cases=keep_cases, as_json=as_json)
        return
    for kernels in kernels_for(document):
        tell_compilation(kernels, quiet=silent)
    result = _sweep(
        document,
        base.sweep,
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


def _sweep(document: Document, plan: Sweep | None, *, silent: bool, **wanted: Any) -> SweepResult:
    """Run a sweep and report its rows."""
    short = short_names(() if plan is None else tuple(plan.vary))
    heads = {} if plan is None else {head.key: head for head in heads_of(plan)}
    with leaving_unfinished_cases(), reporting(short, heads, quiet=silent) as on_row:
        return sweep(document, on_row=on_row, **wanted)


def _merged(folder: Path, scenario: Path | None, *, allow_missing: bool) -> SweepResult:
    if scenario is not None:
        raise typer.BadParameter("--merge takes the plan from the folder; leave the scenario out", param_hint="--merge")
    return merge_shards(folder, allow_missing=allow_missing)


def _tell(result: SweepResult, *, as_json: bool, quiet: bool) -> NoReturn:
    """Show the table and leave with the exit code."""
    if as_json:
        print_json({"folder": str(result.folder), "rows": result.table.to_dict(orient="records")})
    else:
        show_sweep(result, quiet=quiet)
    raise typer.Exit(ExitCode.SWEEP_HAS_FAILURES if result.failed else ExitCode.SUCCESS)
