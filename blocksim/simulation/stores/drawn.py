"""Where blocks ended, as drawings: GeoJSON polygons and closed DXF polylines, which scenarios can take up again."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from blocksim.errors import InvalidInputError
from blocksim.extras import loaded
from blocksim.scenario import PlacedBody, Scenario, place_bodies
from blocksim.scenario.drawings import DXF, DXF_APPLICATION, DXF_INTEGER, DXF_TEXT
from blocksim.simulation.atomic import replacing, write_text
from blocksim.simulation.frames import Frames
from blocksim.simulation.own_files import DXF_PROPERTY, GEOJSON_MARK
from blocksim.world.systems.blocks import are_removed, distinct, local_corners, placed_points
from blocksim.world.systems.system import Floats

UNFIT_FOR_LAYERS = re.compile(r"[<>/\\\":;?*|=']")
CONTROLS = re.compile(r"[\x00-\x1f\x7f]")  # would end a line of the file
MOST_LETTERS = 60  # of a name, 4 bytes each at most: extended data have 255
METRES = 6  # DXF's number of the unit


class _Block(NamedTuple):
    """A block at the end: its corners (m, (k, 2)) and how it was placed."""

    corners: Floats
    body: PlacedBody
    rotation: float  # rad, since the start


def write_geojson(path: Path, frames: Frames, scenario: Scenario) -> int:
    """Write the outlines (m) of the last frame and return the number of blocks; properties are block, fixed and name.

    Raises InvalidInputError when there is no block to write, and OutputError.
    """
    blocks = [*_last_blocks(frames, scenario)]
    features = [
        {
            "type": "Feature",
            "properties": {
                "name": one.body.name,
                "block": one.body.block,
                "fixed": one.body.fixed,
                "rotation_deg": float(np.degrees(one.rotation)),
            },
            "geometry": {"type": "Polygon", "coordinates": [[*one.corners.tolist(), one.corners[0].tolist()]]},
        }
        for one in blocks
    ]
    lines = ",\n".join(json.dumps(feature, ensure_ascii=False) for feature in features)
    write_text(path, f'{{{GEOJSON_MARK}, "type": "FeatureCollection", "features": [\n{lines}\n]}}\n')
    return len(blocks)


def write_dxf(path: Path, frames: Frames, scenario: Scenario) -> int:
    """Write the outlines (m) of the last frame, each in the layer of its block, and return the number of blocks.

    Extended data of BLOCKSIM have the name of each and whether it is fixed; `read_drawing` takes them up again.
    Raises UnavailableError without the package for it, else as `write_geojson`.
    """
    ezdxf = loaded("ezdxf", f"writing {path.name}", DXF)
    blocks = [*_last_blocks(frames, scenario)]
    document = ezdxf.new("R2010", units=METRES)
    document.header.custom_vars.append(*DXF_PROPERTY)
    document.appids.new(DXF_APPLICATION)
    space = document.modelspace()
    for one in blocks:
        layer = {"layer": UNFIT_FOR_LAYERS.sub("_", one.body.block)}
        line = space.add_lwpolyline(one.corners.tolist(), close=True, dxfattribs=layer)
        name = CONTROLS.sub("_", one.body.name)[:MOST_LETTERS]
        line.set_xdata(DXF_APPLICATION, [(DXF_TEXT, name), (DXF_INTEGER, int(one.body.fixed))])
    with replacing(path) as temporary:
        document.saveas(temporary)
    return len(blocks)


def _last_blocks(frames: Frames, scenario: Scenario) -> Iterator[_Block]:
    """Yield the blocks of the last frame in which all of them are somewhere, without those that were removed."""
    somewhere = np.isfinite([frames.x, frames.y, frames.angle]).all(axis=(0, 2))
    if not somewhere.any():
        message = "no frame to export"
        raise InvalidInputError(message)
    if not frames.names:
        message = "no block to export"
        raise InvalidInputError(message)
    last = int(np.flatnonzero(somewhere)[-1])
    local = local_corners(frames.size_x, frames.size_y, frames.outlines)
    places = placed_points(local, frames.x[last], frames.y[last], frames.angle[last])
    for number, body in enumerate(place_bodies(scenario)):
        if not are_removed(frames.vx[last, number]):
            corners = places[number, : len(distinct(local[number]))]
            yield _Block(corners, body, float(frames.rotation[last, number]))
