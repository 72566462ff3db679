"""One panel of a picture of blocks: canvas, x axis, ruler of tilted ground, and a page that holds nothing else."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from blocksim.view import style
from blocksim.view.run_data import Floats
from blocksim.view.window import Extent, turned

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.transforms import Transform

GROUND_THICKNESS = 5.0  # points, below the lowest ground
RULER_EDGE = 10.0  # points; no number is nearer to the edge of a panel
TICK_SPACING = 36.0  # points along the ruler
TICK_LENGTH = 2.5  # points
RULER_HEIGHT = 14.0  # points, with the numbers
TICK_ROOM = 0.4  # inches along the axis for one number
ROW_HEIGHT = 9.0  # points, of one row of measured ranges


@dataclass(frozen=True)
class Canvas:
    """Canvas of one moment: axes in the picture's millimetres, all on one scale."""

    axes: "Axes"
    extent: Extent
    points_per_mm: float

    @cached_property
    def scene(self) -> "Transform":
        """From the scene's millimetres to the paper."""
        from matplotlib.transforms import Affine2D

        return Affine2D().rotate(self.extent.tilt) + self.axes.transData

    @property
    def floor(self) -> float:
        """Where the drawn ground ends (mm, scene)."""
        return self.extent.base - GROUND_THICKNESS / self.points_per_mm

    def box(self) -> tuple[Floats, Floats]:
        """Return lower left and upper right (mm, scene) of all that can be seen, and a little more."""
        sides, ends = (self.extent.left, self.extent.right), (self.extent.lowest, self.extent.top)
        corners = turned(np.array([[x, y] for x in sides for y in ends]), -self.extent.tilt)
        more = 0.1 * (self.extent.width + self.extent.height)
        low, high = corners.min(axis=0) - more, corners.max(axis=0) + more
        return np.array([low[0], self.floor]), high


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
    from matplotlib.ticker import MaxNLocator

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


def draw_ruler(canvas: Canvas, depth: float) -> None:
    """Draw numbers of x (mm) along tilted ground, `depth` (points) below its lowest part."""
    from matplotlib.ticker import MaxNLocator

    y = canvas.extent.base - depth / canvas.points_per_mm
    low, high = canvas.extent.span(y)
    edge = RULER_EDGE / canvas.points_per_mm
    room = (high - low) * canvas.points_per_mm
    locator = MaxNLocator(nbins=max(2, int(room / TICK_SPACING)), steps=[1, 2, 5, 10])
    tick = TICK_LENGTH / canvas.points_per_mm
    canvas.axes.plot([low, high], [y, y], color=style.FAINT_INK, linewidth=style.LINE_WIDTH, transform=canvas.scene)
    ticks = [float(x) for x in locator.tick_values(low, high) if low + edge <= x <= high - edge]
    for x in ticks:
        colour, width = style.FAINT_INK, style.LINE_WIDTH
        canvas.axes.plot([x, x], [y - tick, y], color=colour, linewidth=width, transform=canvas.scene)
        _write_number(canvas, x, y - 1.6 * tick, " mm" if x == ticks[-1] else "")


def _write_number(canvas: Canvas, x: float, y: float, unit: str) -> None:
    """Write a number, with its unit if any, below (x, y), along the ground."""
    canvas.axes.text(
        x,
        y,
        f"{x:g}{unit}".replace("-", "−"),
        rotation=float(np.degrees(canvas.extent.tilt)),
        rotation_mode="anchor",
        ha="center",
        va="top",
        transform=canvas.scene,
    )
