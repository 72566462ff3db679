"""blocksim calibrate: fit inputs to measured repeats, so that agreement is probable under the scatter of the others."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

from blocksim.cli import command_line, output, prepare, progress
from blocksim.errors import ExitCode
from blocksim.options import silent
from blocksim.scenario import Model
from blocksim.study import calibrate, calibrate_plan


def calibrate_command(
    source: prepare.ScenarioInput, options: calibrate_plan.CalibrateOptions, screen: command_line.Screen
) -> command_line.Report:
    """Fit inputs to measured repeats, within their priors.

    Maximises the probability that a run is inside all measured ranges (as in compare) while the other inputs scatter as
    stated, not the agreement of one run. Writes the scenario with the fitted values and where they come from
    in [provenance]. Every trial is kept as it ends; a search that was stopped continues with --resume. Needs the extra
    blocksim[study]. Where no trial is inside all ranges the search minimises the distance to them, the file holds
    the nearest values, and the exit code is 1. The example takes the scatter from [sweep], as in
    "structures.0.overlap" = { mean = "10 mm", sd = "0.3 mm" }; --scatter "structures.0.overlap=10 mm+-0.3 mm" says the
    same.

    Example: blocksim calibrate mine.toml --fit contact.restitution=0.2:0.35
    """
    document = source.document()
    prepare.warn_of_values([Model(document.without_sweep())], screen)
    found = calibrate.calibrate(
        document,
        replace(
            options,
            on_start=partial(prepare.announce_compilation, quiet=screen.silent),
            on_trial=silent if screen.silent else _trial_lines(),
        ),
    )
    nothing = []
    if not found.agrees:  # how far the nearest values are off, by quantity
        rows = [
            [
                f"{hit.range.column} of {hit.range.block}",
                f"[{output.number(hit.range.lower)}, {output.number(hit.range.upper)}]",
                output.number(hit.median),
                f"{hit.share_inside:.0%}",
            ]
            for hit in found.hits
        ]
        nothing = [
            "",
            "nothing found: no sample is inside all ranges. The values above are the nearest",
            "of those tried; widen the priors, fit other keys or raise --trials",
            *output.table_lines(("quantity", "measured", "median", "inside"), rows, left=1),
        ]
    return command_line.Report(
        [*_values(found), "", *found.probability, *nothing],
        found.to_dict(),
        found.remarks,
        code=ExitCode.SUCCESS if found.agrees else ExitCode.OUTSIDE,
    )


def _trial_lines() -> Callable[[calibrate_plan.Trial, calibrate_plan.Trial, int], None]:
    """Return a function that reports every trial that is the best so far, and others now and then.

    It tells the share inside or, where no trial has any, the distance: 0 at the ranges, towards 1 far from them.
    """
    is_due = progress.pace(2.0, 0.0)

    def tell(trial: calibrate_plan.Trial, best: calibrate_plan.Trial, trials: int) -> None:
        if not (is_due() or trial is best or trial.number == trials):
            return
        values = ", ".join(f"{'.'.join(key.split('.')[-2:])} {value}" for key, value in trial.values.items())
        told = f"nothing inside, {trial.score.miss:.3f} off (best {best.score.miss:.3f} of 0 to 1)"
        if best.score.inside:
            told = f"{trial.score.share_inside:.0%} inside (best {best.score.share_inside:.0%})"
        output.note(f"{trial.number}/{trials}: {told}: {values}")

    return tell


def _values(found: calibrate.Fit) -> list[str]:
    """Return the fitted values or, where trials tie, the ranges of those that are equally good."""
    told = found.overview()
    lines = output.table_lines(told.heads, told.texts(), left=1)
    if len(found.ties) < 2:
        return lines
    return [
        *lines,
        "",
        f"{len(found.ties)} of {found.trials} trials tie: the measurement does not decide between their values;",
        "the file holds one of them. More measurements or --samples may tell them apart",
    ]
