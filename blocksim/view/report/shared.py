"""Texts for a page that is sent to others: paths of this machine are cut to the names of files and folders."""

import re

from blocksim.scenario.path_policy import near

ROOT = r"(?:/|[A-Za-z]:[\\/])"
ABSOLUTE = re.compile(rf"'(?P<quoted>{ROOT}[^']+)'|(?<![^\s=,(\"])(?P<bare>{ROOT}[^\s'\",:;()]+)")


def shared_path(path: str) -> str:
    """Return an absolute path as seen from the current folder, or its last name where it lies elsewhere."""
    below = near(path)
    is_elsewhere = below == path and re.match(ROOT, path) is not None
    return re.split(r"[\\/]", path.rstrip("\\/"))[-1] if is_elsewhere else below


def shared_text(text: str) -> str:
    """Return a text with all absolute paths in it as `shared_path` has them; those with spaces need quotes."""
    return ABSOLUTE.sub(lambda found: f"'{shared_path(q)}'" if (q := found["quoted"]) else shared_path(found[0]), text)
