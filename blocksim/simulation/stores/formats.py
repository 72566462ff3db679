"""The formats in which other programs get the frames of a run, by name."""

from collections.abc import Callable
from pathlib import Path

from blocksim.errors import InvalidInputError
from blocksim.simulation.frames import Frames
from blocksim.simulation.stores.frames_csv import write_csv
from blocksim.simulation.stores.vtkhdf import write_vtkhdf

# Each writes a file and returns the number of frames in it; a format is one file and one line here.
FORMATS: dict[str, Callable[[Path, Frames], int]] = {
    "csv": write_csv,
    "vtkhdf": write_vtkhdf,
}


def format_named(name: str) -> Callable[[Path, Frames], int]:
    """Return what writes files of a format. Raises InvalidInputError for an unknown one."""
    if name not in FORMATS:
        message = f"--format {name}: no such format, choose {' or '.join(FORMATS)}"
        raise InvalidInputError(message)
    return FORMATS[name]
