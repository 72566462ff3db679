"""blocksim fragility: the probability of collapse over an intensity."""

from pathlib import Path
from typing import Annotated

import typer

from blocksim.cli import command_line, completion
from blocksim.cli.output import show_answers
from blocksim.cli.prepare import announce_compilation, warn_of_values
from blocksim.cli.progress import case_progress, exit_when_stopped
from blocksim.scenario import Document
from blocksim.simulation.compilation import kernels_of
from blocksim.study.executors import Execution
from blocksim.study.fragility import run_fragility
from blocksim.study.fragility_plan import (
    COLLAPSE,
    FAILS,
    INTENSITY,
    MEMBERS,
    SCATTER,
    STRIPES,
    read_fragility,
)
from blocksim.study.manifest import WHOLE, Shard
from blocksim.study.vary import read_variations


def fragility_command(
    scenario: command_line.ScenarioPath,
    intensity: Annotated[
        str,
        typer.Option(
            INTENSITY,
            metavar="KEY=VALUES",
            help="The key that is the intensity: KEY=a,b,c or KEY=FROM:TO:COUNT (:log at the end spaces them "
            "logarithmically).",
            autocompletion=completion.scenario_keys,
        ),
    ],
    scatter: Annotated[
        list[str] | None,
        typer.Option(
            SCATTER,
            metavar="KEY=MEAN+-SD",
            help="Quantity to sample: KEY=MEAN+-SD, KEY=FROM:TO or equally likely values, KEY=a,b,c. "
            "Repeatable. Default: the distributions of [sweep].",
            autocompletion=completion.scenario_keys,
        ),
    ] = None,
    stripes: Annotated[
        list[str] | None,
        typer.Option(
            STRIPES,
            metavar="KEY=a,b,c",
            help="Records that all intensities share, each once at each of them, such as motion.table=a.csv,b.csv. "
            "Repeatable: keys whose values go together.",
            autocompletion=completion.scenario_keys,
        ),
    ] = None,
    members: Annotated[
        int | None,
        typer.Option(
            "--samples",
            "--members",
            min=1,
            metavar="N",
            help=f"Samples at every intensity (default: {MEMBERS}, or one of each record of {STRIPES}).",
        ),
    ] = None,
    fails: Annotated[
        list[str] | None,
        typer.Option(
            FAILS,
            metavar="CONDITIONS",
            help='What counts as failure, such as "moved > 50 mm" or "outcome = slid | fell". Separated by '
            f'commas: all must hold; repeated: any one suffices (default: "{COLLAPSE}").',
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, metavar="S", help="Random seed.")] = 0,
    settings: command_line.Settings = None,
    executor: command_line.ExecutorName = None,
    jobs: command_line.Jobs = None,
    scheduler: command_line.Scheduler = None,
    shard: Annotated[
        str | None,
        typer.Option(
            metavar="I/N", help="Run only samples I, I + N, ... (job arrays); then once without, for the curve."
        ),
    ] = None,
    retry_failed: Annotated[bool, typer.Option("--retry-failed", help="Rerun samples that did not finish.")] = False,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder to write (default: results/NAME/fragility-HASH)."),
    ] = None,
    overwrite: command_line.Overwrite = False,
    as_json: command_line.Json = False,
    quiet: command_line.Quiet = False,
) -> None:
    """Find the probability of collapse over an intensity.

    Draws samples at every intensity, independently, counts those that fail with exact (Clopper-Pearson) limits, and
    fits a lognormal curve by maximum likelihood: median, dispersion and their intervals. --stripes runs the same
    records at every intensity, each once, and widens the intervals of the curve accordingly. Runs that do not finish
    are listed and not counted (exit code 77). The same command again, also after a kill or with more samples, runs only
    what is missing. Needs the extra blocksim[study]. Exit code 1: no curve fits, as nothing or everything fails.

    Example: blocksim fragility mine.toml --intensity motion.scale=0.5:2:7 --scatter friction.block_block=0.6+-0.05
    """
    silent = quiet or as_json
    plan = read_fragility(
        Document.read(scenario).with_settings(settings or []),
        read_variations([intensity], INTENSITY),
        read_variations(scatter or [], SCATTER),
        stripes=read_variations(stripes or [], STRIPES),
        members=members,
        fails=fails or [COLLAPSE],
        seed=seed,
    )
    base = plan.document.build()
    if not silent:
        warn_of_values(base)
    announce_compilation(kernels_of(base), quiet=silent)
    heads = {head.key: head for head in plan.cases.heads}
    with exit_when_stopped(), case_progress(heads.values(), quiet=silent) as on_row:
        found = run_fragility(
            plan,
            Execution(executor=None if executor is None else executor.value, jobs=jobs, scheduler=scheduler),
            WHOLE if shard is None else Shard.parse(shard),
            out=out,
            overwrite=overwrite,
            retry_failed=retry_failed,
            on_row=on_row,
        )
    data = {"folder": str(found.folder), **found.to_dict()}
    show_answers([found], data, as_json=as_json, quiet=quiet)
    raise typer.Exit(found.code)
