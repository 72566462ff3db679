"""Contact models (narrow phase) and their dispatch.

A model is one file with

    find_points(world, p)              fill world.points with the contact points of pair p, return how many there are
    near_slots(world, a, b, reach, out)   write the slots of a pair that may come into contact, return how many

one code here and one branch in each dispatcher below. How many slots a pair needs is said in world/particles.py. Where
an ended contact was is derived again for corners and kept in the slot for particles (`place_ended`). All models share
laws, friction, dashpots, history and the energy ledger.
"""

from blocksim.kernels.common.arrays import Integers, Record, Records, World
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.explicit.models import particles as discs
from blocksim.kernels.explicit.models import smoothed, surface

SURFACE, PARTICLES, KERNEL = range(3)
MODEL_CODES = {"surface": SURFACE, "particles": PARTICLES, "kernel": KERNEL}


@rare_kernel
def contact_points(world: World, p: int) -> int:
    """Find the contact points of pair p and return how many there are."""
    return points_of(world, p, world.particles)


@kernel
def points_of(world: World, p: int, particles: Records | None) -> int:
    """As contact_points. Where `particles` is None the compiler leaves the models with particles out altogether."""
    if particles is None:
        return surface.find_points(world, p)
    if world.controls[0].model == KERNEL:
        return smoothed.find_points(world, p)
    return discs.find_points(world, p)


@rare_kernel
def near_slots(world: World, a: int, b: int, reach: float, out: Integers) -> int:
    """Write the candidate slots of the pair of bodies a and b into `out` and return how many there are."""
    return slots_near(world, a, b, reach, out, world.particles)


@kernel
def slots_near(world: World, a: int, b: int, reach: float, out: Integers, particles: Records | None) -> int:
    """As near_slots; see points_of."""
    if particles is None:
        return surface.near_slots(world, a, b, reach, out)
    if world.controls[0].model == KERNEL:
        return smoothed.near_slots(world, a, b, reach, out)
    return discs.near_slots(world, a, b, reach, out)


@rare_kernel
def place_ended(world: World, p: int, old: Record, point: Record) -> None:
    """Set place, normal and share of a contact of pair p that has just ended."""
    place_of(world, p, old, point, world.particles)


@kernel
def place_of(world: World, p: int, old: Record, point: Record, particles: Records | None) -> None:
    """As place_ended; see points_of."""
    if particles is None:
        surface.place_ended(world, world.pairs[p], old, point)
    else:
        point.x = old.x
        point.y = old.y
        point.nx = old.nx
        point.ny = old.ny
