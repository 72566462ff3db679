"""What results/README.md quotes is what the code gives."""

import json
from pathlib import Path

import pytest

from blocksim.verification.findings import BEGIN, FINDINGS, STORE, Finding, measure_finding, with_table

PAGE = Path(__file__).parents[2] / "results" / "README.md"
KEPT = {row["command"]: row for row in json.loads(PAGE.with_name(STORE).read_text(encoding="utf-8"))}


def test_table_of_the_page_is_that_of_the_kept_findings() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert BEGIN in page
    assert with_table(page, list(KEPT.values())) == page, "run: make findings"


def check(finding: Finding) -> None:
    now, kept = measure_finding(finding), KEPT[finding.command]
    assert now["x_mm"] == pytest.approx(kept["x_mm"], abs=0.02), "run: make findings"
    assert now["inside"] == kept["inside"]


@pytest.mark.parametrize("finding", [finding for finding in FINDINGS if not finding.slow], ids=lambda row: row.title)
def test_quoted_run_ends_where_the_page_says(finding: Finding) -> None:
    check(finding)


@pytest.mark.long
@pytest.mark.parametrize("finding", [finding for finding in FINDINGS if finding.slow], ids=lambda row: row.title)
def test_quoted_run_of_particles_ends_where_the_page_says(finding: Finding) -> None:
    check(finding)
