"""blocksim limit: the values of a key between which the structure stands and falls."""

import re
import textwrap
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated

import typer

from blocksim.cli import completion, options
from blocksim.cli.limit_curve import show_curve
from blocksim.cli.limit_give import level_lines, margin_lines, step_lines, told_stiffness, warn_of_give
from blocksim.cli.output import answer, note, number, print_json, table_lines, width_of_screen
from blocksim.cli.prepare import tell_compilation
from blocksim.cli.progress import leaving_unfinished_cases
from blocksim.errors import ExitCode
from blocksim.scenario import Document
from blocksim.scenario.models.stepping import SCHEMES, SPRINGS
from blocksim.scenario.plausible import implausible_values
from blocksim.simulation.compilation import kernels_of
from blocksim.simulation.movement import DISPLACEMENT, FIRST_MOVED, FIRST_MOVER, OUTCOME, PEAK, TURN, Manner
from blocksim.study.criterion import DEFAULT, Verdict
from blocksim.study.executors import Execution
from blocksim.study.limit import OnRun, find_limit
from blocksim.study.limit_curve import OPTION as OVER
from blocksim.study.limit_curve import read_curve
from blocksim.study.limit_plan import OPTION, SCANNED, TOLERANCE, LimitPlan, read_limit, variants
from blocksim.study.limit_result import LimitResult
from blocksim.study.limit_search import Change, Number
from blocksim.study.limit_stiff import refuse_without_springs
from blocksim.study.rows import Row
from blocksim.study.vary import RANGE, read_variations

SHARE = re.compile(r"([0-9.]+(?:[eE][+-]?[0-9]+)?)\s*(%?)")
PERCENT = 100.0
UNSETTLED = "does not settle"
AT_ONCE = (
    "start.settle = false: loads that come at once shift limits of arches and walls by 0.2 to 4 %; leave it out, and "
    "every run begins at rest"
)
HEADS = ("verdict", "outcome", "first to move", "at s", "moved mm", "turned °")


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
    scenario: options.ScenarioPath,
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
    settings: options.Settings = None,
    executor: options.ExecutorName = None,
    jobs: options.Jobs = None,
    scheduler: options.Scheduler = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Folder to write (default: results/NAME/limit-HASH).")
    ] = None,
    overwrite: options.Overwrite = False,
    no_runs: Annotated[
        bool, typer.Option("--no-runs", help="Keep no runs of both sides of a bracket, which plot and report show.")
    ] = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
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
    if over is not None:
        if both_laws:
            raise typer.BadParameter(
                "a curve of limits is searched with one law; leave --both-laws out", param_hint=OVER
            )
        curve = read_curve(document, given, read_variations([over], OVER), stands=stands, tolerance=to, scan=scan)
        _warn(curve.one, silent=silent)
        show_curve(
            curve,
            Execution(executor=None if executor is None else executor.value, jobs=jobs, scheduler=scheduler),
            out,
            overwrite=overwrite,
            stiffer=stiffer,
            as_json=as_json,
            quiet=quiet,
        )
    plans = {
        name: read_limit(one, given, stands=stands, tolerance=to, scan=scan)
        for name, one in variants(document, both_laws=both_laws).items()
    }
    if stiffer:
        refuse_without_springs(*plans.values())
    _warn(next(iter(plans.values())), silent=silent)
    found = {}
    for name, plan in plans.items():
        base = plan.scenario_at(plan.span.low)
        tell_compilation(kernels_of(base), quiet=silent)
        with leaving_unfinished_cases():
            found[name] = find_limit(
                plan,
                Execution(executor=None if executor is None else executor.value, jobs=jobs, scheduler=scheduler),
                out=None if out is None else out / _folder(name) if len(plans) > 1 else out,
                overwrite=overwrite,
                keep_runs=not no_runs,
                stiffer=None if stiffer and name != SCHEMES[SPRINGS].contacts else stiffer,
                on_stiffer=told_stiffness(silent=silent),
                on_run=(lambda *_: None) if silent else _telling(plan.shown),
            )
    _show(found, as_given=stiffer is False, as_json=as_json, quiet=quiet)
    raise typer.Exit(ExitCode.SUCCESS if all(one.changes for one in found.values()) else ExitCode.OUTSIDE)


def _warn(plan: LimitPlan, *, silent: bool) -> None:
    """Warn of implausible values of the scenario, and of those at both ends of the range; compile what it needs."""
    tell_compilation(kernels_of(plan.scenario_at(plan.span.low)), quiet=silent)
    if silent:
        return
    ends = (plan.scenario_at(value) for value in (plan.span.low, plan.span.high))
    for text in dict.fromkeys(text for scenario in ends for text in implausible_values(scenario)):
        note(f"warning: {text}")
    if plan.comes_at_once:
        note(AT_ONCE)


def _show(found: Mapping[str, LimitResult], *, as_given: bool, as_json: bool, quiet: bool) -> None:
    """Print every search, how far they lie apart, and where the runs are."""
    if as_json:
        print_json([{"contacts": name, "folder": str(one.folder), **one.to_dict()} for name, one in found.items()])
    else:
        answer("\n\n".join("\n".join(_lines(name, one)) for name, one in found.items()))
        _compare(found)
    if quiet or as_json:
        return
    if any(Verdict.UNDECIDED in one.verdicts.values() for one in found.values()):
        note("undecided: blocks were still moving at the end; increase time.end to decide")
    warn_of_give(found.values(), as_given=as_given)
    plan = next(iter(found.values())).plan
    if not plan.span.is_whole and (plan.has_islands or not all(one.changes for one in found.values())):
        spacing = f"a {plan.span.count - 1}th of the range" if plan.span.is_log else plan.shown(plan.span.spacing)
        note(f"islands narrower than {spacing}, between values of the scan, are not seen: --scan N for more values")
    for one in found.values():
        note(f"{one.runs} runs, {one.run} of them now: {one.folder / 'limit.csv'}")
        if one.pictured:
            note(f"picture of the mechanism: blocksim plot {one.folder}")


def _folder(name: str) -> str:
    """Return a name of a variant that needs no quotes in a shell."""
    return re.sub(r"[^a-z0-9.]+", "-", name)


def _telling(shown: Callable[[Number], str]) -> OnRun:
    def tell(value: Number, verdict: Verdict, row: Row) -> None:
        note(f"{shown(value)}: {verdict.value} ({row['reason']})")

    return tell


def _lines(name: str, found: LimitResult) -> list[str]:
    """Return both sides of every change, and what that comes to."""
    plan = found.plan
    title = textwrap.wrap(f'{plan.key}, {name}: stands means "{plan.criterion.text}"', width_of_screen())
    changes = found.changes_as_given
    if changes:
        sides = [side for one in changes for side in ((one.low, one.below), (one.high, one.above))]
        told = [line for one in changes for line in _told(found, one)]
    else:
        ends = list(found.verdicts.items())
        sides = [ends[0], ends[-1]]
        span = f"{plan.shown(plan.span.low)} to {plan.shown(plan.span.high)}"
        told = [f"no change from {span}: {ends[0][1].value} at all {len(ends)} values"]
    heads = (f"value {plan.unit}".rstrip(), *HEADS)
    rows = [_cells(value, verdict, found.seen(value)) for value, verdict in dict.fromkeys(sides)]
    return [*title, "", *table_lines(heads, rows, left=4), "", *told]


def _cells(value: Number, verdict: Verdict, row: Row) -> list[str]:
    if verdict is Verdict.FAILED:
        return [f"{value:.8g}", verdict.value, str(row["reason"]).splitlines()[0], *("",) * 4]
    if OUTCOME not in row:  # it falls before time zero
        return [f"{value:.8g}", verdict.value, UNSETTLED, *("",) * 4]
    moved = row.get(FIRST_MOVED)
    first = "" if row.get(FIRST_MOVER) is None else f"block {row[FIRST_MOVER]}"
    return [
        f"{value:.8g}",
        verdict.value,
        _outcome(row),
        first,
        "" if moved is None else number(float(str(moved)), 3),
        number(float(str(row[DISPLACEMENT]))),
        number(float(str(row[TURN]))),
    ]


def _outcome(row: Row) -> str:
    """Return the outcome, with the amplitude of what still rocks."""
    is_known = row[OUTCOME] == Manner.ROCKING.value and PEAK in row
    return f"{row[OUTCOME]} ±{float(str(row[PEAK])):.2g}°" if is_known else str(row[OUTCOME])


def _told(found: LimitResult, change: Change[Verdict]) -> list[str]:
    """Return the answer, after what it is extrapolated from."""
    shown, answered, levels = found.plan.shown, found.answer(change), found.levels.get(change)
    width = (answered.high - answered.low) / max(abs(answered.low), abs(answered.high))
    below = f"{answered.below.value} up to {shown(answered.low)}"
    line = f"{below}, {answered.above.value} from {shown(answered.high)} (bracket {width:.2%})"
    lines = step_lines(found, change)
    if levels is not None and levels.stiff is not None:
        lines += [*level_lines(found, levels), "stiff contacts, extrapolated with 1/stiffness:"]
    return [*lines, line, *margin_lines(found, change)]


def _compare(found: Mapping[str, LimitResult]) -> None:
    """Report how far the limits of several laws lie apart, where they have as many."""
    if len(found) < 2:
        return
    (first, one), *others = found.items()
    for name, other in others:
        if len(one.limits) != len(other.limits):
            answer(f"\n{first} has {len(one.limits)} limits, {name} {len(other.limits)}")
            continue
        for mine, its in zip(one.limits, other.limits, strict=True):
            middle, theirs = 0.5 * (mine.low + mine.high), 0.5 * (its.low + its.high)
            answer(f"\n{name} against {first}: {(theirs - middle) / abs(middle):+.2%} (middles of the brackets)")
