"""Frames that no run has made: blocks in rows of ten that topple to the right."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text
from numpy.typing import ArrayLike, NDArray

from blocksim.simulation.trajectory import CONTACT_ROW, SUPPORT, Contacts, Frames

HOSTILE = (
    "<script>alert(1)</script>",
    "$x^2$ \\frac",
    "\u202eright to left \u05e9\u05dc\u05d5\u05dd",
    "\N{GRINNING FACE}" * 40,
    "two\nlines\x07",
    "_hidden",
    "-->",
)


def blocks_at(
    x: ArrayLike,
    y: ArrayLike = 0.0,
    angle: ArrayLike = 0.0,
    *,
    time: ArrayLike | None = None,
    size: tuple[float, float] = (0.032, 0.050),
) -> Frames:
    """Return frames of blocks at these places (steps, blocks), or of one block (steps); a second apart, at rest."""
    x, y, angle = np.broadcast_arrays(*(np.asarray(one, dtype=float) for one in (x, y, angle)))
    x, y, angle = (one.reshape(len(x), -1).copy() for one in (x, y, angle))
    steps, blocks = x.shape
    return Frames(
        step=np.arange(steps),
        time=np.arange(steps, dtype=float) if time is None else np.array(time),
        x=x,
        y=y,
        angle=angle,
        vx=np.zeros_like(x),
        vy=np.zeros_like(x),
        spin=np.zeros_like(x),
        energy={},
        contact_count=np.full(steps, 2.0),
        largest_overlap=np.zeros(steps),
        names=tuple(str(number + 1) for number in range(blocks)),
        size_x=np.full(blocks, size[0]),
        size_y=np.full(blocks, size[1]),
        start_angle=np.zeros(blocks),
    )


def toppling(blocks: int, steps: int = 40, end: float = 0.6) -> Frames:
    """Return blocks in rows of ten that turn to the right, the later the further up; 32 x 50 mm each."""
    time = np.linspace(0.0, end, steps)
    row, column = np.divmod(np.arange(blocks), 10)
    share = (time[:, None] / end) ** 2
    x, y = 0.040 * column + 0.06 * share * (row + 1), 0.025 + 0.05 * row * (1.0 - share)
    frames = blocks_at(x, y, -0.5 * np.pi * share * np.ones(blocks), time=time)
    frames.vx[:], frames.vy[:], frames.spin[:] = 0.25, -0.5, -0.125
    energy = {"kinetic": time, "potential": 3.0 - time, "friction": 0.0 * time, "dashpot": 0.5 * time, "elf": time}
    return replace(frames, energy=energy)


def pressed(frames: Frames, force: float = 2.0) -> Frames:
    """Return the same frames with two contacts of each block with the ground, at its middle and right of it."""
    steps, blocks = frames.x.shape
    rows = np.zeros(2 * steps * blocks, CONTACT_ROW)
    rows["body_a"], rows["body_b"] = np.tile(np.repeat(np.arange(blocks), 2), steps), SUPPORT
    rows["x"] = np.repeat(frames.x.ravel(), 2) + np.tile([0.0, 0.012], steps * blocks)
    rows["normal_y"], rows["normal_force"] = 1.0, force * (1.0 + rows["body_a"])
    rows["shear_force"] = np.tile([0.0, -0.3 * force], steps * blocks)
    return replace(frames, contacts=Contacts(2 * blocks * np.arange(1, steps + 1), rows))


def stacked(blocks: int) -> Frames:
    """Return a tower at rest."""
    frames = toppling(blocks)
    frames.x[:], frames.angle[:] = 0.016, 0.0
    frames.y[:] = 0.025 + 0.05 * np.arange(blocks)
    return frames


def texts_of(figure: Figure) -> list[Text]:
    """Return the texts of a figure that can be seen, numbers of axes and legends included."""
    texts = [text for text in figure.texts if text.get_text() and text.get_visible()]
    return texts + [text for axes in figure.axes for text in texts_in(axes)]


def texts_in(axes: Axes) -> list[Text]:
    """Return the texts of axes that can be seen."""
    legend = axes.get_legend()
    texts = [child for child in axes.get_children() if isinstance(child, Text)]  # titles and what else is written there
    texts += legend.get_texts() if legend else []
    if axes.axison:
        texts += [*_of_axis(axes, "x"), *_of_axis(axes, "y")]
    return [text for text in texts if text.get_text() and text.get_visible()]


def _of_axis(axes: Axes, name: str) -> list[Text]:
    axis = axes.xaxis if name == "x" else axes.yaxis
    if not axis.get_visible():
        return []
    low, high = sorted(axes.get_xlim() if name == "x" else axes.get_ylim())
    ticks = [tick.label1 for tick in axis.get_major_ticks() if low <= tick.get_loc() <= high]
    return [axis.label, *(tick for tick in ticks if tick.get_visible())]


def boxes_of(figure: Figure) -> list[tuple[str, NDArray[np.float64]]]:
    """Return what is written and the box (pixels, left, bottom, right, top) of every text."""
    return [(text.get_text(), np.array(text.get_window_extent().extents)) for text in texts_of(figure)]


def overlapping(figure: Figure) -> list[tuple[str, str]]:
    """Return the pairs of texts that cover each other, and the texts that are cut at the edge beside nothing."""
    boxes = boxes_of(figure)
    found = []
    for index, (one, box) in enumerate(boxes):
        if min(box[0], box[1], figure.bbox.width - box[2], figure.bbox.height - box[3]) < 0.0:
            found.append((one, ""))
        for other, other_box in boxes[index + 1 :]:
            width = min(box[2], other_box[2]) - max(box[0], other_box[0])
            height = min(box[3], other_box[3]) - max(box[1], other_box[1])
            if min(width, height) > 0.0:
                found.append((one, other))
    return found


def polygons(frames: Frames, *shapes: Sequence[tuple[float, float]]) -> Frames:
    """Return the same frames of blocks with these corners (m) about the centroid, taken in turn."""
    own = [shapes[number % len(shapes)] for number in range(len(frames.names))]
    most = max(map(len, own))
    outlines = np.array([[*shape, *[shape[-1]] * (most - len(shape))] for shape in own])
    size_x, size_y = np.ptp(outlines, axis=1).T
    return replace(frames, outlines=outlines, size_x=size_x, size_y=size_y)
