"""Springs and dashpots, small explicit steps."""

from blocksim.kernels.advance import advance, advance_in_team
from blocksim.kernels.arrays import World
from blocksim.kernels.energy import LEDGER_ROW, measure
from blocksim.kernels.ensemble import advance_members
from blocksim.simulation.schemes.explicit_contacts import explicit_contacts
from blocksim.simulation.schemes.scheme import Scheme
from blocksim.world.build import EXPLICIT as CONSTRUCTION
from blocksim.world.build import with_more_room, with_threads

WORK_SPACE = ("points", "matrices", "before", "action")


def with_own_work_space(world: World) -> World:
    """Return the same world with arrays of its own where one pair is worked on."""
    return world._replace(**{name: getattr(world, name).copy() for name in WORK_SPACE})


EXPLICIT = Scheme(
    name="explicit",
    scene_type=World,
    ledger=LEDGER_ROW,
    least_bodies=100,
    construction=CONSTRUCTION,
    advance=advance,
    advance_in_team=advance_in_team,
    advance_members=advance_members,
    with_more_room=with_more_room,
    with_threads=with_threads,
    threads_of=lambda world: int(world.shares.size),
    for_another_thread=with_own_work_space,
    contacts=explicit_contacts,
    measure=measure,
)
