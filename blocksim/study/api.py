"""Pictures and studies as a Python script asks for them: places, scenarios and plain values in, results out.

The commands of the same name build on the same functions; here are the defaults that a script expects.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TypeVar

from blocksim.errors import InvalidInputError
from blocksim.scenario import Source, document_of
from blocksim.silence import silent
from blocksim.simulation import Result
from blocksim.simulation.own_files import refuse_foreign
from blocksim.study import calibrate as calibration
from blocksim.study import sensitivity as analysis
from blocksim.study.calibrate_plan import read_plan
from blocksim.study.fragility import FragilityResult
from blocksim.study.limit_curve import CurveResult
from blocksim.study.limit_result import LimitResult
from blocksim.study.pictures import draw
from blocksim.study.plan import Values, Variations
from blocksim.study.reporting import report_on
from blocksim.study.run_pictures import RunLook
from blocksim.study.sensitivity_methods import METHODS
from blocksim.study.stored_run import stored_run
from blocksim.study.sweep_table import SweepResult
from blocksim.view.animation import Look, Pace, draw_animation
from blocksim.view.layout import MILLIMETRES_PER_INCH, Paper
from blocksim.view.paint import paint_named
from blocksim.view.run_data import support_of

Place = Path | str | Result | SweepResult | FragilityResult | LimitResult | CurveResult
T = TypeVar("T")
NOTHING = "nothing to vary: give vary={key: {'from': a, 'to': b}}, or a [sweep] table with distributions"


def plot(  # noqa: PLR0913 - one argument for each option of the command
    place: Place,
    out: Path | str | None = None,
    *,
    kind: str | None = None,
    times: Sequence[float] | None = None,
    frames: int | None = None,
    panels: Sequence[str] | None = None,
    blocks: Sequence[str] | None = None,
    relative: bool = False,
    colour: str = "block",
    forces: bool = False,
    size: tuple[float, float] | None = None,
    dpi: float | None = None,
    experiment: Path | str | None = None,
    overwrite: bool = False,
) -> Path:
    """Draw a run (kind strip, final or history), a sweep (lines, map, matrix, histogram) or a table of sensitivities.

    `place` is a result that is kept in a folder, a sweep, or what the command takes; `size` is width and height in mm.
    Returns the path of the picture (default: NAME.png in the current folder). Raises InvalidInputError for an unknown
    kind or format, too small a page and a result that was not kept, InputMissingError, OutputExistsError for a file of
    others unless `overwrite`, OutputError.
    """
    table = None if experiment is None else Path(experiment)
    ready = partial(refuse_foreign, overwrite=overwrite)
    paper = Paper(None if size is None else (size[0] / MILLIMETRES_PER_INCH, size[1] / MILLIMETRES_PER_INCH), dpi)
    look = RunLook(_tuple(times), frames, _tuple(panels), _tuple(blocks), relative, colour, forces)
    return draw(_folder(place), None if out is None else Path(out), look, table, kind, paper, ready=ready)[0]


def animate(
    place: Path | str | Result,
    out: Path | str | None = None,
    *,
    speed: float = 0.25,
    fps: float = 30.0,
    width: int = 800,
    trails: bool | None = None,
    colour: str = "block",
    forces: bool = False,
    overwrite: bool = False,
) -> Path:
    """Write a run as an animation, GIF or MP4, and return its path (default: NAME.gif in the current folder).

    `speed` is simulated seconds per second, `fps` frames per second, `width` in pixels. Raises as `plot` does, and
    UnavailableError where nothing can write MP4.
    """
    stored = stored_run(_folder(place))
    path = Path(f"{stored.scenario.name}.gif" if out is None else out)
    refuse_foreign(path, overwrite=overwrite)
    look = Look(width, trails, stored.scenario.name, forces, paint_named(colour, stored.frames, stored.scenario))
    draw_animation(stored.frames, path, Pace(speed, fps), look, support_of(stored.scenario, stored.events))
    return path


def report(
    *places: Place, out: Path | str = "report.html", experiment: Path | str | None = None, overwrite: bool = False
) -> Path:
    """Write runs and sweeps into one self-contained HTML file with a player, and return its path.

    Raises as `plot` does, and InvalidInputError, after writing, for what is damaged in them.
    """
    path = Path(out)
    refuse_foreign(path, overwrite=overwrite)
    table = None if experiment is None else Path(experiment)
    _, problems = report_on([_folder(place) for place in places], path, table)
    if problems:
        raise InvalidInputError("\n".join(problems))
    return path


def _folder(place: Place) -> Path:
    """Return where a run or a sweep lies. Raises InvalidInputError for a result that was not kept."""
    if isinstance(place, SweepResult | FragilityResult | LimitResult | CurveResult):
        return place.folder
    if not isinstance(place, Result):
        return Path(place)
    if place.folder is None:
        message = f"{place.name}: this result is in memory only; run it with out=FOLDER to store what pictures need"
        raise InvalidInputError(message)
    return place.folder


def _tuple(values: Sequence[T] | None) -> tuple[T, ...] | None:
    return None if values is None else tuple(values)


def calibrate(  # noqa: PLR0913 - one argument for each option of the command
    scenario: Source,
    fit: Mapping[str, Values],
    scatter: Mapping[str, Values] | None = None,
    *,
    experiment: Path | str | None = None,
    trials: int = calibration.TRIALS,
    members: int = calibration.MEMBERS,
    fresh_members: int = calibration.FRESH_MEMBERS,
    seed: int = 0,
    out: Path | str | None = None,
    resume: bool = False,
    overwrite: bool = False,
) -> calibration.Fit:
    """Fit inputs to measured repeats so that agreement is probable under the scatter of the other inputs.

    `fit` gives the priors by dotted key, {"contact.restitution": {"from": 0.2, "to": 0.35}}, `scatter` distributions
    ({"mean": m, "sd": s} or {"from": a, "to": b}; default: those of the [sweep] table). Writes a scenario with the
    fitted values and their provenance to `out` (default: results/NAME/calibrate-HASH/scenario.toml) and returns the
    fit. Raises ScenarioError, InputMissingError without an experiment table, InvalidInputError, OutputExistsError,
    UnavailableError without the extra `study`, StoppedEarlyError on Ctrl-C (`resume` continues).
    """
    plan = read_plan(
        document_of(scenario),
        Variations.of(fit),
        None if scatter is None else Variations.of(scatter),
        experiment=None if experiment is None else Path(experiment),
        members=members,
        seed=seed,
    )
    return calibration.calibrate(
        plan,
        trials=trials,
        fresh_members=fresh_members,
        out=None if out is None else Path(out),
        resume=resume,
        overwrite=overwrite,
        on_trial=silent,
    )


def sensitivity(
    scenario: Source,
    vary: Mapping[str, Values] | None = None,
    *,
    method: str = "morris",
    samples: int | None = None,
    seed: int = 0,
) -> analysis.Sensitivity:
    """Return Morris (`method="morris"`) or Sobol (`"sobol"`) indices of the run-outs and of the outcome.

    `vary` gives a distribution by dotted key, {"gravity": {"from": 9.7, "to": 9.9}} (default: those of the [sweep]
    table). `samples` is the number of trajectories or base samples. Raises ScenarioError, InvalidInputError where
    nothing is varied or the method is unknown, UnavailableError without the extra `study`, TooManyFailuresError.
    """
    if method not in METHODS:
        message = f"unknown method {method!r}; choose one of {', '.join(METHODS)}"
        raise InvalidInputError(message)
    document = document_of(scenario)
    plan = analysis.sampled_plan(document, Variations.of(vary or {}), "vary", NOTHING)
    return analysis.sensitivity(document.without_sweep(), plan, METHODS[method], samples=samples, seed=seed)
