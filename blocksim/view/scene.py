"""One moment of a run as a drawing: ground, numbered blocks, measured positions. Millimetres."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from blocksim.view import style
from blocksim.view.moments import Floats, FramesLike, Indices

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MILLIMETRES = 1e3  # per metre
UNIT_CORNERS = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])  # counter-clockwise from lower left
GROUND_THICKNESS = 5.0  # points
EDGE_INSET = 0.86  # where the mark of the upper side runs, as a part of half the height


@dataclass(frozen=True)
class Extent:
    """The part of the plane that is shown (mm)."""

    left: float
    right: float
    bottom: float
    top: float

    @property
    def width(self) -> float:
        """Width (mm)."""
        return self.right - self.left

    @property
    def height(self) -> float:
        """Height (mm)."""
        return self.top - self.bottom


@dataclass(frozen=True)
class MeasuredRange:
    """Measured centre of one block (mm) and the row below the ground it is drawn in."""

    block: str
    mean: float
    minimum: float
    maximum: float
    row: int


def corners(frames: FramesLike, frame: int) -> Floats:
    """Return the corners (mm) of every block in one frame, (b, 4, 2), counter-clockwise."""
    local = UNIT_CORNERS[None] * np.stack([frames.size_x, frames.size_y], axis=-1)[:, None, :]
    return MILLIMETRES * _placed(local, frames, frame)


def extent_of(frames: FramesLike, chosen: Indices) -> Extent:
    """Return what has to be shown so that no block is cut in any chosen frame, with a small margin."""
    cosine, sine = np.abs(np.cos(frames.angle[chosen])), np.abs(np.sin(frames.angle[chosen]))
    reach_x = 0.5 * (cosine * frames.size_x + sine * frames.size_y)
    reach_y = 0.5 * (sine * frames.size_x + cosine * frames.size_y)
    x, y = frames.x[chosen], frames.y[chosen]
    left, right = MILLIMETRES * float((x - reach_x).min()), MILLIMETRES * float((x + reach_x).max())
    bottom = MILLIMETRES * min(float((y - reach_y).min()), 0.0)
    top = MILLIMETRES * float((y + reach_y).max())
    margin = 0.04 * max(right - left, top - bottom)
    return Extent(left - margin, right + margin, bottom - margin, top + margin)


def draw_scene(axes: "Axes", frames: FramesLike, frame: int, extent: Extent, points_per_mm: float) -> None:
    """Draw ground and blocks of one frame, with the blocks' names where there is room for all."""
    from matplotlib.collections import LineCollection, PolyCollection  # noqa: PLC0415 - see style

    outlines = corners(frames, frame)
    fills = [style.block_colour(index) for index in range(len(frames.names))]
    smallest = MILLIMETRES * points_per_mm * float(min(frames.size_x.min(), frames.size_y.min()))
    thin = min(style.LINE_WIDTH, 0.05 * smallest)
    ground = GROUND_THICKNESS / points_per_mm
    axes.fill_between([extent.left, extent.right], -ground, 0.0, color=style.GROUND_COLOUR, linewidth=0)
    axes.axhline(0.0, color=style.INK, linewidth=style.LINE_WIDTH)
    axes.add_collection(PolyCollection(list(outlines), facecolors=fills, edgecolors=style.INK, linewidths=thin))
    axes.add_collection(LineCollection(list(_upper_sides(frames, frame)), colors=style.INK, linewidths=2.0 * thin))
    fonts = _label_fonts(frames, points_per_mm)
    for index, font in enumerate(fonts):
        x, y = outlines[index].mean(axis=0)
        colour = style.text_colour(fills[index])
        name = frames.names[index]
        axes.text(x, y, name, fontsize=font, color=colour, ha="center", va="center_baseline", clip_on=True)


def draw_centres(axes: "Axes", frames: FramesLike, frame: int, points_per_mm: float) -> None:
    """Mark the centre of every block by a line through the ground below it."""
    for x in MILLIMETRES * frames.x[frame]:
        axes.plot([x, x], [-GROUND_THICKNESS / points_per_mm, 0.0], color=style.INK, linewidth=1.2)


def draw_measured(axes: "Axes", measured: list[MeasuredRange], points_per_mm: float, row_height: float) -> None:
    """Draw measured mean and range of each block in rows of `row_height` (points) below the ground."""
    for item in measured:
        y = -(GROUND_THICKNESS + (item.row + 0.6) * row_height) / points_per_mm
        cap = 2.2 / points_per_mm
        colour = style.MEASURED_COLOUR
        axes.plot([item.minimum, item.maximum], [y, y], color=colour, linewidth=1.2)
        for end in (item.minimum, item.maximum):
            axes.plot([end, end], [y - cap, y + cap], color=colour, linewidth=1.2)
        axes.plot(item.mean, y, marker="o", markersize=3.2, color=colour)
        font = style.fitting_font(item.block, (30.0, row_height), 6.0)
        if font:
            axes.annotate(
                item.block,
                (item.maximum, y),
                xytext=(3.0, 0.0),
                textcoords="offset points",
                fontsize=font,
                color=colour,
                va="center",
            )


def _label_fonts(frames: FramesLike, points_per_mm: float) -> list[float]:
    """Return the font size of each block's name; empty when one of them would be unreadable.

    Names on some blocks only would look like a difference between the blocks.
    """
    sizes = MILLIMETRES * points_per_mm * np.minimum(frames.size_x, frames.size_y)
    rooms = [(0.85 * float(size), 0.7 * float(size)) for size in sizes]
    fonts = [style.fitting_font(name, room) for name, room in zip(frames.names, rooms, strict=True)]
    return fonts if all(fonts) else []


def _upper_sides(frames: FramesLike, frame: int) -> Floats:
    """Return a line (mm) inside each block along its own upper side, which shows turns; (b, 2, 2)."""
    half_x, half_y = 0.5 * frames.size_x, 0.5 * frames.size_y
    inset = half_y - (1.0 - EDGE_INSET) * np.minimum(half_x, half_y)
    reach = half_x - (half_y - inset)
    local = np.stack([np.stack([-reach, inset], axis=-1), np.stack([reach, inset], axis=-1)], axis=1)
    return MILLIMETRES * _placed(local, frames, frame)


def _placed(local: Floats, frames: FramesLike, frame: int) -> Floats:
    """Turn and move points given in the blocks' own axes (m), (b, k, 2)."""
    cosine, sine = np.cos(frames.angle[frame])[:, None], np.sin(frames.angle[frame])[:, None]
    x = frames.x[frame][:, None] + cosine * local[..., 0] - sine * local[..., 1]
    y = frames.y[frame][:, None] + sine * local[..., 0] + cosine * local[..., 1]
    return np.stack([x, y], axis=-1)
