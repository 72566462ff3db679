"""blocksim limit: the values of a key between which the structure stands and falls."""

import re
from pathlib import Path
from typing import Annotated

import typer

from blocksim.cli import command_line, completion
from blocksim.cli.output import answer, note, show_answers
from blocksim.cli.prepare import announce_compilation
from blocksim.cli.progress import exit_when_stopped
from blocksim.scenario import Document
from blocksim.scenario.check import implausible_values
from blocksim.scenario.models.stepping import SPRINGS
from blocksim.simulation.compilation import kernels_of
from blocksim.study.criterion import DEFAULT, Verdict
from blocksim.study.executors import Execution
from blocksim.study.limit import STEP, find_curve, find_limit
from blocksim.study.limit_answer import LimitAnswer
from blocksim.study.limit_margin import STIFFNESS, refuse_without_springs
from blocksim.study.limit_plan import (
    NAMES,
    OPTION,
    OVER,
    SCANNED,
    TOLERANCE,
    LimitPlan,
    read_curve,
    read_limit,
    variants,
)
from blocksim.study.rows import Row
from blocksim.study.vary import RANGE, read_variations

SHARE = re.compile(r"([0-9.]+(?:[eE][+-]?[0-9]+)?)\s*(%?)")
PERCENT = 100.0
AT_ONCE = (
    "start.settle = false: loads that come at once shift limits of arches and walls by 0.2 to 4 %; leave it out, and "
    "every run begins at rest"
)


def _share(text: object) -> float:
    """Return a share that is written as 0.1% or 0.001. Raises BadParameter, a mistake of usage."""
    found = SHARE.fullmatch(str(text).strip())
    if found is None:
        raise typer.BadParameter(f"{str(text)[:40]!r} is not a share; write it as in 0.1% or 0.001")
    try:
        value = float(found[1])
    except ValueError:
        raise typer.BadParameter(f"{found[1]!r} is not a number") from None
    return value / PERCENT if found[2] else value


def limit_command(
    scenario: command_line.ScenarioPath,
    vary: Annotated[
        list[str],
        typer.Option(
            OPTION,
            metavar="KEY=FROM:TO",
            help="The key and its range. KEY=FROM:TO:COUNT scans COUNT values first (default: those of --scan); :log "
            "at the end spaces them logarithmically.",
            autocompletion=completion.scenario_keys,
        ),
    ],
    stands: Annotated[
        str,
        typer.Option(
            metavar="CONDITIONS",
            help='What counts as standing, such as "moved < 5 mm", "turned < 10 deg" or "outcome != fell". '
            "Separated by commas: all must hold.",
        ),
    ] = DEFAULT,
    to: Annotated[
        float,
        typer.Option(
            metavar="SHARE", parser=_share, help="Relative width of the bracket at which to stop, such as 0.1%."
        ),
    ] = TOLERANCE,
    scan: Annotated[
        int,
        typer.Option(
            "--scan",
            metavar="N",
            help="How many values are scanned first. An island between two of them, in which other things happen, is "
            "not seen.",
        ),
    ] = SCANNED,
    over: Annotated[
        str | None,
        typer.Option(
            OVER,
            metavar="KEY=VALUES",
            help="Another key, KEY=a,b,c or KEY=FROM:TO:COUNT: search the limit at each of its values.",
            autocompletion=completion.scenario_keys,
        ),
    ] = None,
    both_laws: Annotated[
        bool, typer.Option("--both-laws", help="Search with springs and with rigid contacts, and compare.")
    ] = False,
    stiffer: Annotated[
        bool | None,
        typer.Option(
            "--stiffer/--as-given",
            help="Search once more with springs ten times as stiff and extrapolate to stiff contacts, always or never "
            "(default: where springs shift a limit by more than 0.25 %). --as-given also leaves the time step of rigid "
            "contacts as it is, which is halved once otherwise.",
        ),
    ] = None,
    settings: command_line.Settings = None,
    executor: command_line.ExecutorName = None,
    jobs: command_line.Jobs = None,
    scheduler: command_line.Scheduler = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Folder to write (default: results/NAME/limit-HASH).")
    ] = None,
    overwrite: command_line.Overwrite = False,
    no_runs: Annotated[
        bool, typer.Option("--no-runs", help="Keep no runs of both sides of a bracket, which plot and report show.")
    ] = False,
    as_json: command_line.Json = False,
    quiet: command_line.Quiet = False,
) -> None:
    """Find the critical value of a parameter (collapse threshold).

    Scans the range, as there may be more than one change, and then narrows every change between neighbours to a
    bracket. Under sustained loads every run begins at rest, unless start.settle = false. Failed runs are reported. The
    same command again, also after a kill, repeats no run. Limits of springs that give way are extrapolated to stiff
    contacts, those of rigid contacts verified with half the time step. Exit code 1: nothing changes within the range.

    Example: blocksim limit scenarios/tilting_wall.toml --vary ground.tilt=20deg:40deg
    """
    silent = quiet or as_json
    document = Document.read(scenario).with_settings(settings or [])
    given = read_variations(vary, OPTION, RANGE)
    execution = Execution(executor=None if executor is None else executor.value, jobs=jobs, scheduler=scheduler)
    if over is not None:
        if both_laws:
            raise typer.BadParameter(
                "a curve of limits is searched with one law; leave --both-laws out", param_hint=OVER
            )
        curve = read_curve(document, given, read_variations([over], OVER), stands=stands, tolerance=to, scan=scan)
        _warn(curve.one, silent=silent)

        def tell(value: float, search: LimitAnswer) -> None:
            if not silent:
                shown = f"{value:.6g} {curve.head.unit}".rstrip()
                note(f"{curve.head.key} = {shown}: {search.runs} runs, {search.run} of them now")

        with exit_when_stopped():
            points = find_curve(curve, execution, out=out, overwrite=overwrite, stiffer=stiffer, on_limit=tell)
        data = {"folder": str(points.folder), **points.to_dict()}
        show_answers([points], data, as_json=as_json, quiet=quiet)
        raise typer.Exit(points.code)
    plans = {
        name: read_limit(one, given, stands=stands, tolerance=to, scan=scan)
        for name, one in variants(document, both_laws=both_laws).items()
    }
    if stiffer:
        refuse_without_springs(*plans.values())
    _warn(next(iter(plans.values())), silent=silent)
    found = {}
    for name, plan in plans.items():
        announce_compilation(kernels_of(plan.scenario_at(plan.span.low)), quiet=silent)

        def tell_run(value: float, verdict: Verdict, row: Row, plan: LimitPlan = plan) -> None:
            if not silent:
                note(f"{plan.shown(value)}: {verdict.value} ({row['reason']})")

        folder = re.sub(r"[^a-z0-9.]+", "-", name)  # needs no quotes in a shell
        with exit_when_stopped():
            found[name] = find_limit(
                plan,
                execution,
                out=out / folder if out is not None and len(plans) > 1 else out,
                overwrite=overwrite,
                keep_runs=not no_runs,
                stiffer=None if stiffer and name != NAMES[SPRINGS] else stiffer,
                on_run=tell_run,
                on_other=lambda plan: None if silent else _tell_search(plan),
            )
    searches = [{"contacts": name, "folder": str(one.folder), **one.to_dict()} for name, one in found.items()]
    show_answers(list(found.values()), searches, as_json=as_json, quiet=quiet)
    if len(found) == 2 and not as_json:
        _compare(*found.values())
    raise typer.Exit(max(one.code for one in found.values()))


def _warn(plan: LimitPlan, *, silent: bool) -> None:
    """Warn of implausible values of the scenario, and of those at both ends of the range; compile what it needs."""
    announce_compilation(kernels_of(plan.scenario_at(plan.span.low)), quiet=silent)
    if silent:
        return
    ends = (plan.scenario_at(value) for value in (plan.span.low, plan.span.high))
    for text in dict.fromkeys(text for scenario in ends for text in implausible_values(scenario)):
        note(f"warning: {text}")
    if plan.comes_at_once:
        note(AT_ONCE)


def _tell_search(plan: LimitPlan) -> None:
    """Say that a limit is searched with stiffer springs, or half the step."""
    if STIFFNESS in plan.apart:
        note(f"springs shift this limit, or may: once more with {STIFFNESS} = {plan.apart[STIFFNESS]:g}")
    else:
        note(f"both sides once more with half the time step, {STEP} = {plan.apart[STEP]:.3g} s")


def _compare(one: LimitAnswer, other: LimitAnswer) -> None:
    """Report how far the limits of two laws lie apart, where they have as many."""
    first, second = NAMES[one.scheme], NAMES[other.scheme]
    if len(one.limits) != len(other.limits):
        answer(f"\n{first} has {len(one.limits)} limits, {second} {len(other.limits)}")
        return
    for mine, its in zip(one.limits, other.limits, strict=True):
        middle, theirs = 0.5 * (mine.low + mine.high), 0.5 * (its.low + its.high)
        answer(f"\n{second} against {first}: {(theirs - middle) / abs(middle):+.2%} (middles of the brackets)")
