"""One world out of many copies of a scene."""

from blocksim.kernels.common.arrays import Records, World
from blocksim.kernels.common.jit import kernel, rare_kernel


@kernel
def of_member(records: Records | None, m: int) -> Records | None:
    """Return the particles or corners of one member; None where there are none."""
    if records is None:
        return None
    return records[m]


@rare_kernel
def member(worlds: World, m: int) -> World:
    """Return the world of one member; every array of `worlds` has the members along its first axis."""
    return World(
        worlds.bodies[m],
        worlds.pairs[m],
        worlds.contacts[m],
        worlds.candidates[m],
        worlds.operators[m],
        worlds.interactions[m],
        of_member(worlds.particles, m),
        of_member(worlds.corners, m),
        worlds.points[m],
        worlds.spare_pairs[m],
        worlds.spare_candidates[m],
        worlds.heads[m],
        worlds.links[m],
        worlds.large[m],
        worlds.neighbours[m],
        worlds.action[m],
        worlds.before[m],
        worlds.matrices[m],
        worlds.moved[m],
        worlds.motion[m],
        worlds.controls[m],
        worlds.clock[m],
        worlds.ledger[m],
        worlds.shares[m],
        worlds.between[m],
        worlds.team[m],
        worlds.loads[m],
        worlds.load_pieces[m],
    )
