"""Data of a picture of a sweep: the inputs of every case, and the final places of its blocks."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from blocksim.view.series import Typed, most_moving, scale_of

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
QUARTER = 90.0  # deg
RARE = 5.0  # percent of run-outs at either end that do not make a block worth drawing


@dataclass(frozen=True, eq=False)
class Input:
    """One varied key of n cases: values in SI, or numbers of `levels` where the values are words."""

    key: str
    unit: str  # of SI; empty for plain numbers
    values: Floats  # (n,)
    levels: tuple[str, ...] = ()
    is_even: bool = False  # drawn from a range without regard to decades
    typed: Typed | None = None  # the unit that the user has typed, if any

    @property
    def is_number(self) -> bool:
        """Whether the values can be an axis."""
        return not self.levels

    @property
    def count(self) -> int:
        """How many values differ."""
        return len(np.unique(self.values))

    def told(self, value: float) -> str:
        """Return a value as it stands in a label, in the typed unit or else that in which all are best read."""
        if self.levels:
            return self.levels[int(value)]
        factor, unit = scale_of(np.abs(self.values).max(), self.unit, self.typed) if self.unit else (1.0, "")
        return f"{value * factor:.6g}{' ' if unit else ''}{unit}".replace("-", "−")


@dataclass(frozen=True, eq=False)
class Measured:
    """Measurements of the blocks: repeats of x, limits of inside and prediction (mm), and the class."""

    x_mm: Mapping[str, Floats] = field(default_factory=dict)  # by block, (repeats,)
    limits_mm: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    prediction_mm: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    outcome: tuple[int, ...] | None = None  # rotations of all blocks in degrees, rounded to quarter turns

    def range_of(self, block: str) -> tuple[float, float] | None:
        """Return the smallest and largest repeat (mm), None where there is none."""
        repeats = self.x_mm.get(block)
        return None if repeats is None else (float(repeats.min()), float(repeats.max()))


@dataclass(frozen=True, eq=False)
class FoundSweep:
    """n cases of a sweep with k inputs and b blocks; numbers of cases that did not finish are NaN."""

    title: str
    mode: str
    inputs: tuple[Input, ...]  # (k,) keys that take more than one value, or the first one
    blocks: tuple[str, ...]  # (b,)
    x_mm: Floats  # (n, b) final centres
    rotation_deg: Floats  # (n, b)
    finished: Flags  # (n,)
    inside: Flags | None = None  # (n,) in all measured ranges; None without an experiment
    measured: Measured = field(default_factory=Measured)

    @property
    def is_sampled(self) -> bool:
        """Whether values were drawn, so that shares of cases are probabilities."""
        return self.mode in {"lhs", "sobol", "normal"}

    @property
    def is_grid(self) -> bool:
        """Whether every value of a key goes with all values of the others."""
        return self.mode == "grid"

    @property
    def moving(self) -> list[int]:
        """The numbers of the blocks that are worth drawing."""
        low, high = np.percentile(self.x_mm[self.finished], [RARE, 100.0 - RARE], axis=0)
        return most_moving(high - low)

    @property
    def outcomes(self) -> list[tuple[int, ...] | None]:
        """The class of every case: final rotations rounded to quarter turns (degrees), None where it did not finish."""
        with np.errstate(invalid="ignore"):
            turns = np.where(self.finished[:, None], np.round(self.rotation_deg / QUARTER), 0.0) * QUARTER
        return [tuple(int(turn) for turn in row) if ok else None for row, ok in zip(turns, self.finished, strict=True)]


def short_names(keys: Sequence[str]) -> list[str]:
    """Return the keys with the shortest ends that distinguish them."""
    ends = [_ends(key) for key in keys]
    return [next(end for end in mine if sum(end in others for others in ends) == 1 or end == mine[-1]) for mine in ends]


def told_outcome(outcome: tuple[int, ...], most: int = 6) -> str:
    """Write a class: the rotations of a few blocks, or how many of many have turned."""
    if len(outcome) <= most:
        return "/".join(f"{turn}°".replace("-", "−") for turn in outcome)
    return f"{sum(turn != 0 for turn in outcome)} of {len(outcome)} turned"


def _ends(key: str) -> list[str]:
    parts = key.split(".")
    return [".".join(parts[start:]) for start in reversed(range(len(parts)))]
