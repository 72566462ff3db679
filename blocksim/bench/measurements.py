"""All measurements: one file each, and one line here; those with other engines apart."""

from collections.abc import Sequence

from blocksim.bench import (
    ensemble,
    nonsmooth_blocks,
    nonsmooth_threads,
    nonsmooth_walls,
    startup,
    threads,
    three_blocks,
    walls,
)
from blocksim.bench.measurement import Measurement
from blocksim.bench.peers import peer_three_blocks, peer_wall
from blocksim.errors import BlocksimError, ExitCode
from blocksim.scenario.spelling import nearest

MOST_SLIPS = 3

MEASUREMENTS = (
    Measurement("three-blocks", "collapse of the three blocks", three_blocks.measure, quick=three_blocks.QUICK),
    Measurement("ensemble", "many collapses together", ensemble.measure, quick=ensemble.QUICK),
    Measurement("walls", "pushed walls", walls.measure, quick=walls.QUICK),
    Measurement("threads", "two threads on one wall", threads.measure, quick=threads.QUICK),
    Measurement(
        "nonsmooth-blocks",
        "collapse of the three blocks, non-smooth",
        nonsmooth_blocks.measure,
        quick=nonsmooth_blocks.QUICK,
    ),
    Measurement("nonsmooth-walls", "pushed walls, non-smooth", nonsmooth_walls.measure, quick=nonsmooth_walls.QUICK),
    Measurement(
        "nonsmooth-threads",
        "two threads on one wall, non-smooth",
        nonsmooth_threads.measure,
        quick=nonsmooth_threads.QUICK,
    ),
    Measurement("start-up", "starting the command", startup.measure, quick=startup.QUICK),
)
PEERS = (
    Measurement(
        "three-blocks",
        "three blocks to within 0.2 mm, also by pymunk and Box2D",
        peer_three_blocks.measure,
        quick=peer_three_blocks.QUICK,
    ),
    Measurement(
        "three-blocks-e0",
        "the same without restitution",
        peer_three_blocks.measure_without_restitution,
        quick=peer_three_blocks.QUICK,
    ),
    Measurement("wall", "pushed wall, also by pymunk and Box2D", peer_wall.measure, quick=peer_wall.QUICK),
)


class UnknownMeasurementError(BlocksimError):
    """A measurement that is not in the registry."""

    exit_code = ExitCode.USAGE


def chosen(names: Sequence[str], *, peers: bool = False) -> tuple[Measurement, ...]:
    """Return the measurements of some names, in the order of the registry; all without names."""
    table = PEERS if peers else MEASUREMENTS
    known = [one.name for one in table]
    unknown = [name for name in dict.fromkeys(names) if name not in known]
    if unknown:
        raise UnknownMeasurementError("\n".join(_unknown(name, known, peers=peers) for name in unknown))
    return tuple(one for one in table if not names or one.name in names)


def _unknown(name: str, known: Sequence[str], *, peers: bool) -> str:
    meant = nearest(name, known, MOST_SLIPS)
    hint = f", did you mean '{meant}'?" if meant else ";"
    where = " with --peers" if peers else ""
    return f"bench: NAME '{name}': no such measurement{hint} Choose{where}: {', '.join(known)}".replace("; C", "; c")
