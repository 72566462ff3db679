"""What compiled code does with lanes, as Python does it: four numbers are a numpy array.

Most functions take `lane` first: None for all four at once, or the number of the lane that is meant, so that one source
serves four rows and a single one.
"""

from typing import Any

import numpy as np

from blocksim.kernels.common.arrays import Records

WIDTH = 4  # numbers in a register
Lanes = Any  # (4,) float64
Mask = Any  # (4,) bool
Places = Any  # numbers of four records: a field of four or a tuple
Lane = Any  # None where a function is to deal with all lanes of a group at once; else the number of one


def spread(number: float) -> Lanes:
    """Return one number in all lanes."""
    return np.full(WIDTH, number)


def select(mask: Mask, yes: Lanes, no: Lanes) -> Lanes:
    """Return one or the other in every lane, or of two single numbers."""
    chosen: Any = np.where(mask, yes, no)
    return chosen[()]


def branch(mask: Mask, yes: Lanes, no: Lanes) -> Lanes:
    """Return the same as `select`; of two single numbers by a branch.

    What the processor predicts, it does not wait for: worth it where the flag is known late and seldom changes.
    """
    return select(mask, yes, no)


def greater(x: Lanes, y: Lanes) -> Lanes:
    """Return the greater number in every lane, or of two single numbers; the second where they do not compare."""
    return select(x > y, x, y)


def lesser(x: Lanes, y: Lanes) -> Lanes:
    """Return the lesser number in every lane, or of two single numbers; the second where they do not compare."""
    return select(x < y, x, y)


def root(x: Lanes) -> Lanes:
    """Return the square root in every lane, or of a single number."""
    found: Any = np.sqrt(x)
    return found


def is_all(mask: Mask) -> bool:
    """Return True if all flags are set, or a single one."""
    return bool(np.all(mask))


def split(x: Lanes) -> tuple[float, float, float, float]:
    """Return the numbers in the lanes, or a single one four times."""
    return tuple(np.broadcast_to(x, WIDTH))


def four(lane: Lane, one: float, two: float, three: float, last: float) -> Lanes:
    """Return four numbers as lanes, or the first of them where a single lane is meant."""
    return np.array([one, two, three, last]) if lane is None else one


def load(lane: Lane, field: Any) -> Lanes:
    """Return the numbers in a field of four, or the one of a lane."""
    return np.array(field) if lane is None else field[lane]


def store(lane: Lane, field: Any, x: Lanes) -> None:
    """Write a field of four numbers, or the one of a lane."""
    field[slice(None) if lane is None else lane] = x


def _fields(lane: Lane, records: Records, places: Places, first: int) -> tuple[Lanes, ...]:
    of = [records[place] for place in (places if lane is None else places[lane : lane + 1])]
    columns = [np.array([float(one[k]) for one in of]) for k in range(first, first + WIDTH)]
    return tuple(column if lane is None else column[0] for column in columns)


def fields_0(lane: Lane, records: Records, places: Places) -> tuple[Lanes, Lanes, Lanes, Lanes]:
    """Return the first four fields, all doubles, of the records at four places."""
    return _fields(lane, records, places, 0)


def fields_4(lane: Lane, records: Records, places: Places) -> tuple[Lanes, Lanes, Lanes, Lanes]:
    """Return the next four fields of the records at four places."""
    return _fields(lane, records, places, 4)


def fields_8(lane: Lane, records: Records, places: Places) -> tuple[Lanes, Lanes, Lanes, Lanes]:
    """Return the four fields after those of the records at four places."""
    return _fields(lane, records, places, 8)


def fields_12(lane: Lane, records: Records, places: Places) -> tuple[Lanes, Lanes, Lanes, Lanes]:
    """Return the four fields after those of the records at four places; what is no double there makes no sense."""
    return _fields(lane, records, places, 12)


def fields_16(lane: Lane, records: Records, places: Places) -> tuple[Lanes, Lanes, Lanes, Lanes]:
    """Return four fields of the records at four places, from the seventeenth on."""
    return _fields(lane, records, places, 16)


def _write(lane: Lane, records: Records, places: Places, mask: Mask, columns: tuple[Lanes, ...], first: int) -> None:
    for k in range(WIDTH) if lane is None else [lane]:
        if np.atleast_1d(mask)[k if lane is None else 0]:
            for place, column in enumerate(columns, first):
                records[places[k]][place] = np.atleast_1d(column)[k if lane is None else 0]


def write_fields_0(lane: Lane, records: Records, places: Places, mask: Mask, columns: tuple[Lanes, ...]) -> None:
    """Write the first four fields, all doubles, of the records at four places; of those whose flag is set."""
    _write(lane, records, places, mask, columns, 0)


def write_fields_4(lane: Lane, records: Records, places: Places, mask: Mask, columns: tuple[Lanes, ...]) -> None:
    """Write the next four fields."""
    _write(lane, records, places, mask, columns, 4)


def write_fields_8(lane: Lane, records: Records, places: Places, mask: Mask, columns: tuple[Lanes, ...]) -> None:
    """Write the four fields after those."""
    _write(lane, records, places, mask, columns, 8)
