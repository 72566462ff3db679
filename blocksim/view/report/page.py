"""The HTML file: templates, style, scripts and data."""

import functools
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING

from blocksim.simulation.atomic import write_bytes
from blocksim.view.report.differences import labels
from blocksim.view.report.subjects import Subject

if TYPE_CHECKING:
    from jinja2 import Environment

SCRIPTS = ("decode", "frames", "view", "drawing", "player", "history", "table", "map", "main")  # in this order
PARTS = resources.files("blocksim.view.report") / "parts"


def write_report(subjects: Sequence[Subject], path: Path, *, title: str, version: str) -> int:
    """Write subjects, the members of sweeps among them, into one file; return its size in bytes.

    Raises OutputError.
    """
    text = page_text(subjects, title=title, version=version)
    content = text.encode(errors="replace")  # names of folders may not be valid text
    write_bytes(path, content)
    return len(content)


def page_text(subjects: Sequence[Subject], *, title: str, version: str) -> str:
    """Return the text of the page; those subjects that have a parent are reached from it only."""
    listed = [subject for subject in subjects if not subject.page.get("parent")]
    return (
        _environment()
        .get_template("page.html")
        .render(
            title=title,
            version=version,
            subjects=subjects,
            listed=listed,
            labels=labels(listed),
            style=_part("style.css"),
            script="\n".join(_part(f"{name}.js") for name in SCRIPTS),
        )
    )


@functools.cache
def _environment() -> "Environment":
    from jinja2 import DictLoader, Environment, StrictUndefined  # noqa: PLC0415 - only reports need it
    from markupsafe import Markup  # noqa: PLC0415

    texts = {name: _part(name) for name in ("page.html", "parts.html")}
    environment = Environment(
        loader=DictLoader(texts), autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=StrictUndefined
    )
    environment.policies["json.dumps_kwargs"] = {"sort_keys": False, "allow_nan": False}
    environment.filters["fixed"] = _fixed
    environment.filters["own"] = Markup  # for our own style and scripts, never for what comes from a scenario
    return environment


def _fixed(value: float, digits: int) -> str:
    """Return a number for people, no minus sign on zero."""
    text = f"{value:.{digits}f}"
    return text[1:] if text.startswith("-") and not text.strip("-0.") else text.replace("-", "−")


def _part(name: str) -> str:
    return (PARTS / name).read_text(encoding="utf-8")
