"""blocksim calibrate: fit inputs to measured repeats, so that agreement is probable under the scatter of the others."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from blocksim.cli import completion, options
from blocksim.cli.output import note, number, show, table_lines
from blocksim.cli.prepare import tell_compilation
from blocksim.errors import ExitCode
from blocksim.scenario import Document
from blocksim.simulation.compilation import kernels_of
from blocksim.study.calibrate import FRESH_MEMBERS, MEMBERS, TRIALS, Fit, calibrate
from blocksim.study.calibrate_plan import FIT, SCATTER, read_plan
from blocksim.study.calibrate_search import Trial
from blocksim.study.vary import RANGE, SPREAD, read_variations

COLUMNS = ("key", "prior", "fitted")
TIED = ("key", "prior", "equally good", "written")
TOLD_SECONDS = 2.0


def calibrate_command(
    scenario: options.ScenarioPath,
    fit: Annotated[
        list[str] | None,
        typer.Option(
            FIT,
            metavar="KEY=FROM:TO",
            help="A key to fit, and its prior. Repeatable.",
            autocompletion=completion.scenario_keys,
        ),
    ] = None,
    scatter: Annotated[
        list[str] | None,
        typer.Option(
            SCATTER,
            metavar="KEY=MEAN+-SD",
            help="Scatter of an input (KEY=FROM:TO: uniform); of a fitted key, about its fitted value. Repeatable. "
            "Default: the distributions of [sweep].",
            autocompletion=completion.scenario_keys,
        ),
    ] = None,
    trials: Annotated[int, typer.Option(min=1, metavar="N", help="Number of trials.")] = TRIALS,
    members: Annotated[
        int, typer.Option("--samples", "--members", min=1, metavar="M", help="Samples of the scatter per trial.")
    ] = MEMBERS,
    fresh: Annotated[
        int, typer.Option(min=1, metavar="M", help="Fresh samples for the final estimate of the probability.")
    ] = FRESH_MEMBERS,
    seed: Annotated[int, typer.Option(min=0, metavar="S", help="Random seed.")] = 0,
    experiment: options.ExperimentPath = None,
    settings: options.Settings = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="FILE", help="Scenario file to write (default: results/NAME/calibrate-HASH/scenario.toml)."
        ),
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Resume with the existing trials.")] = False,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the file and the existing trials.")] = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Fit inputs to measured repeats, within their priors.

    Maximises the probability that a run is inside all measured ranges (as in compare) while the other inputs scatter as
    stated, not the agreement of one run. Writes the scenario with the fitted values and where they come from
    in [provenance]. Every trial is kept as it ends; a search that was stopped continues with --resume. Needs the extra
    blocksim[study]. Exit code 1: nothing inside all ranges was found. The search then minimises the distance to
    the ranges, and the file holds the nearest values. The example takes the scatter from [sweep], as in
    "structures.0.overlap" = { mean = "10 mm", sd = "0.3 mm" }; --scatter "structures.0.overlap=10 mm+-0.3 mm" says the
    same.

    Example: blocksim calibrate mine.toml --fit contact.restitution=0.2:0.35
    """
    silent = quiet or as_json
    plan = read_plan(
        Document.read(scenario).with_settings(settings or []),
        read_variations(fit or [], FIT, RANGE),
        read_variations(scatter or [], SCATTER, SPREAD),
        experiment=experiment,
        members=members,
        seed=seed,
    )
    tell_compilation(kernels_of(plan.base), quiet=silent)
    found = calibrate(
        plan,
        trials=trials,
        fresh_members=fresh,
        out=out,
        resume=resume,
        overwrite=overwrite,
        on_trial=(lambda *_: None) if silent else _telling(),
    )
    show(_lines(found), _data(found), as_json=as_json)
    if not silent:
        _tell_end(found)
    raise typer.Exit(ExitCode.SUCCESS if found.found else ExitCode.OUTSIDE)


def _telling() -> Callable[[Trial, Trial, int], None]:
    """Return a function that reports every trial that is the best so far, and others now and then."""
    told_at = 0.0

    def tell(trial: Trial, best: Trial, trials: int) -> None:
        nonlocal told_at
        now = time.monotonic()
        if trial is best or now - told_at > TOLD_SECONDS or trial.number == trials:
            told_at = now
            values = ", ".join(f"{'.'.join(key.split('.')[-2:])} {value}" for key, value in trial.values.items())
            note(f"{trial.number}/{trials}: {_agreement(trial, best)}: {values}")

    return tell


def _agreement(trial: Trial, best: Trial) -> str:
    """Return the share inside or, where no trial has any, the distance: 0 at the ranges, towards 1 far from them."""
    if best.score.inside:
        return f"{trial.score.share_inside:.0%} inside (best {best.score.share_inside:.0%})"
    return f"nothing inside, {trial.score.miss:.3f} off (best {best.score.miss:.3f} of 0 to 1)"


def _lines(found: Fit) -> list[str]:
    nothing = [] if found.found else ["", *_nothing_found(found)]
    return [*_values(found), "", *_probability(found), *nothing]


def _values(found: Fit) -> list[str]:
    """Return the fitted values or, where trials tie, the ranges of those that are equally good."""
    rows = [(prior, str(found.best.values[prior.key])) for prior in found.plan.priors]
    if not found.is_one_of_many:
        return table_lines(COLUMNS, [[prior.key, str(prior), value] for prior, value in rows], left=1)
    tied = [[prior.key, str(prior), prior.range_of(*found.equally_good(prior)), value] for prior, value in rows]
    return [
        *table_lines(TIED, tied, left=1),
        "",
        f"{len(found.ties)} of {found.trials} trials tie: the measurement does not decide between their values;",
        "the file holds one of them. More measurements or --samples may tell them apart",
    ]


def _nothing_found(found: Fit) -> list[str]:
    """Report how far the nearest values are off, by quantity."""
    rows = [
        [
            f"{hit.range.column} of {hit.range.block}",
            f"[{number(hit.range.lower)}, {number(hit.range.upper)}]",
            number(hit.median),
            f"{hit.share_inside:.0%}",
        ]
        for hit in found.hits
    ]
    return [
        "nothing found: no sample is inside all ranges. The values above are the nearest",
        "of those tried; widen the priors, fit other keys or raise --trials",
        *table_lines(("quantity", "measured", "median", "inside"), rows, left=1),
    ]


def _probability(found: Fit) -> list[str]:
    score, tried = found.score, found.best.score
    if found.plan.scatter.plan is None:
        verdict = "inside all ranges" if score.inside else f"not inside all ranges ({score.miss:.3g} off)"
        return [f"one run, without input scatter: {verdict}"]
    low, high = score.interval
    return [
        f"P(inside all ranges) = {score.share_inside:.3f}, 95 % interval {low:.3f} to {high:.3f} (Clopper-Pearson)",
        f"of {score.members} fresh random samples; search estimate {tried.share_inside:.3f} ({tried.members} samples)",
    ]


def _tell_end(found: Fit) -> None:
    for prior in found.at_bounds:
        value = found.best.values[prior.key]
        note(f"warning: {prior.key} = {value} lies at a bound of its prior; a wider one might fit better")
    failed = found.score.failed
    if failed:
        note(f"{failed} of {found.score.members} fresh samples failed or cannot be simulated; they count as outside")
    note(f"written: {found.path}")


def _data(found: Fit) -> dict[str, object]:
    low, high = found.score.interval
    return {
        "scenario": str(found.path),
        "found": found.found,
        "fitted": [
            {
                "key": prior.key,
                "prior": [prior.low, prior.high],
                "unit": prior.unit,
                "value": found.best.values[prior.key],
                "at_bound": prior in found.at_bounds,
                "equally_good": list(found.equally_good(prior)),
            }
            for prior in found.plan.priors
        ],
        "scatter": found.plan.scatter.described(),
        "experiment": found.plan.table.source,
        "trials": found.trials,
        "members": found.plan.members,
        "seed": found.plan.seed,
        "best_trial": found.best.number,
        "tied_trials": len(found.ties),
        "search_share_inside": found.best.score.share_inside,
        "share_inside": found.score.share_inside,
        "interval": [low, high],
        "fresh_members": found.score.members,
        "failed": found.score.failed,
        "quantities": [
            {
                "block": hit.range.block,
                "quantity": hit.range.column,
                "range": [hit.range.lower, hit.range.upper],
                "median": hit.median,
                "share_inside": hit.share_inside,
            }
            for hit in found.hits
        ],
    }
