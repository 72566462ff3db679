"""Contact models (narrow phase) and their dispatch.

A model is one file with

    find_points(world, p)              fill world.points with the contact points of pair p, return how many there are
    near_slots(world, a, b, reach, out)   write the slots of a pair that may come into contact, return how many

one code here and one branch in each dispatcher below. How many slots a pair needs is said in world/bodies.py and
build.py. Where an ended contact was is derived again for corners and kept in the slot for particles (`place_of`). All
models share laws, friction, dashpots, history and the energy ledger.
"""

from blocksim.kernels.common.arrays import Integers, Record, Records, World
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.explicit.models import particles as discs, smoothed, surface

SURFACE, PARTICLES, KERNEL = range(3)
MODEL_CODES = {"surface": SURFACE, "particles": PARTICLES, "kernel": KERNEL}


@rare_kernel
def contact_points(world: World, p: int) -> int:
    """Find the contact points of pair p and return how many there are."""
    return points_of(world, p, world.particles)


@kernel
def points_of(world: World, p: int, particles: Records | None) -> int:
    """As contact_points. Where the last one is None the compiler leaves out altogether what is for it."""
    if particles is None:
        return surface.find_points(world, p)
    if world.controls[0].model == KERNEL:
        return smoothed.find_points(world, p)
    return discs.find_points(world, p)


@kernel
def near_slots(world: World, a: int, b: int, reach: float, out: Integers, particles: Records | None) -> int:
    """Write the candidate slots of the pair of bodies a and b into `out`, return how many there are; see points_of."""
    if particles is None:
        return surface.near_slots(world, a, b, reach, out)
    if world.controls[0].model == KERNEL:
        return smoothed.near_slots(world, a, b, reach, out)
    return discs.near_slots(world, a, b, reach, out)


@kernel
def place_of(world: World, p: int, old: Record, point: Record, particles: Records | None) -> None:
    """Set place and normal of a contact of pair p that has just ended; see points_of."""
    if particles is None:
        point.x, point.y = surface.slot_place(world, world.pairs[p], old.slot)
        point.nx, point.ny = surface.slot_normal(world, world.pairs[p], old.slot, old.face)
    else:
        point.x = old.x
        point.y = old.y
        point.nx = old.nx
        point.ny = old.ny
