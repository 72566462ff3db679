"""One panel of a picture of blocks: its x axis, the rows below its ground, and a page that holds nothing else."""

from dataclasses import dataclass, replace

import numpy as np

from blocksim.view import style
from blocksim.view.ground import GROUND_THICKNESS, RULER_HEIGHT, Canvas
from blocksim.view.window import Extent

TICK_ROOM = 0.4  # inches along the axis for one number
ROW_HEIGHT = 9.0  # points, of one row of measured ranges


@dataclass(frozen=True)
class Page:
    """A page with one panel as wide as the page allows, in inches; `points_per_mm` is the panel's scale."""

    width: float
    height: float
    panel_height: float
    side: float
    foot: float
    points_per_mm: float
    extent: Extent

    @property
    def panel_width(self) -> float:
        """Width of the panel."""
        return self.width - 2.0 * self.side

    @property
    def place(self) -> tuple[float, float, float, float]:
        """Return left, bottom, width, height of the panel as parts of the page."""
        across, up = self.width, self.height
        return self.side / across, self.foot / up, self.panel_width / across, self.panel_height / up


def page_for(extent: Extent, width: float, tallest: float, margins: tuple[float, float, float]) -> Page:
    """Return a page of this width for an extent, which is widened where the panel would be higher than `tallest`.

    `margins` are those at the sides, above and below the panel. All in inches.
    """
    side, head, foot = margins
    across = width - 2.0 * side
    missing = max(extent.height * across / tallest - extent.width, 0.0)
    extent = replace(extent, left=extent.left - 0.5 * missing, right=extent.right + 0.5 * missing)
    scale = across / extent.width  # inches per mm
    below = max((extent.lowest - extent.bottom) * scale, room_below(extent, 0) / style.POINTS_PER_INCH)
    panel_height = (extent.top - extent.lowest) * scale + below
    height = head + panel_height + foot
    return Page(width, height, panel_height, side, foot, scale * style.POINTS_PER_INCH, extent)


def depth_of(rows: int) -> float:
    """Return how far rows of measured ranges reach below the lowest ground (points)."""
    return GROUND_THICKNESS + (rows + 0.4) * ROW_HEIGHT


def room_below(extent: Extent, rows: int) -> float:
    """Return how far the picture continues below the lowest ground (points)."""
    depth = depth_of(rows)
    return (depth + RULER_HEIGHT) / float(np.cos(extent.tilt)) if extent.tilt else depth


def finish_panel(canvas: Canvas, size: tuple[float, float], *, labelled: bool) -> None:
    """Fix the scale of a panel of this size (inches) and leave only its x axis; tilted ground has its own ruler."""
    from matplotlib.ticker import MaxNLocator  # noqa: PLC0415 - see style

    axes, extent = canvas.axes, canvas.extent
    axes.set_xlim(extent.left, extent.right)
    axes.set_ylim(extent.top - size[1] * style.POINTS_PER_INCH / canvas.points_per_mm, extent.top)
    axes.spines[["left", "right", "top"]].set_visible(False)
    axes.yaxis.set_visible(False)
    axes.xaxis.set_major_locator(MaxNLocator(nbins=max(2, int(size[0] / TICK_ROOM)), steps=[1, 2, 5, 10]))
    axes.tick_params(axis="x", length=2.5, pad=1.5)
    axes.xaxis.set_visible(not extent.tilt)
    axes.spines["bottom"].set_visible(not extent.tilt)
    if labelled:
        axes.set_xlabel("x (mm)", labelpad=1.0)
