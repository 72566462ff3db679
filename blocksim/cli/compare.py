"""blocksim compare: judge runs against measured repeats."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from blocksim.cli import options
from blocksim.cli.output import answer, print_json
from blocksim.cli.verdict import comparison_table, verdict_lines
from blocksim.errors import ExitCode, InputMissingError
from blocksim.study.many import TABLE, read_sweep
from blocksim.study.single import compare, find_run


@dataclass(frozen=True)
class Judged:
    """What is to be said of one place: for people, for programs, and whether it is inside."""

    head: str
    lines: tuple[str, ...]
    data: dict[str, object]
    inside: bool


def compare_command(
    runs: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN", help="Run folder, results/NAME (its newest finished run), scenario file, or sweep folder."
        ),
    ],
    experiment: options.ExperimentPath = None,
    threshold: Annotated[
        float, typer.Option(min=0.0, max=1.0, help="For sweeps: share of cases that must be inside.")
    ] = 0.5,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Compare runs with measured repeats.

    Exit code 1 says that something is outside. A position is inside between the smallest and the largest repeat (0.5 mm
    either side where all repeats are equal), a rotation within 5 degrees of the mean.

    Example: blocksim compare scenarios/three_blocks.toml
    """
    judged = [_judge(run, experiment, threshold) for run in runs]
    if as_json:
        print_json([one.data for one in judged])
    else:
        answer("\n\n".join(_text(one, headed=not quiet or len(judged) > 1) for one in judged))
    raise typer.Exit(ExitCode.SUCCESS if all(one.inside for one in judged) else ExitCode.OUTSIDE)


def _text(one: Judged, *, headed: bool) -> str:
    return "\n".join([one.head, *one.lines] if headed else one.lines)


def _judge(place: Path, experiment: Path | None, threshold: float) -> Judged:
    if (place / TABLE).is_file():
        return _judge_sweep(place, experiment, threshold)
    return _judge_run(place, experiment)


def _judge_sweep(place: Path, experiment: Path | None, threshold: float) -> Judged:
    result = read_sweep(place)
    share = result.share_inside if experiment is None else result.share_inside_of(experiment)
    if share is None:
        message = f"{place}: no case was compared with an experiment; give a table with --experiment"
        raise InputMissingError(message)
    line = f"{share:.0%} of {len(result.table)} cases are inside all measured ranges (asked for: {threshold:.0%})"
    data: dict[str, object] = {"sweep": str(place), "share_inside": share, "threshold": threshold}
    return Judged(f"{place}:", (line,), {**data, "inside": share >= threshold}, share >= threshold)


def _judge_run(place: Path, experiment: Path | None) -> Judged:
    folder = find_run(place)
    comparison = compare(folder, experiment)
    head = f"{folder} against {_near(comparison.source)}:"
    lines = (*comparison_table(comparison), *verdict_lines(comparison))
    return Judged(head, lines, {"run": str(folder), **comparison.to_dict()}, comparison.inside)


def _near(path: str) -> str:
    """Return a path as seen from here, where it lies below."""
    here = Path.cwd()
    return str(Path(path).relative_to(here)) if Path(path).is_relative_to(here) else path
