"""What a scenario places where, its shapes, and the records of all bodies at time zero.

Blocks come first, then pieces of ground and walls, the half-plane last. A piece is a slab of which only the upper face
counts. The corners of all bodies are kept, each shape once, and with the contact models `particles` and `kernel` the
boundary particles of all bodies.

Contact of a corner with a face lasts as long as no other face is nearer. At the distance e from the end of a face and
so deep behind it, all others of a convex body are at least `clear` e minus the depth away: along the face the least
distance to the others is a concave function, zero at both ends, and `clear` is its value in the middle over half of the
length. Near an end only the face beside it can be nearer, as those beyond are `far` from all of the face.
"""

import math
from collections.abc import Iterable, Sequence
from functools import lru_cache
from itertools import pairwise
from operator import attrgetter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.kernels.common import arrays, tolerances
from blocksim.kernels.explicit.models.particles import PER_PARTICLE
from blocksim.scenario import Model, PlacedBody, PlacedSegment, Scenario, derived, placement
from blocksim.scenario.placement import GEOMETRY
from blocksim.world.excitation import Drives, LoadArrays, drive_records, load_arrays
from blocksim.world.interactions import ContactClass, Interactions, contact_classes, interactions_of

NO_FACE = (0.0, 0.0, 0.0, 0.0, math.inf, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)  # nothing is beyond it, or looks against it
LENGTHS = ("half_x", "half_y", "radius", "inner_radius", "least_width")  # m, of a block by its shape
FIELDS = ("x", "y", "nx", "ny", "distance", "half", "middle", "clear", "far", "sharp", "cone")
CORNERS = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))  # of a rectangle, in half sides
NORMALS = ((0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0))
SLAB_SHARE = 0.25  # of the smallest side of all blocks: thicker than any overlap, less than a ledge worth modelling
UPPER_FACE = 1 << 1  # bits as in kernels/common/arrays.py
UPPER_RIGHT, UPPER_LEFT = 1 << 2, 1 << 3
SHARP_RIGHT, SHARP_LEFT = 1 << 4, 1 << 5
Corners = tuple[tuple[float, float], ...]  # m, counter-clockwise about the centroid


class Shapes(NamedTuple):
    """The shapes of a scene, and where each of its bodies has its corners."""

    table: arrays.Records  # (q,) CORNER
    firsts: tuple[int, ...]  # (n + 1,) of blocks, pieces of ground and the half-plane
    sizes: tuple[int, ...]  # (n + 1,) numbers of corners
    faces: tuple[int, ...]  # (n,) of blocks: kernels take OUTLINE by its corners, ALL by its half sides
    has_polygons: bool  # kernels need the table
    lengths: NDArray[np.float64]  # (5, n) LENGTHS of blocks


class CornerTable(NamedTuple):
    """The corners of some shapes and pieces of ground."""

    table: arrays.Records  # (q,) CORNER, not to be written
    firsts: dict[Corners, int]  # where those of a shape begin; those of pieces come last
    lengths: dict[Corners, tuple[float, ...]]  # LENGTHS of a shape but the last one


def shapes_of(placed: Sequence[PlacedBody], slabs: Iterable[tuple[float, float]]) -> Shapes:
    """Return the corners of all bodies, of rectangles too.

    `slabs` (m) are the half sides of the pieces of ground. The half-plane, the last of all bodies, is a rectangle that
    is infinitely wide and has its upper face in its centre. After the corners of a block come as many others as a block
    may have here, so that four blocks are gone through together. Of ground no face is beside another.
    """
    blocks = [body.corners for body in placed]
    kinds = dict(zip(blocks, placed, strict=True))  # a body of each shape
    ground = (*slabs, (math.inf, 0.0))
    table, first_of, lengths_of = corner_table((*kinds,), ground)
    lengths = {corners: (*lengths_of[corners], body.least_width) for corners, body in kinds.items()}
    pieces = range(len(table) - len(CORNERS) * len(ground), len(table), len(CORNERS))
    firsts = (*(first_of[corners] for corners in blocks), *pieces)
    sizes = (*map(len, blocks), *[len(CORNERS)] * len(pieces))
    faces = tuple(arrays.OUTLINE if body.outline else arrays.ALL for body in placed)
    of_blocks = np.array([lengths[corners] for corners in blocks]).reshape(-1, len(LENGTHS))
    return Shapes(table, firsts, sizes, faces, arrays.OUTLINE in faces, of_blocks.T)


@lru_cache(maxsize=16)  # ensembles are made of scenes of the same shapes
def corner_table(kinds: tuple[Corners, ...], slabs: tuple[tuple[float, float], ...]) -> CornerTable:
    """Return the corners of shapes and of pieces of ground with half sides (m), and what each shape has there."""
    firsts: dict[Corners, int] = {}
    lengths: dict[Corners, tuple[float, ...]] = {}
    rows: list[tuple[float, ...]] = []
    most = max(map(len, kinds), default=0)
    for corners in kinds:
        firsts[corners], own = len(rows), corner_rows(corners)
        half_sides = (max(map(abs, axis)) for axis in zip(*corners, strict=True))
        inner = min(row[FIELDS.index("distance")] for row in own)
        lengths[corners] = (*half_sides, max(math.hypot(x, y) for x, y in corners), inner)
        rows += [*own, *[NO_FACE] * (most - len(corners))]
    for half_x, half_y in slabs:
        corners = ((-half_x, -half_y), (half_x, -half_y), (half_x, half_y), (-half_x, half_y))
        for (x, y), (nx, ny) in zip(corners, NORMALS, strict=True):
            side = (half_y, half_x) if nx == 0.0 else (half_x, half_y)
            rows.append((x, y, nx, ny, *side, 0.0, 1.0, 0.0, 0.0, tolerances.CONE_TOLERANCE))
    table = arrays.zeros(len(rows), arrays.CORNER)
    for name, column in zip(FIELDS, zip(*rows, strict=True), strict=True):
        table[name] = column
    table.flags.writeable = False  # it is shared
    return CornerTable(table, firsts, lengths)


def corner_rows(corners: Corners) -> list[tuple[float, ...]]:
    """Return the fields of CORNER, in the order of FIELDS, of the corners of one shape."""
    sides: list[tuple[float, ...]] = []
    for (x, y), (next_x, next_y) in zip(corners, (*corners[1:], corners[0]), strict=True):
        length = math.hypot(next_x - x, next_y - y)
        nx, ny = (next_y - y) / length, (x - next_x) / length
        half = 0.5 * length
        sides.append((x, y, nx, ny, nx * x + ny * y, half, half - (ny * x - nx * y)))
    rows, cone = [], cone_of(corners)
    for number, side in enumerate(sides):
        x, y, nx, ny, _, half, _ = side
        before, after = (number - 1) % len(sides), (number + 1) % len(sides)
        beside = [sides[before], sides[after]]
        others = [one for k, one in enumerate(sides) if k != number]
        beyond = [one for k, one in enumerate(sides) if k not in {before, number, after}]
        middle, ends = (x - half * ny, y + half * nx), (side[:2], sides[after][:2])
        clear = min(one[4] - one[2] * middle[0] - one[3] * middle[1] for one in others) / half
        far = min((one[4] - one[2] * x - one[3] * y for one in beyond for x, y in ends), default=math.inf)
        is_sharp = any(nx * one[2] + ny * one[3] < 0.0 for one in beside)  # meets it at less than a right angle
        rows.append((*side, clear, far, is_sharp, cone))
    return rows


def cone_of(corners: Corners) -> float:
    """Return the sine of the angle up to which a face of a shape is parallel to one of another body.

    At most half of the least angle by which the outline turns at a corner: a body that rolls over it from one face to
    the next is on neither of them half way. And at most half of the sharpest corner: beyond that the sides of one
    corner would be parallel.
    """
    edges = [math.atan2(y - last_y, x - last_x) for (last_x, last_y), (x, y) in pairwise((*corners, corners[0]))]
    turns = [(after - before) % (2.0 * math.pi) for before, after in zip((edges[-1], *edges), edges, strict=False)]
    return min(tolerances.CONE_TOLERANCE, math.sin(0.5 * min(turns)), math.sin(0.5 * (math.pi - max(turns))))


def place_particles(bodies: arrays.Records, model: str, spacing: float) -> arrays.Records:
    """Give every body its boundary particles: fills its row and range fields and returns the particles of all.

    `spacing` (m) is the largest distance of neighbours; bodies of equal sides share their particles. `model` is
    "kernel" or "particles", whose discs lie inside the edge. Of a piece of ground they see the line only, and the
    kernel also its free ends, which blocks can land on.
    """
    inset = 0.0 if model == "kernel" else 0.5 * spacing
    known: dict[tuple[float, ...], tuple[int, arrays.Records]] = {}
    total = 0
    for body in bodies[:-1]:
        is_block = body.faces == arrays.ALL
        body.row_x = division(2.0 * (body.half_x - inset), spacing) if is_block else 1
        body.row_y = division(2.0 * (body.half_y - inset), spacing) if is_block else 1
        key = (body.half_x, body.half_y, body.faces, body.corners)
        if key not in known:
            known[key] = (total, _edge_particles(body, inset) if is_block else _end_particles(body, inset))
            total += known[key][1].size
        body.first_particle, body.particle_count = known[key][0], known[key][1].size
    particles = arrays.zeros(total, arrays.PARTICLE)
    for first, part in known.values():
        particles[first : first + part.size] = part
    return particles


def _edge_particles(body: arrays.Record, inset: float) -> arrays.Records:
    """Return the particles of a block, counter-clockwise from the lower left corner.

    Without an `inset` (m) four rows on the true edge, both ends of each included: half an interval is tributary to an
    end, so that lengths of a face sum to its own. Else centres of discs so far inside, corners once: a corner stands
    for half an interval of each of its two faces.
    """
    ends = 0 if inset else 1
    counts = [int(body.row_x), int(body.row_y)] * 2
    sides = [2.0 * (side - inset) for side in (body.half_x, body.half_y)] * 2
    parts = []
    for k, (normal, count) in enumerate(zip(NORMALS, counts, strict=True)):
        row = arrays.zeros(count + ends, arrays.PARTICLE)
        begin, end = np.array(CORNERS[k]), np.array(CORNERS[(k + 1) % 4])
        way = (end - begin) * (np.arange(row.size) / count)[:, None]
        places = (begin + way) * (body.half_x - inset, body.half_y - inset)
        row["x"], row["y"] = places[:, 0], places[:, 1]
        row.nx, row.ny = row.mx, row.my = normal
        row["share"] = 1.0 / count
        if ends:
            row[0].mx, row[0].my = NORMALS[k - 1]
            row[-1].mx, row[-1].my = NORMALS[(k + 1) % 4]
            row["share"][[0, -1]] = 0.5 / count
            row["length"] = row["share"] * sides[k]
        else:
            row["share"][0] = 0.5 / count + 0.5 / counts[k - 1]
            row["length"] = sides[k] / count
            row["length"][0] = 0.5 * (sides[k] / count + sides[k - 1] / counts[k - 1])
        parts.append(row)
    return np.concatenate(parts).view(np.recarray)


def _end_particles(body: arrays.Record, inset: float) -> arrays.Records:
    """Return the particles at the free ends of a piece of ground; discs, which have an inset, do not see them."""
    ends = [] if inset else [k for k in (2, 3) if body.corners >> k & 1]
    row = arrays.zeros(len(ends), arrays.PARTICLE)
    for particle, k in zip(row, ends, strict=True):
        particle.x, particle.y = CORNERS[k][0] * body.half_x, body.half_y
        particle.ny = particle.my = 1.0
        particle.share = 0.5
    return row


def slots_of_a_pair(bodies: arrays.Records, model: str) -> int:
    """Return how many contact slots the pair of the two largest bodies needs."""
    most = int(bodies["particle_count"].max())
    return {"surface": arrays.SLOTS, "kernel": 2 * most, "particles": PER_PARTICLE * most}[model]


def division(side: float, spacing: float) -> int:
    """Return the number of equal intervals, none longer than `spacing`, that a side (both m) is divided into."""
    # a quotient that round-off lifted just over an integer must not add a particle
    return max(1, math.ceil(side / spacing * (1.0 - 1e-12)))


class Layout(NamedTuple):
    """Placement of a scenario before arrays are built: it determines their sizes."""

    model: Model
    scenario: Scenario
    placed: tuple[PlacedBody, ...]
    segments: tuple[PlacedSegment, ...]
    classes: tuple[ContactClass, ...]
    interactions: Interactions
    drives: Drives
    applied: LoadArrays
    slabs: arrays.Records  # (s,) BODY: the pieces of ground and walls
    shapes: Shapes

    @property
    def shape(self) -> tuple[object, ...]:
        """Common properties of scenes that are built together."""
        model = self.scenario.contact.model
        moved = (*self.drives.driven["body"].tolist(), self.drives.paths, self.drives.pieces.size)
        loads = self.applied.loads.size, self.applied.pieces.size
        shapes = self.shapes.table.size if self.shapes.has_polygons else 0
        return model, len(self.placed), len(self.segments), len(self.classes), moved, loads, shapes


def layout_of(model: Model) -> Layout:
    """Return the layout of a scenario."""
    classes, slabs = contact_classes(model), slab_records(model)
    table = interactions_of(model.scenario, classes)
    kept = model, model.scenario, model.bodies, model.segments, classes, table
    return Layout(*kept, drive_records(model), load_arrays(model), slabs, placed_shapes(model))


@derived(*GEOMETRY, "contact")
def placed_shapes(model: Model) -> Shapes:
    """Return the shapes of all bodies."""
    slabs = slab_records(model)
    return shapes_of(model.bodies, zip(slabs["half_x"].tolist(), slabs["half_y"].tolist(), strict=True))


@derived(*GEOMETRY, "contact")
def slab_records(model: Model) -> arrays.Records:
    """Return every piece of ground as a slab below its line, longer where it must leave no crack."""
    segments, classes = model.segments, contact_classes(model)
    slabs = arrays.zeros(len(segments), arrays.BODY)
    if not segments:
        return slabs
    smallest = placement.reference_length(placement.smallest_width(model.bodies))
    thickness = max(SLAB_SHARE * smallest, 2.0 * (model.scenario.contact.max_overlap or 0.0))
    for record, segment in zip(slabs, segments, strict=True):
        along = ((segment.x1 - segment.x0) / segment.length, (segment.y1 - segment.y0) / segment.length)
        begin = -thickness if segment.extends_start else 0.0
        end = segment.length + (thickness if segment.extends_end else 0.0)
        middle = 0.5 * (begin + end)
        record.cos, record.sin = along
        record.angle = math.atan2(along[1], along[0])
        record.x = segment.x0 + along[0] * middle + along[1] * 0.5 * thickness
        record.y = segment.y0 + along[1] * middle - along[0] * 0.5 * thickness
        record.half_x, record.half_y = 0.5 * (end - begin), 0.5 * thickness
        record.radius, record.least_width = math.hypot(record.half_x, record.half_y), math.inf
        record.faces = UPPER_FACE
        record.corners = (UPPER_RIGHT if segment.touches_end else 0) | (UPPER_LEFT if segment.touches_start else 0)
        record.corners |= (SHARP_RIGHT if segment.sharp_end else 0) | (SHARP_LEFT if segment.sharp_start else 0)
        wall = ContactClass(segment.material, math.inf, is_wall=True)
        record.contact_class = classes.index(wall) if segment.material else 0
    return slabs


def body_records(layouts: Sequence[Layout]) -> arrays.Records:
    """Return the records (m, n + 1) of blocks, pieces and half-plane of scenes of one shape.

    With a profile the half-plane is out of reach. The ground's face still has the length of the block above it.
    """
    blocks = len(layouts[0].placed)
    bodies = arrays.zeros((len(layouts), blocks + len(layouts[0].segments) + 1), arrays.BODY)
    bodies["cos"] = 1.0  # the half-plane's, last
    bodies["faces"] = bodies["corners"] = arrays.ALL
    bodies["least_width"] = math.inf  # the half-plane's
    _fill_blocks(bodies[:, :blocks], layouts)
    for records, layout in zip(bodies, layouts, strict=True):
        if layout.segments:
            records[blocks:-1] = layout.slabs
    plain, shapes = bodies.view(np.ndarray), [layout.shapes for layout in layouts]
    plain["first_corner"], plain["corner_count"] = [one.firsts for one in shapes], [one.sizes for one in shapes]
    plain["faces"][:, :blocks] = [one.faces for one in shapes]
    for name, *lengths in zip(LENGTHS, *(one.lengths for one in shapes), strict=True):
        plain[name][:, :blocks] = lengths
    has_profile = [layout.scenario.ground.profile is not None for layout in layouts]
    bodies["y"][has_profile, -1] = -math.inf
    bodies["is_moved"] = np.where(bodies["inverse_mass"] == 0.0, arrays.SUPPORT, 0)
    bodies["is_moved"][:, layouts[0].drives.driven["body"]] = arrays.DRIVEN
    return bodies


def _fill_blocks(records: NDArray[np.record], layouts: Sequence[Layout]) -> None:
    """Write pose, velocity, mass and contact class of all blocks into their records."""
    placed = [body for layout in layouts for body in layout.placed]

    def column(values: Iterable[float]) -> NDArray[np.float64]:
        return np.fromiter(values, np.float64, len(placed)).reshape(records.shape)

    for name in ("x", "y", "angle", "vx", "vy", "spin"):
        records[name] = column(map(attrgetter(name), placed))
    records["cos"] = column(math.cos(body.angle) for body in placed)  # numpy's may differ in the last digit
    records["sin"] = column(math.sin(body.angle) for body in placed)
    is_free = ~np.array([body.fixed for body in placed], bool).reshape(records.shape)
    for name in ("mass", "inertia"):
        records[name][is_free] = column(map(attrgetter(name), placed))[is_free]
        is_heavy = records["mass"] > 0.0
        records[f"inverse_{name}"][is_heavy] = 1.0 / records[name][is_heavy]
    classes = [
        {(one.material, one.depth): code for code, one in enumerate(layout.classes) if not one.is_ground}
        for layout in layouts
    ]
    records["contact_class"] = column(
        codes[body.material, body.depth]
        for layout, codes in zip(layouts, classes, strict=True)
        for body in layout.placed
    )


def motion_records(bodies: arrays.Records, layouts: Sequence[Layout]) -> arrays.Records:
    """Return where all bodies of scenes (m, n + 1) start that move with the supports, then all that are driven, (m, f).

    In every scene there are equally many.
    """
    driven = layouts[0].drives.driven.size
    numbers = np.nonzero(bodies["is_moved"] == arrays.SUPPORT)[-1].reshape(len(bodies), -1)
    count = numbers.shape[1]
    records = arrays.zeros((len(bodies), count + driven), arrays.MOVED)
    records["body"][:, :count] = numbers
    for name in ("x", "y"):
        records[name][:, :count] = np.take_along_axis(bodies[name], numbers, -1)
    for own, layout in zip(records, layouts, strict=True):
        own[count:] = layout.drives.driven
    return records
