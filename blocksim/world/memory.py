"""How much memory a run needs, told before anything is allocated, and how much there is.

Sizes follow from the types in blocksim.kernels.arrays, so that they change with them.
"""

import os
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from blocksim.errors import InvalidInputError
from blocksim.kernels.arrays import BODY, CONTACT, CONTACTS, OPERATOR, PAIR, PARTICLE_CONTACT, POINT
from blocksim.kernels.lanes import WIDTH
from blocksim.kernels.nonsmooth.arrays import BEFORE, BOOK, GROUP, KEPT, LINE, PART, ROW, SPOT

LISTS = 2  # of candidate pairs: the present one and the one being built
OPERATORS = 2  # of a pair: along the normal and along the tangent
INDEX = np.dtype(np.uint32).itemsize
VALUE = np.dtype(np.float64).itemsize
OBJECT_BYTES = 450  # a placed body with its name, and its places in lists; measured 410
MOTION_VALUES = 6  # of a body in a frame: place, angle, velocity, spin
FRAME_VALUES = 12  # of a frame beside those: step, time, energies, number of contacts, largest overlap
CONTACT_VALUES = 8  # of a recorded contact: two bodies in one, place, normal, overlap, forces
CONTACTS_OF_A_BODY = 4  # recorded in a frame, of corners and rigid faces: hardly ever more
COPIES = 2  # of all frames at the end of a run: as they came, and joined
UNITS = ("bytes", "kB", "MB", "GB", "TB", "PB", "EB")
THOUSAND = 1000
MOST_SHOWN = 999.5  # rounds to four digits
KIBI = 1024


class SceneTooLargeError(InvalidInputError):
    """A scene needs more memory than there is; both in bytes."""

    def __init__(self, size: "Size", available: int) -> None:
        """Say both, and what the need consists of."""
        self.needed = size.bytes_needed
        self.available = available
        frames = f", {readable(size.record_bytes)} for {size.frames} frames (output.every)" if size.frames else ""
        super().__init__(
            f"this scene is too large: it needs about {readable(self.needed)} of memory and {readable(available)} are "
            f"free; {readable(size.world_bytes)} for {size.bodies} bodies and {size.pairs} pairs of neighbours{frames}"
        )


class Size(ABC):
    """What the memory of a run depends on."""

    bodies: int
    pairs: int  # of neighbours that there is room for
    frames: int  # recorded, at most
    contacts: int  # recorded in every frame, at most

    @property
    @abstractmethod
    def world_bytes(self) -> int:
        """Bytes of the arrays of a scene and of the bodies as they were placed."""

    @property
    def record_bytes(self) -> int:
        """Bytes that all frames take until the end of a run."""
        return COPIES * file_bytes(self.bodies, self.frames, self.contacts)

    @property
    def bytes_needed(self) -> int:
        """Bytes that a run needs at most."""
        return self.world_bytes + self.record_bytes


@dataclass(frozen=True)
class SceneSize(Size):
    """Of the explicit scheme."""

    bodies: int
    pairs: int
    slots: int  # corners or particles of a pair that can come into contact
    frames: int = 0
    has_particles: bool = False
    contacts: int = 0

    @property
    def world_bytes(self) -> int:
        """As Size."""
        if self.has_particles:
            contacts, candidates = self.slots * PARTICLE_CONTACT.itemsize, self.slots * INDEX
        else:
            contacts, candidates = CONTACTS * CONTACT.itemsize, self.slots
        pair = LISTS * (PAIR.itemsize + candidates) + OPERATORS * OPERATOR.itemsize + contacts
        work = (self.slots + 1) * POINT.itemsize + contacts
        return self.bodies * (BODY.itemsize + OBJECT_BYTES) + self.pairs * pair + work


@dataclass(frozen=True)
class RigidSize(Size):
    """Of the non-smooth scheme."""

    bodies: int
    pairs: int
    frames: int = 0
    contacts: int = 0

    @property
    def world_bytes(self) -> int:
        """As Size."""
        body = BODY.itemsize + LINE.itemsize + BEFORE.itemsize + SPOT.itemsize + 2 * VALUE + OBJECT_BYTES
        pair = ROW.itemsize + KEPT.itemsize + -(-GROUP.itemsize // WIDTH) + -(-BOOK.itemsize // (WIDTH * PART))
        return self.bodies * body + self.pairs * pair


def file_bytes(bodies: int, frames: int, contacts: int = 0) -> int:
    """Return the bytes that frames with so many contacts each take in a file."""
    return frames * VALUE * (FRAME_VALUES + MOTION_VALUES * bodies + CONTACT_VALUES * contacts)


def recorded_contacts(bodies: int, particles: int) -> int:
    """Return how many contacts a frame hardly ever has more of, where they are recorded."""
    return max(CONTACTS_OF_A_BODY * bodies, particles)


def refuse_if_too_large(size: Size) -> None:
    """Raise SceneTooLargeError where a run needs more memory than there is; nothing where that cannot be told."""
    available = available_bytes()
    if available is not None and size.bytes_needed > available:
        raise SceneTooLargeError(size, available)


def readable(count: int) -> str:
    """Return bytes in the largest unit of which there is at least one, such as "3.1 GB"."""
    value, unit = float(count), 0
    while value >= MOST_SHOWN and unit + 1 < len(UNITS):
        value, unit = value / THOUSAND, unit + 1
    return f"{value:.3g} {UNITS[unit]}"


def available_bytes(root: Path = Path("/")) -> int | None:
    """Return the memory (bytes) that a process can still get, or None on a system that does not tell.

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
