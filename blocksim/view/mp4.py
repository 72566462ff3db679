"""MP4: small animations, through the package imageio-ffmpeg or, where that is missing, the system's ffmpeg."""

import shutil
import subprocess
from collections.abc import Callable, Iterator
from functools import partial
from importlib import import_module
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from blocksim.errors import OutputError, UnavailableError
from blocksim.simulation.atomic import replacing
from blocksim.simulation.own_files import NAME

Pixels = NDArray[np.uint8]
Encode = Callable[[Path, Iterator[Pixels], float, int], bool]

PROGRAM = "ffmpeg"
QUALITY = 8.0  # of 10; thin lines stay sharp
CODECS = {  # of the system's ffmpeg, the best first
    "libx264": ["-c:v", "libx264", "-crf", "18"],
    "libopenh264": ["-c:v", "libopenh264", "-b:v", "4M"],
    "mpeg4": ["-c:v", "mpeg4", "-q:v", "3"],
}
OPTIONS = ["-movflags", "+faststart", "-metadata", f"comment={NAME.decode()}"]  # a browser may begin before it has all


def write_mp4(path: Path, pictures: Iterator[NDArray[np.uint8]], seconds: NDArray[np.float64]) -> None:
    """Write pictures (height, width, 3), both sides even, at the pace of the first one; held ones are repeated.

    Raises UnavailableError with neither the package nor ffmpeg, OutputError.
    """
    encode = _encoder()
    rate = 1.0 / float(seconds[0])
    repeats = np.round(seconds * rate).astype(int)
    with replacing(path) as temporary:
        try:
            is_whole = encode(temporary, _repeated(pictures, repeats), rate, int(repeats.sum()))
        except (OSError, RuntimeError):
            is_whole = False
        if not is_whole:  # nothing else reports a disk that was full at the end
            message = f"{path}: cannot be written: ffmpeg stopped before the end"
            raise OutputError(message)


def _repeated(pictures: Iterator[Pixels], repeats: NDArray[np.int_]) -> Iterator[Pixels]:
    for repeat, picture in zip(repeats, pictures, strict=True):
        for _ in range(repeat):
            yield np.ascontiguousarray(picture)


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


def _by_package(package: Any, path: Path, pictures: Iterator[Pixels], rate: float, count: int) -> bool:
    """Encode pictures and return whether all of them are in the file."""
    first = next(pictures)
    size = first.shape[1], first.shape[0]
    settings = {"fps": rate, "quality": QUALITY, "macro_block_size": 2, "output_params": OPTIONS}
    film = package.write_frames(str(path), size, **settings, ffmpeg_log_level="error")
    film.send(None)
    try:
        for picture in chain([first], pictures):
            film.send(picture)
    finally:
        film.close()
    written, _ = package.count_frames_and_secs(str(path))
    return bool(written == count)


def _by_program(program: str, path: Path, pictures: Iterator[Pixels], rate: float, count: int) -> bool:
    """Encode pictures by the ffmpeg of the system and return whether it has taken all of them and written its end."""
    first = next(pictures)
    size = f"{first.shape[1]}x{first.shape[0]}"
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", size, "-r", repr(rate), "-i", "-"]
    form = ["-an", *_codec(program), "-pix_fmt", "yuv420p", *OPTIONS, "-f", "mp4", str(path.absolute())]
    command = [program, "-y", "-loglevel", "error", *raw, *form]
    sent = 0
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as film:  # noqa: S603 - what `which` has found
        if film.stdin is None:
            return False
        for picture in chain([first], pictures):
            film.stdin.write(picture.tobytes())
            sent += 1
        film.stdin.close()
        return film.wait() == 0 and sent == count and path.stat().st_size > 0


def _codec(program: str) -> list[str]:
    """Return the options of the best encoder that this ffmpeg has; builds without H.264 have MPEG-4."""
    told = subprocess.run([program, "-hide_banner", "-encoders"], capture_output=True, text=True, check=False)  # noqa: S603 - as above
    known = {line.split()[1] for line in told.stdout.splitlines() if len(line.split()) > 1}
    return next((options for name, options in CODECS.items() if name in known), CODECS["mpeg4"])
