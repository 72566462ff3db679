"""Records of all bodies at time zero: blocks, then pieces of ground and walls, the half-plane last."""

import math
from collections.abc import Iterable, Iterator
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray

from blocksim.kernels.arrays import ALL, BODY, Record, Records, zeros
from blocksim.scenario import PlacedSegment
from blocksim.world.interactions import ContactClass
from blocksim.world.outline import Outline, Outlines

# A piece of ground is a slab of which only the upper face counts; its thickness is a share of the smallest side of all
# blocks: more than any overlap, less than a ledge that is worth modelling.
SLAB_SHARE = 0.25
UPPER_FACE = 1 << 1  # bits as in kernels/arrays.py
UPPER_RIGHT, UPPER_LEFT = 1 << 2, 1 << 3
SHARP_RIGHT, SHARP_LEFT = 1 << 4, 1 << 5


def body_records(outlines: Outlines) -> Records:
    """Return the records (m, n + 1) of blocks, pieces and half-plane of scenes of one shape.

    With a profile the half-plane is out of reach. The ground's face still has the length of the block above it.
    """
    blocks, pieces = len(outlines[0].placed), len(outlines[0].segments)
    bodies = zeros((len(outlines), blocks + pieces + 1), BODY)
    bodies["cos"] = 1.0  # the half-plane's, last
    bodies["faces"] = bodies["corners"] = ALL
    _fill_blocks(bodies[:, :blocks], outlines)
    if pieces:
        for records, outline in zip(bodies, outlines, strict=True):
            _fill_slabs(records[blocks:-1].view(np.recarray), outline)
    has_profile = [outline.scenario.ground.profile is not None for outline in outlines]
    bodies["y"][has_profile, -1] = -math.inf
    bodies["is_moved"] = bodies["inverse_mass"] == 0.0
    return bodies


def _fill_blocks(records: NDArray[np.record], outlines: Outlines) -> None:
    placed = [body for outline in outlines for body in outline.placed]

    def column(values: Iterable[float]) -> NDArray[np.float64]:
        return np.fromiter(values, np.float64, len(placed)).reshape(records.shape)

    for name in ("x", "y", "angle", "vx", "vy", "spin"):
        records[name] = column(map(attrgetter(name), placed))
    records["cos"] = column(math.cos(body.angle) for body in placed)  # numpy's may differ in the last digit
    records["sin"] = column(math.sin(body.angle) for body in placed)
    records["half_x"] = 0.5 * column(body.size_x for body in placed)
    records["half_y"] = 0.5 * column(body.size_y for body in placed)
    records["radius"] = 0.5 * column(math.hypot(body.size_x, body.size_y) for body in placed)
    is_free = ~np.array([body.fixed for body in placed]).reshape(records.shape)
    for name in ("mass", "inertia"):
        records[name][is_free] = column(map(attrgetter(name), placed))[is_free]
        is_heavy = records["mass"] > 0.0
        records[f"inverse_{name}"][is_heavy] = 1.0 / records[name][is_heavy]
    records["contact_class"] = column(code for outline in outlines for code in _codes(outline))


def _codes(outline: Outline) -> Iterator[int]:
    """Return the class of every block."""
    codes = {(one.material, one.depth): code for code, one in enumerate(outline.classes) if not one.is_ground}
    return (codes[body.material, body.depth] for body in outline.placed)


def _fill_slabs(records: Records, outline: Outline) -> None:
    smallest = min(min(body.size_x, body.size_y) for body in outline.placed)
    thickness = max(SLAB_SHARE * smallest, 2.0 * (outline.scenario.contact.max_overlap or 0.0))
    for record, segment in zip(records, outline.segments, strict=True):
        _fill_slab(record, segment, thickness)
        wall = ContactClass(segment.material, math.inf, is_wall=True)
        record.contact_class = outline.classes.index(wall) if segment.material else 0


def _fill_slab(record: Record, segment: PlacedSegment, thickness: float) -> None:
    """Turn a piece into a slab below its line, lengthened by its thickness where it must leave no crack."""
    along = ((segment.x1 - segment.x0) / segment.length, (segment.y1 - segment.y0) / segment.length)
    begin = -thickness if segment.extends_start else 0.0
    end = segment.length + (thickness if segment.extends_end else 0.0)
    middle = 0.5 * (begin + end)
    record.cos, record.sin = along
    record.angle = math.atan2(along[1], along[0])
    record.x = segment.x0 + along[0] * middle + along[1] * 0.5 * thickness
    record.y = segment.y0 + along[1] * middle - along[0] * 0.5 * thickness
    record.half_x, record.half_y = 0.5 * (end - begin), 0.5 * thickness
    record.radius = math.hypot(record.half_x, record.half_y)
    record.faces = UPPER_FACE
    record.corners = (UPPER_RIGHT if segment.touches_end else 0) | (UPPER_LEFT if segment.touches_start else 0)
    record.corners |= (SHARP_RIGHT if segment.sharp_end else 0) | (SHARP_LEFT if segment.sharp_start else 0)
