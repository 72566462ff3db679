"""MP4: small films, through the package imageio-ffmpeg."""

from collections.abc import Iterator
from importlib import import_module
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from blocksim.errors import OutputError, UnavailableError
from blocksim.simulation.atomic import replacing
from blocksim.simulation.own_files import NAME

QUALITY = 8.0  # of 10; thin lines stay sharp
OPTIONS = ["-movflags", "+faststart", "-metadata", f"comment={NAME.decode()}"]  # a browser may begin before it has all


def write_mp4(path: Path, pictures: Iterator[NDArray[np.uint8]], seconds: NDArray[np.float64]) -> None:
    """Write pictures (height, width, 3), both sides even, at the pace of the first one; held ones are repeated.

    Raises UnavailableError without the package, OutputError.
    """
    package = _package()
    rate = 1.0 / float(seconds[0])
    repeats = np.round(seconds * rate).astype(int)
    with replacing(path) as temporary:
        try:
            _encode(package, temporary, pictures, repeats, rate)
            written, _ = package.count_frames_and_secs(str(temporary))
        except (OSError, RuntimeError):
            written = 0
        if written != repeats.sum():  # nothing else tells of a disk that was full in the end
            message = f"{path}: cannot be written: ffmpeg stopped before the end"
            raise OutputError(message)


def _encode(
    package: Any, path: Path, pictures: Iterator[NDArray[np.uint8]], repeats: NDArray[np.int_], rate: float
) -> None:
    first = next(pictures)
    size = first.shape[1], first.shape[0]
    settings = {"fps": rate, "quality": QUALITY, "macro_block_size": 2, "output_params": OPTIONS}
    film = package.write_frames(str(path), size, **settings, ffmpeg_log_level="error")
    film.send(None)
    try:
        for repeat, picture in zip(repeats, chain([first], pictures), strict=True):
            for _ in range(repeat):
                film.send(np.ascontiguousarray(picture))
    finally:
        film.close()


def _package() -> Any:
    """Return imageio_ffmpeg with an ffmpeg that it has found; raises UnavailableError."""
    try:
        package = import_module("imageio_ffmpeg")
        package.get_ffmpeg_exe()
    except (ImportError, RuntimeError) as error:
        message = f"MP4 needs the package imageio-ffmpeg ({error}); install the extra: pip install 'blocksim[video]'"
        raise UnavailableError(message) from None
    return package
