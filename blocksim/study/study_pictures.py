"""What `plot` draws of the folders of fragility studies, as they are read back from their own files."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from pydantic import BaseModel, Field, ValidationError

from blocksim.analysis.lognormal import Counts, Curve, NoCurve, fit
from blocksim.errors import InvalidInputError
from blocksim.scenario import load_stored
from blocksim.scenario.bounded_read import MEGABYTE, read_limited
from blocksim.study.fragility_counts import Point
from blocksim.study.sweep_folder import FRAGILITY, FolderKind
from blocksim.view.fragility import Band, Fragility, draw_fragility, places
from blocksim.view.layout import Paper
from blocksim.view.style import picture_suffix

MOST_BYTES = 50 * MEGABYTE


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


def study_in(place: Path | str) -> FolderKind | None:
    """Return the kind of study whose answer a folder holds, None for anything else."""
    return next((kind for kind in DRAWN if (Path(place) / kind.origin).is_file()), None)


def draw_study(
    folder: Path, kind: FolderKind, path: Path | None, picture: str | None, paper: Paper, ready: Callable[[Path], None]
) -> Path:
    """Draw a study; return the picture's path (default: NAME_KIND.png).

    `ready` is asked about the path first. Raises InvalidInputError for another kind of picture, an unknown format and
    what cannot be read, InputMissingError, OutputError.
    """
    name, draw = DRAWN[kind]
    if picture not in {None, name}:
        message = f"{folder}: {kind.what} is drawn as {name!r}, not as {picture!r}"
        raise InvalidInputError(message)
    scenario = load_stored(folder / kind.plan)
    path = path or Path(f"{scenario.name}_{name}.png")
    picture_suffix(path)
    ready(path)
    draw(folder, path, scenario.description or scenario.name, paper)
    return path


def draw_fragility_of(folder: Path, path: Path, title: str, paper: Paper) -> None:
    """Draw counts and curve of a fragility study."""
    draw_fragility(read_fragility_picture(folder), path, title, paper)


def read_answer(folder: Path) -> tuple[StoredFragility, list[Point]]:
    """Return what a study found. Raises InputMissingError or InvalidInputError."""
    path = folder / FRAGILITY.origin
    try:
        stored = StoredFragility.model_validate_json(read_limited(path, MOST_BYTES))
    except ValidationError as error:
        message = f"{path}: not the answer of a fragility study: {str(error).splitlines()[0]}"
        raise InvalidInputError(message) from None
    return stored, [Point(**one.model_dump()) for one in stored.points if one.failures <= one.members]


def read_fragility_picture(folder: Path) -> Fragility:
    """Return the counts of a study and the curve through them. Raises InputMissingError or InvalidInputError."""
    stored, read = read_answer(folder)
    points = [one for one in read if one.members]
    if not points:
        message = f"{folder}: no member of this study has a result; nothing to draw"
        raise InvalidInputError(message)
    x, share, low, high = np.array([(one.intensity, one.share, *one.limits) for one in points]).T
    curve = fit(Counts.of(x.tolist(), [one.failures for one in points], [one.members for one in points]))
    at = places(x)
    band = Band(at, curve.probability(at), *curve.band(at)) if isinstance(curve, Curve) else None
    return Fragility(stored.key, stored.unit, x, share, low, high, band, notes=(f"{_told(curve, stored)}.",))


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
}
"""Kinds of studies: the name of their picture, and what draws it."""
