"""The paper by one command: tables, equations over motions; what results/README.md quotes is what the code gives."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from blocksim.errors import BlocksimError
from blocksim.scenario import load_scenario
from blocksim.simulation.run import simulate
from tests.verification import paper as laws
from tests.verification.findings import BEGIN, FINDINGS, STORE, Finding, measure_finding, with_table
from tests.verification.paper import COLLAPSES, write_paper

SCENARIOS = Path(laws.__file__).parents[2] / "scenarios"
RESULTS = SCENARIOS.parent / "results"
SOFT = {"contact.stiffness_scale": 0.001}


def cells(text: str, name: str) -> list[str]:
    """Return the cells of the row of a table that begins with a name."""
    return next([cell.strip() for cell in line.split("|")[2:-1]] for line in text.splitlines() if f"| {name} |" in line)


def test_all_figures_and_tables_are_written_and_linked(tmp_path: Path) -> None:
    written = write_paper(tmp_path / "paper", SCENARIOS, SOFT)
    text = (tmp_path / "paper" / "README.md").read_text(encoding="utf-8")
    linked = re.findall(r"\]\((\w+\.png)\)", text)
    assert {path.name for path in written} == {*linked, "README.md"} == {p.name for p in (tmp_path / "paper").iterdir()}
    assert sum(path.stat().st_size for path in written) < 1_000_000
    assert cells(text, "density ρ (a unit weight)")[:2] == ["26.7", "26.7"]
    assert cells(text, "left, block 3")[:7] == ["114.32", "114.07", "111.03", "104.93", "116.32", "106.21", "111.15"]
    centres = cells(text, "block 2")
    assert centres[:8] == ["71.69", "76.57", "72.70", "73.22", "73.73", "78.53", "74.41", "76.05"]
    assert len(centres) == 8 + len(COLLAPSES)
    for cell in centres[8:]:
        assert cell.endswith("✓" if 71.69 <= float(cell.split()[0]) <= 78.53 else "✗")


def test_the_page_that_is_kept_has_the_calibrated_run_inside_and_the_one_with_nothing_tuned_outside() -> None:
    centres = cells((RESULTS / "paper" / "README.md").read_text(encoding="utf-8"), "block 2")
    assert centres[8].endswith("✓")
    assert centres[9].endswith("✗")  # block 2 stops short


def test_a_bounce_follows_equation_10_and_another_restitution_does_not() -> None:
    scenario = load_scenario(SCENARIOS / "bounce.toml")
    run = simulate(scenario)
    law = laws.bounce_law(run)
    assert law.largest < 0.03  # mm, of 100: contact takes a little time
    assert law.expected[0] == pytest.approx(100.0)
    assert law.expected[-1] == 0.0
    at_half = 0.5 * (law.marks[0] + law.marks[1])
    assert np.interp(at_half, law.time, law.expected) == pytest.approx(25.0, abs=0.01)  # h0 e^2
    for one in laws.bounces(run):
        assert one.apex == pytest.approx(one.eq12_apex, rel=0.01, abs=0.002)
        assert one.flight == pytest.approx(one.eq12_flight, rel=0.002)
    assert len(laws.bounces(run)) == 6
    wrong = {"contact.restitution": 0.45}
    other = laws.bounce_law(simulate(load_scenario(SCENARIOS / "bounce.toml", wrong)))
    assert np.abs(other.simulated - law.expected).max() > 1.0


def test_a_slide_follows_equation_13() -> None:
    law = laws.slide_law(simulate(load_scenario(SCENARIOS / "slide.toml")))
    assert law.largest < 1e-3  # mm/s, of 500
    assert law.marks[0] == pytest.approx(0.5 / (0.38 * 9.81))
    assert law.expected[0] == pytest.approx(500.0)


def test_a_run_that_does_not_finish_is_reported(tmp_path: Path) -> None:
    with pytest.raises(BlocksimError, match=r"three_blocks\.toml: the run has failed"):
        write_paper(tmp_path, SCENARIOS, {**SOFT, "contact.max_overlap": 1e-9})


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
