"""How the comparison of a run with measured repeats is shown."""

from blocksim.analysis.compare import Comparison, ComparisonRow, Verdict
from blocksim.cli.output import number, table_lines

COLUMNS = ("block", "quantity", "simulated", "mean ± s", "[min, max]", "error", "verdict")
SIGNS = {"deg": "°"}


def comparison_table(comparison: Comparison) -> list[str]:
    """Return the table of a comparison, for a screen 80 columns wide."""
    return table_lines(COLUMNS, [_cells(row) for row in comparison.rows], left=2)


def _cells(row: ComparisonRow) -> tuple[str, ...]:
    return (
        row.block,
        f"{row.quantity} {SIGNS.get(row.unit, row.unit)}",
        number(row.simulated),
        f"{number(row.mean)} ± {number(row.s)}",
        f"[{number(row.minimum)}, {number(row.maximum)}]",
        number(row.error),
        str(row.verdict),
    )


def verdict_lines(comparison: Comparison) -> list[str]:
    """Return what is outside and by how much, or that all is inside."""
    outside = [row for row in comparison.rows if row.verdict == Verdict.OUTSIDE]
    found = [f"outside: {row.quantity} of block {row.block} by {number(row.distance)} {row.unit}" for row in outside]
    return [*comparison.messages, *(found or ["all inside"])]
