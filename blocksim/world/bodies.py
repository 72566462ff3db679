"""Records of all bodies at time zero: blocks, then pieces of ground and walls, the half-plane last."""

import math

import numpy as np

from blocksim.kernels.arrays import ALL, BODY, Record, Records, zeros
from blocksim.scenario import PlacedBody, PlacedSegment, Scenario, place_segments
from blocksim.world.interactions import ContactClass

# A piece of ground is a slab of which only the upper face counts; its thickness is a share of the smallest side of all
# blocks: more than any overlap, less than a ledge that is worth modelling.
SLAB_SHARE = 0.25
UPPER_FACE = 1 << 1  # bits as in kernels/arrays.py
UPPER_RIGHT, UPPER_LEFT = 1 << 2, 1 << 3


def body_records(scenario: Scenario, placed: tuple[PlacedBody, ...], classes: tuple[ContactClass, ...]) -> Records:
    """Return the records (n + 1,) of blocks, pieces and half-plane. With a profile the half-plane is out of reach."""
    segments = place_segments(scenario)
    bodies = zeros(len(placed) + len(segments) + 1, BODY)
    bodies.cos = 1.0  # the half-plane's, last
    bodies.faces = bodies.corners = ALL
    _fill_blocks(bodies[: len(placed)].view(np.recarray), placed)
    codes = {one: code for code, one in enumerate(classes) if not one.is_ground}
    bodies["contact_class"][: len(placed)] = [codes[ContactClass(body.material, body.depth)] for body in placed]
    smallest = min(min(body.size_x, body.size_y) for body in placed)
    thickness = max(SLAB_SHARE * smallest, 2.0 * (scenario.contact.max_overlap or 0.0))
    for record, segment in zip(bodies[len(placed) : -1], segments, strict=True):
        _fill_slab(record, segment, thickness)
        wall = ContactClass(segment.material, math.inf, is_wall=True)
        record.contact_class = classes.index(wall) if segment.material else 0
    if scenario.ground.profile is not None:
        bodies[-1].y = -math.inf
    bodies.is_moved = bodies.inverse_mass == 0.0
    return bodies


def _fill_blocks(records: Records, placed: tuple[PlacedBody, ...]) -> None:
    for name in ("x", "y", "angle", "vx", "vy", "spin"):
        records[name] = [getattr(body, name) for body in placed]
    records["cos"] = [math.cos(body.angle) for body in placed]  # numpy's may differ in the last digit
    records["sin"] = [math.sin(body.angle) for body in placed]
    records["half_x"] = [0.5 * body.size_x for body in placed]
    records["half_y"] = [0.5 * body.size_y for body in placed]
    records["radius"] = [0.5 * math.hypot(body.size_x, body.size_y) for body in placed]
    records["mass"] = [0.0 if body.fixed else body.mass for body in placed]
    records["inertia"] = [0.0 if body.fixed else body.inertia for body in placed]
    is_free = records["mass"] > 0.0
    for name in ("mass", "inertia"):
        records[f"inverse_{name}"][is_free] = 1.0 / records[name][is_free]


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
