"""How the comparison of a run with measured repeats is shown."""

from blocksim.analysis.compare import Comparison, ComparisonRow, Verdict
from blocksim.cli.output import number, table_lines, width_of_screen

COLUMNS = ("block", "quantity", "simulated", "mean ± s", "[min, max]", "error", "verdict")
DIGITS = 2
SIGNS = {"deg": "°"}


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
