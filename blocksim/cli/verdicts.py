"""How comparisons with measured repeats are shown: of a run, and of a sweep by all metrics."""

import textwrap
from collections.abc import Iterator

from blocksim.analysis.compare import Comparison, ComparisonRow, Verdict
from blocksim.analysis.judgement import Judgement
from blocksim.analysis.members import Failure
from blocksim.analysis.metrics import METRICS
from blocksim.analysis.metrics.metric import BLOCK, Column, Findings, Form, Metric, Row, Value
from blocksim.cli.output import number, table_lines, width_of_screen

COLUMNS = ("block", "quantity", "simulated", "mean ± s", "[min, max]", "error", "verdict")
DIGITS = 2
SIGNS = {"deg": "°"}
MOST_ROWS = 40  # of one table
MOST_FAILURES = 3
PERCENT = 100.0
DASH = "–"


def comparison_table(comparison: Comparison) -> list[str]:
    """Return the table of a comparison: the measured blocks, with a digit less where it would not fit the screen."""
    measured = {row.block for row in comparison.rows if row.verdict != Verdict.NO_DATA}
    rows = [row for row in comparison.rows if row.block in measured]
    tables = (table_lines(COLUMNS, [_cells(row, digits) for row in rows], left=2) for digits in (DIGITS, DIGITS - 1))
    return min(tables, key=_misfit)


def _misfit(lines: list[str]) -> tuple[bool, bool]:
    """Return whether a table is wider than the screen, and whether a text in it had to be cut."""
    return max(map(len, lines)) > width_of_screen(), any("…" in line for line in lines)


def _cells(row: ComparisonRow, digits: int) -> tuple[str, ...]:
    return (
        row.block,
        f"{row.quantity} {SIGNS.get(row.unit, row.unit)}",
        number(row.simulated, digits),
        f"{number(row.mean, digits)} ± {number(row.s, digits)}",
        f"[{number(row.minimum, digits)}, {number(row.maximum, digits)}]",
        number(row.error, digits),
        str(row.verdict),
    )


def verdict_lines(comparison: Comparison) -> list[str]:
    """Return what is outside and by how much, or that all is inside."""
    outside = [row for row in comparison.rows if row.verdict == Verdict.OUTSIDE]
    found = [f"outside: {row.quantity} of block {row.block} by {_amount(row.distance)} {row.unit}" for row in outside]
    return [*comparison.messages, *(found or ["all inside"])]


def _amount(distance: float) -> str:
    """Return how far something is outside, which is never shown as zero."""
    least = 10.0**-DIGITS
    return f"less than {least:g}" if distance < least else number(distance, DIGITS)


def judgement_lines(judgement: Judgement) -> list[str]:
    """Return all tables and their notes, for a screen 80 columns wide."""
    lines = [*_failures(judgement.failures), *_wrapped(judgement.messages)]
    for name, found in judgement.findings.items():
        lines += ["", *_wrapped([f"{name}: {METRICS[name].meaning}"]), *_table(METRICS[name], found)]
        lines += _wrapped(found.messages)
    return [*lines, "", _share_line(judgement)]


def meanings() -> str:
    """Return the names of all numbers with their meanings, a line each, for the help."""
    return "\n\n".join("\b\n" + "\n".join(_explained(metric)) for metric in METRICS.values())


def _explained(metric: Metric) -> Iterator[str]:
    yield f"{metric.name}: {metric.meaning}"
    for column in metric.columns:
        if column not in BLOCK:
            yield f"  {column.name:<13} {column.meaning}"


def _failures(failures: tuple[Failure, ...]) -> list[str]:
    """Name the first samples that failed, a line each."""
    lines = [
        textwrap.shorten(f"row {one.row}, case {one.case}: {one.status}: {one.reason}", width_of_screen())
        for one in failures[:MOST_FAILURES]
    ]
    more = len(failures) - len(lines)
    return [*lines, f"... and {more} more did not finish (--json names all)"] if more else lines


def _table(metric: Metric, found: Findings) -> list[str]:
    if not found.rows:
        return []
    columns = [column for column in metric.columns if column.head]
    rows = [[_cell(row, column) for column in columns] for row in found.rows[:MOST_ROWS]]
    left = next(i for i, column in enumerate(columns) if column.form is not Form.TEXT)
    lines = table_lines([column.head for column in columns], rows, left)
    more = len(found.rows) - len(rows)
    return [*lines, f"... and {more} more rows (--json has all)"] if more else lines


def _cell(row: Row, column: Column) -> str:
    value = row[column.name]
    if column.name == "quantity" and row["unit"]:
        return f"{value} {SIGNS.get(str(row['unit']), row['unit'])}"
    return _shown(value, column)


def _shown(value: Value, column: Column) -> str:
    """Return a value for people; a dash where there is none."""
    match value:
        case None:
            return DASH
        case bool():
            return "yes" if value else "no"
        case (low, high):
            return _interval(low, high, column)
        case float() if column.form is Form.SHARE:
            return f"{number(PERCENT * value, column.digits)} %"
        case float():
            return number(value, column.digits)
        case _:
            return str(value)


def _interval(low: float, high: float, column: Column) -> str:
    if column.form is Form.SHARE:
        return f"{number(PERCENT * low, column.digits)}–{number(PERCENT * high, column.digits)} %"
    ends = [number(low, column.digits), number(high, column.digits)]
    return DASH if ends == [DASH, DASH] else f"[{ends[0]}, {ends[1]}]"


def _share_line(judgement: Judgement) -> str:
    share, asked = (f"{PERCENT * part:.1f} %" for part in (judgement.share_inside, judgement.settings.threshold))
    count = f"{judgement.inside_all} of {judgement.members} samples ({share})"
    return f"{count} are within all measured ranges; threshold: {asked}"


def _wrapped(texts: tuple[str, ...] | list[str]) -> list[str]:
    width = width_of_screen()
    return [line for text in texts for line in textwrap.wrap(text, width, break_long_words=False)]
