"""Pictures, animations, reports and exports of blocksim, distinguished from files of others by the mark each bears.

Only those are replaced without being asked for. The marks are where each format keeps who made a file: PNG `Software`,
SVG and PDF `Creator`, a comment in GIF and MP4, `generator` in HTML, the heads of a table, groups of VTKHDF.
"""

import json
import os
import re
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import BinaryIO

import h5py

from blocksim.errors import BlocksimError, OutputError, OutputExistsError
from blocksim.scenario.bounded_read import MEGABYTE, open_regular
from blocksim.simulation.stores.hdf5_open import DAMAGE

NAME = b"blocksim"
HEAD_BYTES = 1 << 16
TAIL_BYTES = 1 << 16
PNG = b"\x89PNG\r\n\x1a\n"
PNG_TEXT = b"Software\0" + NAME
SVG = re.compile(rb"<dc:creator>\s*<cc:Agent>\s*<dc:title>blocksim</dc:title>")
PDF_INFO = re.compile(rb"/Info\s+(\d+)\s+0\s+R")
GIF_COMMENT = b"\x21\xfe" + bytes([len(NAME)]) + NAME + b"\0"
MP4_COMMENT = re.compile(rb"\xa9cmt.{4}data.{8}blocksim", re.DOTALL)
REPORT = b'<meta name="generator" content="blocksim report">'
REPORT_HEAD = 2000  # bytes in which a report says so
BENCH_KEYS = {"machine", "measurements"}
VTKHDF_NAMES = "blocksim/block_names"
GEOJSON_MARK = '"generator": "blocksim"'
DXF_PROPERTY = "generator", "blocksim"
DXF_MARK = re.compile(rb"\$CUSTOMPROPERTYTAG\s+1\s+generator\s+9\s+\$CUSTOMPROPERTY\s+1\s+blocksim\s")
IsOwn = Callable[[BinaryIO], bool]


def refuse_foreign(path: Path, is_own: IsOwn, *, overwrite: bool = False) -> None:
    """Raise OutputExistsError where something is in the way of a file: one of others, unless `overwrite`, or no file.

    To be called before the work begins. Raises OutputError where the folder for the file is missing.
    """
    if not (path.exists() or path.is_symlink()):
        _refuse_missing_folder(path)
        return
    try:
        with open_regular(path, links=True) as file:
            if overwrite or is_own(file):
                return
    except BlocksimError as error:
        message = f"{error}; write elsewhere with --out"
        raise OutputExistsError(message) from None
    message = f"{path}: already exists; rerun with --overwrite"
    raise OutputExistsError(message)


def _refuse_missing_folder(path: Path) -> None:
    if not path.parent.exists():
        message = f"{path}: cannot be written: there is no folder {path.parent}"
        raise OutputError(message)


def is_picture(file: BinaryIO) -> bool:
    """Return True for a PNG, SVG or PDF that blocksim drew."""
    head = file.read(HEAD_BYTES)
    if head.startswith(PNG):
        return any(kind == b"tEXt" and text == PNG_TEXT for kind, text in _chunks(head))
    return SVG.search(head) is not None or (head.startswith(b"%PDF-") and _is_our_pdf(head, file))


def _chunks(head: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Yield type and content of the chunks at the start of a PNG."""
    place = len(PNG)
    while place + 8 <= len(head):
        size, kind = struct.unpack_from(">I4s", head, place)
        yield kind, head[place + 8 : place + 8 + size]
        place += size + 12


def _is_our_pdf(head: bytes, file: BinaryIO) -> bool:
    """Return True where the PDF itself says that blocksim created it, not a picture in it."""
    end = file.seek(0, os.SEEK_END)
    file.seek(max(0, end - TAIL_BYTES))
    text = file.read() if end > len(head) else head
    info = PDF_INFO.findall(text)
    if not info:
        return False
    entry = re.search(rb"(?<!\d)" + info[-1] + rb" 0 obj\s*<<(.*?)>>", text, re.DOTALL)
    return entry is not None and b"/Creator (" + NAME + b")" in entry[1]


def is_film(file: BinaryIO) -> bool:
    """Return True for a GIF or MP4 that blocksim made."""
    head = file.read(HEAD_BYTES)
    if head.startswith(b"GIF"):
        return GIF_COMMENT in head
    return head[4:8] == b"ftyp" and MP4_COMMENT.search(_movie_box(file)) is not None


def _movie_box(file: BinaryIO) -> bytes:
    """Return the box of an MP4 that says what is in it; nothing where there is none."""
    place = 0
    while True:
        file.seek(place)
        header = file.read(8)
        if len(header) < 8:
            return b""
        size, kind = struct.unpack(">I4s", header)
        if kind == b"moov":
            return file.read(min(size, 100 * MEGABYTE))
        if size < 8:
            return b""
        place += size


def is_report(file: BinaryIO) -> bool:
    """Return True for a report."""
    return REPORT in file.read(REPORT_HEAD)


def is_bench(file: BinaryIO) -> bool:
    """Return True for the measurements of `blocksim bench`."""
    try:
        data = json.loads(file.read(100 * MEGABYTE))
    except (ValueError, RecursionError):
        return False
    return isinstance(data, dict) and data.keys() == BENCH_KEYS


def is_table(*columns: str) -> IsOwn:
    """Return what recognises a CSV file with exactly these columns."""
    line = ",".join(columns).encode()
    return lambda file: file.readline(HEAD_BYTES).rstrip(b"\r\n") == line


def is_table_from(*columns: str) -> IsOwn:
    """Return what recognises a CSV file whose first columns are these: later versions may add some."""
    line = ",".join(columns).encode()

    def is_own(file: BinaryIO) -> bool:
        head = file.readline(HEAD_BYTES).rstrip(b"\r\n")
        return head == line or head.startswith(line + b",")

    return is_own


def is_geojson(file: BinaryIO) -> bool:
    """Return True for an export as GeoJSON."""
    return file.read(HEAD_BYTES).startswith(b"{" + GEOJSON_MARK.encode())


def is_dxf(file: BinaryIO) -> bool:
    """Return True for an export as DXF."""
    return DXF_MARK.search(file.read(HEAD_BYTES)) is not None


def is_vtkhdf(file: BinaryIO) -> bool:
    """Return True for an export as VTKHDF."""
    try:
        with h5py.File(file, "r") as content:
            return "VTKHDF" in content and VTKHDF_NAMES in content
    except DAMAGE:
        return False
