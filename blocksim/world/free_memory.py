"""Available memory, bytes as text, and the chunks in which run.h5 takes room. Independent of scenes and the solver."""

import os
from pathlib import Path

UNITS = ("bytes", "kB", "MB", "GB", "TB", "PB", "EB")
MOST_SHOWN = 999.5  # rounds to four digits
CHUNK_VALUES = 1 << 17  # a megabyte
# Of control groups of version 1 and 2, by their controllers: where they are mounted, their limit and usage, and the
# entry of memory.stat for cached files that are given up when memory runs short.
GROUP_FILES = {
    "memory": ("sys/fs/cgroup/memory", "memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"),
    "": ("sys/fs/cgroup", "memory.max", "memory.current", "inactive_file"),
}


def readable(count: int) -> str:
    """Return bytes in the largest unit of which there is at least one, such as "3.1 GB"."""
    value, unit = float(count), 0
    while value >= MOST_SHOWN and unit + 1 < len(UNITS):
        value, unit = value / 1000, unit + 1
    return f"{value:.3g} {UNITS[unit]}"


def chunk_rows(elements: int) -> int:
    """Return how many frames of so many elements, the most of any system, run.h5 takes room for at a time."""
    return min(64, max(1, CHUNK_VALUES // max(elements, 1)))  # frames in a chunk of run.h5


def available_bytes(root: Path = Path("/")) -> int | None:
    """Return the memory (bytes) that a process can still get, or None on a system that does not report it.

    That of the machine, or what is left of the limit of a control group (container, batch job) that this process is in,
    or of one around it. Swap does not count.
    """
    limits = []
    for name, value, *_ in (line.split() for line in _lines(root / "proc/meminfo")):
        if name == "MemAvailable:":
            limits.append(int(value) * 1024)
    if not limits and "SC_AVPHYS_PAGES" in getattr(os, "sysconf_names", {}):
        limits.append(os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    for line in _lines(root / "proc/self/cgroup"):  # hierarchy:controllers:path
        _, controllers, path = line.split(":", 2)
        if controllers in GROUP_FILES:
            mount, *names = GROUP_FILES[controllers]
            own = root / mount / path.strip("/")
            groups = (group for group in (own, *own.parents) if group.is_relative_to(root / mount))
            limits += [left for group in groups if (left := _left_in(group, *names)) is not None]
    return max(0, min(limits)) if limits else None


def _left_in(group: Path, limit_file: str, usage_file: str, reclaimable: str) -> int | None:
    """Return what is left (bytes) of the limit of a control group; None where there is none."""
    limit, usage = _lines(group / limit_file), _lines(group / usage_file)
    if not (limit and usage) or not limit[0].isdecimal():  # "max": no limit
        return None
    stat = dict(line.split() for line in _lines(group / "memory.stat"))
    return int(limit[0]) - int(usage[0]) + int(stat.get(reclaimable, "0"))


def _lines(path: Path) -> list[str]:
    """Return the lines of a file, none where it cannot be read."""
    try:
        return path.read_text(encoding="ascii").splitlines()
    except (OSError, ValueError):
        return []
