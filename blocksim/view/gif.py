"""GIF: animations that every browser and every office program shows."""

from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from blocksim.errors import InvalidInputError
from blocksim.simulation.atomic import write_bytes
from blocksim.simulation.own_files import NAME

if TYPE_CHECKING:
    from PIL.Image import Image

TICK = 0.01  # s, of a GIF's clock
SHORTEST = 2  # ticks; browsers slow down what is shorter
COLOURS = 128
FILLS, SHARES = 16, np.array([[0.2], [0.4], [0.6], [0.8]])  # so many colours get so many shades
UNKNOWN = 255
Pixels = NDArray[np.uint8]  # (height, width, 3)
MOST_BYTES = 1 << 30  # of all pictures together, which Pillow keeps in memory


def write_gif(path: Path, pictures: Iterator[Pixels], seconds: NDArray[np.float64]) -> None:
    """Write pictures (height, width, 3) that are shown for the given seconds each; the GIF repeats for ever.

    Raises InvalidInputError for more than 50 pictures a second or more pictures than fit into memory, OutputError.
    """
    durations = ticks(seconds)
    if durations.min() < SHORTEST:
        message = f"{path}: a GIF shows at most {1.0 / (SHORTEST * TICK):.0f} frames per second; lower --fps"
        raise InvalidInputError(message)
    first = next(pictures)
    if len(seconds) * first[..., 0].size > MOST_BYTES:
        message = f"{path}: {len(seconds)} frames are too many for a GIF; write .mp4, raise --speed or lower --width"
        raise InvalidInputError(message)
    palette = Palette(first)
    buffer = BytesIO()
    palette.reduced(first).save(
        buffer,
        format="GIF",
        save_all=True,
        append_images=map(palette.reduced, pictures),
        duration=[int(10 * duration) for duration in durations],
        loop=0,
        comment=NAME,
    )
    write_bytes(path, buffer.getvalue())


def ticks(seconds: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return how many hundredths of a second each picture stays, so that they add up to the length of the animation."""
    ends = np.round(np.cumsum(seconds) / TICK).astype(np.int64)
    return np.diff(ends, prepend=0)


class Palette:
    """The colours of an animation: the most frequent ones of its first picture, unchanged, and shades of these.

    All others become the nearest.
    """

    def __init__(self, picture: Pixels) -> None:
        """Choose the colours."""
        colours, counts = np.unique(_packed(picture), return_counts=True)
        frequent = colours[np.argsort(-counts, kind="stable")[:COLOURS]]
        self.colours = np.concatenate([_unpacked(frequent), _mixed(_unpacked(frequent))])
        self.numbers = np.full(1 << 24, UNKNOWN, dtype=np.uint8)  # of every colour, found when first met
        self.numbers[frequent] = np.arange(len(frequent))

    def reduced(self, picture: Pixels) -> "Image":
        """Return a picture in these colours."""
        from PIL import Image  # noqa: PLC0415 - comes with matplotlib, only for films

        packed = _packed(picture)
        unknown = np.unique(packed[self.numbers[packed] == UNKNOWN])
        apart = np.abs(_unpacked(unknown)[:, None] - self.colours).sum(axis=-1)
        self.numbers[unknown] = apart.argmin(axis=1)
        image = Image.fromarray(self.numbers[packed])
        image.putpalette(self.colours.astype(np.uint8).tobytes())
        return image


def _mixed(colours: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return shades between the first colours and the darkest: the edges of lines that come later."""
    darkest = colours[colours.sum(axis=1).argmin()]
    shades = darkest + (colours[:FILLS, None] - darkest) * SHARES
    mixed: NDArray[np.int32] = np.round(shades).astype(np.int32).reshape(-1, 3)
    return mixed


def _packed(picture: Pixels) -> NDArray[np.int32]:
    """Return the colours of pixels as one number each."""
    red, green, blue = np.moveaxis(picture.astype(np.int32), -1, 0)
    packed: NDArray[np.int32] = red << 16 | green << 8 | blue
    return packed


def _unpacked(colours: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return red, green and blue, (k, 3)."""
    return np.stack([colours >> 16, colours >> 8 & 255, colours & 255], axis=-1)
