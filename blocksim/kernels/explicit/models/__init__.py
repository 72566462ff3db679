"""Contact models (narrow phase) and their dispatch.

A model is one file with

    find_points(world, p)              fill world.points with the contact points of pair p, return how many there are
    near_slots(world, a, b, reach, out)   write the slots of a pair that may come into contact, return how many

one code here and one branch in each dispatcher below. The `surface` model has two: with polygons in a scene, all its
corners lie in a table (`corners` below), which outlines.py reads. How many slots a pair needs is said in
world/bodies.py. Where an ended contact was is derived again for corners and kept in the slot for particles
(`place_of`). All models share laws, friction, dashpots, history and the energy ledger.
"""

from blocksim.kernels.common.arrays import Integers, Record, Records, World
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.explicit.models import outlines, particles as discs, smoothed, surface

SURFACE, PARTICLES, KERNEL = range(3)
MODEL_CODES = {"surface": SURFACE, "particles": PARTICLES, "kernel": KERNEL}


@rare_kernel
def contact_points(world: World, p: int) -> int:
    """Find the contact points of pair p and return how many there are."""
    return points_of(world, p, world.particles, world.corners)


@kernel
def points_of(world: World, p: int, particles: Records | None, corners: Records | None) -> int:
    """As contact_points. Where one of the last two is None the compiler leaves out altogether what is for it."""
    if corners is not None:
        return outlines.find_points(world, p, corners)
    if particles is None:
        return surface.find_points(world, p)
    if world.controls[0].model == KERNEL:
        return smoothed.find_points(world, p)
    return discs.find_points(world, p)


@rare_kernel
def near_slots(world: World, a: int, b: int, reach: float, out: Integers) -> int:
    """Write the candidate slots of the pair of bodies a and b into `out` and return how many there are."""
    return slots_near(world, a, b, reach, out, world.particles, world.corners)


@kernel
def slots_near(
    world: World, a: int, b: int, reach: float, out: Integers, particles: Records | None, corners: Records | None
) -> int:
    """As near_slots; see points_of."""
    if corners is not None:
        return outlines.near_slots(world, a, b, reach, out, corners)
    if particles is None:
        return surface.near_slots(world, a, b, reach, out)
    if world.controls[0].model == KERNEL:
        return smoothed.near_slots(world, a, b, reach, out)
    return discs.near_slots(world, a, b, reach, out)


@rare_kernel
def slot_normal(world: World, pair: Record, slot: int, face: int) -> tuple[float, float]:
    """Return the normal, from b to a, of the contact of a corner with a face of the other body."""
    return normal_of_slot(world, pair, slot, face, world.corners)


@kernel
def normal_of_slot(world: World, pair: Record, slot: int, face: int, corners: Records | None) -> tuple[float, float]:
    """As slot_normal; see points_of."""
    if corners is None:
        return surface.slot_normal(world, pair, slot, face)
    return outlines.slot_normal(world, pair, slot, face, corners)


@rare_kernel
def slot_place(world: World, pair: Record, slot: int) -> tuple[float, float]:
    """Return the place (m) of the corner of a slot."""
    return place_of_slot(world, pair, slot, world.corners)


@kernel
def place_of_slot(world: World, pair: Record, slot: int, corners: Records | None) -> tuple[float, float]:
    """As slot_place; see points_of."""
    if corners is None:
        return surface.slot_place(world, pair, slot)
    return outlines.slot_place(world, pair, slot, corners)


@kernel
def place_of(world: World, p: int, old: Record, point: Record, particles: Records | None) -> None:
    """Set place and normal of a contact of pair p that has just ended; see points_of."""
    if particles is None:
        point.x, point.y = slot_place(world, world.pairs[p], old.slot)
        point.nx, point.ny = slot_normal(world, world.pairs[p], old.slot, old.face)
    else:
        point.x = old.x
        point.y = old.y
        point.nx = old.nx
        point.ny = old.ny
