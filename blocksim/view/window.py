"""The part of the plane that a strip shows: the reach of all blocks, and the support near them. Millimetres.

Gravity points down in pictures: where the ground is tilted, all that is drawn is turned by the tilt. "Picture" means
the turned axes, "scene" those of the scenario, with x along the ground.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario.segments import ENDLESS
from blocksim.view.run_data import Floats, FramesLike, Indices, Support, others_of, outlines_of
from blocksim.world.systems.blocks import boxes_around

Flags = NDArray[np.bool_]
MILLIMETRES = 1e3  # per metre
MARGIN = 0.04  # of the larger side, around everything
FEW_LEFT_OUT, MANY = (
    0.05,
    20,
)  # share of the blocks that may be left out of an animation's window; number of many blocks
GAP, WIDE_GAP = 0.2, 1.5  # over the reach of all others: how far off a block has to be, of many and of few
LEAST_TOGETHER = 3  # blocks, of which one can be far from the others
NEAR = 0.15  # of a side: what of the support is this near is shown as well; at least the largest block's diagonal


@dataclass(frozen=True)
class Extent:
    """The part of the picture that is shown (mm).

    `base` is the lowest ground in it (mm, scene); the ground is drawn down to a little below. The picture is turned
    against the scene by `tilt` (rad).
    """

    left: float
    right: float
    bottom: float
    top: float
    base: float = 0.0
    tilt: float = 0.0

    @property
    def width(self) -> float:
        """Width (mm)."""
        return self.right - self.left

    @property
    def height(self) -> float:
        """Height (mm)."""
        return self.top - self.bottom

    @property
    def lowest(self) -> float:
        """Where a line along the ground through `base` is lowest in the picture (mm)."""
        return self.base / float(np.cos(self.tilt)) + min(self.left * self._slope, self.right * self._slope)

    def span(self, y: float) -> tuple[float, float]:
        """Return from which to which x a line along the ground at height y can be seen (mm, scene)."""
        cosine, shift = float(np.cos(self.tilt)), float(np.sin(self.tilt)) * y
        return (self.left + shift) / cosine, (self.right + shift) / cosine

    @property
    def _slope(self) -> float:
        return float(np.tan(self.tilt))


def extent_of(
    frames: FramesLike, chosen: Indices, support: Support | None = None, blocks: Flags | None = None
) -> Extent:
    """Return the extent in which no block, and no other system, is cut in any chosen frame, with a small margin.

    The ground below every block is shown, and the corners of the ground and the walls that are near. `blocks` (b,)
    selects the blocks that count, by default all.
    """
    support = support or Support()
    reached = _reached(frames, chosen, support)
    if blocks is not None:
        reached = reached[:, blocks]
    others = [turned(outlines_of(one, chosen), support.tilt).reshape(-1, 2) for one in others_of(frames)]
    reached = np.concatenate([reached.reshape(-1, 2), *others])
    low, high = reached.min(axis=0), reached.max(axis=0)
    shifts = _extreme_offsets(frames, chosen, support)
    diagonal = float(np.hypot(frames.size_x, frames.size_y).max(initial=0.0))
    reach = np.maximum(diagonal, NEAR * (high - low))
    points = np.concatenate([[low, high], _near(support, shifts, low - reach, high + reach)])
    low, high = points.min(axis=0), points.max(axis=0)
    margin = MARGIN * float((high - low).max())
    low, high = low - margin, high + margin
    (left, bottom), (right, top) = MILLIMETRES * low, MILLIMETRES * high
    extent = Extent(float(left), float(right), float(bottom), float(top), tilt=support.tilt)
    return replace(extent, base=MILLIMETRES * _lowest_ground(support, shifts, low, high))


def together(frames: FramesLike, chosen: Indices, support: Support | None = None) -> Flags:
    """Return True for every block that stays with the others, (b,); those that fly far off would make a window vast.

    Far off is what leaves a gap to the reach of all others, to a side or upwards, of a fifth of their width or height;
    with few blocks, of which each matters, of one and a half times that. At most a twentieth of the blocks are left
    out, or one, and never a fixed one; of two, each as far from the other, none.
    """
    count = len(frames.names)
    if count < LEAST_TOGETHER:
        return np.ones(count, dtype=bool)
    support = support or Support()
    reached = _reached(frames, chosen, support)
    low, high = reached.min(axis=0), reached.max(axis=0)
    most, share = max(1, int(FEW_LEFT_OUT * count)), GAP if count >= MANY else WIDE_GAP
    stays = np.ones(count, dtype=bool)
    for reach, other in ((high[:, 0], low[:, 0]), (-low[:, 0], -high[:, 0]), (high[:, 1], low[:, 1])):
        order = np.argsort(reach, kind="stable")
        for last in range(max(count - most, 1), count):
            near, far = order[:last], order[last:]
            if stays[far].sum() + (~stays).sum() > most:
                continue
            if reach[far[0]] - reach[near].max() > share * float(reach[near].max() - other[near].min()):
                stays[far] = False
                break
    return np.asarray(stays | np.array(support.fixed or (False,) * count, dtype=bool))


def turned(points: Floats, angle: float) -> Floats:
    """Return points (..., 2) turned counter-clockwise about the origin by an angle (rad)."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.asarray(points @ np.array([[cosine, sine], [-sine, cosine]]))


def parts_within(line: Floats, low: Floats, high: Floats) -> Floats:
    """Return the parts (m, 2, 2) of a line's straight pieces that lie within a box; after Liang and Barsky (1984)."""
    starts, ways = line[:-1], np.diff(line, axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = np.stack([(low - starts) / ways, (high - starts) / ways])
    enter = np.fmin(*shares).max(axis=1).clip(min=0.0)
    leave = np.fmax(*shares).min(axis=1).clip(max=1.0)
    ends = starts[:, None] + ways[:, None] * np.stack([enter, leave], axis=1)[:, :, None].clip(0.0, 1.0)
    return np.asarray(ends[enter <= leave])


def _reached(frames: FramesLike, chosen: Indices, support: Support) -> Floats:
    """Return points (m, picture) around all that each block and the ground below it take up, (3 n, b, 2)."""
    x = frames.x[chosen]
    centres = np.stack([x, frames.y[chosen]], axis=-1)
    offsets = support.offset(frames.time[chosen])[:, None]
    below = np.stack([x, support.height(x - offsets[..., 0]) + offsets[..., 1]], axis=-1)
    centres, below = turned(centres, support.tilt), turned(below, support.tilt)
    angle = frames.angle[chosen] + support.tilt
    if frames.outlines is not None:
        return np.concatenate([*boxes_around(frames.outlines, centres[..., 0], centres[..., 1], angle), below])
    cosine, sine = np.abs(np.cos(angle)), np.abs(np.sin(angle))
    wide = cosine * frames.size_x + sine * frames.size_y
    tall = sine * frames.size_x + cosine * frames.size_y
    half = 0.5 * np.stack([wide, tall], axis=-1)
    return np.concatenate([centres - half, centres + half, below])


def _extreme_offsets(frames: FramesLike, chosen: Indices, support: Support) -> Floats:
    """Return the support's places (m) at its start and farthest to either side, (k, 2)."""
    displacement = support.displacement(frames.time[chosen])
    farthest = np.unique([0.0, displacement.min(), displacement.max()])
    return np.asarray(np.multiply.outer(farthest, support.direction))


def _near(support: Support, shifts: Floats, low: Floats, high: Floats) -> Floats:
    """Return the corners of the ground and the ends of the walls' parts (m, picture) that lie within a box."""
    found = [np.zeros((0, 2))]
    for shift in shifts:
        corners = turned(support.corners() + shift, support.tilt)
        found.append(corners[((low <= corners) & (corners <= high)).all(axis=1)])
        for wall in support.walls:
            line = turned(np.array([[wall.x0, wall.y0], [wall.x1, wall.y1]]) + shift, support.tilt)
            found.append(parts_within(line, low, high).reshape(-1, 2))
    return np.concatenate(found)


def _lowest_ground(support: Support, shifts: Floats, low: Floats, high: Floats) -> float:
    """Return the least height (m, scene) of the ground within a box of the picture."""
    line = support.line(ENDLESS)
    parts = [parts_within(turned(line + shift, support.tilt), low, high).reshape(-1, 2) for shift in shifts]
    return float(turned(np.concatenate(parts), -support.tilt)[:, 1].min())
