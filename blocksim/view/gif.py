"""GIF: films that every browser and every office program shows."""

from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from blocksim.errors import InvalidInputError
from blocksim.simulation.atomic import write_bytes

if TYPE_CHECKING:
    from PIL.Image import Image

TICK = 0.01  # s, of a GIF's clock
SHORTEST = 2  # ticks; browsers slow down what is shorter
COLOURS = 128
MOST_BYTES = 1 << 30  # of all pictures together, which Pillow keeps in memory


def write_gif(path: Path, pictures: Iterator[NDArray[np.uint8]], seconds: NDArray[np.float64]) -> None:
    """Write pictures (height, width, 3) that are shown for so many seconds each; it repeats for ever.

    Raises InvalidInputError for more than 50 pictures a second or more pictures than fit into memory, OutputError.
    """
    durations = ticks(seconds)
    if durations.min() < SHORTEST:
        message = f"{path}: a GIF shows at most {1.0 / (SHORTEST * TICK):.0f} pictures a second; lower --fps"
        raise InvalidInputError(message)
    first = next(pictures)
    if len(seconds) * first[..., 0].size > MOST_BYTES:
        message = f"{path}: {len(seconds)} pictures are too many for a GIF; write .mp4, raise --speed or lower --width"
        raise InvalidInputError(message)
    palette = _palette(first)
    buffer = BytesIO()
    _reduced(first, palette).save(
        buffer,
        format="GIF",
        save_all=True,
        append_images=(_reduced(picture, palette) for picture in pictures),
        duration=[int(10 * duration) for duration in durations],
        loop=0,
    )
    write_bytes(path, buffer.getvalue())


def ticks(seconds: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return how many hundredths of a second each picture stays, so that they add up to the length of the film."""
    ends = np.round(np.cumsum(seconds) / TICK).astype(np.int64)
    return np.diff(ends, prepend=0)


def _palette(picture: NDArray[np.uint8]) -> "Image":
    """Return the most frequent colours of a picture, unchanged; all pictures of a film are shown in these."""
    from PIL import Image  # noqa: PLC0415 - comes with matplotlib, only for films

    packed = picture.reshape(-1, 3) @ np.array([1 << 16, 1 << 8, 1])
    colours, counts = np.unique(packed, return_counts=True)
    frequent = colours[np.argsort(-counts, kind="stable")[:COLOURS]]
    palette = Image.new("P", (1, 1))
    palette.putpalette(np.stack([frequent >> 16, frequent >> 8 & 255, frequent & 255], axis=-1).ravel().tolist())
    return palette


def _reduced(picture: NDArray[np.uint8], palette: "Image") -> "Image":
    from PIL import Image  # noqa: PLC0415 - see _palette

    return Image.fromarray(picture).quantize(palette=palette, dither=Image.Dither.NONE)
