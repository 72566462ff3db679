"""All measurements: one file each, and one line here; those with other engines apart."""

from collections.abc import Sequence

from blocksim.bench import ensemble, soils, startup, threads, three_blocks, walls
from blocksim.bench.measurement import Measurement
from blocksim.bench.peers import PEERS, require_all
from blocksim.errors import BlocksimError, ExitCode
from blocksim.scenario.spelling import nearest

MOST_SLIPS = 3

MEASUREMENTS = (
    three_blocks.EXPLICIT,
    ensemble.ENSEMBLE,
    walls.EXPLICIT,
    threads.EXPLICIT,
    three_blocks.NONSMOOTH,
    walls.NONSMOOTH,
    threads.NONSMOOTH,
    soils.SOILS,
    startup.START_UP,
)


class UnknownMeasurementError(BlocksimError):
    """A measurement that is not in the registry."""

    exit_code = ExitCode.USAGE


def chosen(names: Sequence[str], *, peers: bool = False) -> tuple[Measurement, ...]:
    """Return the measurements of some names, in the order of the registry; all without names.

    Raises UnknownMeasurementError, and UnavailableError where a package of other engines is missing.
    """
    table = PEERS if peers else MEASUREMENTS
    known = [one.name for one in table]
    unknown = [name for name in dict.fromkeys(names) if name not in known]
    if unknown:
        raise UnknownMeasurementError("\n".join(_unknown(name, known, peers=peers) for name in unknown))
    if peers:
        require_all()
    return tuple(one for one in table if not names or one.name in names)


def _unknown(name: str, known: Sequence[str], *, peers: bool) -> str:
    meant = nearest(name, known, MOST_SLIPS)
    hint = f", did you mean '{meant}'? Choose" if meant else "; choose"
    where = " with --peers" if peers else ""
    return f"bench: NAME '{name}': no such measurement{hint}{where}: {', '.join(known)}"
