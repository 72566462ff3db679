"""Refining time step, stiffness and particle spacing of one scenario, one at a time, until the run-out stops moving.

Every level is a run in a folder of its own, named by its hash: called again, with more levels or after it was stopped,
only what is missing is run.

A level counts refinements of the scenario's own value: 0 is that value, 1 the next finer, -1 the next coarser.
"""

import os
from collections.abc import Callable, Generator, Iterable
from contextlib import closing, suppress
from dataclasses import replace
from math import log10, sqrt
from pathlib import Path

from blocksim.errors import BlocksimError, InvalidInputError, StoppedEarlyError
from blocksim.scenario import Scenario, Source, load_scenario, place_bodies
from blocksim.scenario.soil_places import soil_tables
from blocksim.silence import silent
from blocksim.simulation import folder as files
from blocksim.simulation.compilation import compile_kernels, kernels_of
from blocksim.simulation.provenance import run_hash
from blocksim.simulation.schemes import build_scene
from blocksim.simulation.stopping import interruptible
from blocksim.simulation.summary import read_summary
from blocksim.study.convergence import (
    Convergence,
    ConvergenceVerdict,
    Coordinates,
    Recommendation,
    Refinement,
    RefinementStudy,
    distance,
    judge,
    with_setting,
)
from blocksim.study.executors import Batch, Setting, Task
from blocksim.study.executors.processes import DEAD, run_here, run_tasks
from blocksim.study.rows import FINISHED, Row, check_experiment
from blocksim.world.nonsmooth import velocity_tolerance
from blocksim.world.step import safety_of

FOLDER = "converge"
SOIL_SPACING = "soils.spacing"
TOLERANCE_MM = 0.1
LEVELS = 4  # refinements of the scenario's own value
FEWEST_LEVELS = 2  # refinements that it takes to converge
DIED = "a worker process has died (out of memory?); rerun the command to repeat this case"
UNFINISHED = {ConvergenceVerdict.NOT_YET, ConvergenceVerdict.SCATTERED, ConvergenceVerdict.FLIPS}
UNRELIABLE = {ConvergenceVerdict.SCATTERED, ConvergenceVerdict.FLIPS}
OnRun = Callable[[str, Row], None]
STEP, STIFFNESS, SPACING, TOLERANCE = "step", "stiffness", "spacing", "tolerance"
REFINEMENTS = (STEP, STIFFNESS, SPACING, TOLERANCE)
PARTICLE_MODELS = frozenset({"particles", "kernel"})
SOFTEST = 1e-3  # stiffness scale


def converge(
    scenario: Source,
    *,
    tolerance_mm: float = TOLERANCE_MM,
    levels: int = LEVELS,
    studies: Iterable[str] | None = None,
    out: Path | str | None = None,
    jobs: int | None = 1,
    on_run: OnRun = silent,
) -> Convergence:
    """Refine each setting until two refinements in a row move no block by more than the tolerance.

    `studies` names some of step, stiffness, spacing, tolerance (default: all that mean something); `levels` is how
    often the scenario's own value is refined at most. The runs are kept in `out` (default: results/NAME/converge). With
    more than one job (None: one a core), a script needs the guard `if __name__ == "__main__":`. Raises ScenarioError,
    InvalidInputError, StepTooLargeError for the scenario as it is, and StoppedEarlyError on Ctrl-C.
    """
    if not isinstance(scenario, Scenario):
        scenario = load_scenario(scenario)
    if not tolerance_mm > 0.0 or levels < FEWEST_LEVELS:
        message = f"the tolerance must be above 0 mm and levels {FEWEST_LEVELS} or more"
        raise InvalidInputError(message)
    scenario = scenario.model_copy(update={"sweep": None})
    check_experiment(scenario)
    build_scene(scenario)
    refinements = refinements_of(scenario, studies)
    compile_kernels(kernels_of(scenario))
    folder = Path(out) if out is not None else files.RESULTS / scenario.name / FOLDER
    runs = _Runs(folder, jobs or os.cpu_count() or 1, on_run)
    found = _refine(scenario, refinements, runs, tolerance_mm, levels)
    return Convergence(
        name=scenario.name,
        blocks=Coordinates(scenario).blocks,
        tolerance_mm=tolerance_mm,
        studies=found,
        notes=_notes(scenario, runs, studies),
        recommended=_recommended(scenario, found, runs, tolerance_mm),
    )


class _Runs:
    """All runs so far, by the hash of their scenario."""

    def __init__(self, folder: Path, jobs: int, on_run: OnRun) -> None:
        self.folder, self.jobs, self.on_run = folder, jobs, on_run
        self.rows: dict[str, Row] = {}

    def run(self, scenarios: dict[str, Scenario]) -> None:
        """Run what has not run yet; the keys are labels for people."""
        labels = {run_hash(scenario): label for label, scenario in reversed(scenarios.items())}
        wanted = {run_hash(scenario): scenario for scenario in scenarios.values()}
        missing = [(name, scenario) for name, scenario in wanted.items() if name not in self.rows]
        tasks = [Task(number, name, {}, scenario) for number, (name, scenario) in enumerate(missing)]
        try:
            with interruptible(), closing(self._batches(tasks)) as batches:
                for batch in batches:
                    for task, row in zip(batch.tasks, batch.rows, strict=True):
                        self._keep(task.name, row, labels[task.name])
        except KeyboardInterrupt:
            message = f"stopped after {len(self.rows)} runs; rerun the command to finish"
            raise StoppedEarlyError(message) from None

    def _batches(self, tasks: list[Task]) -> Generator[Batch, None, None]:
        jobs = min(self.jobs, len(tasks))
        run = run_tasks if jobs > 1 else run_here
        return run(iter(tasks), Setting(jobs, folder=self.folder))

    def _keep(self, name: str, row: Row, label: str) -> None:
        kept = {**row, "reason": DIED} if row == DEAD else {**row, "seconds": _solver_seconds(self.folder / name, row)}
        self.rows[name] = kept
        self.on_run(label, kept)

    def row(self, scenario: Scenario) -> Row:
        """Return the row of a scenario that has run."""
        return self.rows[run_hash(scenario)]


def _solver_seconds(place: Path, row: Row) -> object:
    """Return what the setting decides: the time in compiled code, without that for writing files."""
    with suppress(BlocksimError):
        return read_summary(place / files.SUMMARY).solver_seconds
    return row["seconds"]


def _refine(
    scenario: Scenario, refinements: tuple[Refinement, ...], runs: _Runs, tolerance_mm: float, levels: int
) -> tuple[RefinementStudy, ...]:
    """Run all coarser levels and two finer ones of every study, then one finer at a time where it is needed."""
    finest = {one.study: FEWEST_LEVELS for one in refinements}
    coordinates = Coordinates(scenario)
    while True:
        wanted = [
            (one, {n: one.at(scenario, n) for n in range(-one.coarser, finest[one.study] + 1)}) for one in refinements
        ]
        runs.run({f"{one.key} = {one.value(n):g}": level for one, at in wanted for n, level in at.items()})
        found = tuple(
            judge({n: runs.row(level) for n, level in at.items()}, one, coordinates, tolerance_mm) for one, at in wanted
        )
        again = [study.study for study in found if study.verdict in UNFINISHED and finest[study.study] < levels]
        if not again:
            return found
        for name in again:
            finest[name] += 1


def _recommended(
    scenario: Scenario, studies: tuple[RefinementStudy, ...], runs: _Runs, tolerance_mm: float
) -> Recommendation | None:
    """Try all recommended values together, then each alone, the cheapest first; None where none holds the tolerance."""
    if any(study.verdict in UNRELIABLE for study in studies) or not studies[0].own.is_finished:
        return None
    changed = [(level, study.key) for study in studies if (level := study.recommended) and not level.is_own]
    together = {key: level.value for level, key in changed}
    singles = [{key: level.value} for level, key in sorted(changed, key=lambda pair: pair[0].seconds)]
    candidates = (_joint(scenario, settings, studies, runs) for settings in (together, *singles) if settings)
    return next((joint for joint in candidates if joint.to_finest_mm <= tolerance_mm), None)


def _joint(
    scenario: Scenario, settings: dict[str, float], studies: tuple[RefinementStudy, ...], runs: _Runs
) -> Recommendation:
    """Run the scenario with some settings and compare it with the finest level of every study."""
    changed = scenario
    for key, value in settings.items():
        changed = with_setting(changed, key, value)
    runs.run({"recommended settings together": changed})
    row, coordinates = runs.row(changed), Coordinates(scenario)
    finest = [runs.row(with_setting(scenario, study.key, study.levels[-1].value)) for study in studies]
    return Recommendation(
        settings=settings,
        seconds=float(str(row["seconds"])),
        own_seconds=studies[0].own.seconds,
        to_finest_mm=max(distance(coordinates.point(row), coordinates.point(one)) for one in finest),
    )


def _notes(scenario: Scenario, runs: _Runs, studies: Iterable[str] | None) -> tuple[str, ...]:
    """Say what was not studied, and what the numbers cannot mean."""
    notes = []
    if soil_tables(scenario):
        more = "; --study spacing halves soils.spacing, eight times the cost a level" if studies is None else ""
        notes.append(f"distances are those of blocks, not of soil{more}")
    elif studies is None and not has_particles(scenario):
        notes.append(f"{effects_note(scenario, ['spacing'])}: not studied")
    reasons = {str(row["reason"]) for row in runs.rows.values() if row["status"] == FINISHED}
    if scenario.time.stop_at_rest and "end of simulated time" in reasons:
        notes.append("some runs ended before everything was at rest: their final positions depend on time.end")
    return tuple(notes)


def refinements_of(scenario: Scenario, studies: Iterable[str] | None = None) -> tuple[Refinement, ...]:
    """Return the refinements that mean something for a scenario, or those of the named studies among them.

    Raises InvalidInputError for an unknown name, and where nothing is left.
    """
    asked = REFINEMENTS if studies is None else tuple(studies)
    unknown = [name for name in asked if name not in REFINEMENTS]
    if unknown:
        message = f"'{unknown[0]}' unknown convergence study; choose {', '.join(REFINEMENTS)}"
        raise InvalidInputError(message)
    chosen = tuple(one for one in _possible(scenario) if one.study in asked)
    if studies is None:
        chosen = tuple(one for one in chosen if one.key != SOIL_SPACING)
    if not chosen:
        raise InvalidInputError(f"nothing to study: {effects_note(scenario, asked)}")
    return chosen


def _possible(scenario: Scenario) -> list[Refinement]:
    """Return what can be refined, and how: by halves, or by half decades, also from coarser values that are cheap."""
    time, contact = scenario.time, scenario.contact
    if time.has_rigid_contacts:
        step = float(build_scene(scenario).world.controls[0].step)  # as given or as it was chosen
        tolerance = velocity_tolerance(scenario, len(place_bodies(scenario)))
        key = "time.velocity_tolerance"
        return [
            _halved(scenario, "time.step", step),
            Refinement(TOLERANCE, "velocity tolerance", key, tolerance, sqrt(0.1), 2),
        ]
    key, own = ("time.safety", safety_of(scenario)) if time.step == "auto" else ("time.step", time.step)
    scale = contact.stiffness_scale
    coarser = min(max(round(2.0 * log10(scale / SOFTEST)), 2), 6)
    chosen = [
        _halved(scenario, key, own),
        Refinement(STIFFNESS, "stiffness", "contact.stiffness_scale", scale, sqrt(10.0), coarser),
    ]
    if has_particles(scenario):
        key = "contact.particle_spacing"
        chosen.append(Refinement(SPACING, "particle spacing", key, contact.particle_spacing, 0.5, 1))
    soils = soil_tables(scenario)
    if soils:  # twice the spacing may be too coarse to be admissible
        chosen.append(Refinement(SPACING, "spacing of soil", SOIL_SPACING, soils[0].spacing, 0.5, 0))
    return chosen


def has_particles(scenario: Scenario) -> bool:
    """Return True if the contact model examines the particles on the boundaries."""
    return scenario.contact.model in PARTICLE_MODELS


def effects_note(scenario: Scenario, asked: Iterable[str]) -> str:
    """Say what of the asked studies is left out, and why; nothing where none is."""
    if scenario.time.has_rigid_contacts:
        return "contacts are rigid: neither a stiffness nor the particle spacing has an effect"
    notes = {
        "spacing": f'the particle spacing has no effect on contact.model = "{scenario.contact.model}"',
        "tolerance": "the explicit scheme solves every step exactly and has no tolerance",
    }
    possible = {one.study for one in _possible(scenario)}
    return "; ".join(note for name, note in notes.items() if name in asked and name not in possible)


def _halved(scenario: Scenario, key: str, own: float) -> Refinement:
    halved = Refinement(STEP, "time step", key, own, 0.5, 0)
    coarser = next((n for n in (2, 1) if _is_safe(halved.at(scenario, -n))), 0)
    return replace(halved, coarser=coarser)


def _is_safe(scenario: Scenario) -> bool:
    """Return True if a scenario's step is admissible."""
    try:
        type(scenario.time).model_validate(scenario.time.model_dump())
        build_scene(scenario)
    except (ValueError, InvalidInputError):
        return False
    return True
