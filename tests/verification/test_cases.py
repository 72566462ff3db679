"""Every case, under both laws; `blocksim verify` runs the same functions. And: what the README says is still so."""

from __future__ import annotations

from pathlib import Path

import pytest

from blocksim.verification.case import Case, CaseOutcome, Row, Setting, at_least, run_case
from blocksim.verification.cases import CASES, choose_cases
from blocksim.verification.reference import (
    BEGIN,
    END,
    SETTINGS,
    STORE,
    cases_of,
    read_store,
    rows_of,
    table,
    with_table,
)
from tests.verification.rows import allowed, missed, same_kind

ROOT = Path(__file__).parents[2]
LAWS = {"linear": "linear", "Hertz–Mindlin": "hertz-mindlin"}  # head of the column in the README: law
SLOW = {"V10", "V12", "V15", "V18", "V23"}  # seconds; V9, V11 and the ledgers of tests/simulation are there always
LONG = pytest.mark.long
HEADS = [
    pytest.param(
        case, head, id=f"{case.id}-{law}", marks=pytest.mark.long if law != "linear" or case.id in SLOW else ()
    )
    for head, law in LAWS.items()
    for case in CASES
]  # make test has the linear law; tests of Hertz' law are in tests/kernels, its cases are for make test-long


def outcome(case_id: str, law: str, *, quick: bool) -> CaseOutcome:
    (case,) = choose_cases([case_id], Setting())
    return run_case(case, Setting(law=law, quick=quick))


@pytest.mark.parametrize(("case", "head"), HEADS)
def test_case_is_inside_its_tolerances_and_what_the_readme_says(case: Case, head: str) -> None:
    """The quick size may leave rows out; numbers are compared where the sizes are the same."""
    found = outcome(case.id, LAWS[head], quick=True)
    assert found.rows
    assert missed(found) == []
    kept = {row.quantity: row for row in rows_of(read_store(ROOT / STORE), head, case)}
    assert case.quick or list(kept) == [row.quantity for row in found.rows], "run: make verify-table"
    for row in found.rows:
        assert same_kind(kept[row.quantity], row), "run: make verify-table"
        if not case.quick:
            assert kept[row.quantity].measured == pytest.approx(row.measured, rel=1e-9, abs=allowed(row))


@pytest.mark.long
@pytest.mark.parametrize("law", LAWS.values())
@pytest.mark.parametrize("case", [case for case in CASES if case.quick], ids=lambda case: case.id)
def test_case_in_full_is_inside_its_tolerances(case: Case, law: str) -> None:
    assert missed(outcome(case.id, law, quick=False)) == []


def test_table_of_the_readme_is_that_of_the_kept_results() -> None:
    readme = (ROOT / "blocksim/verification/README.md").read_text(encoding="utf-8")
    assert BEGIN in readme
    assert END in readme
    assert with_table(readme, read_store(ROOT / STORE)) == readme, "run: make verify-table"


def test_kept_results_have_all_cases_in_every_column() -> None:
    stored = read_store(ROOT / STORE)
    assert list(stored) == list(SETTINGS), "run: make verify-table"
    for head, column in stored.items():
        assert list(column) == [case.id for case in cases_of(head)]
        assert all(column.values())


@pytest.mark.parametrize(
    ("row", "inside"),
    [
        (Row("number", "m", 1.0, 1.02, 0.01), False),
        (Row("number", "m", 1.0, 0.991, 0.01), True),
        (Row("share", "m", 100.0, 98.0, 0.01, relative=True), False),
        (Row("share", "m", -100.0, -100.9, 0.01, relative=True), True),
        (Row("not a number", "m", 1.0, float("nan"), 10.0), False),
        (at_least("order", "", 1.8, 1.79), False),
        (at_least("order", "", 1.8, 2.5), True),
    ],
)
def test_a_number_is_inside_up_to_its_tolerance(row: Row, inside: bool) -> None:
    assert row.is_inside == inside


def test_table_shows_a_miss_and_its_reason() -> None:
    stored = read_store(ROOT / STORE)
    changed = {head: dict(column) for head, column in stored.items()}
    changed["linear"]["V2"] = [{**changed["linear"]["V2"][0], "measured": None}]
    line = next(line for line in table(changed).splitlines() if line.startswith("| V2 "))
    assert "– ✗" in line
