"""Systems beside the blocks, for the player: outlines of their elements over time, in millimetres.

Elements that only move keep one outline and their centres, a tenth of all corners; those that turn or change their
shape keep every corner of every frame.
"""

from typing import Any

import numpy as np

from blocksim.simulation.frames import Frames
from blocksim.view import style
from blocksim.view.paint import ELEMENT_COLOURS, shade_scale
from blocksim.view.report.packing import SHORT_BYTES, pack
from blocksim.view.run_data import Floats, Indices, others_of, outlines_of
from blocksim.view.window import MILLIMETRES
from blocksim.world.systems.system import Track

STEPS = 24  # of the colours of elements: each is one path of the canvas
SAME_SHAPE = 1e-6  # of its size, by which corners of an outline that only moves may be off


def element_bytes(frames: Frames, drawable: Indices) -> int:
    """Return about how many bytes the elements of all systems take in one frame."""
    ends = drawable[[0, -1]]
    tracks = others_of(frames)
    return sum(SHORT_BYTES * (_numbers(track, ends) + len(track.system.shades)) * len(track.names) for track in tracks)


def _numbers(track: Track, ends: Indices) -> int:
    """Return how many numbers an element has in a frame, judged by two of them."""
    outlines = np.concatenate([_outlines(track, frame) for frame in ends])
    return 2 if _only_move(outlines.reshape(len(ends), -1, *outlines.shape[1:])) else 2 * outlines.shape[1]


def _outlines(track: Track, frame: int) -> Floats:
    """Return the outlines (mm) in one frame, (b, k, 2)."""
    return np.asarray(MILLIMETRES * outlines_of(track, np.array([frame]))[0])


def _only_move(outlines: Floats) -> bool:
    """Return True if no element turns or changes its shape, (f, b, k, 2)."""
    shapes = outlines - outlines.mean(axis=2, keepdims=True)
    size = np.ptp(shapes[0], axis=(0, 1)).max(initial=0.0)
    return bool(np.abs(shapes - shapes[:1]).max(initial=0.0) <= SAME_SHAPE * size)


def pack_systems(frames: Frames, kept: Indices) -> list[dict[str, Any]]:
    """Return every system with its name, colour, number of elements and corners, and places in the kept frames.

    `x` and `y` are those of centres (f, b), with a `shape` of one outline for each element, or for all; without it
    those of all corners (f, b, k). `shades` are what elements can be coloured by: labels, values (f, b), and the value
    of the last of the `palette`.
    """
    return [
        {
            "name": track.system.name,
            "colour": style.block_colour(number),
            **_packed(track, kept),
            "shades": [
                {"label": shade.label, "high": shade_scale(shade, values).high, "values": pack(values)[0]}
                for shade in track.system.shades
                for values in [shade.of(track.some(kept))]
            ],
            "palette": palette() if track.system.shades else [],
        }
        for number, track in enumerate(others_of(frames), start=1)
    ]


def palette() -> list[str]:
    """Return the colours of elements, in even steps from none to most."""
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    return [to_hex(colour) for colour in colormaps[ELEMENT_COLOURS](np.linspace(0.0, 1.0, STEPS))]


def _packed(track: Track, kept: Indices) -> dict[str, Any]:
    first = _outlines(track, int(kept[0]))
    sizes = {"count": first.shape[0], "corners": first.shape[1]}
    places = np.empty((len(kept), *first.shape[:1], 2))
    for number, frame in enumerate(kept):
        outlines = _outlines(track, int(frame))
        if not _only_move(np.stack([first, outlines])):
            every = np.stack([_outlines(track, int(one)) for one in kept])
            return {**sizes, "shape": None, **_axes(every)}
        places[number] = outlines.mean(axis=1)
    shapes = first - first.mean(axis=1, keepdims=True)
    is_one = _only_move(np.stack([shapes, np.broadcast_to(shapes[:1], shapes.shape)]))
    return {**sizes, "shape": pack(shapes[:1] if is_one else shapes, exact=True)[0], **_axes(places)}


def _axes(places: Floats) -> dict[str, Any]:
    return {axis: pack(places[..., number])[0] for number, axis in enumerate(("x", "y"))}
