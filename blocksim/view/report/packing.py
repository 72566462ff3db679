"""Numbers as text that a page can carry: base64 of 32-bit floats, or of 16-bit steps where there are many."""

import base64
from typing import Any

import numpy as np
from numpy.typing import NDArray

from blocksim.view.run_data import Floats

EXACT_VALUES = 200_000  # up to so many values are kept as 32-bit floats
LEVELS = 65_535  # steps of a rounded value
SHORT_BYTES = 2


def pack(values: Floats, *, exact: bool = False) -> tuple[dict[str, Any], float]:
    """Return values as base64 text with the range they are rounded in, and the largest error of that.

    Few values, or all with `exact`, become 32-bit floats; many become 16-bit steps between smallest and largest.
    Values that are not finite stay what they are, or become 0 in steps.
    """
    if exact or values.size <= EXACT_VALUES:
        floats = values.astype("<f4")
        return {"type": "f4", "data": _text(floats)}, _largest(floats.astype(float) - values)
    finite = np.nan_to_num(values, nan=0.0, posinf=0.0, neginf=0.0)
    low, high = float(finite.min()), float(finite.max())
    step = (high - low) / LEVELS or 1.0
    steps = np.rint((finite - low) / step).astype("<u2")
    return {"type": "u2", "low": low, "step": step, "data": _text(steps)}, _largest(low + step * steps - values)


def listed(values: Floats) -> list[float]:
    """Return a few values as plain numbers of seven digits."""
    return [float(f"{value:.7g}") for value in values]


def _largest(errors: Floats) -> float:
    finite = np.abs(errors[np.isfinite(errors)])
    return float(finite.max()) if finite.size else 0.0


def _text(values: NDArray[Any]) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii")
