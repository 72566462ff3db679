"""Bitwise comparison of two recordings of the same run."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from blocksim.simulation.frames import CONTACT_ROW, UNITS, Contacts, Floats, Frames, Rows

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
    first = min(_firsts(stored, now, min(counts)), key=lambda one: one.frame, default=None)
    if first is None:
        return Differences(counts)
    places = [_largest(stored, now, min(counts), names) for names in (("x", "y"), ("angle",))]
    return Differences(counts, first, MILLI * places[0], float(np.degrees(places[1])))


def _firsts(stored: Frames, now: Frames, count: int) -> list[FirstDifference]:
    """Return the first difference in each quantity of the first `count` frames."""
    lacking = np.full(count, np.nan)
    found = [
        _first(stored, count, label, getattr(stored, name), getattr(now, name), stored.names, factor)
        for name, (label, factor) in MOTION.items()
    ]
    scene = [
        ("step", stored.step.astype(np.float64), now.step.astype(np.float64)),
        ("time_s", stored.time, now.time),
        *((f"{name}_J", values, now.energy.get(name, lacking)) for name, values in stored.energy.items()),
        ("contact_count", stored.contact_count, now.contact_count),
        ("largest_overlap_mm", MILLI * stored.largest_overlap, MILLI * now.largest_overlap),
    ]
    found += [_first(stored, count, *one) for one in scene]
    for old, new in zip(stored.others, now.others, strict=True):
        for one in old.system.quantities:
            label = f"{old.system.name} {one.name} ({one.unit})"
            found.append(_first(stored, count, label, old[one.name], new[one.name], old.names))
    found.append(_first_in_contacts(stored, now, count))
    return [one for one in found if one is not None]


def _first(
    stored: Frames, count: int, label: str, old: Floats, new: Floats, names: Sequence[str] = (), factor: float = 1.0
) -> FirstDifference | None:
    """Return the first difference of a quantity: of the scene (n,), or of elements with names (n, b)."""
    where = np.argwhere(_is_other(old[:count], new[:count]))
    if not where.size:
        return None
    frame, *element = where[0].tolist()
    values = (factor * float(one[frame, *element]) for one in (old, new))
    name = names[element[0]] if element else None
    return FirstDifference(frame, float(stored.time[frame]), name, label, *values)


def _first_in_contacts(stored: Frames, now: Frames, count: int) -> FirstDifference | None:
    """Return the first frame whose recorded contacts differ; the first one if one recording has none."""
    old, new = stored.contacts, now.contacts
    if old is None or new is None:
        return None if old is new else _in_frame(stored, 0, "recorded_contacts", *map(_number_in_all, (old, new)))
    for frame in range(count):
        tables = (old.at(frame), new.at(frame))
        if len(tables[0]) != len(tables[1]):
            return _in_frame(stored, frame, "recorded_contacts", *map(len, tables))
        if tables[0].tobytes() != tables[1].tobytes():
            return _first_in_tables(stored, frame, *tables)
    return None


def _first_in_tables(stored: Frames, frame: int, old: Rows, new: Rows) -> FirstDifference:
    """Return where two tables of contacts, of as many rows but with other bytes, differ first."""
    names = CONTACT_ROW.names or ()
    columns = {name: (old[name].astype(float), new[name].astype(float)) for name in names}
    row, name = min((int(np.argmax(other)), name) for name in names if (other := _is_other(*columns[name])).any())
    values = (float(one[row]) for one in columns[name])
    return _in_frame(stored, frame, f"contact {row + 1}, {name}{CONTACT_ENDS.get(name, '')}", *values)


def _number_in_all(contacts: Contacts | None) -> float:
    return math.nan if contacts is None else len(contacts.rows)


def _in_frame(stored: Frames, frame: int, quantity: str, old: float, new: float) -> FirstDifference:
    return FirstDifference(frame, float(stored.time[frame]), None, quantity, float(old), float(new))


def _is_other(old: Floats, new: Floats) -> NDArray[np.bool_]:
    """Return where the bits of two arrays differ."""
    return np.not_equal(*(np.ascontiguousarray(one).view(np.uint64) for one in (old, new)), dtype=np.bool_)


def _largest(stored: Frames, now: Frames, count: int, names: tuple[str, ...]) -> float:
    with np.errstate(invalid="ignore"):  # infinity minus infinity
        return max(float(np.max(np.abs(getattr(stored, name)[:count] - getattr(now, name)[:count]))) for name in names)
