"""The formats in which other programs get the frames of a run, by name."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from blocksim.errors import InvalidInputError
from blocksim.scenario import Scenario
from blocksim.simulation.contacts import Contacts
from blocksim.simulation.frames import Frames
from blocksim.simulation.own_files import IsOwn, is_table, is_vtkhdf
from blocksim.simulation.stores.contacts_csv import write_contacts_csv
from blocksim.simulation.stores.frames_csv import COLUMNS, write_csv
from blocksim.simulation.stores.vtkhdf import write_vtkhdf


class Format(NamedTuple):
    """How a format is written, both functions return how many frames or contacts there are in the file; and known."""

    write: Callable[[Path, Frames, Scenario], int]
    is_own: IsOwn
    write_contacts: Callable[[Path, Frames, Contacts], int] | None = None  # into a file of their own


# A format is one file and one line here.
FORMATS: dict[str, Format] = {
    "csv": Format(lambda path, frames, _: write_csv(path, frames), is_table(*COLUMNS), write_contacts_csv),
    "vtkhdf": Format(write_vtkhdf, is_vtkhdf),
}


def format_named(name: str) -> Format:
    """Return what writes files of a format. Raises InvalidInputError for an unknown one."""
    if name not in FORMATS:
        message = f"--format {name}: unsupported format; use {' or '.join(FORMATS)}"
        raise InvalidInputError(message)
    return FORMATS[name]
