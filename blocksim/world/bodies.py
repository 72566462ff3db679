"""What a scenario places where, and the records of all bodies at time zero.

Blocks come first, then pieces of ground and walls, the half-plane last. The prescribed motion of the supports is a
cubic polynomial of displacement for every stretch of time.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from operator import attrgetter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.kernels.common.arrays import (
    ALL,
    BODY,
    DRIVEN,
    MOTION_PIECE,
    MOVED,
    OUTLINE,
    SUPPORT,
    Record,
    Records,
    zeros,
)
from blocksim.scenario import PlacedBody, PlacedSegment, Scenario, place_bodies, place_segments
from blocksim.scenario.motion import motion_pieces
from blocksim.scenario.placement import length_beside, smallest_width
from blocksim.world.applied import Applied, applied_loads
from blocksim.world.drives import DriveRecords, drive_records, piece_records
from blocksim.world.interactions import ContactClass, Interactions, contact_classes, interactions_of
from blocksim.world.shapes import HalfSides, Shapes, shapes_of

# A piece of ground is a slab of which only the upper face counts; its thickness is a share of the smallest side of all
# blocks: more than any overlap, less than a ledge that is worth modelling.
SLAB_SHARE = 0.25
UPPER_FACE = 1 << 1  # bits as in kernels/common/arrays.py
UPPER_RIGHT, UPPER_LEFT = 1 << 2, 1 << 3
SHARP_RIGHT, SHARP_LEFT = 1 << 4, 1 << 5


class Outline(NamedTuple):
    """Placement of a scenario before arrays are built: it determines their sizes."""

    scenario: Scenario
    placed: tuple[PlacedBody, ...]
    segments: tuple[PlacedSegment, ...]
    classes: tuple[ContactClass, ...]
    interactions: Interactions
    motion: Records  # (m,) MOTION_PIECE, of driven bodies and then of the support
    drives: DriveRecords
    applied: Applied
    shapes: Shapes | None

    @property
    def shape(self) -> tuple[object, ...]:
        """Common properties of scenes that are built together."""
        model = self.scenario.contact.model
        drives = (*self.drives.driven["body"].tolist(), self.drives.paths.size)
        loads = self.applied.loads.size, self.applied.pieces.size
        shapes = None if self.shapes is None else (self.shapes.firsts, self.shapes.sizes)
        return model, len(self.placed), len(self.segments), len(self.classes), self.motion.size, drives, loads, shapes


Outlines = Sequence[Outline]
"""Those of several scenes; where arrays are made of them, of one shape."""


def outline_of(scenario: Scenario) -> Outline:
    """Return the outline of a scenario."""
    placed = place_bodies(scenario)
    classes = contact_classes(scenario, placed)
    interactions = interactions_of(scenario, classes)
    motion, drives = motion_records(scenario), drive_records(scenario, placed)
    if drives.paths.size:
        both = zeros(drives.paths.size + motion.size, MOTION_PIECE)
        both[: drives.paths.size], both[drives.paths.size :] = drives.paths, motion
        motion = both
    applied = applied_loads(scenario, placed)
    segments = place_segments(scenario)
    shapes = shapes_of(placed, _slab_half_sides(scenario, placed, segments))
    return Outline(scenario, placed, segments, classes, interactions, motion, drives, applied, shapes)


def body_records(outlines: Outlines) -> Records:
    """Return the records (m, n + 1) of blocks, pieces and half-plane of scenes of one shape.

    With a profile the half-plane is out of reach. The ground's face still has the length of the block above it.
    """
    blocks, pieces = len(outlines[0].placed), len(outlines[0].segments)
    bodies = zeros((len(outlines), blocks + pieces + 1), BODY)
    bodies["cos"] = 1.0  # the half-plane's, last
    bodies["faces"] = bodies["corners"] = ALL
    _fill_blocks(bodies[:, :blocks], outlines)
    for records, outline in zip(bodies, outlines, strict=True):
        if outline.shapes is not None:
            records["first_corner"], records["corner_count"] = outline.shapes.firsts, outline.shapes.sizes
            _fill_polygons(records[:blocks], outline.placed, outline.shapes)
    if pieces:
        for records, outline in zip(bodies, outlines, strict=True):
            _fill_slabs(records[blocks:-1].view(np.recarray), outline)
    has_profile = [outline.scenario.ground.profile is not None for outline in outlines]
    bodies["y"][has_profile, -1] = -math.inf
    bodies["is_moved"] = np.where(bodies["inverse_mass"] == 0.0, SUPPORT, 0)
    bodies["is_moved"][:, outlines[0].drives.driven["body"]] = DRIVEN
    return bodies


def with_freed(bodies: Records, outlines: Outlines) -> Records:
    """Return the same records with the masses of bodies that events free, by which steps are chosen."""
    places = [(m, i) for m, one in enumerate(outlines) for i, body in enumerate(one.placed) if body.freed]
    if not places:
        return bodies
    heavy = bodies.copy()
    for m, i in places:
        body = outlines[m].placed[i]
        heavy["mass"][m, i], heavy["inertia"][m, i] = body.mass, body.inertia
        heavy["inverse_mass"][m, i], heavy["inverse_inertia"][m, i] = 1.0 / body.mass, 1.0 / body.inertia
    return heavy


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
    is_free = ~np.array([body.fixed for body in placed], bool).reshape(records.shape)
    for name in ("mass", "inertia"):
        records[name][is_free] = column(map(attrgetter(name), placed))[is_free]
        is_heavy = records["mass"] > 0.0
        records[f"inverse_{name}"][is_heavy] = 1.0 / records[name][is_heavy]
    classes = [
        {(one.material, one.depth): code for code, one in enumerate(outline.classes) if not one.is_ground}
        for outline in outlines
    ]
    records["contact_class"] = column(
        codes[body.material, body.depth]
        for outline, codes in zip(outlines, classes, strict=True)
        for body in outline.placed
    )


def _fill_polygons(records: NDArray[np.record], placed: Sequence[PlacedBody], shapes: Shapes) -> None:
    """Tell which blocks are polygons, and how large."""
    records["inner_radius"] = [shapes.inner[body.corners] for body in placed]
    for record, body in zip(records, placed, strict=True):
        if body.outline:
            record["least_width"] = body.least_width
            record["half_x"], record["half_y"] = (max(map(abs, axis)) for axis in zip(*body.outline, strict=True))
            record["radius"] = body.radius
            record["faces"] = OUTLINE


def _slab_thickness(scenario: Scenario, placed: Sequence[PlacedBody]) -> float:
    """Return the thickness (m) of the pieces of ground."""
    smallest = length_beside(smallest_width(placed))
    return max(SLAB_SHARE * smallest, 2.0 * (scenario.contact.max_overlap or 0.0))


def _slab_ends(segment: PlacedSegment, thickness: float) -> tuple[float, float]:
    """Return where (m, along a piece from its start) its slab begins and ends: longer where it must leave no crack."""
    begin = -thickness if segment.extends_start else 0.0
    return begin, segment.length + (thickness if segment.extends_end else 0.0)


def _slab_half_sides(
    scenario: Scenario, placed: Sequence[PlacedBody], segments: Sequence[PlacedSegment]
) -> Iterator[HalfSides]:
    """Yield half the length and thickness (m) of every slab."""
    thickness = _slab_thickness(scenario, placed)
    for segment in segments:
        begin, end = _slab_ends(segment, thickness)
        yield 0.5 * (end - begin), 0.5 * thickness


def _fill_slabs(records: Records, outline: Outline) -> None:
    thickness = _slab_thickness(outline.scenario, outline.placed)
    for record, segment in zip(records, outline.segments, strict=True):
        _fill_slab(record, segment, thickness)
        wall = ContactClass(segment.material, math.inf, is_wall=True)
        record.contact_class = outline.classes.index(wall) if segment.material else 0


def _fill_slab(record: Record, segment: PlacedSegment, thickness: float) -> None:
    """Turn a piece into a slab below its line."""
    along = ((segment.x1 - segment.x0) / segment.length, (segment.y1 - segment.y0) / segment.length)
    begin, end = _slab_ends(segment, thickness)
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


STANDSTILL = zeros(1, MOTION_PIECE)


def all_moved_records(bodies: Records, outlines: Outlines) -> Records:
    """Return what moves with the supports of m scenes, then what is driven, (m, f)."""
    supports, driven = moved_records(bodies), [outline.drives.driven for outline in outlines]
    count = supports.shape[-1]
    records = zeros((len(outlines), count + driven[0].size), MOVED)
    records[:, :count] = supports
    for m, own in enumerate(driven):
        records[m, count:] = own
    return records


def moved_records(bodies: Records) -> Records:
    """Return where all bodies (..., n + 1) that move with the support start; in every scene there are equally many."""
    is_moved = bodies["is_moved"] == SUPPORT
    numbers = np.nonzero(is_moved)[-1].reshape(*is_moved.shape[:-1], -1)
    records = zeros(numbers.shape, MOVED)
    records["body"] = numbers
    for name in ("x", "y"):
        records[name] = np.take_along_axis(bodies[name], numbers, -1)
    return records


def motion_records(scenario: Scenario) -> Records:
    """Return the pieces of the displacement over time; where a motion ends before the run, the last one is constant."""
    if scenario.motion is None:
        return STANDSTILL
    records = piece_records(motion_pieces(scenario))
    return records if records.size else STANDSTILL
