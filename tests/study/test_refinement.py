"""What is refined where contacts are rigid: the step, as it was chosen, and the tolerance."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from blocksim.errors import InvalidInputError
from blocksim.scenario import Document, Scenario
from blocksim.study.converge import STUDIES, converge, refinements_of
from blocksim.study.convergence import Verdict
from tests.study.conftest import SCENARIOS

if TYPE_CHECKING:
    from pathlib import Path


def rigid(name: str, **values: object) -> Scenario:
    """Return a shipped scenario with rigid contacts; double underscores in names stand for dots."""
    keys: dict[str, Any] = {key.replace("__", "."): value for key, value in values.items()}
    return Document.read(SCENARIOS / f"{name}.toml").with_values({"time.scheme": "nonsmooth", **keys}).build()


def test_step_and_tolerance_are_refined_from_what_the_run_takes() -> None:
    step, tolerance = refinements_of(rigid("slide"))
    assert (step.key, step.factor, step.coarser) == ("time.step", 0.5, 2)
    assert step.own == pytest.approx(1e-3 / 13)  # what "auto" takes for a single block of 25 mm
    assert (tolerance.key, tolerance.own) == ("time.velocity_tolerance", 1e-3)
    assert [tolerance.value(level) for level in (-2, 0, 2)] == pytest.approx([1e-2, 1e-3, 1e-4])
    assert tolerance.at(rigid("slide"), 2).time.velocity_tolerance == pytest.approx(1e-4)  # type: ignore[union-attr]


def test_crowd_starts_from_its_own_tolerance_and_step() -> None:
    step, tolerance = refinements_of(rigid("wall", time__step=5e-4))
    assert (step.own, tolerance.own) == (5e-4, 0.1)


def test_no_step_is_tried_that_would_be_refused() -> None:
    assert refinements_of(rigid("three_blocks_nominal", time__step=6e-3))[0].coarser == 0


@pytest.mark.parametrize(("name", "studies"), [("slide", ["stiffness", "spacing"]), ("slide", ["spacing"])])
def test_springs_are_not_studied_where_there_are_none(name: str, studies: list[str]) -> None:
    with pytest.raises(InvalidInputError, match="nothing to study: contacts are rigid"):
        refinements_of(rigid(name), studies)


def test_springs_have_no_tolerance_to_study() -> None:
    scenario = Document.read(SCENARIOS / "slide.toml").build()
    with pytest.raises(InvalidInputError, match="nothing to study"):
        refinements_of(scenario, ["tolerance"])
    assert {one.study for one in refinements_of(scenario)} | {"spacing", "tolerance"} == set(STUDIES)


def test_slide_converges_in_the_square_of_the_step(tmp_path: Path) -> None:
    found = converge(rigid("slide", contact__restitution=0.0), tolerance_mm=0.01, out=tmp_path)
    step, tolerance = found.studies
    assert (step.verdict, tolerance.verdict) == (Verdict.CONVERGED, Verdict.CONVERGED)
    assert tolerance.last_change_mm < 1e-3
    assert "contacts are rigid" in found.notes[0]
