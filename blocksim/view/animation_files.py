"""Files of animations: GIF, and MP4 through the package imageio-ffmpeg or the system's ffmpeg."""

import shutil
import subprocess
from collections.abc import Callable, Iterator
from functools import partial
from importlib import import_module
from io import BytesIO
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from blocksim.errors import InvalidInputError, OutputError, UnavailableError
from blocksim.simulation.atomic import replacing, write_bytes
from blocksim.simulation.own_files import NAME

if TYPE_CHECKING:
    from PIL.Image import Image


TICK = 0.01  # s, of a GIF's clock
SHORTEST = 2  # ticks; browsers slow down what is shorter
COLOURS = 128
FILLS, SHARES = 16, np.array([[0.2], [0.4], [0.6], [0.8]])  # so many colours get so many shades
UNKNOWN = 255
MOST_BYTES = 1 << 30  # of all pictures together, which Pillow keeps in memory

_Pixels = NDArray[np.uint8]
Encode = Callable[[Path, Iterator[_Pixels], float, int], bool]

PROGRAM = "ffmpeg"
QUALITY = 8.0  # of 10; thin lines stay sharp
CODECS = {  # of the system's ffmpeg, the best first
    "libx264": ["-c:v", "libx264", "-crf", "18"],
    "libopenh264": ["-c:v", "libopenh264", "-b:v", "4M"],
    "mpeg4": ["-c:v", "mpeg4", "-q:v", "3"],
}
OPTIONS = ["-movflags", "+faststart", "-metadata", f"comment={NAME.decode()}"]  # a browser may begin before it has all


def write_gif(path: Path, pictures: Iterator[_Pixels], seconds: NDArray[np.float64]) -> None:
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

    def __init__(self, picture: _Pixels) -> None:
        """Choose the colours."""
        colours, counts = np.unique(_packed(picture), return_counts=True)
        frequent = colours[np.argsort(-counts, kind="stable")[:COLOURS]]
        self.colours = np.concatenate([_unpacked(frequent), _mixed(_unpacked(frequent))])
        self.numbers = np.full(1 << 24, UNKNOWN, dtype=np.uint8)  # of every colour, found when first met
        self.numbers[frequent] = np.arange(len(frequent))

    def reduced(self, picture: _Pixels) -> "Image":
        """Return a picture in these colours."""
        from PIL import Image

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


def _packed(picture: _Pixels) -> NDArray[np.int32]:
    """Return the colours of pixels as one number each."""
    red, green, blue = np.moveaxis(picture.astype(np.int32), -1, 0)
    packed: NDArray[np.int32] = red << 16 | green << 8 | blue
    return packed


def _unpacked(colours: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return red, green and blue, (k, 3)."""
    return np.stack([colours >> 16, colours >> 8 & 255, colours & 255], axis=-1)


def write_mp4(path: Path, pictures: Iterator[NDArray[np.uint8]], seconds: NDArray[np.float64]) -> None:
    """Write pictures (height, width, 3), both sides even, at the pace of the first one; held ones are repeated.

    Raises UnavailableError with neither the package nor ffmpeg, OutputError.
    """
    encode = _encoder()
    rate = 1.0 / float(seconds[0])
    repeats = np.round(seconds * rate).astype(int)
    shown = zip(repeats, pictures, strict=True)
    repeated = (np.ascontiguousarray(picture) for repeat, picture in shown for _ in range(repeat))
    with replacing(path) as temporary:
        try:
            is_whole = encode(temporary, repeated, rate, int(repeats.sum()))
        except (OSError, RuntimeError):
            is_whole = False
        if not is_whole:  # nothing else reports a disk that was full at the end
            message = f"{path}: cannot be written: ffmpeg stopped before the end"
            raise OutputError(message)


def _encoder() -> Encode:
    """Return what encodes pictures into a file; raises UnavailableError."""
    try:
        package = import_module("imageio_ffmpeg")
        package.get_ffmpeg_exe()
    except (ImportError, RuntimeError) as error:
        program = shutil.which(PROGRAM)
        if program is None:
            message = (
                f"MP4 needs ffmpeg, or the package imageio-ffmpeg ({error}); install the extra: "
                "pip install 'blocksim[video]'"
            )
            raise UnavailableError(message) from None
        return partial(_by_program, program)
    return partial(_by_package, package)


def _by_package(package: Any, path: Path, pictures: Iterator[_Pixels], rate: float, count: int) -> bool:
    """Encode pictures and return whether all of them are in the file."""
    first = next(pictures)
    size = first.shape[1], first.shape[0]
    settings = {"fps": rate, "quality": QUALITY, "macro_block_size": 2, "output_params": OPTIONS}
    stream = package.write_frames(str(path), size, **settings, ffmpeg_log_level="error")
    stream.send(None)
    try:
        for picture in chain([first], pictures):
            stream.send(picture)
    finally:
        stream.close()
    written, _ = package.count_frames_and_secs(str(path))
    return bool(written == count)


def _by_program(program: str, path: Path, pictures: Iterator[_Pixels], rate: float, count: int) -> bool:
    """Encode pictures by the ffmpeg of the system and return whether it has taken all of them and written its end."""
    first = next(pictures)
    size = f"{first.shape[1]}x{first.shape[0]}"
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", size, "-r", repr(rate), "-i", "-"]
    form = ["-an", *_codec(program), "-pix_fmt", "yuv420p", *OPTIONS, "-f", "mp4", str(path.absolute())]
    command = [program, "-y", "-loglevel", "error", *raw, *form]
    sent = 0
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as pipe:  # noqa: S603 - what `which` has found
        if pipe.stdin is None:
            return False
        for picture in chain([first], pictures):
            pipe.stdin.write(picture.tobytes())
            sent += 1
        pipe.stdin.close()
        return pipe.wait() == 0 and sent == count and path.stat().st_size > 0


def _codec(program: str) -> list[str]:
    """Return the options of the best encoder that this ffmpeg has; builds without H.264 have MPEG-4."""
    encoders = subprocess.run([program, "-hide_banner", "-encoders"], capture_output=True, text=True, check=False)  # noqa: S603 - as above
    known = {line.split()[1] for line in encoders.stdout.splitlines() if len(line.split()) > 1}
    return next((options for name, options in CODECS.items() if name in known), CODECS["mpeg4"])
