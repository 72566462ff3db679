"""The tables of blocksim/verification/README.md: measured, kept in results/verify.json, written as Markdown.

`python -m tests.verification.reference blocksim/verification/README.md` writes the tables from the kept results.
With `--measure` all cases are run first (twenty-five minutes) and the results replaced; names of columns after it limit
that to these: `--measure nonsmooth` takes half a minute and leaves all others as they are, `--measure soil` is soil.
"""

import json
import re
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from blocksim.scenario.models.timeline import IMPULSES
from blocksim.simulation.files import write_text
from blocksim.verification.case import Case, Row, Setting, run_case
from blocksim.verification.cases import CASES, choose_cases, exclusions
from tests.verification.paper import markdown

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
SOIL = "soil"  # the cases of soil, in a table of their own
SETTINGS = {**COLUMNS, RIGID: Setting(scheme=IMPULSES), SOIL: Setting()}
Stored = dict[str, dict[str, list[dict[str, Any]]]]  # head of the column, case id, rows


def cases_of(head: str) -> tuple[Case, ...]:
    """Return the cases of a column."""
    return choose_cases([], SETTINGS[head], soil=head == SOIL)


def rows_of(stored: Stored, head: str, case: Case) -> list[Row]:
    """Return the kept rows of one case in one setting; a number that is not finite is kept as None."""
    rows = stored.get(head, {}).get(case.id, [])
    return [Row(**{**row, "measured": float("nan") if row["measured"] is None else row["measured"]}) for row in rows]


def with_part(text: str, begin: str, part: str, end: str) -> str:
    """Return a page with what stands between two marks replaced."""
    marked = re.compile(f"{re.escape(begin)}.*{re.escape(end)}", re.DOTALL)
    return marked.sub(lambda _: f"{begin}\n{part}\n{end}", text)


def table(stored: Stored) -> str:
    """Return the tables of blocks as Markdown, with the reasons for misses of models and for cases left out."""
    rows = []
    for case in CASES:
        columns = [{row.quantity: row for row in rows_of(stored, head, case)} for head in COLUMNS]
        name = f"{case.id} {case.title}"
        for quantity, row in columns[0].items():
            others = [column.get(quantity) for column in columns]
            texts = [other.texts for other in others[:2] if other is not None]
            stated = [" / ".join(dict.fromkeys(text[key] for text in texts)) for key in ("expected", "tolerance")]
            rows.append([name, row.texts["quantity"], *stated, *map(_cell, others)])
            name = ""
    reasons = [reason for head in COLUMNS for reason in _reasons(stored, head, f"{head} ")]
    if reasons:
        reasons = ["", "Where models other than `surface` miss a tolerance:", "", *reasons]
    heads, scheme = ("case", "quantity", "expected", "tolerance"), SETTINGS[RIGID].scheme
    rigid = [
        f"Rigid contacts, `blocksim verify --scheme {scheme}`:",
        "",
        markdown((*heads, "measured"), list(_rows(stored, RIGID))),
        "",
        f"Left out: {'; '.join(exclusions(scheme))}.",
    ]
    return "\n".join([markdown((*heads, *COLUMNS), rows), *reasons, "", *rigid])


def soil_table(stored: Stored) -> str:
    """Return the table of soil as Markdown, misses among it, and their reasons."""
    heads = ("case", "source", "quantity", "expected", "tolerance", "measured", "error")
    reasons = list(_reasons(stored, SOIL))
    if reasons:
        reasons = ["", "Where a tolerance is missed:", "", *reasons]
    return "\n".join([markdown(heads, list(_rows(stored, SOIL))), *reasons])


def _rows(stored: Stored, head: str) -> Iterator[list[str]]:
    """Yield the rows of a table of one column; that of soil has the sources and errors too."""
    for case in cases_of(head):
        names = [f"{case.id} {case.title}", *([case.source] if head == SOIL else [])]
        for row in rows_of(stored, head, case):
            texts = row.texts
            errors = [texts["error"]] if head == SOIL else []
            yield [*names, texts["quantity"], texts["expected"], texts["tolerance"], _cell(row), *errors]
            names = [""] * len(names)


def _cell(row: Row | None) -> str:
    return "–" if row is None else f"{row.texts['measured']} {'✓' if row.is_inside else '✗'}"


def _reasons(stored: Stored, head: str, before: str = "") -> Iterator[str]:
    """Yield the reasons of cases that miss a tolerance."""
    model = SETTINGS[head].model
    for case in cases_of(head):
        if model in case.remarks and not all(row.is_inside for row in rows_of(stored, head, case)):
            yield f"* {before}{case.id}: {case.remarks[model]}"


def with_table(text: str, stored: Stored) -> str:
    """Return a README with the tables between their marks replaced."""
    return with_part(with_part(text, BEGIN, table(stored), END), SOIL_BEGIN, soil_table(stored), SOIL_END)


def read_store(path: Path) -> Stored:
    """Read the kept results."""
    stored: Stored = json.loads(path.read_text(encoding="utf-8"))
    return stored


def measure(store: Path, heads: Sequence[str]) -> None:
    """Run all cases in the settings of some columns and keep the results, column by column.

    One row is a line of the file; numbers that are not finite are null.
    """
    for head in heads:
        setting, column = SETTINGS[head], {}
        for case in cases_of(head):
            outcome = run_case(case, setting)
            name = f"{setting.scheme} {setting.model} {setting.law} {case.id}"
            print(f"{name}: {outcome.seconds:.1f} s", file=sys.stderr, flush=True)  # noqa: T201 - progress
            column[case.id] = [asdict(row) for row in outcome.rows]
        stored = {**(read_store(store) if store.is_file() else {}), head: column}
        finite = json.loads(
            json.dumps({name: stored[name] for name in SETTINGS if name in stored}), parse_constant=lambda _: None
        )
        text = json.dumps(finite, indent=1, ensure_ascii=False, allow_nan=False)
        folded = re.sub(r"\{\n\s+\"quantity\".*?\}", lambda row: " ".join(row.group().split()), text, flags=re.DOTALL)
        write_text(store, folded + "\n")


def main(arguments: Sequence[str]) -> None:
    """Write the table into the README named first, after measuring where asked to."""
    readme, *options = arguments
    if options[:1] == ["--measure"]:
        measure(STORE, options[1:] or list(SETTINGS))
    write_text(Path(readme), with_table(Path(readme).read_text(encoding="utf-8"), read_store(STORE)))


if __name__ == "__main__":
    main(sys.argv[1:])
