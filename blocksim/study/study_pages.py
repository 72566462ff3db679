"""Fragility studies and limits as parts of a report."""

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from blocksim.errors import BlocksimError
from blocksim.scenario import load_stored
from blocksim.scenario.models.stepping import SCHEMES
from blocksim.study.study_pictures import draw_study, read_answer, read_curve_answer, read_limit_answer, with_unit
from blocksim.study.sweep_folder import FRAGILITY, LIMIT, LIMIT_CURVE, FolderKind
from blocksim.view.layout import OWN
from blocksim.view.report.studies import StudyPage

HEADS = ("samples", "failures", "share", "95 % low", "95 % high", "still moving", "no result")
SIDE_HEADS = ("verdict", "outcome", "first to move", "at s", "moved mm")
Parts = tuple[list[tuple[str, str]], str, tuple[str, ...], list[list[str]]]


def study_page(folder: Path, kind: FolderKind) -> StudyPage:
    """Return a study as a report shows it. Raises InputMissingError or InvalidInputError where it cannot be read."""
    summary, title, heads, rows = PARTS[kind](folder)
    scenario = load_stored(folder / kind.plan)
    picture, problem = _picture(folder, kind)
    description = scenario.description or ""
    return StudyPage(scenario.name, description, summary, title, heads, rows, picture, [problem] if problem else [])


def _picture(folder: Path, kind: FolderKind) -> tuple[bytes | None, str]:
    """Return the picture as a PNG, or why there is none."""
    with TemporaryDirectory() as place:
        path = Path(place) / "picture.png"
        try:
            draw_study(folder, kind, path, None, OWN, lambda _: None)
        except BlocksimError as error:
            return None, str(error)
        return path.read_bytes(), ""


def _fragility(folder: Path) -> Parts:
    stored, points = read_answer(folder)
    rows = [
        [
            f"{one.intensity:.6g}",
            str(one.members),
            str(one.failures),
            *(f"{value:.3f}" for value in (one.share, *one.limits)),
            str(one.moving_on),
            str(one.no_result),
        ]
        for one in points
    ]
    summary = [("intensity", stored.key), ("failure", stored.fails), ("samples", str(sum(p.members for p in points)))]
    return summary, "Failures over the intensity", (with_unit(stored.key, stored.unit), *HEADS), rows


def _limit(folder: Path) -> Parts:
    stored = read_limit_answer(folder)
    ends = [end for one in stored.changes for end in one.ends]
    rows = [
        [
            f"{value:.8g}",
            end.verdict,
            end.outcome or "",
            "" if end.first_mover is None else f"block {end.first_mover}",
            *("" if number is None else f"{number:.3g}" for number in (end.first_moved_s, end.displacement_mm)),
        ]
        for value, end in dict.fromkeys(ends)
    ]
    found = [f"{one.low:.7g} ({one.below.verdict}) to {one.high:.7g} ({one.above.verdict})" for one in stored.changes]
    stiff = [one for one in stored.changes if one.extrapolated]
    levels = [level for one in stiff for level in one.levels]
    unit = f" {stored.unit}" if stored.unit else ""
    summary = [
        ("key", stored.key),
        ("stands means", stored.stands),
        ("contacts", SCHEMES[stored.scheme].contacts if stored.scheme in SCHEMES else stored.scheme),
        ("runs", str(stored.runs)),
        *(("limit", f"{text}{unit}") for text in found or ["nothing changes within the range"]),
        *(
            (f"at stiffness scale {one.stiffness_scale:g}", f"{one.low:.7g} to {one.high:.7g}{unit}, extrapolated from")
            for one in levels
        ),
    ]
    return summary, "Both sides of every bracket", (f"value{unit}", *SIDE_HEADS), rows


def _curve(folder: Path) -> Parts:
    stored = read_curve_answer(folder)
    heads = (with_unit(stored.over, stored.over_unit), with_unit(stored.key, stored.unit), "to", "below", "above")
    rows = [
        [f"{point.over:.6g}", f"{one.low:.8g}", f"{one.high:.8g}", one.below.verdict, one.above.verdict]
        for point in stored.points
        for one in point.changes
    ]
    return [("key", stored.key), ("over", stored.over), ("stands means", stored.stands)], "Limits", heads, rows


PARTS: dict[FolderKind, Callable[[Path], Parts]] = {FRAGILITY: _fragility, LIMIT: _limit, LIMIT_CURVE: _curve}
"""What is shown of each kind of study beside its picture: pairs, title, heads and rows of a table."""
