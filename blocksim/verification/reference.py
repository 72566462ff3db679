"""The verification tables of this folder's README: measured, kept in results/verify.json, written as Markdown.

`python -m blocksim.verification.reference blocksim/verification/README.md` writes the tables from the kept results.
With `--measure` all cases are run first (twenty-five minutes) and the results replaced; names of columns after it limit
that to these: `--measure nonsmooth` takes half a minute and leaves all others as they are, `--measure soil` is soil.
"""

import json
import re
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from blocksim.scenario.key_table import with_part
from blocksim.scenario.models.stepping import IMPULSES
from blocksim.simulation.atomic import write_text
from blocksim.verification.case import (
    Case,
    Row,
    Setting,
    Verdict,
    error_text,
    expected_text,
    number,
    run_case,
    tolerance_text,
)
from blocksim.verification.cases import CASES, choose_cases, excluded_cases
from blocksim.verification.soil import SOIL_CASES

BEGIN = "<!-- verify: written by `make verify-table` -->"
END = "<!-- end of verify -->"
SOIL_BEGIN = "<!-- soil: written by `make verify-table` -->"
SOIL_END = "<!-- end of soil -->"
STORE = Path("results") / "verify.json"  # below the current folder
COLUMNS = {  # head of the column: how it is measured
    "linear": Setting(),
    "Hertz–Mindlin": Setting(law="hertz-mindlin"),
    "`kernel`, quick": Setting("kernel", quick=True),
    "`particles`, quick": Setting("particles", quick=True),
}
RIGID = IMPULSES  # head of the second table's column
RIGID_HEADS = ("case", "quantity", "expected", "tolerance", "measured")
SOIL = "soil"  # the cases of soil, in a table of their own
SOIL_HEADS = ("case", "source", "quantity", "expected", "tolerance", "measured", "error")
SETTINGS = {**COLUMNS, RIGID: Setting(scheme=IMPULSES), SOIL: Setting()}
FIELDS = ("quantity", "unit", "expected", "measured", "tolerance", "relative", "at_least")
SIGNS = {Verdict.INSIDE: "✓", Verdict.OUTSIDE: "✗"}
Stored = dict[str, dict[str, list[dict[str, Any]]]]  # head of the column, case id, rows


def cases_of(head: str) -> tuple[Case, ...]:
    """Return the cases of a column."""
    return SOIL_CASES if head == SOIL else choose_cases([], SETTINGS[head].scheme)


def _measured(head: str) -> Iterator[tuple[str, list[dict[str, Any]]]]:
    setting = SETTINGS[head]
    for case in cases_of(head):
        outcome = run_case(case, setting)
        name = f"{setting.scheme} {setting.model} {setting.law} {case.id}"
        print(f"{name}: {outcome.seconds:.1f} s", file=sys.stderr, flush=True)  # noqa: T201
        yield case.id, [{name: getattr(row, name) for name in FIELDS} for row in outcome.rows]


def stored_rows(stored: Stored, head: str, case: Case) -> list[Row]:
    """Return the kept rows of one case in one setting."""
    return [Row(**{**row, "measured": _number(row["measured"])}) for row in stored.get(head, {}).get(case.id, [])]


def _number(value: float | None) -> float:
    return float("nan") if value is None else value


def table(stored: Stored) -> str:
    """Return the tables as Markdown: with the reasons for misses of models and for cases left out."""
    heads = ("case", "quantity", "expected", "tolerance", *COLUMNS)
    lines = markdown(heads, [cells for case in CASES for cells in _case_cells(stored, case)])
    return "\n".join([lines, *_remarks(stored), "", *_rigid_table(stored)])


def markdown(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table as Markdown."""
    head, *lines = (f"| {' | '.join(cells)} |" for cells in (heads, *rows))
    return "\n".join([head, f"|{' --- |' * len(heads)}", *lines])


def soil_table(stored: Stored) -> str:
    """Return the table of soil as Markdown, misses among it, and their reasons."""
    rows = [cells for case in SOIL_CASES for cells in _cells(stored, SOIL, case)]
    found = _missed(stored, SOIL)
    reasons = ["", "Where a tolerance is missed:", "", *found] if found else []
    return "\n".join([markdown(SOIL_HEADS, rows), *reasons])


def _rigid_table(stored: Stored) -> Iterator[str]:
    scheme = SETTINGS[RIGID].scheme
    yield from [f"Rigid contacts, `blocksim verify --scheme {scheme}`:", ""]
    yield markdown(RIGID_HEADS, [cells for case in choose_cases([], scheme) for cells in _cells(stored, RIGID, case)])
    yield from ["", f"Left out: {'; '.join(excluded_cases(scheme))}."]


def _cells(stored: Stored, head: str, case: Case) -> Iterator[list[str]]:
    """Yield the cells of a table of one column; that of soil has the sources and errors too."""
    names = [f"{case.id} {case.title}", *([case.source] if head == SOIL else [])]
    for row in stored_rows(stored, head, case):
        quantity = f"{row.quantity}, {row.unit}" if row.unit else row.quantity
        errors = [error_text(row)] if head == SOIL else []
        yield [*names, quantity, expected_text(row), tolerance_text(row), _cell(row), *errors]
        names = [""] * len(names)


def _case_cells(stored: Stored, case: Case) -> Iterator[list[str]]:
    columns = [{row.quantity: row for row in stored_rows(stored, head, case)} for head in COLUMNS]
    name = f"{case.id} {case.title}"
    for quantity, row in columns[0].items():
        others = [column.get(quantity) for column in columns]
        laws = [other for other in others[:2] if other is not None]
        yield [
            name,
            f"{quantity}, {row.unit}" if row.unit else quantity,
            " / ".join(dict.fromkeys(expected_text(other) for other in laws)),
            " / ".join(dict.fromkeys(tolerance_text(other) for other in laws)),
            *(_cell(other) for other in others),
        ]
        name = ""


def _cell(row: Row | None) -> str:
    return "–" if row is None else f"{number(row.measured)} {SIGNS[row.verdict]}"


def _remarks(stored: Stored) -> Iterator[str]:
    found = [text for head in COLUMNS for text in _missed(stored, head, f"{head} ")]
    if found:
        yield from ["", "Where models other than `surface` miss a tolerance:", "", *found]


def _missed(stored: Stored, head: str, before: str = "") -> list[str]:
    """Return the reasons of cases that miss a tolerance."""
    model = SETTINGS[head].model
    missed = [
        case
        for case in cases_of(head)
        if any(row.verdict == Verdict.OUTSIDE for row in stored_rows(stored, head, case)) and model in case.remarks
    ]
    return [f"* {before}{case.id}: {case.remarks[model]}" for case in missed]


def with_table(text: str, stored: Stored) -> str:
    """Return a README with the tables between their marks replaced."""
    return with_part(with_part(text, BEGIN, table(stored), END), SOIL_BEGIN, soil_table(stored), SOIL_END)


def read_store(path: Path) -> Stored:
    """Read the kept results."""
    stored: Stored = json.loads(path.read_text(encoding="utf-8"))
    return stored


def write_store(path: Path, stored: Stored) -> None:
    """Keep results; one row a line, numbers that are not finite as null."""
    finite = json.loads(json.dumps(stored), parse_constant=lambda _: None)
    text = json.dumps(finite, indent=1, ensure_ascii=False, allow_nan=False)
    folded = re.sub(r"\{\n\s+\"quantity\".*?\}", lambda row: " ".join(row.group().split()), text, flags=re.DOTALL)
    write_text(path, folded + "\n")


def main(arguments: Sequence[str]) -> None:
    """Write the table into the README named first, after measuring where asked to."""
    readme, *options = arguments
    store = STORE
    if options[:1] == ["--measure"]:
        measure(store, options[1:] or list(SETTINGS))
    text = Path(readme).read_text(encoding="utf-8")
    write_text(Path(readme), with_table(text, read_store(store)))


def measure(store: Path, heads: Sequence[str]) -> None:
    """Run all cases in the settings of some columns and keep the results, column by column."""
    for head in heads:
        stored = read_store(store) if store.is_file() else {}
        stored[head] = dict(_measured(head))
        write_store(store, {name: stored[name] for name in SETTINGS if name in stored})


if __name__ == "__main__":
    main(sys.argv[1:])
