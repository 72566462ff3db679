"""blocksim limit and fragility: where a structure stands and falls over a key, and how probably over an intensity."""

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from blocksim.cli import command_line, output, prepare, progress
from blocksim.options import Option
from blocksim.scenario.models.timeline import SPRINGS
from blocksim.simulation.schemes import kernels_of
from blocksim.study import answer, criterion, fragility, limit, limit_answer, limit_plan, rows
from blocksim.study.plan import estimate_of
from blocksim.world import describe

ONE_CHANGE = (
    "for one change in the middle of the range, which nothing foretells; each further\n"
    "change is narrowed too, and stiffer springs or half the time step take some runs"
)
AT_ONCE = (
    "start.settle = false: loads that are applied suddenly shift limits of arches and walls by 0.2 to 4 %; leave it "
    "out, and every run begins at rest"
)
LEAST_SAID = 0.1  # s of a run


def limit_command(
    source: prepare.ScenarioInput,
    options: limit_plan.LimitOptions,
    *,
    over: limit_plan.OtherKey = None,
    both_laws: Annotated[bool, Option("Search with springs and with rigid contacts, and compare.")] = False,
    static: Annotated[
        bool, Option("By statics alone, without a run: a bound beyond which no equilibrium exists.")
    ] = False,
    dry_run: prepare.DryRun = False,
    no_runs: Annotated[bool, Option("Keep no runs of both sides of a bracket, which plot and report show.")] = False,
    screen: command_line.Screen,
) -> command_line.Report:
    """Find the critical value of a parameter (collapse threshold).

    Scans the range, as there may be more than one change, and then narrows every change between neighbours to a
    bracket. Under sustained loads every run begins at rest, unless start.settle = false. Failed runs are reported. The
    same command again, also after a kill, repeats no run. Limits of springs that give way are extrapolated to stiff
    contacts, those of rigid contacts verified with half the time step. Exit code 1: nothing changes within the range.

    Example: blocksim limit scenarios/tilting_wall.toml --vary ground.tilt=20deg:40deg
    """
    document = source.document()
    if dry_run:
        if over is not None or both_laws or static:
            raise typer.BadParameter("an estimate is of one search; leave --over, --both-laws and --static out")
        cases = limit_plan.read_limit(document, options).cases_of_one_change()
        return prepare.estimate_report(estimate_of(cases), options.jobs, screen, [ONE_CHANGE])
    if static:
        if both_laws or over is not None:
            raise typer.BadParameter("statics has one key and no law; leave --both-laws and --over out")
        from blocksim.study import static_limit

        bound = static_limit.find_static(limit_plan.read_limit(document, options), options)
        return command_line.report_of([bound], {"folder": str(bound.folder), **bound.to_dict()})
    if over is not None:
        if both_laws:
            raise typer.BadParameter(
                "a curve of limits is searched with one law; leave --both-laws out", param_hint=limit_plan.OVER
            )
        of_curve = limit_plan.CurveOptions(**options.search_options, over=over)
        curve = limit_plan.read_curve(document, of_curve)
        _warn(next(iter(curve.searches.values())), screen)

        def tell_limit(value: float, search: limit_answer.LimitAnswer) -> None:
            at = f"{curve.head.key} = {answer.with_unit(value, curve.head.unit, 6)}"
            screen.note(f"{at}: {search.runs} runs, {search.run} of them now")

        with progress.exit_on_stop():
            points = limit.find_curve(curve, of_curve, tell_limit)
        return command_line.report_of([points], {"folder": str(points.folder), **points.to_dict()})
    documents = limit_plan.variants(document, both_laws=both_laws)
    plans = {name: limit_plan.read_limit(one, options) for name, one in documents.items()}
    if options.stiffer:
        limit.refuse_without_springs(*plans.values())
    _warn(next(iter(plans.values())), screen)
    found = {}
    for name, plan in plans.items():
        prepare.announce_compilation(kernels_of(plan.scenario_at(plan.span.low)), quiet=screen.silent)

        def tell_run(
            value: float, verdict: criterion.Stability, row: rows.Row, plan: limit_plan.LimitPlan = plan
        ) -> None:
            screen.note(f"{answer.with_unit(value, plan.unit)}: {verdict.value} ({row['reason']})")

        def tell_search(plan: limit_plan.LimitPlan) -> None:
            scale, step = (plan.apart.get(key) for key in (limit.STIFFNESS, limit_answer.STEP))
            if scale is not None:
                changed = f"springs shift this limit, or may: once more with {limit.STIFFNESS} = {scale:g}"
            else:
                changed = f"both sides once more with half the time step, {limit_answer.STEP} = {step:.3g} s"
            screen.note(changed)

        out, stiffer = options.out, options.stiffer
        if out is not None and len(plans) > 1:
            out = Path(out) / re.sub(r"[^a-z0-9.]+", "-", name)  # needs no quotes in a shell
        if stiffer and name != limit_plan.NAMES[SPRINGS]:
            stiffer = None
        of_plan = replace(options, out=out, stiffer=stiffer, keep_runs=not no_runs, on_run=tell_run)
        with progress.exit_on_stop():
            found[name] = limit.find_limit(plan, of_plan, on_other=tell_search)
    searches = [{"contacts": name, "folder": str(one.folder), **one.to_dict()} for name, one in found.items()]
    report = command_line.report_of(list(found.values()), searches)
    return replace(report, lines=[*report.lines, *_comparison(*found.values())]) if len(found) == 2 else report


def _warn(plan: limit_plan.LimitPlan, screen: command_line.Screen) -> None:
    """Warn of implausible values of the scenario, and of those at both ends of the range; compile what it needs."""
    ends = [plan.scenario_at(value) for value in (plan.span.low, plan.span.high)]
    prepare.announce_compilation(kernels_of(ends[0]), quiet=screen.silent)
    prepare.warn_of_values(ends, screen)
    seconds = output.duration(max(LEAST_SAID, *(describe.describe(one).seconds for one in ends)))
    runs = f"about {plan.usual_runs} runs for each change in the range, {plan.most_runs} at most"
    screen.note(f"forecast: {runs}; up to {seconds} each on one core")
    if not any(one.start.settle for one in ends) and all(map(limit_plan.is_sustained, ends)):
        screen.note(AT_ONCE)


def _comparison(one: limit_answer.LimitAnswer, other: limit_answer.LimitAnswer) -> Iterator[str]:
    """Yield how far the limits of two laws lie apart, where they have as many."""
    first, second = limit_plan.NAMES[one.scheme], limit_plan.NAMES[other.scheme]
    if len(one.limits) != len(other.limits):
        yield f"\n{first} has {len(one.limits)} limits, {second} {len(other.limits)}"
        return
    for mine, its in zip(one.limits, other.limits, strict=True):
        middle, theirs = 0.5 * (mine.low + mine.high), 0.5 * (its.low + its.high)
        yield f"\n{second} against {first}: {(theirs - middle) / abs(middle):+.2%} (middles of the brackets)"


def fragility_command(
    source: prepare.ScenarioInput,
    options: fragility.FragilityOptions,
    *,
    dry_run: prepare.DryRun = False,
    screen: command_line.Screen,
) -> command_line.Report:
    """Find the probability of collapse over an intensity.

    Draws samples at every intensity, independently, counts those that fail with exact (Clopper-Pearson) limits, and
    fits a lognormal curve by maximum likelihood: median, dispersion and their intervals. --stripes runs the same
    records at every intensity, each once, and widens the intervals of the curve accordingly. Runs that do not finish
    are listed and not counted (exit code 77). The same command again, also after a kill or with more samples, runs only
    what is missing. Exit code 1: no curve fits, as nothing or everything fails.

    Example: blocksim fragility mine.toml --intensity motion.scale=0.5:2:7 --scatter friction.block_block=0.6+-0.05
    """
    plan = fragility.read_fragility(source.document(), options)
    base = plan.document.build()
    prepare.warn_of_values([base], screen)
    if dry_run:
        return prepare.estimate_report(estimate_of(plan.cases), options.jobs, screen)
    prepare.announce_compilation(kernels_of(base), quiet=screen.silent)
    heads = {head.key: head for head in plan.cases.heads}
    with progress.exit_on_stop(), progress.case_progress(heads.values(), quiet=screen.silent) as on_row:
        found = fragility.run_fragility(plan, replace(options, on_row=on_row))
    return command_line.report_of([found], {"folder": str(found.folder), **found.to_dict()})
