"""What a method of sensitivity analysis consists of. All methods work in the unit cube, a dimension a key."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
PURPOSE = "sensitivity"


@dataclass(frozen=True)
class Method:
    """A design of runs in blocks, and the numbers that come from the results of whole blocks.

    `columns` are the names of the numbers of every key, with what they mean. `rows_of_block` gives the runs of a block
    for k keys; blocks do not depend on one another, so some may be left out. `points` (keys, blocks, seed) gives the
    design, shape (blocks * rows, keys), in [0, 1]. `numbers` (points, results, seed) gives the columns, shape (keys,).
    """

    name: str
    title: str
    samples: int
    sample_word: str
    columns: Mapping[str, str]
    rows_of_block: Callable[[int], int]
    points: Callable[[int, int, int], Floats]
    numbers: Callable[[Floats, Floats, int], Mapping[str, Floats]]


def unit_cube(keys: int) -> dict[str, object]:
    """Return what SALib calls a problem."""
    return {"num_vars": keys, "names": [f"u{i}" for i in range(keys)], "bounds": [[0.0, 1.0]] * keys}
