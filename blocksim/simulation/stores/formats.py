"""The formats in which other programs get the frames of a run, by name."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from blocksim.errors import InvalidInputError
from blocksim.scenario import Scenario
from blocksim.simulation.contacts import Contacts
from blocksim.simulation.frames import Frames
from blocksim.simulation.stores.csv_tables import write_contacts_csv, write_frames_csv
from blocksim.simulation.stores.drawn import write_dxf, write_geojson
from blocksim.simulation.stores.vtkhdf import write_vtkhdf


class Format(NamedTuple):
    """How a format is written; both writers return the number of frames, blocks or contacts in it."""

    write: Callable[[Path, Frames, Scenario], int]
    write_contacts: Callable[[Path, Frames, Contacts], int] | None = None  # into a file of their own
    counted: str = "frames"


# A format is one entry here.
FORMATS: dict[str, Format] = {
    "csv": Format(lambda path, frames, _: write_frames_csv(path, frames), write_contacts_csv),
    "vtkhdf": Format(write_vtkhdf),
    "geojson": Format(write_geojson, counted="blocks"),
    "dxf": Format(write_dxf, counted="blocks"),
}


def format_named(name: str) -> Format:
    """Return what writes files of a format. Raises InvalidInputError for an unknown one."""
    if name not in FORMATS:
        message = f"--format {name}: unsupported format; use {' or '.join(FORMATS)}"
        raise InvalidInputError(message)
    return FORMATS[name]
