"""What `plot` draws of the folders of fragility studies and limits, as they are read back from their own files."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import numpy as np
from pydantic import BaseModel, Field, ValidationError

from blocksim.analysis.lognormal import Counts, Curve, NoCurve, fit
from blocksim.errors import InvalidInputError
from blocksim.scenario import load_stored
from blocksim.scenario.bounded_read import MEGABYTE, read_limited
from blocksim.study.criterion import Verdict
from blocksim.study.fragility_counts import Point
from blocksim.study.published import read_published
from blocksim.study.stored_run import stored_run
from blocksim.study.sweep_folder import FRAGILITY, LIMIT, LIMIT_CURVE, FolderKind, case_folder
from blocksim.view.fragility import Band, Fragility, draw_fragility, places
from blocksim.view.layout import Paper
from blocksim.view.limit_curve import Bracket, LimitCurve, draw_limit_curve
from blocksim.view.mechanism import Side, draw_mechanisms
from blocksim.view.run_data import support_of
from blocksim.view.style import picture_suffix

MOST_BYTES = 50 * MEGABYTE
STANDS = Verdict.STANDS.value
Answer = TypeVar("Answer", bound=BaseModel)


class StoredPoint(BaseModel, frozen=True):
    """An intensity of fragility.json."""

    intensity: float = Field(gt=0.0, lt=1e300)
    members: int = Field(ge=0)
    failures: int = Field(ge=0)
    moving_on: int = Field(ge=0)
    no_result: int = Field(ge=0)


class StoredFragility(BaseModel, frozen=True):
    """What a picture needs of fragility.json."""

    key: str
    unit: str
    fails: str
    points: tuple[StoredPoint, ...]
    inflation: float | None = Field(default=None, ge=1.0, lt=1e6)


class StoredSide(BaseModel, frozen=True):
    """One side of a bracket of limit.json; `case` is the folder of its run in `cases`, `value` that of the run."""

    verdict: str
    value: float | None = None  # in answers of earlier versions that of the bracket
    outcome: str | None = None
    first_mover: str | int | None = None
    first_moved_s: float | None = None
    displacement_mm: float | None = None
    turn_deg: float | None = None
    case: str | None = None


class StoredLevel(BaseModel, frozen=True):
    """The bracket of a limit at one stiffness scale."""

    stiffness_scale: float
    low: float
    high: float


class StoredChange(BaseModel, frozen=True):
    """A bracket of limit.json; `levels` are those of springs that it is extrapolated from."""

    low: float
    high: float
    below: StoredSide
    above: StoredSide
    extrapolated: bool = False
    levels: tuple[StoredLevel, ...] = ()

    @property
    def ends(self) -> tuple[tuple[float, StoredSide], tuple[float, StoredSide]]:
        """The values that were run on either side, and what they came to."""
        given = ((self.low, self.below), (self.high, self.above))
        (low, below), (high, above) = ((value if side.value is None else side.value, side) for value, side in given)
        return (low, below), (high, above)


class StoredLimit(BaseModel, frozen=True):
    """What a picture needs of limit.json."""

    key: str
    unit: str
    stands: str
    scheme: str
    runs: int
    changes: tuple[StoredChange, ...]


class StoredCurvePoint(BaseModel, frozen=True):
    """The search at one value of limits.json."""

    over: float
    changes: tuple[StoredChange, ...]


class StoredCurve(BaseModel, frozen=True):
    """What a picture needs of limits.json."""

    key: str
    unit: str
    over: str
    over_unit: str
    stands: str
    points: tuple[StoredCurvePoint, ...]


def study_in(place: Path | str) -> FolderKind | None:
    """Return the kind of study whose answer a folder holds, None for anything else."""
    return next((kind for kind in DRAWN if (Path(place) / kind.origin).is_file()), None)


def draw_study(
    folder: Path,
    kind: FolderKind,
    path: Path | None,
    picture: str | None,
    paper: Paper,
    ready: Callable[[Path], None],
    *,
    published: Path | None = None,
) -> Path:
    """Draw a study; return the picture's path (default: NAME_KIND.png).

    `ready` is asked about the path first; `published` is a table of limits to draw beside a curve of them. Raises
    InvalidInputError for another kind of picture, an unknown format, a table for another study and what cannot be
    read, InputMissingError, OutputError.
    """
    name, draw = DRAWN[kind]
    if picture not in {None, name}:
        message = f"{folder}: {kind.what} is drawn as {name!r}, not as {picture!r}"
        raise InvalidInputError(message)
    if published is not None and kind != LIMIT_CURVE:
        message = f"{published}: a table is drawn beside {LIMIT_CURVE.what} only, and {folder} is {kind.what}"
        raise InvalidInputError(message)
    scenario = load_stored(folder / kind.plan)
    path = path or Path(f"{scenario.name}_{name}.png")
    picture_suffix(path)
    ready(path)
    title = scenario.description or scenario.name
    if kind == LIMIT_CURVE:
        draw_curve_of(folder, path, title, paper, published)
    else:
        draw(folder, path, title, paper)
    return path


def draw_fragility_of(folder: Path, path: Path, title: str, paper: Paper) -> None:
    """Draw counts and curve of a fragility study."""
    draw_fragility(read_fragility_picture(folder), path, title, paper)


def _read(path: Path, model: type[Answer], kind: FolderKind) -> Answer:
    try:
        return model.model_validate_json(read_limited(path, MOST_BYTES))
    except ValidationError as error:
        message = f"{path}: not the answer of {kind.what}: {str(error).splitlines()[0]}"
        raise InvalidInputError(message) from None


def read_answer(folder: Path) -> tuple[StoredFragility, list[Point]]:
    """Return what a study found. Raises InputMissingError or InvalidInputError."""
    stored = _read(folder / FRAGILITY.origin, StoredFragility, FRAGILITY)
    return stored, [Point(**one.model_dump()) for one in stored.points if one.failures <= one.members]


def read_fragility_picture(folder: Path) -> Fragility:
    """Return the counts of a study and the curve through them. Raises InputMissingError or InvalidInputError."""
    stored, read = read_answer(folder)
    points = [one for one in read if one.members]
    if not points:
        message = f"{folder}: no sample of this study has a result; nothing to draw"
        raise InvalidInputError(message)
    x, share, low, high = np.array([(one.intensity, one.share, *one.limits) for one in points]).T
    counts = Counts.of(x.tolist(), [one.failures for one in points], [one.members for one in points])
    curve = fit(counts, inflation=stored.inflation)
    at = places(x)
    band = Band(at, curve.probability(at), *curve.band(at)) if isinstance(curve, Curve) else None
    return Fragility(stored.key, stored.unit, x, share, low, high, band, notes=(f"{_told(curve, stored)}.",))


def read_limit_answer(folder: Path) -> StoredLimit:
    """Return what a search for a limit found. Raises InputMissingError or InvalidInputError."""
    return _read(folder / LIMIT.origin, StoredLimit, LIMIT)


def draw_limit_of(folder: Path, path: Path, title: str, paper: Paper) -> None:
    """Draw both sides of the brackets whose runs were kept."""
    stored = read_limit_answer(folder)
    brackets = [pair for change in stored.changes if (pair := _sides(folder, stored, change)) is not None]
    if not brackets:
        why = (
            "nothing changes within its range" if not stored.changes else "it holds no runs of both sides of a bracket"
        )
        message = f"{folder}: {why}; nothing to draw"
        raise InvalidInputError(message)
    draw_mechanisms(brackets, path, title, paper)


def read_curve_answer(folder: Path) -> StoredCurve:
    """Return the limits of a curve. Raises InputMissingError or InvalidInputError."""
    return _read(folder / LIMIT_CURVE.origin, StoredCurve, LIMIT_CURVE)


def draw_curve_of(folder: Path, path: Path, title: str, paper: Paper, published: Path | None = None) -> None:
    """Draw limits over the other key, with a table of others beside them."""
    stored = read_curve_answer(folder)
    points = [
        (one.over, [Bracket(c.low, c.high, c.below.verdict, c.above.verdict) for c in one.changes])
        for one in stored.points
    ]
    none = [f"{value:.6g}" for value, found in points if not found]
    if len(none) == len(points):
        message = f"{folder}: nothing changes within its range; nothing to draw"
        raise InvalidInputError(message)
    notes = [f"Stands means: {stored.stands}.", *([f"Nothing changes at {', '.join(none)}."] if none else [])]
    axes = with_unit(stored.over, stored.over_unit), with_unit(stored.key, stored.unit)
    beside = () if published is None else read_published(published, stored.over_unit, stored.unit)
    draw_limit_curve(LimitCurve(*axes, points, tuple(notes), beside), path, title, paper)


def with_unit(key: str, unit: str) -> str:
    """Return a key with its unit, as along an axis."""
    return f"{key} ({unit})" if unit else key


def _sides(folder: Path, stored: StoredLimit, change: StoredChange) -> tuple[Side, Side] | None:
    """Return what is drawn of a bracket: what stands on the left."""
    ends = list(change.ends)
    ends.sort(key=lambda end: end[1].verdict != STANDS)
    found = [side for value, end in ends if (side := _side(folder, stored, value, end)) is not None]
    return (found[0], found[1]) if len(found) == len(ends) else None


def _side(folder: Path, stored: StoredLimit, value: float, end: StoredSide) -> Side | None:
    place = None if end.case is None else case_folder(folder, end.case)
    if place is None:
        return None
    run = stored_run(place)
    first = None if end.first_mover is None else str(end.first_mover)
    said = f"{end.verdict} at {stored.key} = {value:.7g} {stored.unit}".rstrip()
    if first is None:
        told = end.outcome or ""
    else:
        told = f"{end.outcome}; first to move: block {first} at {end.first_moved_s or 0.0:.3g} s"
    side = Side(run.frames, support_of(run.scenario, run.events), first, said, is_mechanism=end.verdict != STANDS)
    moment = float(run.frames.time[side.frame])
    return replace(side, caption=f"{said}\n{told} (drawn at {moment:.3g} s)")


def _told(curve: Curve | NoCurve, stored: StoredFragility) -> str:
    """Return what failure means, and the curve in words."""
    unit = f" {stored.unit}" if stored.unit else ""
    if not isinstance(curve, Curve):
        return f"Failure: {stored.fails}; no curve: {curve.reason}"
    (low, high), (least, most) = curve.median_interval, curve.dispersion_interval
    median = f"median {curve.median:.4g}{unit} [{low:.4g}, {high:.4g}]"
    return f"Failure: {stored.fails}; {median}, dispersion {curve.dispersion:.3g} [{least:.3g}, {most:.3g}]"


DRAWN: dict[FolderKind, tuple[str, Callable[[Path, Path, str, Paper], None]]] = {
    FRAGILITY: ("fragility", draw_fragility_of),
    LIMIT: ("mechanism", draw_limit_of),
    LIMIT_CURVE: ("limits", draw_curve_of),
}
"""Kinds of studies: the name of their picture, and what draws it."""
