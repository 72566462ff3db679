"""What a run file from somebody else may make the HDF5 library do, looked at before anything of it is read.

A run file leads nowhere else: soft and external links, external storage and virtual data sets are refused, as they
would have this process read any file. Data are stored plainly: no compression and no types of variable length, so
nothing can be larger in memory than it is on the disk.
"""

from pathlib import Path
from typing import Any

import h5py

from blocksim.world.free_memory import available_bytes, readable

MOST_ENERGIES = 64
"""In `observables`; the schemes have a dozen."""
SHOWN = 200  # characters of what HDF5 says
NUMBERS = "if"  # kinds of numpy: whole and floating-point


class UnsafeError(ValueError):
    """A run file that is not as blocksim writes it; the text says where."""


def data_set(file: Any, name: str, dimensions: int) -> Any:
    """Return a data set of plain numbers, reached by no links but its own groups. Raises UnsafeError, KeyError."""
    found = member(file, name)
    if not isinstance(found, h5py.Dataset):
        raise UnsafeError(f"{name}: not a data set")
    if found.is_virtual or found.external:
        raise UnsafeError(f"{name}: its values lie in other files; they are not followed")
    if found.dtype.kind not in NUMBERS or found.dtype.itemsize > 8 or found.dtype.shape:  # noqa: PLR2004 - bytes
        raise UnsafeError(f"{name}: holds {found.dtype}, no plain numbers")
    if found.ndim != dimensions:
        raise UnsafeError(f"{name}: has {found.ndim} dimensions, not {dimensions}")
    if found.id.get_create_plist().get_nfilters():
        raise UnsafeError(f"{name}: compressed, which no run file is")
    return found


def group(file: Any, name: str) -> Any:
    """Return a group with a number of members that a run can have. Raises UnsafeError, KeyError."""
    found = member(file, name)
    if not isinstance(found, h5py.Group):
        raise UnsafeError(f"{name}: not a group")
    if len(found) > MOST_ENERGIES:
        raise UnsafeError(f"{name}: {len(found)} members; at most {MOST_ENERGIES} are read")
    return found


def has(file: Any, name: str) -> bool:
    """Return True if there is a member or a link of this name, which is not followed."""
    return bool(file.id.links.exists(name.encode()))


def member(file: Any, name: str) -> Any:
    """Return what a name means, where no part of it is a link to elsewhere. Raises UnsafeError, KeyError."""
    place = file
    for part in name.split("/"):
        if not isinstance(place, h5py.Group):
            raise UnsafeError(f"{name}: not in a group")
        if place.id.links.get_info(part.encode()).type != h5py.h5l.TYPE_HARD:  # h5py's own get() follows links first
            raise UnsafeError(f"{name}: a link to elsewhere; links are not followed")
        place = place[part]
    return place


def refuse_too_many(path: Path, sets: dict[str, Any], rows: int, what: str = "frames") -> None:
    """Raise UnsafeError where the first `rows` of data sets cannot all be in the file, or not in the memory."""
    size, wanted = path.stat().st_size, 0
    for name, one in sets.items():
        if one.shape[0] < rows:
            raise UnsafeError(f"{name}: holds {one.shape[0]} {what}, not {rows}")
        row_bytes = one.dtype.itemsize * (one.shape[1] if one.ndim > 1 else 1)
        wanted += rows * row_bytes
    if wanted > size:
        raise UnsafeError(f"announces {readable(wanted)} of {what} in a file of {readable(size)}")
    available = available_bytes()
    if available is not None and 3 * wanted > available:  # as read, put together, and as frames
        raise UnsafeError(
            f"its {what} need about {readable(3 * wanted)} of memory; {readable(available)} are available"
        )


def told(error: BaseException) -> str:
    """Return what HDF5 says, on one short line."""
    text = " ".join(str(error).split())
    return text if len(text) <= SHOWN else f"{text[:SHOWN]} ..."
