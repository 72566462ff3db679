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
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import closing, nullcontext, suppress
from dataclasses import asdict, dataclass, replace
from enum import StrEnum
from itertools import pairwise
from math import inf, isfinite, log, log10, nan, sqrt
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from blocksim.analysis.experiment import load_table
from blocksim.errors import BlocksimError, InvalidInputError, StoppedEarlyError
from blocksim.options import Option, silent, takes
from blocksim.scenario import Model, PlacedBody, Scenario, Source, load_scenario, placement
from blocksim.simulation import files, interruption, provenance, results, schemes
from blocksim.study import pictures
from blocksim.study.answer import Overview, UnstoredResult
from blocksim.study.executors import RunSetting, Task, processes
from blocksim.study.rows import FINISHED, Row, check_experiment
from blocksim.view import studies as drawings
from blocksim.view.style import Paper
from blocksim.world.nonsmooth import velocity_tolerance
from blocksim.world.step import safety_of

DIGITS = 6  # of a level's value, so that the value that is reported gives the same run when it is set
ROUND_OFF_MM = 1e-6  # a smaller change says nothing about the order
SHRINKING = 0.75  # a change is at most this part of the one before it where changes shrink
MILLI = 1e3
AXES = ("x_mm", "y_mm", "rotation_deg")
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
    def recommendation(self) -> Level | None:
        """The coarsest level that stays within the tolerance of the finest, with all levels between them."""
        if self.verdict is not ConvergenceVerdict.CONVERGED:
            return None
        chosen = None
        for level in reversed(self.levels):
            if not level.to_finest_mm <= self.tolerance_mm:
                break
            chosen = level
        return chosen


@dataclass(frozen=True)
class Recommendation:
    """Recommended settings in one run; `to_finest_mm` is its distance to the farthest of all finest levels."""

    settings: dict[str, float]
    seconds: float
    own_seconds: float
    to_finest_mm: float


NO_CHANGE = Recommendation({}, nan, nan, nan)


FEWEST_SHOWN = 2  # levels, to show a distance


@dataclass(frozen=True, repr=False)
class Convergence(UnstoredResult):
    """All studies of one scenario; `recommended` is None where there is nothing to change, or nothing to rely on."""

    what = "a study of convergence"
    picture = "levels"
    caption = "Levels of refinement"
    scenario: Scenario
    blocks: tuple[str, ...]
    tolerance_mm: float
    studies: tuple[RefinementStudy, ...]
    notes: tuple[str, ...]
    recommended: Recommendation | None

    @property
    def failed(self) -> bool:
        """Return True if the scenario does not even run as it is."""
        return not self.studies[0].own.x_mm

    @property
    def converged(self) -> bool:
        """Return True if every study has converged."""
        return all(study.verdict is ConvergenceVerdict.CONVERGED for study in self.studies)

    def to_dict(self) -> dict[str, object]:
        """Return plain values for JSON."""
        studies = [
            {**asdict(one), "recommended": None if one.recommendation is None else one.recommendation.value}
            for one in self.studies
        ]
        return {
            "name": self.name,
            "blocks": self.blocks,
            "tolerance_mm": self.tolerance_mm,
            "studies": studies,
            "notes": self.notes,
            "recommended": None if self.recommended is None else asdict(self.recommended),
            "converged": self.converged,
        }

    def overview(self) -> Overview:
        """Return the levels of all studies, from coarse to fine, with the verdicts."""
        rows: list[tuple[str | float, ...]] = []
        for one in self.studies:
            own = [f"{level.value:g}{' (own)' if level.is_own else ''}" for level in one.levels]
            rows += [
                (one.key, value, level.status, level.change_mm, level.order, level.to_finest_mm, level.seconds)
                for value, level in zip(own, one.levels, strict=True)
            ]
        verdicts = [(one.title, str(one.verdict)) for one in self.studies]
        settings = ", ".join(f"{key} = {value:g}" for key, value in (self.recommended or NO_CHANGE).settings.items())
        return Overview(
            f"{self.name}: {', '.join(': '.join(one) for one in verdicts)} (tolerance {self.tolerance_mm:g} mm)",
            ("setting", "value", "status", "change mm", "order", "to finest mm", "seconds"),
            rows,
            left=3,
            digits=3,
            lines=[f"recommended: {settings}"] if settings else [],
            notes=self.notes,
            summary=[*verdicts, *([("recommended", settings)] if settings else [])],
        )

    def panels(self) -> list[drawings.LevelPanel]:
        """Return a panel for each study with enough levels."""
        found = []
        for study in self.studies:
            levels = [level for level in study.levels if level.x_mm]
            if len(levels) < FEWEST_SHOWN:
                continue
            x, unit = np.array([level.x_mm for level in levels]), pictures.unit_of(self.scenario, study.key)
            found.append(
                drawings.LevelPanel(
                    title=study.title,
                    key=f"{study.key} ({unit})" if unit else study.key,
                    verdict=study.verdict.value,
                    values=np.array([level.value for level in levels]),
                    blocks=self.blocks,
                    off_mm=np.abs(x - x[-1]),
                    largest_off_mm=np.array([level.to_finest_mm for level in levels]),
                    tolerance_mm=self.tolerance_mm,
                    own=study.own.value,
                    recommended=None if study.recommendation is None else study.recommendation.value,
                )
            )
        return found

    def draw(self, path: Path, title: str, paper: Paper) -> None:
        """Draw the distances from the finest levels.

        Raises InvalidInputError for an unknown format, too small a page and where no study has two levels, OutputError.
        """
        panels = self.panels()
        if not panels:
            raise InvalidInputError(f"{self.name}: fewer than {FEWEST_SHOWN} levels have finished; nothing to draw")
        table = None if self.scenario.experiment is None else load_table(self.scenario.experiment.table)
        rows = [] if table is None else [row for row in table.summaries() if row.quantity == "x"]
        widths = {row.block: row.maximum - row.minimum for row in rows}  # of the measured ranges
        drawings.draw_levels(panels, path, title=title, measured=widths, paper=paper)


class Coordinates:
    """Final states as points in a space whose largest coordinate difference is the distance defined above (mm)."""

    def __init__(self, placed: Sequence[PlacedBody]) -> None:
        """Learn names and sizes of the blocks."""
        self.blocks = tuple(body.name for body in placed)
        self._reach = np.array([MILLI * body.radius for body in placed])
        self._longest = MILLI * np.array([(body.size_x, body.size_y) for body in placed]).max(axis=1)
        self._shortest = np.array([MILLI * body.least_width for body in placed])

    def end(self, row: Row) -> tuple[Floats, Floats, Floats] | None:
        """Return final x, y (mm) and rotation (degrees) of every block, None where the run did not finish."""
        if row["status"] != FINISHED:
            return None
        table = np.array([[row[f"{block}.{name}"] for block in self.blocks] for name in AXES], dtype=float)
        return table[0], table[1], table[2]

    def point(self, row: Row) -> Floats:
        """Return the coordinates (mm), empty where the run did not finish."""
        if (end := self.end(row)) is None:
            return NO_COORDINATES
        return np.concatenate([end[0], np.radians(end[2]) * self._reach])

    def flips(self, before: Row, row: Row) -> tuple[str, ...]:
        """Return the blocks whose outcome differs between two runs; none where one of them did not finish."""
        ends = self.end(before), self.end(row)
        if ends[0] is None or ends[1] is None:
            return ()
        x, y, turn = np.abs(np.subtract(ends[1], ends[0]))
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
        row, end = rows[number], coordinates.end(rows[number])
        levels.append(
            Level(
                value=refinement.value(number),
                is_own=number == 0,
                status=str(row["status"]),
                reason=str(row["reason"]),
                seconds=float(str(row["seconds"])),
                x_mm=() if end is None else tuple(end[0].tolist()),
                rotation_deg=() if end is None else tuple(end[2].tolist()),
                change_mm=distance(points[i - 1], points[i]) if i else nan,
                order=observed_order(points[i - 2 : i + 1], refinement.factor) if i > 1 else nan,
                to_finest_mm=distance(points[i], finest),
                flipped=coordinates.flips(rows[order[i - 1]], row) if i else (),
            )
        )
    verdict = verdict_of(levels, tolerance_mm)
    one = refinement
    return RefinementStudy(one.study, one.title, one.key, one.factor, tolerance_mm, tuple(levels), verdict)


def verdict_of(levels: Sequence[Level], tolerance_mm: float) -> ConvergenceVerdict:
    """Judge the changes from level to level, from coarse to fine; NaN is a change to or from a failed level."""
    changes = [level.change_mm for level in levels[1:]]
    last = changes[-2:]
    if len(last) < 2 or not all(map(isfinite, last)):
        return ConvergenceVerdict.FAILED
    if any(level.flipped for level in levels[-2:]):
        return ConvergenceVerdict.FLIPS
    if max(last) < tolerance_mm:
        return ConvergenceVerdict.CONVERGED
    before = next((change for change in reversed(changes[:-2]) if isfinite(change)), inf)
    shrinks = all(after <= SHRINKING * before for before, after in pairwise([before, *last]))
    return ConvergenceVerdict.NOT_YET if shrinks else ConvergenceVerdict.SCATTERED


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

    >>> soft = load("scenarios/slide.toml", {"contact.stiffness_scale": 0.001})
    >>> converge(soft, studies=["step"], levels=3, out="results/converge")
    <Convergence of slide: time step: converged (tolerance 0.1 mm)>
    """
    tolerance_mm, levels, studies = options.tolerance_mm, options.levels, options.studies
    if not isinstance(scenario, Scenario):
        scenario = load_scenario(scenario)
    if not tolerance_mm > 0.0 or levels < FEWEST_LEVELS:
        raise InvalidInputError(f"the tolerance must be above 0 mm and levels {FEWEST_LEVELS} or more")
    scenario = scenario.model_copy(update={"sweep": None})
    model = Model(scenario)
    check_experiment(model)
    schemes.build(model)
    refinements = refinements_of(scenario, studies)
    schemes.compile_kernels(schemes.kernels_of(scenario))
    folder = Path(options.out) if options.out is not None else files.RESULTS / scenario.name / "converge"
    runs = LevelRuns(scenario, folder, options.jobs or os.cpu_count() or 1, options.on_run)
    found = runs.refine(refinements, tolerance_mm, levels)
    notes, recommended = runs.notes(studies), None  # notes are about the levels
    if found[0].own.x_mm and not any(study.verdict in UNRELIABLE for study in found):
        # all recommended values together, then each alone, the cheapest first; None where none holds the tolerance
        changed = [(level, study.key) for study in found if (level := study.recommendation) and not level.is_own]
        together = {key: level.value for level, key in changed}
        singles = [{key: level.value} for level, key in sorted(changed, key=lambda pair: pair[0].seconds)]
        candidates = (runs.joint(settings, found) for settings in (together, *singles) if settings)
        recommended = next((joint for joint in candidates if joint.to_finest_mm <= tolerance_mm), None)
    return Convergence(scenario, runs.coordinates.blocks, tolerance_mm, found, notes, recommended)


class LevelRuns:
    """All runs of a scenario with other settings so far, by their hashes, each in a folder of this name."""

    def __init__(self, scenario: Scenario, folder: Path, jobs: int, on_run: OnRun) -> None:
        """Run nothing yet."""
        self.scenario, self.folder, self.jobs, self.on_run = scenario, folder, jobs, on_run
        self.coordinates = Coordinates(Model(scenario).bodies)
        self.rows: dict[str, Row] = {}

    def run(self, scenarios: Mapping[str, Scenario]) -> list[Row]:
        """Return the rows of scenarios, after running what has not run yet; the keys are labels for people."""
        models = {label: Model(scenario) for label, scenario in scenarios.items()}
        names = [provenance.run_hash(model) for model in models.values()]
        named = dict(zip(reversed(names), reversed(models.items()), strict=True))  # the first label of each
        missing = [name for name in dict.fromkeys(names) if name not in self.rows]
        tasks = [Task(number, name, {}, named[name][1]) for number, name in enumerate(missing)]
        jobs = min(self.jobs, len(tasks))
        rounds = processes.for_rounds() if jobs > 1 else nullcontext(processes.run_here)
        try:
            with (
                interruption.interruptible(),
                rounds as run,
                closing(run(iter(tasks), RunSetting(jobs, folder=self.folder))) as batches,
            ):
                for task, row in (pair for batch in batches for pair in zip(batch.tasks, batch.rows, strict=True)):
                    kept = {**row, "reason": DIED} if row == processes.DEAD else row.copy()
                    with suppress(BlocksimError):  # what the setting decides: time in compiled code, without files
                        if row != processes.DEAD:
                            path = self.folder / task.name / files.SUMMARY
                            kept["seconds"] = results.read_summary(path).solver_seconds
                    self.rows[task.name] = kept
                    self.on_run(named[task.name][0], kept)
        except KeyboardInterrupt:
            raise StoppedEarlyError(f"stopped after {len(self.rows)} runs; rerun the command to finish") from None
        return [self.rows[name] for name in names]

    def refine(
        self, refinements: tuple[Refinement, ...], tolerance_mm: float, levels: int
    ) -> tuple[RefinementStudy, ...]:
        """Run all coarser levels and two finer ones of every study, then one finer at a time where it is needed."""
        finest = {one.study: FEWEST_LEVELS for one in refinements}
        while True:
            wanted = [(one, n) for one in refinements for n in range(-one.coarser, finest[one.study] + 1)]
            scenarios = {
                f"{one.key} = {one.value(n):g}": with_setting(self.scenario, one.key, one.value(n)) for one, n in wanted
            }
            rows = dict(zip(wanted, self.run(scenarios), strict=True))
            found = tuple(
                judge({n: row for (of, n), row in rows.items() if of is one}, one, self.coordinates, tolerance_mm)
                for one in refinements
            )
            again = [study.study for study in found if study.verdict in UNFINISHED and finest[study.study] < levels]
            if not again:
                return found
            for name in again:
                finest[name] += 1

    def joint(self, settings: dict[str, float], studies: tuple[RefinementStudy, ...]) -> Recommendation:
        """Run the scenario with some settings and compare it with the finest level of every study."""
        changed = self.scenario
        for key, value in settings.items():
            changed = with_setting(changed, key, value)
        finest = {study.key: with_setting(self.scenario, study.key, study.levels[-1].value) for study in studies}
        row, *others = self.run({"recommended settings together": changed, **finest})
        point = self.coordinates.point(row)
        far = max(distance(point, self.coordinates.point(one)) for one in others)
        return Recommendation(settings, float(str(row["seconds"])), studies[0].own.seconds, far)

    def notes(self, studies: Iterable[str] | None) -> tuple[str, ...]:
        """Say what was not studied, and what the numbers cannot mean."""
        notes, scenario = [], self.scenario
        if placement.soil_tables(scenario):
            more = "; --study spacing halves soils.spacing, eight times the cost a level" if studies is None else ""
            notes.append(f"distances are those of blocks, not of soil{more}")
        elif studies is None and scenario.contact.model not in PARTICLE_MODELS:
            notes.append(f"{effects_note(scenario, ['spacing'])}: not studied")
        reasons = {str(row["reason"]) for row in self.rows.values() if row["status"] == FINISHED}
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
        model = Model(scenario)
        step = float(schemes.build(model).world.controls[0].step)  # as given or as it was chosen
        tolerance = velocity_tolerance(scenario, len(model.bodies))
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
    if scenario.contact.model in PARTICLE_MODELS:
        key = "contact.particle_spacing"
        chosen.append(Refinement(SPACING, "particle spacing", key, contact.particle_spacing, 0.5, 1))
    soils = placement.soil_tables(scenario)
    if soils:  # twice the spacing may be too coarse to be admissible
        chosen.append(Refinement(SPACING, "spacing of soil", SOIL_SPACING, soils[0].spacing, 0.5, 0))
    return chosen


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
    """Return the time step, by halves and up to two coarser ones that are admissible."""
    halved = Refinement(STEP, "time step", key, own, 0.5, 0)
    for coarser in (2, 1):
        changed = with_setting(scenario, key, halved.value(-coarser))
        with suppress(ValueError, InvalidInputError):
            type(changed.time).model_validate(changed.time.model_dump())
            schemes.build(Model(changed))
            return replace(halved, coarser=coarser)
    return halved
