"""How far two bodies may overlap, and whether they overlap more: checked wherever forces are evaluated.

A contact pushes a corner out through the nearest face that it can touch. Beyond the middle of a thin body, or deeper
than the particles of a boundary reach, that would be the wrong way or none at all, and a block would come out on the
other side. So a run ends at the first overlap beyond a limit, that of the thinner of the two. While a pair touches, the
overlaps of its contacts are checked; where it does not, or particles may have lost one another, the overlap of the
shapes. No step takes a block far into another (world/step.py, broad_phase.py), so none is behind before it is
found.
"""

from blocksim.kernels.common import arrays, jit, tolerances
from blocksim.kernels.explicit import sides
from blocksim.kernels.explicit.models import KERNEL, SURFACE


@jit.rare_kernel
def overlap_limit(a: arrays.Record, b: arrays.Record, given: float) -> float:
    """Return how far (m) two bodies may overlap; `given` (m) is zero where nothing was asked for."""
    side = min(a.least_width, b.least_width)
    return min(given, tolerances.MIDDLE * side) if given > 0.0 else tolerances.OVERLAP_SHARE * side


@jit.rare_kernel
def penetration(world: arrays.World, pair: arrays.Record) -> float:
    """Return how deep (m) the bodies of a pair overlap; what lies behind a piece of ground does not overlap it."""
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    is_ground = pair.b == world.bodies.size - 1
    if not is_ground and b.faces < arrays.ALL and b.cos * (a.y - b.y) - b.sin * (a.x - b.x) < b.half_y:
        return 0.0
    return -sides.widest_gap(a, b, is_ground, world.corners)[1]


@jit.rare_kernel
def reach_of_contacts(world: arrays.World, pair: arrays.Record) -> float:
    """Return at which overlap (m) of the rectangles contacts may be lost, or act the wrong way."""
    controls = world.controls[0]
    if controls.model == SURFACE:
        return pair.limit
    reach = controls.support if controls.model == KERNEL else tolerances.ROWS_APART * controls.particle_size
    side = min(world.bodies[pair.a].least_width, world.bodies[pair.b].least_width)
    return min(reach, tolerances.MIDDLE * side)


@jit.rare_kernel
def is_too_deep(world: arrays.World, p: int, count: int) -> bool:
    """Return True if pair p, whose `count` points have been found, overlaps too far."""
    pair = world.pairs[p]
    for i in range(count):
        if world.points[i].depth > pair.limit:
            return True
    if count > 0 and world.controls[0].model == SURFACE:
        return False
    return penetration(world, pair) > reach_of_contacts(world, pair)
