"""Refining time step, stiffness and particle spacing of one scenario, one at a time, until the run-out stops moving.

Every level is a run in a folder of its own, named by its hash: called again, with more levels or after it was stopped,
only what is missing is run.
"""

import os
from collections.abc import Callable, Iterable
from contextlib import closing, suppress
from pathlib import Path

from blocksim.errors import BlocksimError, InvalidInputError, StoppedEarlyError
from blocksim.scenario import Scenario, Source, load_scenario
from blocksim.simulation import folder as files
from blocksim.simulation.compilation import compile_kernels, kernels_of
from blocksim.simulation.provenance import run_hash
from blocksim.simulation.schemes import build_scene
from blocksim.simulation.stopping import interruptible
from blocksim.simulation.summary import read_summary
from blocksim.study.convergence import Convergence, Coordinates, Joint, Study, Verdict, distance, judge
from blocksim.study.folders import run_all
from blocksim.study.refinement import Refinement, effects_note, has_particles, refinements_of, with_setting
from blocksim.study.rows import Row
from blocksim.study.single import FINISHED, check_experiment

FOLDER = "converge"
TOLERANCE_MM = 0.1
LEVELS = 4  # refinements of the scenario's own value
FEWEST_LEVELS = 2  # refinements that it takes to converge
UNFINISHED = {Verdict.NOT_YET, Verdict.SCATTERED, Verdict.FLIPS}
UNRELIABLE = {Verdict.SCATTERED, Verdict.FLIPS}
OnRun = Callable[[str, Row], None]


def converge(  # noqa: PLR0913 - one argument for each option of the command
    scenario: Source,
    *,
    tolerance_mm: float = TOLERANCE_MM,
    levels: int = LEVELS,
    studies: Iterable[str] | None = None,
    out: Path | str | None = None,
    jobs: int | None = 1,
    on_run: OnRun = lambda *_: None,
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
        message = f"the tolerance has to be above 0 mm and levels {FEWEST_LEVELS} or more"
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
        labels = {self.folder / run_hash(scenario): label for label, scenario in reversed(scenarios.items())}
        tasks = {self.folder / run_hash(scenario): scenario for scenario in scenarios.values()}
        missing = {place: scenario for place, scenario in tasks.items() if place.name not in self.rows}
        try:
            with interruptible(), closing(run_all(missing, self.jobs)) as ended:
                for place, row in ended:
                    self.rows[place.name] = {**row, "seconds": _solver_seconds(place, row)}
                    self.on_run(labels[place], self.rows[place.name])
        except KeyboardInterrupt:
            message = f"stopped after {len(self.rows)} runs; rerun the command to finish"
            raise StoppedEarlyError(message) from None

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
) -> tuple[Study, ...]:
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


def _recommended(scenario: Scenario, studies: tuple[Study, ...], runs: _Runs, tolerance_mm: float) -> Joint | None:
    """Try all recommended values together, then each alone, the cheapest first; None where none holds the tolerance."""
    if any(study.verdict in UNRELIABLE for study in studies) or not studies[0].own.is_finished:
        return None
    changed = [(level, study.key) for study in studies if (level := study.recommended) and not level.is_own]
    together = {key: level.value for level, key in changed}
    singles = [{key: level.value} for level, key in sorted(changed, key=lambda pair: pair[0].seconds)]
    candidates = (_joint(scenario, settings, studies, runs) for settings in (together, *singles) if settings)
    return next((joint for joint in candidates if joint.to_finest_mm <= tolerance_mm), None)


def _joint(scenario: Scenario, settings: dict[str, float], studies: tuple[Study, ...], runs: _Runs) -> Joint:
    """Run the scenario with some settings and compare it with the finest level of every study."""
    changed = scenario
    for key, value in settings.items():
        changed = with_setting(changed, key, value)
    runs.run({"recommended settings together": changed})
    row, coordinates = runs.row(changed), Coordinates(scenario)
    finest = [runs.row(with_setting(scenario, study.key, study.levels[-1].value)) for study in studies]
    return Joint(
        settings=settings,
        seconds=float(str(row["seconds"])),
        own_seconds=studies[0].own.seconds,
        to_finest_mm=max(distance(coordinates.point(row), coordinates.point(one)) for one in finest),
    )


def _notes(scenario: Scenario, runs: _Runs, studies: Iterable[str] | None) -> tuple[str, ...]:
    """Say what was not studied, and what the numbers cannot mean."""
    notes = []
    if studies is None and not has_particles(scenario):
        notes.append(f"{effects_note(scenario)}: not studied")
    reasons = {str(row["reason"]) for row in runs.rows.values() if row["status"] == FINISHED}
    if scenario.time.stop_at_rest and "end of simulated time" in reasons:
        notes.append("some runs ended before everything was at rest: their final positions depend on time.end")
    return tuple(notes)
