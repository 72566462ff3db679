"""blocksim converge: refine time step, stiffness, spacing and tolerance until the run-out converges."""

import shlex
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Annotated

import numpy as np

from blocksim.cli import command_line, output, prepare
from blocksim.errors import ExitCode
from blocksim.options import Option, Replace
from blocksim.scenario.spelling import list_names
from blocksim.simulation import files, schemes
from blocksim.study import converge, rows
from blocksim.view import studies as drawings, style

MOST_BLOCKS = 3
LONGEST_NAME = 10
PERCENT = 100.0


def converge_command(
    *,
    source: prepare.ScenarioInput,
    options: converge.ConvergeOptions,
    jobs: Annotated[int | None, Option("Processes (default: one a core).", metavar="N", least=1)] = None,
    out: Annotated[
        Path | None, Option("Picture: .png, .svg or .pdf (default: results/NAME/converge.png).", metavar="FILE")
    ] = None,
    picture: Annotated[bool, Option("Draw a picture.", flags=("--picture/--no-picture",))] = True,
    page: style.PageOptions,
    overwrite: Replace = False,
    screen: command_line.Screen,
) -> command_line.Report:
    """Refine step, stiffness and spacing until the run-out converges.

    Refines time step, contact stiffness and particle spacing one at a time (with rigid contacts: step and tolerance),
    the others as in the scenario, until two refinements in a row move no block by more than the tolerance. Where a
    block ends on another side, or farther away than its size, the outcome flips and no order of convergence is
    estimated. Exit code 0 means that the study is complete, converged or not. The same command again runs only missing
    levels.

    Example: blocksim converge scenarios/three_blocks_nominal.toml
    """

    def tell(label: str, row: rows.Row) -> None:
        screen.note(f"{label}: {row['status']} ({row['reason']}), {float(str(row['seconds'])):.2f} s")

    paper = page.paper
    with source.built() as ready:
        prepare.warn_of_values([ready], screen)
        path = out or files.RESULTS / ready.scenario.name / "converge.png"
        style.picture_path(path)
        if picture:
            drawings.refuse_small_page(len(converge.refinements_of(ready.scenario, options.studies)), paper)
            if out is not None or path.parent.exists():  # the usual folder is made with the picture
                files.refuse_foreign(path, overwrite=overwrite)
        prepare.announce_compilation(schemes.kernels_of(ready.scenario), quiet=screen.silent)
        result = converge.converge(ready.scenario, replace(options, jobs=jobs, on_run=tell))
        drawn = path if picture and result.panels() else None
        if drawn is not None:
            result.draw(drawn, f"{result.name}: distance from the finest level", paper)
    lines = []
    for study in result.studies:
        lines += [f"{study.title}: {study.key}", *_table(result, study), *_verdict(study), ""]
    lines += [*result.notes, ""] if result.notes else []
    lines += _recommendation(result, source)
    shown = None if drawn is None else str(drawn)
    return command_line.Report(
        lines,
        {**result.to_dict(), "picture": shown},
        [] if drawn is None else [f"picture: {drawn}"],
        code=ExitCode.NUMERICAL_FAILURE if result.failed else ExitCode.SUCCESS,
    )


def _table(result: converge.Convergence, study: converge.RefinementStudy) -> list[str]:
    """Return the levels of a study with the blocks whose final x its refinement moves most, in their order."""
    finished = np.array([level.x_mm for level in study.levels if level.x_mm])
    chosen: list[int] = []
    if finished.size:
        chosen = sorted(np.argsort(-np.ptp(finished, axis=0), kind="stable")[:MOST_BLOCKS].tolist())

    def cells(level: converge.Level) -> tuple[str, ...]:
        value = f"{level.value:g} (own)" if level.is_own else f"{level.value:g}"
        places = [output.number(level.x_mm[block], 3) if level.x_mm else level.status for block in chosen]
        others = (level.change_mm, 4), (level.order, 1), (level.seconds, 2)
        return (value, *places, *(output.number(*one) for one in others))

    heads = [f"{style.shorten(result.blocks[block], LONGEST_NAME)}: x mm" for block in chosen]
    lines = output.table_lines(("value", *heads, "change mm", "order", "seconds"), map(cells, study.levels))
    if 0 < len(chosen) < len(result.blocks):
        lines.append(
            f"the {len(chosen)} of {len(result.blocks)} blocks that move most; change: the largest of all blocks"
        )
    return lines


def _verdict(study: converge.RefinementStudy) -> list[str]:
    """Return the verdict in words, with the levels between which blocks end in another place or on another side."""
    flips = []
    for before, level in pairwise(study.levels):
        if level.flipped:
            named = list_names([style.shorten(name, LONGEST_NAME) for name in level.flipped], MOST_BLOCKS)
            blocks = "block" if len(level.flipped) == 1 else "blocks"
            flips.append(f"outcome differs between {before.value:g} and {level.value:g}: {blocks} {named}")
    match study.verdict:
        case converge.ConvergenceVerdict.CONVERGED:
            last = max(level.change_mm for level in study.levels[-2:])
            found = f"converged: the last two refinements move no block by more than {_small(last)};"
            best, coarsest = study.recommendation, "the scenario's own value is the coarsest that is fine enough"
            if best is not None and not best.is_own:
                coarsest = f"{best.value:g} is fine enough (within {_small(best.to_finest_mm)} of the finest level)"
            return [found, coarsest, *flips]
        case converge.ConvergenceVerdict.NOT_YET:
            more = sum(not level.is_own for level in study.levels[study.levels.index(study.own) :]) + 2
            return [f"not yet converged: the changes shrink; try --levels {more}", *flips]
        case converge.ConvergenceVerdict.SCATTERED:
            return [
                "not converged: the changes do not shrink. Impacts amplify small differences, so",
                "a single run means little: vary the start by a micrometre (blocksim sweep)",
            ]
        case converge.ConvergenceVerdict.FLIPS:
            return [
                "not converged: the outcome flips between levels. A single run says little:",
                "vary the start by a micrometre (blocksim sweep) and report how often each occurs",
                *flips,
            ]
        case converge.ConvergenceVerdict.FAILED:
            failed = [level for level in study.levels if not level.x_mm]
            count = f"{len(failed)} of {len(study.levels)} levels did not finish"
            return [f"not judged: {count}; the first, {failed[0].value:g}: {failed[0].reason}"]


def _small(length: float) -> str:
    least = converge.TOLERANCE_MM / PERCENT
    return f"{length:.2g} mm" if length >= least else f"{least:g} mm"


def _recommendation(result: converge.Convergence, source: prepare.ScenarioInput) -> list[str]:
    """Return which settings are recommended, if any, and the command that runs the scenario with them."""
    joint = result.recommended
    if result.failed:
        return [f"the scenario as it is {result.studies[0].own.status}: {result.studies[0].own.reason}"]
    if joint is None:
        if not result.converged:
            return ["no recommendation before every study has converged"]
        if all(study.recommendation == study.own for study in result.studies):
            return ["recommended: the scenario as it is"]
        return ["no recommendation: no other setting stays near all finest levels"]
    share = 1.0 - joint.seconds / max(joint.own_seconds, 1e-9)
    saving = f"{share:.0%} less" if share >= 0.0 else f"{-share:.0%} more"
    settings = [f"{key}={value:g}" for key, value in joint.settings.items()]
    kept = [text for text in source.settings or [] if text.partition("=")[0].strip() not in joint.settings]
    texts = [part for text in (*kept, *settings) for part in ("--set", text)]
    within, times = _small(joint.to_finest_mm), f"{joint.seconds:.2f} s instead of {joint.own_seconds:.2f} s"
    return [
        f"recommended: {', '.join(settings)}",
        f"within {within} of the finest levels; {times} ({saving}):",
        shlex.join(["blocksim", "run", str(source.scenario), *texts]),
    ]
