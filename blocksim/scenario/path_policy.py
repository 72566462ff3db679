"""Files that a scenario may name: those below its own folder or below the current one, unless the user allows more.

A scenario may come from somebody else, and the files that it names are read, quoted in messages, and copied into
results. A path that the user gives (`--set experiment.table=PATH`, or an override in Python) may lead anywhere.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from blocksim.scenario.bounded_read import IS_LINK
from blocksim.scenario.quantities import shown

WAY_OUT = "--allow-outside (in Python allow_outside=True) to override"

_is_anywhere = ContextVar("_is_anywhere", default=False)
_follows_links = ContextVar("_follows_links", default=True)


class ByHand(str):
    """A path that the user gave in addition to the scenario; it may lead anywhere."""

    __slots__ = ()


class OutOfReachError(ValueError):
    """A path that leads outside, or to no file; the text has the reason."""


def is_anywhere() -> bool:
    """Return True if scenarios may name any file at present."""
    return _is_anywhere.get()


@contextmanager
def reaching(*, anywhere: bool, links: bool = True) -> Iterator[None]:
    """Let scenarios that are read meanwhile name any file, or only those within reach; and links or not."""
    anywhere_before, links_before = _is_anywhere.set(anywhere), _follows_links.set(links)
    try:
        yield
    finally:
        _is_anywhere.reset(anywhere_before)
        _follows_links.reset(links_before)


def said_by_hand(key: str | Sequence[str | int], value: object) -> object:
    """Mark a value that the user sets, if it is the path of a table."""
    last = key.rpartition(".")[2] if isinstance(key, str) else key[-1]
    return ByHand(value) if last == "table" and isinstance(value, str) else value


def table_in(folder: Path | str, text: str) -> Path:
    """Return the file that a scenario in `folder` names, all links followed. Raises OutOfReachError."""
    is_by_hand = isinstance(text, ByHand)
    if not _follows_links.get() and not is_by_hand and Path(folder, text).is_symlink():
        raise OutOfReachError(f"{shown(text)}: {IS_LINK}")
    try:
        table = Path(folder, text).resolve()
        here = Path.cwd()
        roots = [Path(folder).resolve()]
        if not Path.home().resolve().is_relative_to(here):  # else the current folder is the home folder, or above it
            roots.append(here)
        if not (_is_anywhere.get() or is_by_hand or any(table.is_relative_to(root) for root in roots)):
            where = "leads outside the scenario's folder and the current folder"
            raise OutOfReachError(f"{shown(text)}: {where}; {WAY_OUT}")
        what = "" if table.is_file() else "no such file"
        if not table.is_file() and table.exists():
            what = "is a folder, not a table" if table.is_dir() else "is a pipe or a device, not a file"
    except (OSError, RuntimeError) as error:  # a name that is too long; links in a circle
        reason = getattr(error, "strerror", None) or str(error)
        raise OutOfReachError(f"{shown(text)}: cannot be read: {reason}") from None
    if what:
        raise OutOfReachError(f"{shown(text)}: {what} (paths are relative to the scenario file)")
    return table


def near(path: str) -> str:
    """Return a path as seen from the current folder, where it lies below."""
    here = Path.cwd()
    return str(Path(path).relative_to(here)) if Path(path).is_relative_to(here) else path
