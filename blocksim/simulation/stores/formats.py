"""The formats in which other programs get the frames of a run, by name."""

from collections.abc import Callable
from pathlib import Path

from blocksim.errors import InvalidInputError
from blocksim.scenario.spelling import nearest
from blocksim.simulation.frames import Frames
from blocksim.simulation.stores.frames_csv import write_csv
from blocksim.simulation.stores.vtkhdf import write_vtkhdf

# Each writes a file and returns the number of frames in it; a format is one file and one line here.
FORMATS: dict[str, Callable[[Path, Frames], int]] = {
    "csv": write_csv,
    "vtkhdf": write_vtkhdf,
}
MOST_SLIPS = 3


def format_named(name: str) -> Callable[[Path, Frames], int]:
    """Return what writes files of a format. Raises InvalidInputError for an unknown one."""
    if name not in FORMATS:
        meant = nearest(name, FORMATS, MOST_SLIPS)
        hint = f"did you mean '{meant}'?" if meant else f"choose {' or '.join(FORMATS)}"
        message = f"--format {name}: no such format, {hint}"
        raise InvalidInputError(message)
    return FORMATS[name]
