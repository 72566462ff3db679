"""Rigid contacts and impulses, long steps."""

from blocksim.kernels.nonsmooth.advance import advance_nonsmooth, advance_nonsmooth_in_team
from blocksim.kernels.nonsmooth.arrays import Nonsmooth
from blocksim.kernels.nonsmooth.energy import NONSMOOTH_LEDGER, measure_nonsmooth
from blocksim.kernels.nonsmooth.ensemble import advance_nonsmooth_members
from blocksim.simulation.schemes.nonsmooth_contacts import nonsmooth_contacts
from blocksim.simulation.schemes.scheme import Scheme
from blocksim.world.nonsmooth import NONSMOOTH as CONSTRUCTION
from blocksim.world.nonsmooth import threads_of, with_more_rows, with_more_threads

NONSMOOTH = Scheme(
    name="nonsmooth",
    scene_type=Nonsmooth,
    ledger=NONSMOOTH_LEDGER,
    least_bodies=100,  # two threads on 100 blocks gain nothing, on 200 they are 1.2 to 1.4 times as fast
    construction=CONSTRUCTION,
    advance=advance_nonsmooth,
    advance_in_team=advance_nonsmooth_in_team,
    advance_members=advance_nonsmooth_members,
    with_more_room=with_more_rows,
    with_threads=with_more_threads,
    threads_of=threads_of,
    for_another_thread=lambda scene: scene,  # rows are solved in registers
    contacts=nonsmooth_contacts,
    measure=measure_nonsmooth,
)
