"""Contact forces as arrows: each at its contact point, on the upper block, on a scale that is printed.

A run has few impacts and long rests, and the forces of impacts are many times larger: the scale is that of the forces
most contacts have most of the time, and arrows beyond twice that are cut.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from blocksim.errors import InvalidInputError
from blocksim.simulation.contacts import Contacts, Rows, forces_on_a
from blocksim.view import style
from blocksim.view.panel import Canvas
from blocksim.view.run_data import Floats, FramesLike
from blocksim.view.window import MILLIMETRES

if TYPE_CHECKING:
    from matplotlib.collections import Collection

USUAL = 0.9  # share of all recorded forces that are no larger than the one the scale is made for
USUAL_LENGTH = 0.6  # of the mean side of the blocks: length of the arrow of that force
LONGEST = 2.0  # of that length; longer arrows are cut
_HEAD = 4.0, 1.7  # points: length and half width of a head
LEAST = 0.5  # points; shorter arrows are left out
WIDTH, HALO = 1.1, 2.6  # points: of a shaft, and of the light line below it
WHOLE = 24.0  # points: where the longest arrow is shorter, all of that is smaller in proportion
FORCES, BELOW, VEIL = 3.6, 3.5, 3.4  # order of drawing: above everything else
VEIL_ALPHA = 0.6  # of the white over many small blocks, whose colours would hide small arrows
ROUND = (1.0, 2.0, 5.0, 10.0)
MISSING = (
    "this run has stored no contacts, so their forces cannot be shown; run it again with --set output.contacts=true"
)


class WithContacts(FramesLike, Protocol):
    """Frames that may have contacts."""

    @property
    def contacts(self) -> Contacts | None:
        """Contacts of all frames, where they were recorded."""
        ...


@dataclass(frozen=True)
class ForceScale:
    """Scale of arrows: `mm_per_newton` of the scene, and the length (mm) beyond which they are cut."""

    mm_per_newton: float
    longest: float

    @property
    def explanation(self) -> str:
        """Explanation of the arrows for the reader."""
        most = self.longest / self.mm_per_newton
        return f"Arrows: contact forces, drawn on the upper block; {self.example} long, capped at {most:.3g} N."

    @property
    def example(self) -> str:
        """Length of the arrow of a round force."""
        force = rounded(0.5 * self.longest / self.mm_per_newton)
        return f"{force:g} N is {force * self.mm_per_newton:.3g} mm"


def contacts_of(frames: WithContacts) -> Contacts:
    """Return the contacts of a run. Raises InvalidInputError, with advice, where none were stored."""
    if frames.contacts is None:
        raise InvalidInputError(MISSING)
    return frames.contacts


def force_scale(frames: WithContacts) -> ForceScale:
    """Return the scale for all frames of a run. Raises InvalidInputError where no contacts were stored."""
    force = np.hypot(*forces_on_a(contacts_of(frames).rows).T)
    force = force[np.isfinite(force) & (force > 0.0)]
    usual = float(np.quantile(force, USUAL)) if len(force) else 1.0
    length = USUAL_LENGTH * MILLIMETRES * float(np.mean([frames.size_x.mean(), frames.size_y.mean()]))
    return ForceScale(length / usual, LONGEST * length)


def rounded(value: float) -> float:
    """Return the largest of 1, 2, 5, 10, 20 ... that is not larger."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(part * power for part in ROUND if part * power <= value * (1.0 + 1e-9)))


def pushing_up(rows: Rows, tilt: float) -> Floats:
    """Return the forces (N, (k, 2)) of contacts on the body that they push up in the picture, turned by `tilt`."""
    forces = forces_on_a(rows)
    up = forces @ np.array([np.sin(tilt), np.cos(tilt)])
    return np.asarray(forces * np.where(up < 0.0, -1.0, 1.0)[:, None])


def arrows(rows: Rows, scale: ForceScale, tilt: float) -> Floats:
    """Return start and end (mm, scene, (k, 2, 2)) of the arrow of every contact; those not finite are left out."""
    starts = MILLIMETRES * np.stack([rows["x"], rows["y"]], axis=-1)
    ways = scale.mm_per_newton * pushing_up(rows, tilt)
    shown = np.isfinite(starts).all(axis=1) & np.isfinite(ways).all(axis=1)
    starts, ways = starts[shown], ways[shown]
    lengths = np.hypot(*ways.T)
    ways *= np.minimum(1.0, scale.longest / np.maximum(lengths, 1e-12))[:, None]
    return np.stack([starts, starts + ways], axis=1)


def draw_forces(canvas: Canvas, frames: WithContacts, frame: int, scale: ForceScale) -> None:
    """Draw the forces of all contacts of one frame."""
    found = arrows(contacts_of(frames).at(frame), scale, canvas.extent.tilt)
    size = min(1.0, scale.longest * canvas.points_per_mm / WHOLE)
    if size < 1.0:
        _draw_veil(canvas)
    for part in arrow_parts(found, canvas, size):
        canvas.axes.add_collection(part)


def _draw_veil(canvas: Canvas) -> None:
    """Make everything above the ground paler."""
    from matplotlib.patches import Rectangle

    extent = canvas.extent
    place = (extent.left, extent.lowest), extent.width, extent.top - extent.lowest
    canvas.axes.add_artist(Rectangle(*place, facecolor="#FFFFFF", alpha=VEIL_ALPHA, linewidth=0.0, zorder=VEIL))


def arrow_parts(found: Floats, canvas: Canvas, size: float, colour: str = style.INK) -> "list[Collection]":
    """Return shafts and heads of arrows, with a light line around them that keeps them apart from dark blocks.

    `size` is that of heads and lines over their usual one.
    """
    from matplotlib.collections import LineCollection, PolyCollection

    ways = found[:, 1] - found[:, 0]
    lengths = np.hypot(*ways.T)
    found, ways, lengths = (one[lengths * canvas.points_per_mm >= LEAST] for one in (found, ways, lengths))
    along = ways / lengths[:, None]
    head = np.minimum(size * _HEAD[0] / canvas.points_per_mm, lengths)
    necks = found[:, 1] - head[:, None] * along
    across = np.stack([-along[:, 1], along[:, 0]], axis=-1) * (head * _HEAD[1] / _HEAD[0])[:, None]
    heads = list(np.stack([found[:, 1], necks + across, necks - across], axis=1))
    shafts = list(np.stack([found[:, 0], necks], axis=1))
    at: dict[str, Any] = {"transform": canvas.scene}
    return [
        LineCollection(shafts, colors="#FFFFFF", linewidths=size * HALO, zorder=BELOW, **at),
        PolyCollection(
            heads, facecolors="#FFFFFF", edgecolors="#FFFFFF", linewidths=size * (HALO - WIDTH), zorder=BELOW, **at
        ),
        LineCollection(shafts, colors=colour, linewidths=size * WIDTH, zorder=FORCES, **at),
        PolyCollection(heads, facecolors=colour, linewidths=0.0, zorder=FORCES, **at),
    ]
