"""The table of the cases of soil in this folder's README: measured, kept in results/verify_soil.json, as Markdown.

`python -m blocksim.verification.soil_reference blocksim/verification/README.md` writes the table from what is kept;
with `--measure` all cases are run first (nine minutes), or with names after it these.
"""

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from blocksim.scenario.key_table import with_part
from blocksim.simulation.atomic import write_text
from blocksim.verification.case import Case, Row, Setting, Verdict
from blocksim.verification.cases import chosen_of_soil
from blocksim.verification.reference import FIELDS, SIGNS, markdown
from blocksim.verification.soil import SOIL_CASES
from blocksim.verification.verify import error_text, expected_text, number, run_case, tolerance_text

BEGIN = "<!-- soil: written by `python -m blocksim.verification.soil_reference` -->"
END = "<!-- end of soil -->"
STORE = Path("results") / "verify_soil.json"  # below the current folder
SURFACE = Setting().model
HEADS = ("case", "source", "quantity", "expected", "tolerance", "measured", "error")
Stored = dict[str, list[dict[str, Any]]]  # by case


def rows_of(stored: Stored, case: Case) -> list[Row]:
    """Return the kept rows of a case."""
    return [Row(**row) for row in stored.get(case.id, [])]


def table(stored: Stored) -> str:
    """Return the table as Markdown, misses among it, and their reasons."""
    kept = {case.id: rows_of(stored, case) for case in SOIL_CASES}
    lines = markdown(HEADS, [cells for case in SOIL_CASES for cells in _cells(case, kept[case.id])])
    missed = [case for case in SOIL_CASES if any(row.verdict == Verdict.OUTSIDE for row in kept[case.id])]
    reasons = [f"* {case.id}: {case.remarks[SURFACE]}" for case in missed if SURFACE in case.remarks]
    return "\n".join([lines, *(["", "Where a tolerance is missed:", "", *reasons] if reasons else [])])


def _cells(case: Case, rows: list[Row]) -> Iterator[list[str]]:
    names = [f"{case.id} {case.title}", case.source]
    for row in rows:
        quantity = f"{row.quantity}, {row.unit}" if row.unit else row.quantity
        sign = SIGNS[Verdict(row.verdict)]
        yield [
            *names,
            quantity,
            expected_text(row),
            tolerance_text(row),
            f"{number(row.measured)} {sign}",
            error_text(row),
        ]
        names = ["", ""]


def with_soil_table(text: str, stored: Stored) -> str:
    """Return a README with the table between the two marks replaced."""
    return with_part(text, BEGIN, table(stored), END)


def read_store(path: Path) -> Stored:
    """Return what is kept."""
    found: Stored = json.loads(path.read_text(encoding="utf-8"))
    return found


def measured(case: Case, *, quick: bool = False) -> list[dict[str, Any]]:
    """Run a case and return its rows as they are kept."""
    outcome = run_case(case, Setting(quick=quick))
    return [{name: getattr(row, name) for name in FIELDS} for row in outcome.rows]


def _main(readme: Path, arguments: list[str]) -> None:
    stored = read_store(STORE) if STORE.exists() else {}
    if arguments[:1] == ["--measure"]:
        stored |= {case.id: measured(case) for case in chosen_of_soil(arguments[1:])}
        stored = {case.id: stored[case.id] for case in SOIL_CASES if case.id in stored}
        write_text(STORE, json.dumps(stored, indent=1) + "\n")
    write_text(readme, with_soil_table(readme.read_text(encoding="utf-8"), stored))


if __name__ == "__main__":
    _main(Path(sys.argv[1]), sys.argv[2:])
