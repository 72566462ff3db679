"""blocksim fragility: the probability of collapse over an intensity."""

from math import isfinite
from pathlib import Path
from typing import Annotated

import typer

from blocksim.analysis.lognormal import Curve, NoCurve
from blocksim.cli import completion, options
from blocksim.cli.output import answer, note, number, print_json, table_lines
from blocksim.cli.prepare import tell_compilation, warn_of_values
from blocksim.cli.progress import leaving_unfinished_cases, reporting
from blocksim.errors import ExitCode
from blocksim.scenario import Document
from blocksim.simulation.compilation import kernels_of
from blocksim.study.executors import Execution
from blocksim.study.fragility import FragilityResult, run_fragility
from blocksim.study.fragility_plan import (
    COLLAPSE,
    FAILS,
    INTENSITY,
    MEMBERS,
    SCATTER,
    STRIPES,
    FragilityPlan,
    read_fragility,
)
from blocksim.study.progress import WHOLE, Shard
from blocksim.study.vary import read_variations

DIGITS = 3
DOUBTFUL = 0.05  # probability of a larger deviance below which counts and curve do not agree
HEADS = ("samples", "failures", "P", "95 % low", "high", "curve", "still moving", "no result")


def fragility_command(
    scenario: options.ScenarioPath,
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
    settings: options.Settings = None,
    executor: options.ExecutorName = None,
    jobs: options.Jobs = None,
    scheduler: options.Scheduler = None,
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
    overwrite: options.Overwrite = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
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
    tell_compilation(kernels_of(base), quiet=silent)
    heads = {head.key: head for head in plan.cases.heads}
    with leaving_unfinished_cases(), reporting(heads.values(), quiet=silent) as on_row:
        found = run_fragility(
            plan,
            Execution(executor=None if executor is None else executor.value, jobs=jobs, scheduler=scheduler),
            WHOLE if shard is None else Shard.parse(shard),
            out=out,
            overwrite=overwrite,
            retry_failed=retry_failed,
            on_row=on_row,
        )
    if as_json:
        print_json({"folder": str(found.folder), **found.to_dict()})
    else:
        answer("\n".join([*_table(found), "", *_told(plan, found.curve), *_common(found)]))
    if not silent:
        _tell_end(found)
    raise typer.Exit(_exit_code(found))


def _exit_code(found: FragilityResult) -> ExitCode:
    if found.failed:
        return ExitCode.SWEEP_HAS_FAILURES
    return ExitCode.SUCCESS if isinstance(found.curve, Curve) or found.left else ExitCode.OUTSIDE


def _table(found: FragilityResult) -> list[str]:
    """Return the counts of every intensity, with the curve beside them; columns without news are left out."""
    rows = [
        [
            f"{one.intensity:.6g}",
            str(one.members),
            str(one.failures),
            *(number(value, DIGITS) for value in (one.share, *one.limits, at)),
            str(one.moving_on),
            str(one.no_result),
        ]
        for one, at in zip(found.points, _on_curve(found), strict=True)
    ]
    heads = (_name(found.plan), *HEADS)
    told = [place for place in range(len(heads)) if place < len(heads) - 2 or any(row[place] != "0" for row in rows)]
    title = f'{found.plan.head.key}: failure means "{found.plan.failure}"'
    return [title, "", *table_lines([heads[i] for i in told], [[row[i] for i in told] for row in rows], left=0)]


def _name(plan: FragilityPlan) -> str:
    return plan.head.unit or "value"


def _on_curve(found: FragilityResult) -> list[float]:
    import numpy as np

    at = found.probability(np.array([one.intensity for one in found.points]))
    return [float("nan")] * len(found.points) if at is None else at.tolist()


def _told(plan: FragilityPlan, curve: Curve | NoCurve) -> list[str]:
    """Return the curve in words, or why there is none."""
    if isinstance(curve, NoCurve):
        return [f"no curve: {curve.reason}", *_beyond(plan, curve)]
    lines = [
        f"median      {plan.shown(curve.median)}, 95 % {_span(curve.median_interval, plan.head.unit)}",
        f"dispersion  {curve.dispersion:.4g}, 95 % {_span(curve.dispersion_interval)}",
    ]
    if curve.freedom > 0 and isfinite(curve.fits):
        agrees = "" if curve.fits >= DOUBTFUL else ": counts and curve do not agree"
        lines.append(
            f"deviance    {curve.deviance:.3g}, degrees of freedom {curve.freedom}, p = {curve.fits:.2g}{agrees}"
        )
    return lines


def _common(found: FragilityResult) -> list[str]:
    """Say by how much the records that all intensities share widen the intervals of a curve."""
    if found.inflation is None or isinstance(found.curve, NoCurve):
        return []
    wider = f"{found.inflation**0.5:.3g} times as wide as those of independent draws"
    return [f"intervals   {wider}: {found.plan.records} records shared"]


def _span(ends: tuple[float, float], unit: str = "") -> str:
    low, high = ends
    if high == float("inf"):
        return f"from {low:.5g} {unit}".rstrip() + ", open above" if low else "open: the counts do not bound it"
    return (f"{low:.5g} to {high:.5g} {unit}" if low else f"up to {high:.5g} {unit}").rstrip()


def _beyond(plan: FragilityPlan, curve: NoCurve) -> list[str]:
    """Return what the counts still say of the median."""
    low, high = curve.low, curve.high
    match low > 0.0, high < float("inf"):
        case True, True:
            where = f"between {plan.shown(low)} and {plan.shown(high)}" if low < high else f"near {plan.shown(low)}"
            return [f"the median lies {where}; intensities there would show the curve"]
        case True, False:
            return [f"the median lies above {plan.shown(low)}; larger intensities would show the curve"]
        case False, True:
            return [f"the median lies below {plan.shown(high)}; smaller intensities would show the curve"]
    return []


def _tell_end(found: FragilityResult) -> None:
    moving = sum(one.moving_on for one in found.points)
    if moving:
        note(f"{moving} surviving samples were still moving at the end; increase time.end to decide them")
    if isinstance(found.curve, Curve) and found.is_extrapolated:
        x = [one.intensity for one in found.points if one.members]
        side, end = ("above", max(x)) if found.curve.median > max(x) else ("below", min(x))
        note(f"warning: the median lies {side} {found.plan.shown(end)}, beyond all intensities that were run")
    if found.failed:
        note(f"{found.failed} samples have no result, see members.csv; they count neither as failures nor as survivors")
    if found.left:
        note(f"{found.left} samples have not run; after all shards, rerun without --shard")
    note(f"{sum(one.members + one.no_result for one in found.points)} runs, {found.run} of them now: {found.folder}")
