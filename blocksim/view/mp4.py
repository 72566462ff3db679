"""MP4: small films, through the package imageio-ffmpeg."""

from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from blocksim.errors import OutputError, UnavailableError
from blocksim.simulation.atomic import replacing

QUALITY = 8.0  # of 10; thin lines stay sharp
OPTIONS = ["-movflags", "+faststart"]  # a browser may begin before it has all


def write_mp4(path: Path, pictures: Iterator[NDArray[np.uint8]], seconds: NDArray[np.float64]) -> None:
    """Write pictures (height, width, 3), both sides even, at the pace of the first one; held ones are repeated.

    Raises UnavailableError without the package, OutputError.
    """
    package = _package()
    rate = 1.0 / float(seconds[0])
    with replacing(path) as temporary:
        _encode(package, temporary, pictures, np.round(seconds * rate).astype(int), rate)


def _encode(
    package: Any, path: Path, pictures: Iterator[NDArray[np.uint8]], repeats: NDArray[np.int_], rate: float
) -> None:
    first = next(pictures)
    size = first.shape[1], first.shape[0]
    settings = {"fps": rate, "quality": QUALITY, "macro_block_size": 2, "output_params": OPTIONS}
    film = package.write_frames(str(path), size, **settings, ffmpeg_log_level="error")
    film.send(None)
    try:
        for index, repeat in enumerate(repeats):
            picture = np.ascontiguousarray(first if index == 0 else next(pictures))
            for _ in range(repeat):
                film.send(picture)
    except (OSError, RuntimeError) as error:
        message = f"{path}: ffmpeg cannot write it: {str(error).strip().splitlines()[-1]}"
        raise OutputError(message) from None
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
