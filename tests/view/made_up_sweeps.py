"""Sweeps that were never run: tables are all that pictures need."""

from itertools import product

import numpy as np
from numpy.typing import NDArray

from blocksim.view.sweeps.data import Input, Measurements, SweepData

Floats = NDArray[np.float64]
REPEATS = np.array([71.69, 76.57, 72.70, 73.22, 73.73, 78.53])


def made_up(inputs: tuple[Input, ...], mode: str = "grid", failed: int = 0, *, measured: bool = True) -> SweepData:
    """Return a sweep of two blocks: the first stays, the second goes as far as the mean of the inputs' ranks says."""
    count = len(inputs[0].values)
    ranks = np.mean([np.argsort(np.argsort(one.values)) / max(count - 1, 1) for one in inputs], axis=0)
    finished = np.arange(count) >= failed
    x = np.where(finished[:, None], np.column_stack([np.full(count, 16.0), 60.0 + 30.0 * ranks]), np.nan)
    turns = np.where(
        finished[:, None], np.column_stack([np.zeros(count), np.where(x[:, 1] > 65.0, -90.0, 0.0)]), np.nan
    )
    inside = (x[:, 1] >= REPEATS.min()) & (x[:, 1] <= REPEATS.max())
    known = Measurements(
        {"1": np.full(6, 16.0), "2": REPEATS}, {"1": (15.5, 16.5), "2": (71.69, 78.53)}, {"2": (67.2, 81.6)}, (0, -90)
    )
    return SweepData(
        "made up", mode, inputs, ("1", "2"), x, turns, finished, inside if measured else None,
        known if measured else Measurements(),
    )  # fmt: skip


def grid(columns: int = 0) -> tuple[Input, ...]:
    """Return friction (7 values) over a stiffness that spans decades (5 values), and a word of `columns` levels."""
    levels = tuple(f"level{number}" for number in range(columns))
    cases = list(product(np.linspace(0.2, 0.4, 7), np.geomspace(1e-3, 1e-1, 5), range(max(columns, 1))))
    friction, scale, word = (np.array(values, dtype=np.float64) for values in zip(*cases, strict=True))
    found = (Input("friction.block_block.static", "", friction), Input("contact.stiffness_scale", "", scale))
    return (*found, Input("blocks.brick.upright", "", word, levels)) if columns else found


def samples(inputs: int = 3, count: int = 50) -> tuple[Input, ...]:
    """Return numbers drawn between 0 and 1, and a word of two levels."""
    drawn = np.random.default_rng(1).random((inputs, count))
    numbers = tuple(Input(f"table.key_{i}", "", values, is_even=True) for i, values in enumerate(drawn))
    return (*numbers, Input("time.scheme", "", (np.arange(count) % 2).astype(np.float64), ("explicit", "nonsmooth")))
