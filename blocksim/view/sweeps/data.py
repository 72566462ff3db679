"""A sweep as its pictures need it: inputs with their units and axes, final places of the blocks, measurements."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from blocksim.view.run_data import Flags, Floats

QUARTER = 90.0  # deg
RARE = 5.0  # percent of run-outs at either end that do not make a block worth drawing
MOST_ROWS, MOST_COLUMNS = 4, 4
STAYS_MM = 0.01  # a block whose final x varies less than this is not drawn beside others
DECADES = 30.0  # largest over smallest value from which an axis is logarithmic
NARROW = 1e-2  # span over middle below which an axis shows distances from the middle
LEAST_READABLE = 0.01  # in the typed unit: smaller distances from the middle have a prefix of SI instead
PREFIXED = ("m", "s", "Pa")
PREFIXES = {-9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}


class InputUnit(NamedTuple):
    """The unit in which the user has typed values of a key, and what one of it is in SI."""

    unit: str
    worth: float


@dataclass(frozen=True, eq=False)
class Input:
    """One varied key of n cases: values in SI, or numbers of `levels` where the values are words."""

    key: str
    unit: str  # of SI; empty for plain numbers
    values: Floats  # (n,)
    levels: tuple[str, ...] = ()  # such values cannot be an axis
    is_even: bool = False  # drawn from a range without regard to decades
    typed: InputUnit | None = None  # the unit that the user has typed, if any

    @property
    def count(self) -> int:
        """How many values differ."""
        return len(np.unique(self.values))

    def label(self, value: float) -> str:
        """Return a value as it stands in a label, in the typed unit or else that in which all are best read."""
        if self.levels:
            return self.levels[int(value)]
        factor, unit = scale_of(np.abs(self.values).max(), self.unit, self.typed) if self.unit else (1.0, "")
        return f"{value * factor:.6g}{' ' if unit else ''}{unit}".replace("-", "−")


@dataclass(frozen=True, eq=False)
class Measurements:
    """Measurements of the blocks: repeats of x, limits of inside and prediction (mm), and the class."""

    x_mm: Mapping[str, Floats] = field(default_factory=dict)  # by block, (repeats,)
    limits_mm: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    prediction_mm: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    outcome: tuple[int, ...] | None = None  # rotations of all blocks in degrees, rounded to quarter turns


@dataclass(frozen=True, eq=False)
class SweepData:
    """n cases of a sweep with k inputs and b blocks; numbers of cases that did not finish are NaN."""

    title: str
    mode: str  # of a "grid" every value of a key goes with all values of the others
    inputs: tuple[Input, ...]  # (k,) keys that take more than one value, or the first one
    blocks: tuple[str, ...]  # (b,)
    x_mm: Floats  # (n, b) final centres
    rotation_deg: Floats  # (n, b)
    finished: Flags  # (n,)
    inside: Flags | None = None  # (n,) in all measured ranges; None without an experiment
    measured: Measurements = field(default_factory=Measurements)
    manners: tuple[str, ...] = ()  # (n,) how each case ended, such as `fell`; none where nobody judged it

    @property
    def movers(self) -> list[int]:
        """The numbers of the blocks that are worth drawing."""
        low, high = np.percentile(self.x_mm[self.finished], [RARE, 100.0 - RARE], axis=0)
        return choose_movers(high - low)

    @property
    def outcomes(self) -> list[tuple[int, ...] | None]:
        """The class of every case: final rotations rounded to quarter turns (degrees), None where it did not finish."""
        with np.errstate(invalid="ignore"):
            turns = np.where(self.finished[:, None], np.round(self.rotation_deg / QUARTER), 0.0) * QUARTER
        return [tuple(int(turn) for turn in row) if ok else None for row, ok in zip(turns, self.finished, strict=True)]


def short_names(keys: Sequence[str]) -> list[str]:
    """Return the keys with the shortest ends that distinguish them and name what they are of: "time.end", not "end"."""
    ends = []
    for key in keys:  # the ends of two parts at least, none that begins with a number, the whole last
        parts = key.split(".")
        mine = [".".join(parts[start:]) for start in reversed(range(len(parts))) if not parts[start].isdigit()]
        ends.append(mine[1:] or [key])
    return [next(end for end in mine if sum(end in others for others in ends) == 1 or end == mine[-1]) for mine in ends]


def outcome_label(outcome: tuple[int, ...], most: int = 6) -> str:
    """Write a class: the rotations of a few blocks, or how many of many have turned."""
    if len(outcome) <= most:
        return "/".join(f"{turn}°".replace("-", "−") for turn in outcome)
    return f"{sum(turn != 0 for turn in outcome)} of {len(outcome)} turned"


def percent(share: float) -> str:
    """Write a share, never rounded to 0 or 100 % unless exact."""
    if 0.0 < share < 0.01:
        return f"{100.0 * share:.2g} %"
    return f"{min(round(100.0 * share), 99 if share < 1.0 else 100)} %"


@dataclass(frozen=True)
class ValueAxis:
    """Scale of the values of a key: `(value - middle) * factor`."""

    label: str
    middle: float
    factor: float
    is_log: bool

    def scale(self, values: Floats) -> Floats:
        """Return the numbers on the axis."""
        return (values - self.middle) * self.factor


def choose_movers(spread: Floats) -> list[int]:
    """Return the blocks to draw, in order: those whose final x varies most (mm, (b,)); any where none does."""
    candidates = [int(block) for block in np.argsort(-spread, kind="stable")]
    moving = [block for block in candidates if spread[block] >= STAYS_MM]
    return sorted((moving or candidates)[:MOST_ROWS])


def value_axis(
    values: Floats, key: str, unit: str, *, is_even: bool = False, typed: InputUnit | None = None
) -> ValueAxis:
    """Return the axis for values of a key: over decades (not if spaced evenly), around their middle, or plain."""
    low, high = float(values.min()), float(values.max())
    factor, shown = scale_of(max(abs(low), abs(high)), unit, typed)
    name, middle, is_log = key, 0.0, low > 0.0 and high >= DECADES * low and not is_even
    centre = float(np.median(np.unique(values)))
    if is_log and typed is None:
        factor, shown = 1.0, unit
    if not is_log and 0.0 < high - low < NARROW * abs(centre):
        middle, half = centre, max(high - centre, centre - low)
        other, around = scale_of(abs(middle), unit, typed)
        is_readable = typed is not None and half / typed.worth >= LEAST_READABLE
        factor, shown = scale_of(half, unit, typed if is_readable else None)
        name = f"{key} − {middle * other:.9g} {around}".rstrip()
    return ValueAxis(f"{name} ({shown})" if shown else name, middle, factor, is_log)


def scale_of(size: float, unit: str, typed: InputUnit | None = None) -> tuple[float, str]:
    """Return factor and unit for values in SI: as typed, else as values of this size are best read."""
    if typed is not None:
        return 1.0 / typed.worth, typed.unit
    if unit == "rad":
        return 180.0 / np.pi, "°"
    power = 3 * int(np.floor(np.log10(size) / 3.0)) if size > 0.0 else 0
    if unit in PREFIXED:
        power = min(max(power, min(PREFIXES)), max(PREFIXES))
        return 10.0**-power, PREFIXES[power] + unit
    if power in {-3, 0, 3}:
        return 1.0, unit
    return 10.0**-power, f"10^{power} {unit}".strip()
