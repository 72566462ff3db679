"""Corners of the `surface` model, and which of two corners that meet counts."""

from blocksim.kernels.common.arrays import HALF, Record, Records
from blocksim.kernels.common.geometry import to_world
from blocksim.kernels.common.jit import kernel, rare_kernel

# A corner can touch a face only where the face normal, reversed, lies between the outward normals of the two sides
# that meet in the corner (the vertex-face pairs of the Minkowski difference of two convex bodies). The tolerance
# (sine of an angle) lets both ends of a nearly parallel face contact count. Without this rule the corner of an
# aligned stack, which lies nearer to the side of the block below than to its top, would touch the wrong face.
CONE_TOLERANCE = 0.2

PARALLEL = 0.9
CLOSE = 8.0  # overlaps; two corners nearer than that meet in one place


@kernel
def corner_signs(corner: int) -> tuple[float, float]:
    """Return +-1 for the side of a body that a corner lies on, along its own x and y."""
    return 1.0 if corner == 1 or corner == 2 else -1.0, 1.0 if corner >= 2 else -1.0


@rare_kernel
def outward_along(body: Record, corner: int, tx: float, ty: float) -> float:
    """Return the component along (tx, ty) of the vector (m) from the centre of a body to one of its corners."""
    sx, sy = corner_signs(corner)
    x, y = to_world(body, sx * body.half_x, sy * body.half_y)
    return tx * (x - body.x) + ty * (y - body.y)


@rare_kernel
def same_end(of_a: Record, of_b: Record, a: Record, b: Record) -> bool:
    """Return True if a corner of a and a corner of b (both points) mark the same end of one face contact."""
    if of_a.nx * of_b.nx + of_a.ny * of_b.ny < PARALLEL:
        return False
    end_a = outward_along(a, of_a.slot, -of_a.ny, of_a.nx)
    end_b = outward_along(b, of_b.slot - HALF, -of_a.ny, of_a.nx)
    return end_a * end_b > 0.0


@rare_kernel
def is_oblique(a: Record, b: Record) -> bool:
    """Return True if no face of a is nearly parallel to a face of b, so that they touch in one point at most."""
    c = abs(a.cos * b.cos + a.sin * b.sin)
    s = abs(a.sin * b.cos - a.cos * b.sin)
    return min(c, s) > CONE_TOLERANCE


@rare_kernel
def coincide(one: Record, two: Record) -> bool:
    """Return True if two corners meet: they are about as near to one another as they are deep."""
    dx = one.x - two.x
    dy = one.y - two.y
    reach = CLOSE * max(one.depth, two.depth)
    return dx * dx + dy * dy < reach * reach


@rare_kernel
def was_touching(slot: int, contacts: Records, count: int) -> bool:
    """Return True if a corner is among the first `count` contacts."""
    for j in range(count):
        if contacts[j].slot == slot:
            return True
    return False


@rare_kernel
def keeps_first(one: Record, two: Record, pair: Record, contacts: Records, oblique: bool) -> bool:
    """Choose between two coinciding corners.

    Oblique: the shallower one, which is the nearest edge of the Minkowski difference, so that the overlap changes
    continuously when the corners pass one another. Parallel: the one already in contact, otherwise the deeper one,
    otherwise that of a.
    """
    if oblique:
        return one.depth <= two.depth
    was_one = was_touching(one.slot, contacts, pair.active)
    was_two = was_touching(two.slot, contacts, pair.active)
    return was_one if was_one != was_two else one.depth >= two.depth


@rare_kernel
def drop_point(points: Records, gone: int, count: int) -> int:
    """Remove one point, keep the order of the others, return the new count."""
    for i in range(gone, count - 1):
        points[i] = points[i + 1]
    return count - 1


@rare_kernel
def drop_duplicates(a: Record, b: Record, pair: Record, contacts: Records, points: Records, count: int) -> int:
    """Keep one of two coinciding corners: they are one contact, and a face contact has the stiffness of two points.

    Where two blocks are exactly aligned, or meet corner on corner, a corner of each lies in the other. `contacts` are
    those of this pair so far; the corners that do not count are marked in its `duplicates`.
    """
    oblique = is_oblique(a, b)
    i = 0
    while i < count and points[i].slot < HALF:
        for j in range(i + 1, count):
            if points[j].slot >= HALF and (
                coincide(points[i], points[j]) if oblique else same_end(points[i], points[j], a, b)
            ):
                keep_i = keeps_first(points[i], points[j], pair, contacts, oblique)
                gone = j if keep_i else i
                pair.duplicates |= 1 << points[gone].slot
                count = drop_point(points, gone, count)
                i -= 0 if keep_i else 1
                break
        i += 1
    return count
