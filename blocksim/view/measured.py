"""Measured means and ranges below a picture of the final state, and the room that they take."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Protocol

import numpy as np

from blocksim.view.scene import MeasuredRange
from blocksim.view.window import Extent

if TYPE_CHECKING:
    import pandas as pd

NARROWEST = 0.35  # width over height
RANGE_GAP = 0.06  # part of the width that two measured ranges in one row keep apart


class MeasuredTable(Protocol):
    """The part of a measured table that pictures need."""

    def statistics(self) -> "pd.DataFrame":
        """Return one row a block and quantity: block, quantity, mean, minimum, maximum (mm), ..."""
        ...


def measured_ranges(measured: MeasuredTable, names: Sequence[str], width: float) -> list[MeasuredRange]:
    """Return the measured centres (mm) of the blocks, in rows without overlap; `width` (mm) is shown."""
    statistics = measured.statistics()
    centres = statistics[(statistics["quantity"] == "x") & statistics["block"].isin(names)]
    row_ends: list[float] = []
    ranges = []
    for line in centres.sort_values("minimum", kind="stable").itertuples():
        mean, minimum, maximum = (float(getattr(line, key)) for key in ("mean", "minimum", "maximum"))
        row = next((row for row, end in enumerate(row_ends) if end < minimum), len(row_ends))
        row_ends[row : row + 1] = [maximum + RANGE_GAP * width]
        ranges.append(MeasuredRange(str(line.block), mean, minimum, maximum, row))
    return ranges


def rows_of(ranges: Sequence[MeasuredRange]) -> int:
    """Return the number of rows that measured ranges take."""
    return 1 + max((item.row for item in ranges), default=-1)


def widened(extent: Extent, ranges: Sequence[MeasuredRange]) -> Extent:
    """Return an extent that also holds the measured ranges, and is wide enough for the time above a tower."""
    margin = RANGE_GAP * extent.width
    missing = max(NARROWEST * extent.height - extent.width, 0.0)
    cosine, shift = float(np.cos(extent.tilt)), extent.base * float(np.sin(extent.tilt))
    left = min([extent.left - 0.5 * missing, *(cosine * item.minimum - shift - 0.5 * margin for item in ranges)])
    right = max([extent.right + 0.5 * missing, *(cosine * item.maximum - shift + margin for item in ranges)])
    return replace(extent, left=left, right=right)
