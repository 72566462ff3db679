"""Pictures, animations, reports and exports: those of blocksim are replaced, files of others only when asked for.

What blocksim writes bears a mark where each format keeps who made a file: PNG `Software`, SVG and PDF `Creator`, a
comment in GIF and MP4, `generator` in HTML, GeoJSON and DXF, groups of VTKHDF, the heads of tables and of measurements.
"""

import os
import re
from pathlib import Path
from typing import BinaryIO

from blocksim.errors import BlocksimError, OutputError, OutputExistsError
from blocksim.scenario.bounded_read import open_regular

NAME = b"blocksim"
END_BYTES = 1 << 16  # that are looked at, at the start and at the end of a file
GEOJSON_MARK = '"generator": "blocksim"'
DXF_PROPERTY = "generator", "blocksim"
MARKS = re.compile(
    rb"""
    \A\x89PNG.*tEXtSoftware\0blocksim
    |<dc:creator>\s*<cc:Agent>\s*<dc:title>blocksim</dc:title>
    |\AGIF.*!\xfe\x08blocksim\0
    |\A.{4}ftyp.*\xa9cmt.{4}data.{8}blocksim
    |\A.{0,2000}<meta[ ]name="generator"[ ]content="blocksim[ ]report">
    |\A\{"generator":[ ]"blocksim"
    |\$CUSTOMPROPERTYTAG\s+1\s+generator\s+9\s+\$CUSTOMPROPERTY\s+1\s+blocksim\s
    |\A\x89HDF.*VTKHDF\0.*block_names\0
    |\Atime_s,(?:block,x_mm,y_mm,rotation_deg|body_a,body_b,x_mm),
    |\A\s*\{\s*"machine":\s*\{.*"measurements":\s*\[
    """,
    re.DOTALL | re.VERBOSE,
)
PDF_CREATOR = re.compile(rb"/Creator \((.*?)\)")  # a text with a picture of blocksim in it names another one too


def refuse_foreign(path: Path, *, overwrite: bool = False) -> None:
    """Raise OutputExistsError where something is in the way of a file: one of others, unless `overwrite`, or no file.

    To be called before the work begins. Raises OutputError where the folder for the file is missing.
    """
    if not (path.exists() or path.is_symlink()):
        if not path.parent.exists():
            message = f"{path}: cannot be written: there is no folder {path.parent}"
            raise OutputError(message)
        return
    try:
        with open_regular(path, links=True) as file:
            if overwrite or _is_marked(file):
                return
    except BlocksimError as error:
        message = f"{error}; write elsewhere with --out"
        raise OutputExistsError(message) from None
    message = f"{path}: already exists; rerun with --overwrite"
    raise OutputExistsError(message)


def _is_marked(file: BinaryIO) -> bool:
    """Return True for a file that bears the mark of blocksim at its start or its end."""
    text = file.read(END_BYTES)
    if (size := file.seek(0, os.SEEK_END)) > END_BYTES:
        file.seek(max(END_BYTES, size - END_BYTES))
        text += file.read()
    if text.startswith(b"%PDF-"):
        return set(PDF_CREATOR.findall(text)) == {NAME}
    return MARKS.search(text) is not None
