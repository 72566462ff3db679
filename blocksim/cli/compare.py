"""blocksim compare: judge runs and sweeps against measured repeats."""

import inspect
from pathlib import Path
from typing import Annotated

from blocksim.analysis.judgement import THRESHOLD, U_NUM, Settings
from blocksim.cli.options import Report, Screen
from blocksim.cli.verdicts import comparison_table, judgement_lines, meanings, verdict_lines
from blocksim.errors import ExitCode
from blocksim.options import Option
from blocksim.scenario.path_policy import near
from blocksim.study.compare import ExperimentTablePath, compare_run, compare_sweep
from blocksim.study.stored_run import find_run
from blocksim.study.sweep_table import is_sweep


def compare_command(
    *,
    runs: Annotated[
        list[Path],
        Option(
            "Run folder, results/NAME (its newest finished run), scenario file, or sweep folder.",
            metavar="RUN",
            is_argument=True,
        ),
    ],
    experiment: ExperimentTablePath = None,
    threshold: Annotated[
        float, Option("For sweeps: share of samples that must be within all measured ranges.", least=0.0, most=1.0)
    ] = THRESHOLD,
    u_num: Annotated[
        float,
        Option("For sweeps: standard uncertainty of the numerical solution, in mm.", metavar="MM", least=0.0, most=1e6),
    ] = U_NUM,
    screen: Screen,
) -> Report:
    """Compare runs with measured repeats.

    Exit code 1: anything is out of range. A position is inside between the smallest and the largest repeat (0.5 mm
    either side where all repeats are equal), a rotation within 5 degrees of the mean. Of a sweep, at least the share
    --threshold of the samples must be within all measured ranges; this needs the extra blocksim[study]. Its numbers:

    {meanings}

    Example: blocksim compare scenarios/three_blocks.toml
    """
    texts: list[str] = []
    data: list[dict[str, object]] = []
    judged: list[bool] = []
    for place in runs:
        if is_sweep(place):
            judgement = compare_sweep(place, experiment, Settings(threshold, u_num))
            head, source, lines = place, judgement.source, judgement_lines(judgement)
            data.append(judgement.to_dict())
            judged.append(judgement.inside)
        else:
            head = find_run(place)
            comparison = compare_run(head, experiment)
            source, lines = comparison.source, [*comparison_table(comparison), *verdict_lines(comparison)]
            data.append({"run": str(head), **comparison.to_dict()})
            judged.append(comparison.inside)
        is_alone = screen.quiet and len(runs) == 1
        texts.append("\n".join(lines if is_alone else (f"{head} against {near(source)}:", *lines)))
    return Report(["\n\n".join(texts)], data, code=ExitCode.SUCCESS if all(judged) else ExitCode.OUTSIDE)


compare_command.__doc__ = inspect.cleandoc(compare_command.__doc__ or "").replace("{meanings}", meanings())
