"""Refining time step, stiffness and particle spacing of one scenario, one at a time, until the run-out stops moving.

Every level is a run in a folder of its own, named by its hash: called again, with more levels or after it was stopped,
only what is missing is run. A level counts refinements of the scenario's own value: 0 is that value, 1 the next finer,
-1 the next coarser.

The distance between two results is the largest over all blocks of |change of x| and of |change of rotation| times half
the diagonal, which is how far the turn moves a corner; both in mm. The observed order is Richardson's: with r the
factor of a refinement, a change of order p shrinks by r^p, so p = log(change before / change) / log(r), taken from the
coordinate that changes most and given only where it continues in the same direction by less.

The outcome of a block flips between two levels where it ends turned by more than 45 degrees, farther away than its
longest side, or higher or lower by more than half its shortest side (on another block, or on none). A distance between
two outcomes is no error of discretisation: it has no order, and that it shrinks means nothing.
"""

import os
from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import pairwise
from math import inf, isfinite, log, log10, nan, sqrt
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from blocksim.errors import BlocksimError, InvalidInputError, StoppedEarlyError
from blocksim.options import Option, takes
from blocksim.scenario import Scenario, Source, load_scenario, place_bodies
from blocksim.scenario.start import soil_tables
from blocksim.silence import silent
from blocksim.simulation import folder as files
from blocksim.simulation.compilation import compile_kernels, kernels_of
from blocksim.simulation.provenance import run_hash
from blocksim.simulation.result import read_summary
from blocksim.simulation.schemes import build_scene
from blocksim.simulation.stopping import interruptible
from blocksim.study.executors import Batch, Setting, Task
from blocksim.study.executors.processes import DEAD, run_here, run_tasks
from blocksim.study.rows import FINISHED, Row, check_experiment
from blocksim.world.nonsmooth import velocity_tolerance
from blocksim.world.step import safety_of

DIGITS = 6  # of a level's value, so that the value that is reported gives the same run when it is set
ROUND_OFF_MM = 1e-6  # a smaller change says nothing about the order
SHRINKING = 0.75  # a change is at most this part of the one before it where changes shrink
MILLI = 1e3
ANOTHER_FACE_DEG = 45.0  # turned by more, a block ends on another of its sides
NO_COORDINATES = np.zeros(0)
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Refinement:
    """One setting: `value * factor` is the next finer level of a value; `coarser` levels go the other way."""

    study: str
    title: str
    key: str
    own: float
    factor: float
    coarser: int

    def value(self, level: int) -> float:
        """Return the value at a level, the scenario's own to the last bit."""
        return self.own if level == 0 else float(f"{self.own * self.factor**level:.{DIGITS}g}")

    def at(self, scenario: Scenario, level: int) -> Scenario:
        """Return the scenario at a level, everything else as it was."""
        return with_setting(scenario, self.key, self.value(level))


def with_setting(scenario: Scenario, key: str, value: float) -> Scenario:
    """Return the scenario with a key `table.name` set, of a system in all its tables."""
    table, name = key.split(".")
    if table in scenario.systems:
        tables = tuple(one.model_copy(update={name: value}) for one in scenario.systems[table])
        return scenario.model_copy(update={"systems": {**scenario.systems, table: tables}})
    changed = getattr(scenario, table).model_copy(update={name: value})
    return scenario.model_copy(update={table: changed})


class ConvergenceVerdict(StrEnum):
    """What refining has shown."""

    CONVERGED = "converged"  # two refinements in a row change less than the tolerance
    NOT_YET = "not yet converged"  # the changes shrink, but were still too large at the last level
    SCATTERED = "not converged"  # the changes do not shrink
    FLIPS = "outcome flips"  # in one of the last two refinements some block ends in another place or on another side
    FAILED = "failed"  # a level that was needed did not run to its end


@dataclass(frozen=True)
class Level:
    """One run: the refined value, how the run ended, and how far its final state is from others."""

    value: float
    is_own: bool  # the scenario's own value
    status: str
    reason: str
    seconds: float  # of solving
    x_mm: tuple[float, ...]  # final centre of each block; empty where the run did not finish
    rotation_deg: tuple[float, ...]
    change_mm: float  # distance to the level before; NaN where there is none
    order: float  # observed; NaN where there is none
    to_finest_mm: float  # distance to the finest level that finished
    flipped: tuple[str, ...] = ()  # blocks whose outcome is another one than at the level before

    @property
    def is_finished(self) -> bool:
        """Return True if the run came to its proper end."""
        return self.status == FINISHED


@dataclass(frozen=True)
class RefinementStudy:
    """One setting refined, from its coarsest level to its finest."""

    study: str
    title: str
    key: str
    factor: float
    tolerance_mm: float
    levels: tuple[Level, ...]
    verdict: ConvergenceVerdict

    @property
    def own(self) -> Level:
        """The level of the scenario as it is."""
        return next(level for level in self.levels if level.is_own)

    @property
    def recommended(self) -> Level | None:
        """The coarsest level that stays within the tolerance of the finest, with all levels between them."""
        if self.verdict is not ConvergenceVerdict.CONVERGED:
            return None
        chosen = None
        for level in reversed(self.levels):
            if not level.to_finest_mm <= self.tolerance_mm:
                break
            chosen = level
        return chosen

    @property
    def last_change_mm(self) -> float:
        """The larger of the last two changes; NaN where there are none."""
        return max((level.change_mm for level in self.levels[-2:]), default=nan)


@dataclass(frozen=True)
class Recommendation:
    """Recommended settings in one run; `to_finest_mm` is its distance to the farthest of all finest levels."""

    settings: dict[str, float]
    seconds: float
    own_seconds: float
    to_finest_mm: float


@dataclass(frozen=True)
class Convergence:
    """All studies of one scenario; `recommended` is None where there is nothing to change, or nothing to rely on."""

    name: str
    blocks: tuple[str, ...]
    tolerance_mm: float
    studies: tuple[RefinementStudy, ...]
    notes: tuple[str, ...]
    recommended: Recommendation | None

    @property
    def failed(self) -> bool:
        """Return True if the scenario does not even run as it is."""
        return not self.studies[0].own.is_finished

    @property
    def converged(self) -> bool:
        """Return True if every study has converged."""
        return all(study.verdict is ConvergenceVerdict.CONVERGED for study in self.studies)


class Coordinates:
    """Final states as points in a space whose largest coordinate difference is the distance defined above (mm)."""

    def __init__(self, scenario: Scenario) -> None:
        """Learn names and sizes of the blocks."""
        placed = place_bodies(scenario)
        self.blocks = tuple(body.name for body in placed)
        self._reach = np.array([MILLI * body.radius for body in placed])
        sides = MILLI * np.array([(body.size_x, body.size_y) for body in placed])
        self._longest, self._shortest = sides.max(axis=1), np.array([MILLI * body.least_width for body in placed])

    def read(self, row: Row) -> tuple[Floats, Floats]:
        """Return final x (mm) and rotation (degrees) of every block, of no block where the run did not finish."""
        if row["status"] != FINISHED:
            return NO_COORDINATES, NO_COORDINATES
        return self._column(row, "x_mm"), self._column(row, "rotation_deg")

    def _column(self, row: Row, column: str) -> Floats:
        return np.array([row[f"{name}.{column}"] for name in self.blocks], dtype=float)

    def point(self, row: Row) -> Floats:
        """Return the coordinates (mm), empty where the run did not finish."""
        x, rotation = self.read(row)
        return np.concatenate([x, np.radians(rotation) * self._reach[: len(rotation)]])

    def flipped(self, before: Row, row: Row) -> tuple[str, ...]:
        """Return the blocks whose outcome differs between two runs; none where one of them did not finish."""
        if {before["status"], row["status"]} != {FINISHED}:
            return ()
        x, y, turn = (
            np.abs(self._column(row, name) - self._column(before, name)) for name in ("x_mm", "y_mm", "rotation_deg")
        )
        elsewhere = (np.hypot(x, y) > self._longest) | (y > 0.5 * self._shortest)
        return tuple(self.blocks[i] for i in np.flatnonzero(elsewhere | (turn > ANOTHER_FACE_DEG)))


def distance(one: Floats, other: Floats) -> float:
    """Return the largest difference of two points; NaN where one is missing."""
    return float(np.max(np.abs(one - other))) if one.size and other.size else nan


def observed_order(points: Sequence[Floats], factor: float) -> float:
    """Return the order from three levels, from coarse to fine, each finer by `factor`; NaN where there is none."""
    if not all(point.size for point in points):
        return nan
    coarse, middle, fine = points
    most = int(np.argmax(np.abs(fine - middle)))
    before, after = float(middle[most] - coarse[most]), float(fine[most] - middle[most])
    if abs(after) < ROUND_OFF_MM or before * after <= 0.0 or abs(after) >= abs(before):
        return nan
    return log(before / after) / abs(log(factor))


def judge(
    rows: dict[int, Row], refinement: Refinement, coordinates: Coordinates, tolerance_mm: float
) -> RefinementStudy:
    """Return what the rows of a study's levels say; `rows` is by level and complete from its first to its last."""
    order = sorted(rows)
    points = [coordinates.point(rows[level]) for level in order]
    finest = next((point for point in reversed(points) if point.size), NO_COORDINATES)
    levels = []
    for i, number in enumerate(order):
        x, rotation = coordinates.read(rows[number])
        levels.append(
            Level(
                value=refinement.value(number),
                is_own=number == 0,
                status=str(rows[number]["status"]),
                reason=str(rows[number]["reason"]),
                seconds=float(str(rows[number]["seconds"])),
                x_mm=tuple(x.tolist()),
                rotation_deg=tuple(rotation.tolist()),
                change_mm=distance(points[i - 1], points[i]) if i else nan,
                order=observed_order(points[i - 2 : i + 1], refinement.factor) if i > 1 else nan,
                to_finest_mm=distance(points[i], finest),
                flipped=coordinates.flipped(rows[order[i - 1]], rows[number]) if i else (),
            )
        )
    flips = any(level.flipped for level in levels[-2:])
    verdict = verdict_of([level.change_mm for level in levels[1:]], tolerance_mm, flips=flips)
    return RefinementStudy(
        refinement.study,
        refinement.title,
        refinement.key,
        refinement.factor,
        tolerance_mm,
        tuple(levels),
        verdict,
    )


def verdict_of(changes_mm: Sequence[float], tolerance_mm: float, *, flips: bool) -> ConvergenceVerdict:
    """Judge the changes from level to level, from coarse to fine; NaN is a change to or from a failed level.

    `flips` says that an outcome changes in one of the last two refinements.
    """
    last = changes_mm[-2:]
    if len(last) < 2 or not all(map(isfinite, last)):
        return ConvergenceVerdict.FAILED
    if flips:
        return ConvergenceVerdict.FLIPS
    if max(last) < tolerance_mm:
        return ConvergenceVerdict.CONVERGED
    before = next((change for change in reversed(changes_mm[:-2]) if isfinite(change)), inf)
    shrinks = all(after <= SHRINKING * before for before, after in pairwise([before, *last]))
    return ConvergenceVerdict.NOT_YET if shrinks else ConvergenceVerdict.SCATTERED


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


@dataclass(frozen=True, kw_only=True)
class ConvergeOptions:
    """What is refined, how far, and where its runs are kept."""

    studies: Annotated[
        Iterable[str] | None,
        Option(
            "What to refine (default: all that matters). Repeatable.",
            flags=("--study",),
            python="Some of step, stiffness, spacing, tolerance (default: all that mean something).",
            is_repeatable=True,
            choices=REFINEMENTS,
        ),
    ] = None
    tolerance_mm: Annotated[
        float,
        Option("Largest change of the run-out that counts as converged, in mm.", flags=("--tolerance",), metavar="MM"),
    ] = TOLERANCE_MM
    levels: Annotated[
        int, Option("Maximum number of refinements of the scenario's own value.", metavar="N", least=FEWEST_LEVELS)
    ] = LEVELS
    out: Path | str | None = None
    jobs: int | None = 1
    on_run: OnRun = silent


@takes(ConvergeOptions)
def converge(scenario: Source, options: ConvergeOptions) -> Convergence:
    """Refine each setting until two refinements in a row move no block by more than the tolerance.

    The runs are kept in `out` (default: results/NAME/converge). With more than one of `jobs` (None: one a core), a
    script needs the guard `if __name__ == "__main__":`. `on_run` is called with each level and its row. Raises
    ScenarioError, InvalidInputError, StepError for the scenario as it is, and StoppedEarlyError on Ctrl-C.
    """
    tolerance_mm, levels, studies = options.tolerance_mm, options.levels, options.studies
    if not isinstance(scenario, Scenario):
        scenario = load_scenario(scenario)
    if not tolerance_mm > 0.0 or levels < FEWEST_LEVELS:
        raise InvalidInputError(f"the tolerance must be above 0 mm and levels {FEWEST_LEVELS} or more")
    scenario = scenario.model_copy(update={"sweep": None})
    check_experiment(scenario)
    build_scene(scenario)
    refinements = refinements_of(scenario, studies)
    compile_kernels(kernels_of(scenario))
    folder = Path(options.out) if options.out is not None else files.RESULTS / scenario.name / FOLDER
    runs = _Runs(folder, options.jobs or os.cpu_count() or 1, options.on_run)
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
            raise StoppedEarlyError(f"stopped after {len(self.rows)} runs; rerun the command to finish") from None

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
        raise InvalidInputError(f"'{unknown[0]}' unknown convergence study; choose {', '.join(REFINEMENTS)}")
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
