"""Studies of convergence: what is refined, what is observed, and what is recommended."""

import tomllib
from collections.abc import Iterator
from contextlib import nullcontext
from math import radians
from pathlib import Path
from typing import Any

import pytest

from blocksim.scenario import Document, Model, Scenario
from blocksim.scenario.placement import soil_tables
from blocksim.study.converge import (
    Convergence,
    ConvergenceVerdict,
    Coordinates,
    Refinement,
    RefinementStudy,
    converge,
    judge,
    refinements_of,
    with_setting,
)
from blocksim.study.executors import Batch, RunSetting, Task, ensemble as folders, processes
from blocksim.study.executors.processes import DEAD
from blocksim.study.rows import Row
from tests.golden import Golden
from tests.soils import column, scene
from tests.study.conftest import SCENARIOS

FAILED: Row = {"status": "failed", "reason": "an overlap exceeds contact.max_overlap", "seconds": 0.1}
HALVED = Refinement("step", "time step", "time.safety", 0.05, 0.5, 1)


@pytest.fixture(scope="module")
def slide() -> Scenario:
    """Give the sliding block, a hundred times softer than aluminium."""
    return Document.read(SCENARIOS / "slide.toml").with_values({"contact.stiffness_scale": 0.01}).build()


@pytest.fixture(scope="module")
def coordinates(slide: Scenario) -> Coordinates:
    return Coordinates(Model(slide).bodies)


def finished(x_mm: float, rotation_deg: float = 0.0, seconds: float = 1.0, y_mm: float = 12.5) -> Row:
    ends = {"block.x_mm": x_mm, "block.y_mm": y_mm, "block.rotation_deg": rotation_deg}
    return {"status": "finished", "reason": "at rest", "seconds": seconds, **ends}


PLACES: dict[str, list[float]] = tomllib.loads(Path(__file__).with_name("converge.toml").read_text())


def told(study: RefinementStudy) -> str:
    """Return what a study came to, a line for each level."""
    levels = [
        f"{one.value:g}: change {one.change_mm:.6g} mm, order {one.order:.6g}, to the finest {one.to_finest_mm:.6g} mm"
        + " *" * one.is_own
        + "".join(f", {name} flips" for name in one.flipped)
        for one in study.levels
    ]
    recommended = study.recommendation and f"{study.recommendation.value:g}"
    return "\n".join([*levels, f"{study.verdict}; recommended: {recommended}\n"])


def test_order_verdict_and_recommendation_of_made_up_places(coordinates: Coordinates, golden: Golden) -> None:
    rows = {name: [finished(x, seconds=2.0**i) for i, x in enumerate(places)] for name, places in PLACES.items()}
    rows["turn of a degree"] = [finished(10.0), finished(10.0), finished(10.0, 1.0)]
    rows["failed at last"] = [finished(10.0), finished(10.0), FAILED]
    rows["failed at first"] = [FAILED, *[finished(10.0)] * 3]
    studies = {name: judge(dict(enumerate(ends, -1)), HALVED, coordinates, 0.1) for name, ends in rows.items()}
    golden("\n".join(f"{name}\n{told(study)}" for name, study in studies.items()))
    turned = studies["turn of a degree"].levels[-1]
    assert turned.change_mm == pytest.approx(radians(1.0) * 0.5 * (32.0**2 + 25.0**2) ** 0.5)  # that far a corner moves


def test_outcome_is_another_one_beyond_the_size_of_a_block(coordinates: Coordinates) -> None:
    for end, flips in (
        (finished(10.0 + 31.0), False),  # the block is 32 mm long and 25 mm high
        (finished(10.0 + 33.0), True),
        (finished(10.0, 44.0), False),
        (finished(10.0, -46.0), True),
        (finished(10.0, y_mm=12.5 + 12.0), False),
        (finished(10.0, y_mm=12.5 + 13.0), True),  # on another block
        (FAILED, False),
    ):
        assert bool(coordinates.flips(finished(10.0), end)) is flips
        assert bool(coordinates.flips(end, finished(10.0))) is flips


def levels(refined: Refinement, finest: int) -> list[float]:
    return [refined.value(level) for level in range(-refined.coarser, finest + 1)]


def test_own_value_is_refined_and_coarsened_as_far_as_is_safe(slide: Scenario) -> None:
    step, stiffness = refinements_of(slide)
    assert levels(step, 2) == [0.1, 0.05, 0.025, 0.0125]
    assert levels(stiffness, 2) == pytest.approx([1e-3, 3.16228e-3, 1e-2, 3.16228e-2, 1e-1])
    assert levels(refinements_of(with_setting(slide, "time.safety", 0.02))[0], 0) == [0.08, 0.04, 0.02]
    by_hand = refinements_of(with_setting(slide, "time.step", 1e-7))[0]
    assert (by_hand.key, by_hand.value(1), by_hand.coarser) == ("time.step", 5e-8, 2)
    assert refinements_of(with_setting(slide, "time.step", 5e-6))[0].coarser == 0


def test_spacing_is_refined_where_there_are_particles_and_that_of_soil_where_it_is_asked_for(slide: Scenario) -> None:
    contact = slide.contact.model_copy(update={"model": "particles"})
    *_, spacing = refinements_of(slide.model_copy(update={"contact": contact}))
    assert (spacing.key, levels(spacing, 1)[-2:]) == ("contact.particle_spacing", [1e-3, 5e-4])
    soil = scene(column(0.05, 0.05, 0.005))
    assert {one.study for one in refinements_of(soil)} == {"step", "stiffness"}
    (spacing,) = refinements_of(soil, ["spacing"])
    assert (spacing.key, levels(spacing, 2)) == ("soils.spacing", [0.005, 0.0025, 0.00125])
    (table,) = soil_tables(with_setting(soil, spacing.key, spacing.value(1)))
    assert table.spacing == pytest.approx(0.0025)


@pytest.fixture(scope="module")
def converged(slide: Scenario, tmp_path_factory: pytest.TempPathFactory) -> tuple[Convergence, Path, list[str]]:
    """Give the study of a slide, its folder, and what was told of its runs; not to be changed."""
    labels: list[str] = []
    folder = tmp_path_factory.mktemp("converge")
    return converge(slide, out=folder, on_run=lambda label, _: labels.append(label)), folder, labels


def test_all_recommended_values_are_tried_together(converged: tuple[Convergence, Path, list[str]]) -> None:
    result, folder, labels = converged
    assert result.converged
    assert result.recommended is not None
    assert result.recommended.settings == {"time.safety": 0.1, "contact.stiffness_scale": 0.001}
    assert labels[-1] == "recommended settings together"
    assert len(labels) == len(list(folder.iterdir())) == 4 + 5 - 1 + 1  # the scenario's own run is shared
    assert any("particle spacing has no effect" in text for text in result.notes)


def test_slide_converges_with_the_order_of_its_static_deflections_and_runs_nothing_twice(
    slide: Scenario, converged: tuple[Convergence, Path, list[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    # what a sliding block owes to its springs are lengths such as m g / K: first order in the stiffness
    _, folder, _ = converged
    monkeypatch.setattr(folders, "run", None)
    result = converge(slide, studies=["stiffness"], out=folder, levels=9)
    (study,) = result.studies
    assert study.verdict is ConvergenceVerdict.CONVERGED
    assert [level.order for level in study.levels[2:]] == pytest.approx([1.0] * 3, abs=0.05)
    assert result.recommended is not None
    assert result.recommended.settings == {"contact.stiffness_scale": 0.001}
    assert result.recommended.to_finest_mm < 1e-3
    assert study.own.x_mm[0] == pytest.approx(33.532, abs=1e-3)


def test_refining_continues_until_the_tolerance_is_met(slide: Scenario, tmp_path: Path) -> None:
    few, more = (
        converge(slide, studies=["stiffness"], out=tmp_path, tolerance_mm=1e-6, levels=count).studies[0]
        for count in (2, 6)
    )
    assert (few.verdict, more.verdict) == (ConvergenceVerdict.NOT_YET, ConvergenceVerdict.CONVERGED)
    assert len(few.levels) < len(more.levels) < 2 + 1 + 6
    assert max(level.change_mm for level in more.levels[-2:]) < 1e-6


def test_dead_worker_fails_its_runs_and_says_what_to_do(
    slide: Scenario, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def dying(tasks: Iterator[Task], _: RunSetting) -> Iterator[Batch]:
        yield from (Batch((task,), (DEAD,), 0.0, "") for task in tasks)

    monkeypatch.setattr(processes, "for_rounds", lambda: nullcontext(dying))
    study = converge(slide, studies=["step"], out=tmp_path, jobs=2).studies[0]
    assert {level.status for level in study.levels} == {"failed"}
    assert "rerun the command to repeat this case" in study.own.reason


def test_scenario_that_fails_as_it_is_and_one_cut_by_the_end_of_time_say_so(slide: Scenario, tmp_path: Path) -> None:
    failing = converge(with_setting(slide, "contact.max_overlap", 1e-9), studies=["step"], out=tmp_path / "failing")
    assert failing.failed
    assert (failing.recommended, failing.studies[0].verdict) == (None, ConvergenceVerdict.FAILED)
    short = converge(rigid("slide", time__end=0.01), out=tmp_path / "short")
    assert any("depend on time.end" in text for text in short.notes)
    assert any("contacts are rigid" in text for text in short.notes)


def rigid(name: str, **values: object) -> Scenario:
    """Return a shipped scenario with rigid contacts; double underscores in names stand for dots."""
    keys: dict[str, Any] = {key.replace("__", "."): value for key, value in values.items()}
    return Document.read(SCENARIOS / f"{name}.toml").with_values({"time.scheme": "nonsmooth", **keys}).build()


def test_step_and_tolerance_of_rigid_contacts_are_refined_from_what_the_run_takes() -> None:
    step, tolerance = refinements_of(rigid("slide"))
    assert (step.key, step.factor, step.coarser) == ("time.step", 0.5, 2)
    assert step.own == pytest.approx(1e-3 / 13)  # what "auto" takes for a single block of 25 mm
    assert (tolerance.key, tolerance.own) == ("time.velocity_tolerance", 1e-6)  # of a single block
    assert [tolerance.value(level) for level in (-2, 0, 2)] == pytest.approx([1e-5, 1e-6, 1e-7])
    finer = with_setting(rigid("slide"), tolerance.key, tolerance.value(2))
    assert finer.time.velocity_tolerance == pytest.approx(1e-7)  # type: ignore[union-attr]
    step, tolerance = refinements_of(rigid("wall", time__step=5e-4))  # a crowd has a tolerance of its own
    assert (step.own, tolerance.own) == (5e-4, 0.1)
    assert refinements_of(rigid("three_blocks_nominal", time__step=6e-3))[0].coarser == 0  # 12 ms would be refused
