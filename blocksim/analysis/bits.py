"""Bitwise comparison of two recordings of the same run."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from blocksim.simulation.trajectory import CONTACT_ROW, UNITS, Contacts, Floats, Frames

MILLI = 1e3
MOTION = {  # quantity of a frame: its name in tables, and SI -> that unit
    "x": ("x_mm", MILLI),
    "y": ("y_mm", MILLI),
    "angle": ("angle_deg", 180.0 / np.pi),
    "vx": ("vx_mm_s", MILLI),
    "vy": ("vy_mm_s", MILLI),
    "spin": ("spin_deg_s", 180.0 / np.pi),
}
CONTACT_ENDS = {name: f"_{unit}" for name, unit in UNITS.items() if unit != "1"}


@dataclass(frozen=True)
class FirstDifference:
    """First difference of two recordings: frame (from 0), time, block (none: the whole scene) and quantity."""

    frame: int
    time: float  # s
    block: str | None
    quantity: str
    stored: float
    now: float


@dataclass(frozen=True)
class Differences:
    """Differences of two recordings; none if `is_none`."""

    frames: tuple[int, int]  # how many the stored one has, and the new one
    first: FirstDifference | None = None
    largest_mm: float = 0.0  # of all centres in all frames that both have
    largest_deg: float = 0.0  # of all angles, in the same

    @property
    def is_none(self) -> bool:
        """Return True if all frames are bit-identical."""
        return self.first is None and self.frames[0] == self.frames[1]


def differences(stored: Frames, now: Frames) -> Differences:
    """Compare all numbers of all frames of the same blocks, recorded contacts with their forces included.

    A difference in the sign of zero counts as one. Differences of positions are those of the frames that both have, NaN
    where a state is not finite.
    """
    counts = (len(stored), len(now))
    first = min(_first_of_each(stored, now, min(counts)), key=lambda one: one.frame, default=None)
    if first is None:
        return Differences(counts)
    with np.errstate(invalid="ignore"):  # infinity minus infinity
        x, y, angle = (
            float(np.max(np.abs(getattr(stored, name)[: min(counts)] - getattr(now, name)[: min(counts)])))
            for name in ("x", "y", "angle")
        )
    return Differences(counts, first, MILLI * max(x, y), float(np.degrees(angle)))


def _first_of_each(stored: Frames, now: Frames, count: int) -> Iterator[FirstDifference]:
    """Yield the first difference in each quantity of the first `count` frames."""
    lacking = np.full(count, np.nan)
    quantities: list[tuple[str, Floats, Floats, Sequence[str], float]] = [
        (label, getattr(stored, name), getattr(now, name), stored.names, factor)
        for name, (label, factor) in MOTION.items()
    ]
    scene = (
        ("step", stored.step.astype(np.float64), now.step.astype(np.float64)),
        ("time_s", stored.time, now.time),
        *((f"{name}_J", values, now.energy.get(name, lacking)) for name, values in stored.energy.items()),
        ("contact_count", stored.contact_count, now.contact_count),
        ("largest_overlap_mm", MILLI * stored.largest_overlap, MILLI * now.largest_overlap),
    )
    quantities += [(*one, (), 1.0) for one in scene]
    for old, new in zip(stored.others, now.others, strict=True):
        for one in old.system.quantities:
            label = f"{old.system.name} {one.name} ({one.unit})"
            quantities.append((label, old[one.name], new[one.name], old.names, 1.0))
    for label, before, after, names, factor in quantities:  # of the scene (n,), or of elements with names (n, b)
        where = np.argwhere(_is_other(before[:count], after[:count]))
        if where.size:
            frame, *element = where[0].tolist()
            values = (factor * float(one[frame, *element]) for one in (before, after))
            name = names[element[0]] if element else None
            yield FirstDifference(frame, float(stored.time[frame]), name, label, *values)
    found = _first_in_contacts(stored.contacts, now.contacts, count)
    if found is not None:
        frame, label, *ends = found
        yield FirstDifference(frame, float(stored.time[frame]), None, label, *map(float, ends))


def _first_in_contacts(
    stored: Contacts | None, now: Contacts | None, count: int
) -> tuple[int, str, float, float] | None:
    """Return the first frame whose recorded contacts differ, in what, and both values.

    The first one if one recording has none.
    """
    if stored is None or now is None:
        before, after = (math.nan if one is None else len(one.rows) for one in (stored, now))
        return None if stored is now else (0, "recorded_contacts", before, after)
    for frame in range(count):
        old, new = stored.at(frame), now.at(frame)
        if len(old) != len(new):
            return frame, "recorded_contacts", len(old), len(new)
        if old.tobytes() != new.tobytes():
            columns = {name: (old[name].astype(float), new[name].astype(float)) for name in CONTACT_ROW.names or ()}
            others = {name: _is_other(*ends) for name, ends in columns.items()}
            row, name = min((int(np.argmax(other)), name) for name, other in others.items() if other.any())
            label = f"contact {row + 1}, {name}{CONTACT_ENDS.get(name, '')}"
            return frame, label, columns[name][0][row], columns[name][1][row]
    return None


def _is_other(old: Floats, new: Floats) -> NDArray[np.bool_]:
    """Return where the bits of two arrays differ."""
    return np.not_equal(*(np.ascontiguousarray(one).view(np.uint64) for one in (old, new)), dtype=np.bool_)
