"""blocksim fragility: the probability of collapse over an intensity."""

from dataclasses import replace

from blocksim.cli import command_line, prepare, progress
from blocksim.simulation.schemes import kernels_of
from blocksim.study import fragility


def fragility_command(
    source: prepare.ScenarioInput, options: fragility.FragilityOptions, screen: command_line.Screen
) -> command_line.Report:
    """Find the probability of collapse over an intensity.

    Draws samples at every intensity, independently, counts those that fail with exact (Clopper-Pearson) limits, and
    fits a lognormal curve by maximum likelihood: median, dispersion and their intervals. --stripes runs the same
    records at every intensity, each once, and widens the intervals of the curve accordingly. Runs that do not finish
    are listed and not counted (exit code 77). The same command again, also after a kill or with more samples, runs only
    what is missing. Needs the extra blocksim[study]. Exit code 1: no curve fits, as nothing or everything fails.

    Example: blocksim fragility mine.toml --intensity motion.scale=0.5:2:7 --scatter friction.block_block=0.6+-0.05
    """
    plan = fragility.read_fragility(source.document(), options)
    base = plan.document.build()
    if not screen.silent:
        prepare.warn_of_values(base)
    prepare.announce_compilation(kernels_of(base), quiet=screen.silent)
    heads = {head.key: head for head in plan.cases.heads}
    with progress.exit_on_stop(), progress.case_progress(heads.values(), quiet=screen.silent) as on_row:
        found = fragility.run_fragility(plan, replace(options, on_row=on_row))
    return command_line.report_of([found], {"folder": str(found.folder), **found.to_dict()})
