"""blocksim converge: refine time step, stiffness, spacing and tolerance until the run-out converges."""

import shlex
from collections.abc import Sequence
from dataclasses import asdict
from enum import StrEnum
from itertools import pairwise
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from blocksim.cli import command_line
from blocksim.cli.output import note, number, show, table_lines
from blocksim.cli.prepare import announce_compilation, read_scenario
from blocksim.errors import ExitCode
from blocksim.scenario.spelling import list_names
from blocksim.simulation.compilation import kernels_of
from blocksim.simulation.folder import RESULTS, refuse_foreign
from blocksim.study.converge import (
    FEWEST_LEVELS,
    LEVELS,
    SPACING,
    STEP,
    STIFFNESS,
    TOLERANCE,
    TOLERANCE_MM,
    Convergence,
    ConvergenceVerdict,
    Level,
    RefinementStudy,
    converge,
    refinements_of,
)
from blocksim.study.pictures import draw_convergence
from blocksim.study.rows import Row
from blocksim.view.levels import refuse_small_page
from blocksim.view.page_size import PageOptions
from blocksim.view.style import picture_suffix

MOST_BLOCKS = 3
LONGEST_NAME = 10
PERCENT = 100.0


class Which(StrEnum):
    """What can be refined."""

    STEP = STEP
    STIFFNESS = STIFFNESS
    SPACING = SPACING
    TOLERANCE = TOLERANCE


def converge_command(
    *,
    scenario: command_line.ScenarioPath,
    study: Annotated[
        list[Which] | None, typer.Option(help="What to refine (default: all that matters). Repeatable.")
    ] = None,
    tolerance: Annotated[
        float, typer.Option(metavar="MM", help="Largest change of the run-out that counts as converged, in mm.")
    ] = TOLERANCE_MM,
    levels: Annotated[
        int,
        typer.Option(min=FEWEST_LEVELS, metavar="N", help="Maximum number of refinements of the scenario's own value."),
    ] = LEVELS,
    settings: command_line.Settings = None,
    jobs: Annotated[int | None, typer.Option(min=1, metavar="N", help="Processes (default: one a core).")] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="Picture: .png, .svg or .pdf (default: results/NAME/converge.png)."),
    ] = None,
    picture: Annotated[bool, typer.Option(help="Draw a picture.")] = True,
    page: PageOptions,
    overwrite: command_line.Replace = False,
    as_json: command_line.Json = False,
    quiet: command_line.Quiet = False,
) -> None:
    """Refine step, stiffness and spacing until the run-out converges.

    Refines time step, contact stiffness and particle spacing one at a time (with rigid contacts: step and tolerance),
    the others as in the scenario, until two refinements in a row move no block by more than the tolerance. Where a
    block ends on another side, or farther away than its size, the outcome flips and no order of convergence is
    estimated. Exit code 0 means that the study is complete, converged or not. The same command again runs only missing
    levels.

    Example: blocksim converge scenarios/three_blocks_nominal.toml
    """
    silent = quiet or as_json
    paper = page.paper
    chosen = None if study is None else [one.value for one in study]
    with read_scenario(scenario, settings or []) as ready:
        path = out or RESULTS / ready.name / "converge.png"
        picture_suffix(path)
        if picture:
            refuse_small_page(len(refinements_of(ready, chosen)), paper)
            if out is not None or path.parent.exists():  # the usual folder is made with the picture
                refuse_foreign(path, overwrite=overwrite)
        announce_compilation(kernels_of(ready), quiet=silent)
        result = converge(
            ready,
            tolerance_mm=tolerance,
            levels=levels,
            studies=chosen,
            jobs=jobs,
            on_run=(lambda *_: None) if silent else _tell_run,
        )
        drawn = path if picture and draw_convergence(result, ready, path, paper) else None
    lines = _answer_lines(result, _command(result, scenario, settings or []))
    show(lines, _data(result, drawn), as_json=as_json)
    if drawn is not None and not silent:
        note(f"picture: {drawn}")
    raise typer.Exit(ExitCode.NUMERICAL_FAILURE if result.failed else ExitCode.SUCCESS)


def _tell_run(label: str, row: Row) -> None:
    note(f"{label}: {row['status']} ({row['reason']}), {float(str(row['seconds'])):.2f} s")


def _command(result: Convergence, scenario: Path, settings: Sequence[str]) -> str:
    """Return the command that runs the scenario as recommended."""
    recommended = {} if result.recommended is None else result.recommended.settings
    kept = [text for text in settings if text.partition("=")[0].strip() not in recommended]
    texts = [*kept, *(f"{key}={value:g}" for key, value in recommended.items())]
    return shlex.join(["blocksim", "run", str(scenario), *(part for text in texts for part in ("--set", text))])


def _data(result: Convergence, drawn: Path | None) -> dict[str, object]:
    studies = [
        {**asdict(study), "recommended": None if study.recommended is None else study.recommended.value}
        for study in result.studies
    ]
    shown = None if drawn is None else str(drawn)
    return {**asdict(result), "studies": studies, "converged": result.converged, "picture": shown}


def _answer_lines(result: Convergence, command: str) -> list[str]:
    lines = []
    for study in result.studies:
        lines += [f"{study.title}: {study.key}", *_table(result, study), *_verdict(study), ""]
    lines += [*result.notes, ""] if result.notes else []
    return lines + _recommendation(result, command)


def _table(result: Convergence, study: RefinementStudy) -> list[str]:
    """Return the levels of a study with the blocks that its refinement moves most."""
    chosen = most_moved(study, MOST_BLOCKS)
    heads = [f"{_short(result.blocks[block])}: x mm" for block in chosen]
    rows = [_cells(level, chosen) for level in study.levels]
    columns = ("value", *heads, "change mm", "order", "seconds")
    lines = table_lines(columns, rows)
    if 0 < len(chosen) < len(result.blocks):
        lines.append(
            f"the {len(chosen)} of {len(result.blocks)} blocks that move most; change: the largest of all blocks"
        )
    return lines


def most_moved(study: RefinementStudy, count: int) -> list[int]:
    """Return the blocks whose final x differs most between the levels, in their order."""
    finished = np.array([level.x_mm for level in study.levels if level.is_finished])
    if not finished.size:
        return []
    spread = np.ptp(finished, axis=0)
    return sorted(np.argsort(-spread, kind="stable")[:count].tolist())


def _short(name: str) -> str:
    return name if len(name) <= LONGEST_NAME else name[: LONGEST_NAME - 1] + "…"


def _cells(level: Level, chosen: list[int]) -> tuple[str, ...]:
    value = f"{level.value:g} (own)" if level.is_own else f"{level.value:g}"
    places = [number(level.x_mm[block], 3) if level.is_finished else level.status for block in chosen]
    return (value, *places, number(level.change_mm, 4), number(level.order, 1), number(level.seconds))


def _verdict(study: RefinementStudy) -> list[str]:
    match study.verdict:
        case ConvergenceVerdict.CONVERGED:
            return [_told_convergence(study), *_flips(study)]
        case ConvergenceVerdict.NOT_YET:
            more = sum(not level.is_own for level in study.levels[study.levels.index(study.own) :]) + 2
            return [f"not yet converged: the changes shrink; try --levels {more}", *_flips(study)]
        case ConvergenceVerdict.SCATTERED:
            return [
                "not converged: the changes do not shrink. Impacts amplify small differences, so",
                "a single run means little: vary the start by a micrometre (blocksim sweep)",
            ]
        case ConvergenceVerdict.FLIPS:
            return [
                "not converged: the outcome flips between levels. A single run says little:",
                "vary the start by a micrometre (blocksim sweep) and report how often each occurs",
                *_flips(study),
            ]
        case ConvergenceVerdict.FAILED:
            failed = [level for level in study.levels if not level.is_finished]
            count = f"{len(failed)} of {len(study.levels)} levels did not finish"
            return [f"not judged: {count}; the first, {failed[0].value:g}: {failed[0].reason}"]


def _flips(study: RefinementStudy) -> list[str]:
    """Report between which levels blocks end in another place or on another side, a line each."""
    lines = []
    for before, level in pairwise(study.levels):
        if level.flipped:
            named = list_names(list(map(_short, level.flipped)), MOST_BLOCKS)
            blocks = "block" if len(level.flipped) == 1 else "blocks"
            lines.append(f"outcome differs between {before.value:g} and {level.value:g}: {blocks} {named}")
    return lines


def _told_convergence(study: RefinementStudy) -> str:
    found = f"converged: the last two refinements move no block by more than {_small(study.last_change_mm)}"
    coarsest = study.recommended
    if coarsest is None or coarsest.is_own:
        return f"{found};\nthe scenario's own value is the coarsest that is fine enough"
    return f"{found};\n{coarsest.value:g} is fine enough (within {_small(coarsest.to_finest_mm)} of the finest level)"


def _small(length: float) -> str:
    return f"{length:.2g} mm" if length >= TOLERANCE_MM / PERCENT else f"{TOLERANCE_MM / PERCENT:g} mm"


def _recommendation(result: Convergence, command: str) -> list[str]:
    joint = result.recommended
    if result.failed:
        return [f"the scenario as it is {result.studies[0].own.status}: {result.studies[0].own.reason}"]
    if joint is None:
        if not result.converged:
            return ["no recommendation before every study has converged"]
        if all(study.recommended == study.own for study in result.studies):
            return ["recommended: the scenario as it is"]
        return ["no recommendation: no other setting stays near all finest levels"]
    share = 1.0 - joint.seconds / max(joint.own_seconds, 1e-9)
    saving = f"{share:.0%} less" if share >= 0.0 else f"{-share:.0%} more"
    settings = ", ".join(f"{key}={value:g}" for key, value in joint.settings.items())
    times = f"{joint.seconds:.2f} s instead of {joint.own_seconds:.2f} s"
    return [
        f"recommended: {settings}",
        f"within {_small(joint.to_finest_mm)} of the finest levels; {times} ({saving}):",
        command,
    ]
