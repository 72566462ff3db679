"""The HTML file: templates, style, scripts and data; runs of one name are labelled by the keys that differ."""

import functools
from base64 import b64encode
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from hashlib import sha256
from importlib import resources
from pathlib import Path
from typing import Any

from blocksim.scenario.overrides import KeyPath, format_key
from blocksim.simulation import provenance
from blocksim.simulation.files import write_bytes
from blocksim.view.report.subjects import Subject

SCRIPTS = ("decode", "frames", "view", "drawing", "loads", "player", "pictures", "table", "main")  # in this order
PARTS = resources.files("blocksim.view.report") / "parts"

MOST_KEYS = 2  # in a label
UNTOLD = {"name", "description", "experiment", "provenance"}


def write_report(subjects: Sequence[Subject], path: Path) -> int:
    """Write subjects, the members of sweeps among them, into one file; return its size in bytes.

    Raises OutputError.
    """
    text = page_text(subjects)
    content = text.encode(errors="replace")  # names of folders may not be valid text
    write_bytes(path, content)
    return len(content)


def page_text(subjects: Sequence[Subject]) -> str:
    """Return the text of the page; those subjects that have a parent are reached from it only."""
    listed = [subject for subject in subjects if not subject.page.get("parent")]
    title = f"{', '.join(dict.fromkeys(subject.name for subject in listed))} – blocksim report"
    names = ("style.css", *(f"{name}.js" for name in SCRIPTS))
    style, *scripts = ((PARTS / name).read_text(encoding="utf-8") for name in names)
    # all scripts as one, whose names are seen by nothing else in the page
    script = '\n(() => {\n"use strict";\n' + "\n".join(scripts) + "\n})();\n"
    policy = policy_of(style, script)
    told = {"title": title, "subjects": subjects, "listed": listed, "labels": labels(listed)}
    page = _environment().get_template("page.html")
    return str(page.render(**told, version=provenance.code_version(), policy=policy, style=style, script=script))


def policy_of(style: str, script: str, *more: str) -> str:
    """Return what a page may load and run: its own style and script and pictures within it, and nothing but `more`."""
    nothing = (f"{name} 'none'" for name in ("default-src", "base-uri", "form-action"))
    hashes = {kind: sha256(text.encode()).digest() for kind, text in (("style", style), ("script", script))}
    own = (f"{kind}-src 'sha256-{b64encode(found).decode()}'" for kind, found in hashes.items())  # CSP level 2
    return "; ".join((*nothing, *own, "img-src data:", *more))


@functools.cache
def _environment() -> Any:
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    loader = PackageLoader("blocksim.view.report", "parts")
    environment = Environment(
        loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=StrictUndefined
    )
    environment.policies["json.dumps_kwargs"] = {"sort_keys": False, "allow_nan": False}
    environment.filters["fixed"] = lambda value, digits: f"{value:z.{digits}f}".replace("-", "−")  # for people
    environment.filters["own"] = Markup  # for our own style and scripts, never for what comes from a scenario
    return environment


def labels(subjects: Sequence[Subject]) -> dict[str, str]:
    """Return a label for each run that shares its name with another one, by the keys of the subjects.

    A kinetic friction that equals the static one in all runs is left out: one of the two suffices.
    """
    counts = Counter(subject.name for subject in subjects if subject.page.get("values") is not None)
    found = {}
    for name in (name for name, count in counts.items() if count > 1):
        runs = [one for one in subjects if one.name == name and one.page.get("values")]
        flat = [dict(_leaves(subject.page["values"])) for subject in runs]
        known = dict.fromkeys(key for values in flat for key in values)
        keys = [key for key in known if any(values.get(key) != flat[0].get(key) for values in flat)]
        statics = {key: f"{key.removesuffix('.kinetic')}.static" for key in keys if key.endswith(".kinetic")}
        kept = [
            key
            for key in keys
            if statics.get(key) not in keys or any(one.get(key) != one.get(statics[key]) for one in flat)
        ]
        for subject, values in zip(runs, flat, strict=True):
            parts = []
            for key in kept[:MOST_KEYS]:
                value = values.get(key)
                shown = f"{value:.4g}" if isinstance(value, float) else "–" if value is None else value
                parts.append(f"{key} = {shown}")
            more = len(kept) - MOST_KEYS
            found[subject.key] = ", ".join([*parts, *([f"{more} more"] if more > 0 else [])])
    return found


def _leaves(node: object, path: KeyPath = ()) -> Iterator[tuple[str, object]]:
    """Yield dotted keys and values below a node."""
    if not isinstance(node, Mapping | list | tuple):
        yield format_key(path), node
        return
    for key, entry in node.items() if isinstance(node, Mapping) else enumerate(node):
        if path or key not in UNTOLD:
            yield from _leaves(entry, (*path, key))
