"""blocksim fragility: the probability of collapse over an intensity."""

from dataclasses import replace

from blocksim.cli.command_line import Report, Screen, report_of
from blocksim.cli.prepare import ScenarioInput, announce_compilation, warn_of_values
from blocksim.cli.progress import case_progress, exit_when_stopped
from blocksim.simulation.compilation import kernels_of
from blocksim.study.fragility import run_fragility
from blocksim.study.fragility_plan import FragilityOptions, read_fragility


def fragility_command(source: ScenarioInput, options: FragilityOptions, screen: Screen) -> Report:
    """Find the probability of collapse over an intensity.

    Draws samples at every intensity, independently, counts those that fail with exact (Clopper-Pearson) limits, and
    fits a lognormal curve by maximum likelihood: median, dispersion and their intervals. --stripes runs the same
    records at every intensity, each once, and widens the intervals of the curve accordingly. Runs that do not finish
    are listed and not counted (exit code 77). The same command again, also after a kill or with more samples, runs only
    what is missing. Needs the extra blocksim[study]. Exit code 1: no curve fits, as nothing or everything fails.

    Example: blocksim fragility mine.toml --intensity motion.scale=0.5:2:7 --scatter friction.block_block=0.6+-0.05
    """
    plan = read_fragility(source.document(), options)
    base = plan.document.build()
    if not screen.silent:
        warn_of_values(base)
    announce_compilation(kernels_of(base), quiet=screen.silent)
    heads = {head.key: head for head in plan.cases.heads}
    with exit_when_stopped(), case_progress(heads.values(), quiet=screen.silent) as on_row:
        found = run_fragility(plan, replace(options, on_row=on_row))
    return report_of([found], {"folder": str(found.folder), **found.to_dict()})
