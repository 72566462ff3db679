"""Choice of frames of a run."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from blocksim.errors import InvalidInputError

PRINTED_DIGITS = 3  # of a time in s
PRINTED = 0.000501  # s; half of the last digit of a printed time, and round-off
Floats = NDArray[np.float64]
Indices = NDArray[np.intp]


class FramesLike(Protocol):
    """The part of a run's frames that pictures need: n frames of b blocks, SI, counter-clockwise positive."""

    @property
    def time(self) -> Floats:
        """Time of each frame (s), (n,)."""
        ...

    @property
    def x(self) -> Floats:
        """Centres along the ground (m), (n, b)."""
        ...

    @property
    def y(self) -> Floats:
        """Centres above the ground (m), (n, b)."""
        ...

    @property
    def angle(self) -> Floats:
        """Angles of the blocks' own axes (rad), (n, b)."""
        ...

    @property
    def size_x(self) -> Floats:
        """Sizes along the blocks' own x axis (m), (b,)."""
        ...

    @property
    def size_y(self) -> Floats:
        """Sizes along the blocks' own y axis (m), (b,)."""
        ...

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the blocks."""
        ...


BEYOND_REACH = 1e34
"""Metres or radians: ten thousand times the largest simulated value, and finite as 32-bit millimetres."""


def drawable_frames(frames: FramesLike) -> Indices:
    """Return the indices of the frames in which every number is finite (a failed run may end in others).

    Values beyond all reach, as in a damaged file, do not count: millimetres and areas would overflow.
    Raises InvalidInputError when there is none, or no block.
    """
    if len(frames.names) == 0:
        message = "no block to draw"
        raise InvalidInputError(message)
    finite = np.isfinite(frames.time)
    for field in (frames.x, frames.y, frames.angle):
        finite &= (np.abs(field) < BEYOND_REACH).all(axis=1)  # false for what is not finite
    indices = np.flatnonzero(finite)
    if len(indices) == 0:
        message = "no frame to draw"
        raise InvalidInputError(message)
    return indices


def path_travelled(frames: FramesLike, chosen: Indices, carried: Floats | None = None) -> Floats:
    """Return the path (m) up to each chosen frame, summed over the blocks; (len(chosen),), never falling.

    A turn counts as the way of a corner: the angle times half the diagonal. `carried` is how far the support has moved
    along x and y (m) at the chosen frames, (len(chosen), 2): only the way relative to the support counts.
    """
    radius = 0.5 * np.hypot(frames.size_x, frames.size_y)
    places = np.stack([frames.x[chosen], frames.y[chosen]], axis=-1)
    if carried is not None:
        places -= carried[:, None]
    moved = np.hypot(*np.moveaxis(np.diff(places, axis=0), -1, 0))
    turned = radius * np.abs(np.diff(frames.angle[chosen], axis=0))
    return np.concatenate([[0.0], np.cumsum((moved + turned).sum(axis=1))])


def moments_by_motion(frames: FramesLike, chosen: Indices, count: int, carried: Floats | None = None) -> Indices:
    """Return at most `count` of the chosen frames, even in the path travelled, first and last included.

    Even spacing in time would show the release and the rest several times and the impacts hardly. Where
    nothing moves, the first and the last frame are left. `carried` as for `path_travelled`.
    """
    path = path_travelled(frames, chosen, carried)
    wanted = np.linspace(0.0, path[-1], count)[1:-1]
    between = np.searchsorted(path, wanted) if path[-1] > 0.0 else np.array([], dtype=np.intp)
    last = len(chosen) - 1
    return chosen[np.unique(np.concatenate([[0], between, [last]]).astype(np.intp))]


def moments_at(frames: FramesLike, chosen: Indices, times: Sequence[float]) -> Indices:
    """Return, for every time (s), the chosen frame nearest to it.

    The last frame's time as pictures print it, rounded to milliseconds, means the last frame, though it may lie outside
    or another frame may be nearer. Raises InvalidInputError when there is no
    time or one lies outside the recorded span.
    """
    recorded = frames.time[chosen]
    first, last = float(recorded[0]), float(recorded[-1])
    outside = [time for time in times if not first - PRINTED <= time <= last + PRINTED]
    if outside:
        message = f"time {outside[0]:g} s lies outside the recorded span, {first:g} to {last:g} s"
        raise InvalidInputError(message)
    if len(times) == 0:
        message = "no times to draw were given"
        raise InvalidInputError(message)
    wanted = [last if time == round(last, PRINTED_DIGITS) else time for time in times]
    return chosen[[int(np.argmin(np.abs(recorded - time))) for time in wanted]]
