"""blocksim limit and fragility: where a structure stands and falls over a key, and how probably over an intensity."""

from dataclasses import replace
from typing import Annotated

import typer

from blocksim.cli import command_line, output, prepare, progress
from blocksim.options import Option
from blocksim.scenario import Model
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
        if over is not None or static:
            raise typer.BadParameter("an estimate is of one search; leave --over and --static out")
        cases = limit_plan.read_limit(document, options).cases_of_one_change()
        return prepare.estimate_report(estimate_of(cases), options.jobs, screen, [ONE_CHANGE])
    if static:
        if over is not None:
            raise typer.BadParameter("statics has one key; leave --over out")
        from blocksim.study import static_limit

        bound = static_limit.find_static(limit_plan.read_limit(document, options), options)
        return command_line.report_of([bound], {"folder": str(bound.folder), **bound.to_dict()})
    if over is not None:
        of_curve = limit_plan.CurveOptions(**options.search_options, over=over)
        curve = limit_plan.read_curve(document, of_curve)
        _warn(next(iter(curve.searches.values())), screen)

        def tell_limit(value: float, search: limit_answer.LimitAnswer) -> None:
            at = f"{curve.head.key} = {answer.with_unit(value, curve.head.unit, 6)}"
            screen.note(f"{at}: {search.runs} runs, {search.run} of them now")

        with progress.exit_on_stop():
            points = limit.find_curve(curve, of_curve, tell_limit)
        return command_line.report_of([points], {"folder": str(points.folder), **points.to_dict()})
    plan = limit_plan.read_limit(document, options)
    if options.stiffer:
        limit.refuse_without_springs(plan)
    _warn(plan, screen)

    def tell_run(value: float, verdict: criterion.Stability, row: rows.Row) -> None:
        screen.note(f"{answer.with_unit(value, plan.unit)}: {verdict.value} ({row['reason']})")

    def tell_search(other: limit_plan.LimitPlan) -> None:
        scale, step = (other.apart.get(key) for key in (limit.STIFFNESS, limit_answer.STEP))
        if scale is not None:
            changed = f"springs shift this limit, or may: once more with {limit.STIFFNESS} = {scale:g}"
        else:
            changed = f"both sides once more with half the time step, {limit_answer.STEP} = {step:.3g} s"
        screen.note(changed)

    with progress.exit_on_stop():
        found = limit.find_limit(plan, replace(options, keep_runs=not no_runs, on_run=tell_run), on_other=tell_search)
    return command_line.report_of([found], {"folder": str(found.folder), **found.to_dict()})


def _warn(plan: limit_plan.LimitPlan, screen: command_line.Screen) -> None:
    """Warn of implausible values of the scenario, and of those at both ends of the range; compile what it needs."""
    ends = [plan.model_at(value) for value in (plan.span.low, plan.span.high)]
    prepare.announce_compilation(kernels_of(ends[0].scenario), quiet=screen.silent)
    prepare.warn_of_values(ends, screen)
    seconds = output.duration(max(LEAST_SAID, *(describe.describe(one).seconds for one in ends)))
    runs = f"about {plan.usual_runs} runs for each change in the range, {plan.most_runs} at most"
    screen.note(f"forecast: {runs}; up to {seconds} each on one core")
    if not any(one.scenario.start.settle for one in ends) and all(map(limit_plan.is_sustained, ends)):
        screen.note(AT_ONCE)


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
    base = Model(plan.document)
    prepare.warn_of_values([base], screen)
    if dry_run:
        return prepare.estimate_report(estimate_of(plan.cases), options.jobs, screen)
    prepare.announce_compilation(kernels_of(base.scenario), quiet=screen.silent)
    heads = {head.key: head for head in plan.cases.heads}
    with progress.exit_on_stop(), progress.case_progress(heads.values(), quiet=screen.silent) as on_row:
        found = fragility.run_fragility(plan, replace(options, on_row=on_row))
    return command_line.report_of([found], {"folder": str(found.folder), **found.to_dict()})
