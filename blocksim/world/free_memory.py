"""Available memory, and numbers of bytes as text. Independent of scenes and the solver."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

UNITS = ("bytes", "kB", "MB", "GB", "TB", "PB", "EB")
THOUSAND = 1000
MOST_SHOWN = 999.5  # rounds to four digits
KIBI = 1024


def readable(count: int) -> str:
    """Return bytes in the largest unit of which there is at least one, such as "3.1 GB"."""
    value, unit = float(count), 0
    while value >= MOST_SHOWN and unit + 1 < len(UNITS):
        value, unit = value / THOUSAND, unit + 1
    return f"{value:.3g} {UNITS[unit]}"


def available_bytes(root: Path = Path("/")) -> int | None:
    """Return the memory (bytes) that a process can still get, or None on a system that does not report it.

    That of the machine, or what is left of the limit of a control group (container, batch job). Swap does not count.
    """
    limits = [limit for limit in (_of_machine(root), *_of_groups(root)) if limit is not None]
    return max(0, min(limits)) if limits else None


def _of_machine(root: Path) -> int | None:
    for name, value, *_ in (line.split() for line in _lines(root / "proc/meminfo")):
        if name == "MemAvailable:":
            return int(value) * KIBI
    names = getattr(os, "sysconf_names", {})
    if "SC_AVPHYS_PAGES" in names:
        return os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    return None


class _Names(NamedTuple):
    """Files of a control group."""

    folder: str
    limit: str
    usage: str
    reclaimable: str  # entry of memory.stat: cached files that are given up when memory runs short


VERSION_1 = _Names("sys/fs/cgroup/memory", "memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file")
VERSION_2 = _Names("sys/fs/cgroup", "memory.max", "memory.current", "inactive_file")


def _of_groups(root: Path) -> Iterator[int | None]:
    """Yield what is left of the limits of the control group that this process is in and of all groups around it."""
    for line in _lines(root / "proc/self/cgroup"):  # hierarchy:controllers:path
        _, controllers, path = line.split(":", 2)
        if controllers in ("", "memory"):
            names = VERSION_1 if controllers else VERSION_2
            folder = root / names.folder
            own = folder / path.strip("/")
            for group in (own, *own.parents):
                if group.is_relative_to(folder):
                    yield _left_in(group, names)


def _left_in(group: Path, names: _Names) -> int | None:
    limit, usage = _lines(group / names.limit), _lines(group / names.usage)
    if not (limit and usage) or not limit[0].isdecimal():  # "max": no limit
        return None
    stat = dict(line.split() for line in _lines(group / "memory.stat"))
    return int(limit[0]) - int(usage[0]) + int(stat.get(names.reclaimable, "0"))


def _lines(path: Path) -> list[str]:
    """Return the lines of a file, none where it cannot be read."""
    try:
        return path.read_text(encoding="ascii").splitlines()
    except (OSError, ValueError):
        return []
