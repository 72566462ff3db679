"""blocksim compare: judge runs and sweeps against measured repeats, and show their tables."""

import inspect
import textwrap
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Annotated

from blocksim.analysis import compare, evidence, metrics
from blocksim.analysis.experiment import QUANTITIES
from blocksim.cli import command_line, output
from blocksim.errors import ExitCode
from blocksim.options import Option
from blocksim.scenario.input_files import relative_path
from blocksim.study import manifest, run_folder
from blocksim.study.compare import ExperimentTablePath, compare_run, compare_sweep

COLUMNS = ("block", "quantity", "simulated", "mean ± s", "range", "error", "verdict")
DIGITS = 2
SIGNS = {"deg": "°"}
MOST_ROWS = 40  # of one table
MOST_FAILURES = 3
PERCENT = 100.0
DASH = "–"


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
    ] = metrics.THRESHOLD,
    u_num: Annotated[
        float,
        Option("For sweeps: standard uncertainty of the numerical solution, in mm.", metavar="MM", least=0.0, most=1e6),
    ] = metrics.U_NUM,
    tolerance: Annotated[
        float | None,
        Option(
            "For curves: widen the range of repeats by this share of their mean (default: 0; 0.1 of a single one).",
            least=0.0,
            most=10.0,
        ),
    ] = None,
    screen: command_line.Screen,
) -> command_line.Report:
    """Compare runs with measured repeats.

    Exit code 1: anything is out of range. A position is inside between the smallest and the largest repeat (0.5 mm
    either side where all repeats are equal), a rotation within 5 degrees of the mean. A table of curves (columns probe,
    replicate, and two quantities of that probe such as displacement_mm and force_kN) judges peak, place of the peak,
    stiffness and area; all repeats set the range. Of a sweep, at least the share
    --threshold of the samples must be within all measured ranges. Its numbers:

    {meanings}

    Example: blocksim compare scenarios/three_blocks.toml
    """
    texts: list[str] = []
    data: list[dict[str, object]] = []
    judged: list[bool] = []
    for place in runs:
        if manifest.is_sweep(place):
            judgement = compare_sweep(place, experiment, metrics.Settings(threshold, u_num))
            head, source, lines = place, judgement.source, list(_judgement_lines(judgement))
            data.append(judgement.to_dict())
            judged.append(judgement.inside)
        else:
            head = run_folder.find_run(place)
            comparison = compare_run(head, experiment, metrics.Settings(tolerance=tolerance))
            source, lines = comparison.source, [*comparison_table(comparison), *verdict_lines(comparison)]
            data.append({"run": str(head), **comparison.to_dict()})
            judged.append(comparison.inside)
        is_alone = screen.quiet and len(runs) == 1
        texts.append("\n".join(lines if is_alone else (f"{head} against {relative_path(source)}:", *lines)))
    return command_line.Report(["\n\n".join(texts)], data, code=ExitCode.SUCCESS if all(judged) else ExitCode.OUTSIDE)


_MEANINGS: list[str] = []  # the names of all numbers, for the help
for _one in metrics.METRICS.values():
    _numbers = (f"  {one.name:<13} {one.meaning}" for one in _one.columns if one not in evidence.BLOCK)
    _MEANINGS.append("\n".join(("\b", f"{_one.name}: {_one.meaning}", *_numbers)))
compare_command.__doc__ = inspect.cleandoc(compare_command.__doc__ or "").replace("{meanings}", "\n\n".join(_MEANINGS))


def comparison_table(comparison: compare.Comparison) -> list[str]:
    """Return the table of a comparison: the measured blocks, with a digit less where it would not fit the screen."""
    measured = {row.block for row in comparison.rows if row.verdict != compare.Verdict.NO_DATA}
    rows = [row for row in comparison.rows if row.block in measured]

    def table(digits: int) -> list[str]:
        cells = [
            (
                row.block,
                f"{row.quantity} {SIGNS.get(row.unit, row.unit)}",
                output.number(row.simulated, digits),
                f"{output.number(row.mean, digits)} ± {output.number(row.s, digits)}",
                _range(row, digits),
                output.number(row.error, digits),
                str(row.verdict),
            )
            for row in rows
        ]
        return output.table_lines(COLUMNS, cells, left=2)

    tables, width = (table(digits) for digits in (DIGITS, DIGITS - 1)), output.width_of_screen()
    return min(tables, key=lambda lines: (max(map(len, lines)) > width, any("…" in line for line in lines)))


def _range(row: compare.ComparisonRow, digits: int) -> str:
    """Return the measured range of a row, and the tolerance on both sides of it that decided."""
    if row.quantity == "rotation" and row.n:
        return f"{output.number(row.mean, digits)} ± {compare.ROTATION_TOLERANCE:g}"
    ends = [output.number(end, digits) for end in (row.minimum, row.maximum)]
    if row.minimum != row.maximum:  # of curves a line below has what widens it
        return f"[{', '.join(ends)}]"
    tolerance = row.minimum - row.lower
    share = "" if row.quantity in QUANTITIES or not row.mean else f"{PERCENT * tolerance / abs(row.mean):.3g} %"
    return f"{ends[0]} ± {share or f'{tolerance:g}'}"


def verdict_lines(comparison: compare.Comparison) -> list[str]:
    """Return what is outside and by how much, or that all is inside."""
    outside = []
    for row in comparison.rows:
        if row.verdict == compare.Verdict.OUTSIDE:
            least = 10.0**-DIGITS  # a distance is never shown as zero
            distance = f"less than {least:g}" if row.distance < least else output.number(row.distance, DIGITS)
            whose = "block" if row.quantity in QUANTITIES else "probe"
            outside.append(f"outside: {row.quantity} of {whose} {row.block} by {distance} {row.unit}")
    return [*_wrapped(comparison.messages), *(outside or ["all inside"])]


def _judgement_lines(judgement: metrics.Judgement) -> Iterator[str]:
    """Yield all tables and their notes, after the first samples that failed."""
    for one in judgement.failures[:MOST_FAILURES]:
        yield textwrap.shorten(f"row {one.row}, case {one.case}: {one.status}: {one.reason}", output.width_of_screen())
    more = len(judgement.failures) - MOST_FAILURES
    if more > 0:
        yield f"... and {more} more did not finish (--json names all)"
    yield from _wrapped(judgement.messages)
    for name, found in judgement.findings.items():
        yield ""
        yield from _wrapped([f"{name}: {metrics.METRICS[name].meaning}"])
        yield from _table(metrics.METRICS[name], found)
        yield from _wrapped(found.messages)
    yield ""
    share, asked = (f"{PERCENT * part:.1f} %" for part in (judgement.share_inside, judgement.settings.threshold))
    count = f"{judgement.inside_all} of {judgement.members} samples ({share})"
    yield f"{count} are within all measured ranges; threshold: {asked}"


def _table(metric: evidence.Metric, found: evidence.Findings) -> list[str]:
    if not found.rows:
        return []
    columns = [column for column in metric.columns if column.head]
    rows = [[_cell(row, column) for column in columns] for row in found.rows[:MOST_ROWS]]
    left = next(i for i, column in enumerate(columns) if column.form is not evidence.Form.TEXT)
    lines = output.table_lines([column.head for column in columns], rows, left)
    more = len(found.rows) - len(rows)
    return [*lines, f"... and {more} more rows (--json has all)"] if more else lines


def _cell(row: evidence.Row, column: evidence.Datum) -> str:
    """Return a value for people; a dash where there is none."""
    value, is_share = row[column.name], column.form is evidence.Form.SHARE
    scale = PERCENT if is_share else 1.0
    match value:
        case str() if column.name == "quantity" and row["unit"]:
            return f"{value} {SIGNS.get(str(row['unit']), row['unit'])}"
        case None:
            return DASH
        case bool():
            return "yes" if value else "no"
        case (low, high):
            ends = [output.number(scale * end, column.digits) for end in (low, high)]
            text = f"{ends[0]}–{ends[1]} %" if is_share else f"[{ends[0]}, {ends[1]}]"
            return text if is_share or ends != [DASH, DASH] else DASH
        case float():
            return output.number(scale * value, column.digits) + (" %" if is_share else "")
        case _:
            return str(value)


def _wrapped(texts: Iterable[str]) -> list[str]:
    width = output.width_of_screen()
    return [line for text in texts for line in textwrap.wrap(text, width, break_long_words=False)]
