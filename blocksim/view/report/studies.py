"""Studies in a report: what was found, its picture, and the table of what it was found from."""

from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass

from blocksim.view.report.runs import Subject
from blocksim.view.report.shared import shared_path, shared_text


@dataclass(frozen=True)
class StudyPage:
    """The parts of a study: pairs of what was found, and a table of texts with its title."""

    name: str
    description: str
    summary: Sequence[tuple[str, str]]
    title: str
    heads: Sequence[str]
    rows: Sequence[Sequence[str]]
    picture: bytes | None = None  # PNG
    problems: Sequence[str] = ()


def study_subject(key: str, study: StudyPage, place: str) -> Subject:
    """Return a study for a report."""
    picture = None if study.picture is None else f"data:image/png;base64,{b64encode(study.picture).decode()}"
    page = {
        "place": shared_path(place),
        "description": study.description,
        "summary": list(study.summary),
        "title": study.title,
        "heads": list(study.heads),
        "rows": [list(row) for row in study.rows],
        "picture": picture,
        "problems": [shared_text(text) for text in study.problems],
    }
    return Subject(key, "study", study.name, page, {"kind": "study", "name": study.name, "place": shared_path(place)})
