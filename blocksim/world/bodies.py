"""The corners of all bodies of a scene, each shape once, where any block is a polygon and no rectangle.

Contact of a corner with a face lasts as long as no other face is nearer. At the distance e from the end of a face and
so deep behind it, all others of a convex body are at least `clear` e minus the depth away: along the face the least
distance to the others is a concave function, zero at both ends, and `clear` is its value in the middle over half of the
length. Near an end only the face beside it can be nearer, as those beyond are `far` from all of the face.

Boundary particles of all bodies for the contact models `particles` and `kernel`.

What a scenario places where, and the records of all bodies at time zero.

Blocks come first, then pieces of ground and walls, the half-plane last. The prescribed motion of the supports is a
cubic polynomial of displacement for every stretch of time.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from operator import attrgetter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.kernels.common.arrays import (
    ALL,
    BODY,
    CORNER,
    DRIVEN,
    MOTION_PIECE,
    MOVED,
    OUTLINE,
    PARTICLE,
    SLOTS,
    SUPPORT,
    Record,
    Records,
    zeros,
)
from blocksim.kernels.explicit.models.particles import PER_PARTICLE
from blocksim.kernels.explicit.outlines import WIDEST_CONE
from blocksim.scenario import PlacedBody, PlacedSegment, Scenario, place_bodies, place_segments
from blocksim.scenario.motion import motion_pieces
from blocksim.scenario.placement import length_beside, smallest_width
from blocksim.world.forcing import DriveRecords, LoadArrays, drive_records, load_arrays, piece_records
from blocksim.world.interactions import ContactClass, Interactions, contact_classes, interactions_of

NO_FACE = (0.0, 0.0, 0.0, 0.0, math.inf, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)  # nothing is beyond it, or looks against it
FIELDS = ("x", "y", "nx", "ny", "distance", "half", "middle", "clear", "far", "sharp", "cone")
Corners = tuple[tuple[float, float], ...]  # m, counter-clockwise about the centroid
HalfSides = tuple[float, float]  # m


class Shapes(NamedTuple):
    """The shapes of a scene, and where each of its bodies has its corners."""

    table: Records  # (q,) CORNER
    firsts: tuple[int, ...]  # (n + 1,) of blocks, pieces of ground and the half-plane
    sizes: tuple[int, ...]  # (n + 1,) numbers of corners
    inner: Mapping[Corners, float]  # m: from the centroid of a block to the nearest face


def shapes_of(placed: Sequence[PlacedBody], slabs: Iterable[HalfSides]) -> Shapes | None:
    """Return the corners of all bodies, of rectangles too; None where all blocks are rectangles.

    `slabs` (m) are the half sides of the pieces of ground. The half-plane, the last of all bodies, is a rectangle that
    is infinitely wide and has its upper face in its centre. After the corners of a block come as many others as a block
    may have here, so that four blocks are gone through together.
    """
    if not any(body.outline for body in placed):
        return None
    places: dict[Corners, int] = {}
    rows: list[tuple[float, ...]] = []
    blocks = [body.corners for body in placed]
    most = max(len(corners) for corners in blocks)
    ground = [_rectangle(*half_sides) for half_sides in (*slabs, (math.inf, 0.0))]
    for corners in blocks:
        if corners not in places:
            places[corners] = len(rows)
            rows += [*corner_rows(corners), *[NO_FACE] * (most - len(corners))]
    firsts = [places[corners] for corners in blocks]
    for corners in ground:
        firsts.append(len(rows))
        rows += _ground_rows(corners)
    table = zeros(len(rows), CORNER)
    for name, column in zip(FIELDS, zip(*rows, strict=True), strict=True):
        table[name] = column
    sizes = tuple(len(corners) for corners in (*blocks, *ground))
    inner = {corners: float(table["distance"][place : place + len(corners)].min()) for corners, place in places.items()}
    return Shapes(table, tuple(firsts), sizes, inner)


def corner_rows(corners: Corners) -> list[tuple[float, ...]]:
    """Return the fields of CORNER, in the order of FIELDS, of the corners of one shape."""
    rows: list[tuple[float, ...]] = []
    cone = cone_of(corners)
    for (x, y), (next_x, next_y) in zip(corners, (*corners[1:], corners[0]), strict=True):
        length = math.hypot(next_x - x, next_y - y)
        nx, ny = (next_y - y) / length, (x - next_x) / length
        half = 0.5 * length
        rows.append((x, y, nx, ny, nx * x + ny * y, half, half - (ny * x - nx * y), cone))
    return [
        (
            *row[:-1],
            _clearance(number, rows),
            _distance_of_others(number, rows),
            _is_sharp(row, rows[number - 1], rows[(number + 1) % len(rows)]),
            cone,
        )
        for number, row in enumerate(rows)
    ]


def _is_sharp(face: Sequence[float], *beside: Sequence[float]) -> bool:
    """Return True if a face beside one meets it at less than a right angle."""
    return any(face[2] * other[2] + face[3] * other[3] < 0.0 for other in beside)


def _clearance(number: int, rows: Sequence[tuple[float, ...]]) -> float:
    """Return how far all other faces are from the middle of one, over half of its length."""
    x, y, nx, ny, _, half, *_ = rows[number]
    x, y = x - half * ny, y + half * nx
    return min(row[4] - row[2] * x - row[3] * y for k, row in enumerate(rows) if k != number) / half


def _distance_of_others(number: int, rows: Sequence[tuple[float, ...]]) -> float:
    """Return the distance (m) of a face from all others but those beside it: the lesser one of its two ends."""
    before, after = (number - 1) % len(rows), (number + 1) % len(rows)
    others = [row for k, row in enumerate(rows) if k not in {before, number, after}]
    ends = [rows[number][:2], rows[after][:2]]
    return min((row[4] - row[2] * x - row[3] * y for row in others for x, y in ends), default=math.inf)


def _rectangle(half_x: float, half_y: float) -> Corners:
    """Return the corners of a rectangle from the lower left one."""
    return ((-half_x, -half_y), (half_x, -half_y), (half_x, half_y), (-half_x, half_y))


def _ground_rows(corners: Corners) -> list[tuple[float, ...]]:
    """Return the fields of CORNER of a piece of ground or the half-plane, of which no face is beside another."""
    half_x, half_y = corners[2]
    faces = ((0.0, -1.0, half_y, half_x), (1.0, 0.0, half_x, half_y), (0.0, 1.0, half_y, half_x))
    sides = (*faces, (-1.0, 0.0, half_x, half_y))
    return [(*corner, *side, 0.0, 1.0, 0.0, 0.0, WIDEST_CONE) for corner, side in zip(corners, sides, strict=True)]


def cone_of(corners: Corners) -> float:
    """Return the sine of the angle up to which a face of a shape is parallel to one of another body.

    At most half of the least angle by which the outline turns at a corner: a body that rolls over it from one face to
    the next is on neither of them half way. And at most half of the sharpest corner: beyond that the sides of one
    corner would be parallel.
    """
    edges = [math.atan2(y - last_y, x - last_x) for (last_x, last_y), (x, y) in pairwise((*corners, corners[0]))]
    turns = [(after - before) % (2.0 * math.pi) for before, after in zip((edges[-1], *edges), edges, strict=False)]
    return min(WIDEST_CONE, math.sin(0.5 * min(turns)), math.sin(0.5 * (math.pi - max(turns))))


CORNERS = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))
NORMALS = ((0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0))


def place_particles(bodies: Records, model: str, spacing: float) -> Records | None:
    """Give every body its boundary particles: fills its row and range fields and returns the particles of all.

    `spacing` (m) is the largest distance of neighbours; bodies of equal sides share their particles. The surface model
    has none: None.
    """
    if model == "surface":
        return None
    rows = kernel_rows if model == "kernel" else disc_rows
    known: dict[tuple[float, ...], tuple[int, Records]] = {}
    total = 0
    for body in bodies[:-1]:
        inset = 0.0 if model == "kernel" else 0.5 * spacing
        body.row_x = division(2.0 * (body.half_x - inset), spacing) if body.faces == ALL else 1
        body.row_y = division(2.0 * (body.half_y - inset), spacing) if body.faces == ALL else 1
        key = (body.half_x, body.half_y, body.faces, body.corners)
        if key not in known:
            known[key] = (total, rows(body, inset) if body.faces == ALL else free_ends(body, model))
            total += known[key][1].size
        body.first_particle, body.particle_count = known[key][0], known[key][1].size
    particles = zeros(total, PARTICLE)
    for first, part in known.values():
        particles[first : first + part.size] = part
    return particles


def kernel_rows(body: Record, inset: float) -> Records:
    """Return four rows on the true edge, counter-clockwise from the lower left corner, both ends of each included.

    Tributary lengths are half an interval at the ends, so that those of a face sum to its length.
    """
    parts = []
    for start, normal, count in _rows(body):
        row = zeros(count + 1, PARTICLE)
        _line(row, body, inset, start, np.arange(count + 1) / count)
        row.nx, row.ny = row.mx, row.my = normal
        row[0].mx, row[0].my = NORMALS[start - 1]
        row[-1].mx, row[-1].my = NORMALS[(start + 1) % 4]
        row["share"] = 1.0 / count
        row["share"][[0, -1]] = 0.5 / count
        row["length"] = row["share"] * 2.0 * (body.half_x if normal[0] == 0.0 else body.half_y)
        parts.append(row)
    return np.concatenate(parts).view(np.recarray)


def disc_rows(body: Record, inset: float) -> Records:
    """Return the centres of discs, inset from the edge, counter-clockwise from the lower left one, corners once.

    A corner stands for half an interval of each of its two faces.
    """
    parts = []
    counts = [count for _, _, count in _rows(body)]
    sides = [2.0 * (side - inset) for side in (body.half_x, body.half_y)] * 2
    for k, (start, normal, count) in enumerate(_rows(body)):
        row = zeros(count, PARTICLE)
        _line(row, body, inset, start, np.arange(count) / count)
        row.nx, row.ny = row.mx, row.my = normal
        row["share"] = 1.0 / count
        row["share"][0] = 0.5 / count + 0.5 / counts[k - 1]
        row["length"] = sides[k] / count
        row["length"][0] = 0.5 * (sides[k] / count + sides[k - 1] / counts[k - 1])
        parts.append(row)
    return np.concatenate(parts).view(np.recarray)


def free_ends(body: Record, model: str) -> Records:
    """Return the particles of a piece of ground: its free ends, which blocks can land on; discs see its line only."""
    ends = [k for k in (2, 3) if body.corners >> k & 1] if model == "kernel" else []
    row = zeros(len(ends), PARTICLE)
    for particle, k in zip(row, ends, strict=True):
        particle.x, particle.y = CORNERS[k][0] * body.half_x, body.half_y
        particle.ny = particle.my = 1.0
        particle.share = 0.5
    return row


def slots_of_a_pair(bodies: Records, model: str) -> int:
    """Return how many contact slots the pair of the two largest bodies needs."""
    most = int(bodies["particle_count"].max())
    return {"surface": SLOTS, "kernel": 2 * most, "particles": PER_PARTICLE * most}[model]


def division(side: float, spacing: float) -> int:
    """Return the number of equal intervals, none longer than `spacing`, that a side (both m) is divided into."""
    # a quotient that round-off lifted just over an integer must not add a particle
    return max(1, math.ceil(side / spacing * (1.0 - 1e-12)))


def _rows(body: Record) -> list[tuple[int, tuple[float, float], int]]:
    """Return start corner, normal and number of intervals of every row."""
    return [(k, NORMALS[k], int(body.row_x if k % 2 == 0 else body.row_y)) for k in range(4)]


def _line(row: Records, body: Record, inset: float, start: int, share: NDArray[np.float64]) -> None:
    begin, end = np.array(CORNERS[start]), np.array(CORNERS[(start + 1) % 4])
    places = (begin + (end - begin) * share[:, None]) * (body.half_x - inset, body.half_y - inset)
    row["x"], row["y"] = places[:, 0], places[:, 1]


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
    applied: LoadArrays
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
    applied = load_arrays(scenario, placed)
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


def free_masses(bodies: Records, outlines: Outlines) -> Records:
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


def stacked_driven_records(bodies: Records, outlines: Outlines) -> Records:
    """Return what moves with the supports of m scenes, then what is driven, (m, f)."""
    supports, driven = driven_records(bodies), [outline.drives.driven for outline in outlines]
    count = supports.shape[-1]
    records = zeros((len(outlines), count + driven[0].size), MOVED)
    records[:, :count] = supports
    for m, own in enumerate(driven):
        records[m, count:] = own
    return records


def driven_records(bodies: Records) -> Records:
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
