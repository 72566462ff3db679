"""All measurements: one line each."""

from collections.abc import Sequence

from blocksim.bench import soils, startup, three_blocks, walls
from blocksim.bench.measurement import Measurement
from blocksim.errors import BlocksimError, ExitCode
from blocksim.scenario.spelling import nearest

MOST_SLIPS = 3

MEASUREMENTS = (
    three_blocks.EXPLICIT,
    three_blocks.ENSEMBLE,
    walls.EXPLICIT,
    walls.EXPLICIT_THREADS,
    three_blocks.NONSMOOTH,
    walls.NONSMOOTH,
    walls.NONSMOOTH_THREADS,
    soils.SOILS,
    startup.START_UP,
)


class UnknownMeasurementError(BlocksimError):
    """A measurement that is not in the registry."""

    exit_code = ExitCode.USAGE


def choose(names: Sequence[str], table: Sequence[Measurement] | None = None) -> tuple[Measurement, ...]:
    """Return the measurements of some names, in the order of a table, by default MEASUREMENTS; all without names.

    Raises UnknownMeasurementError.
    """
    table = MEASUREMENTS if table is None else table
    known = [one.name for one in table]
    unknown = [name for name in dict.fromkeys(names) if name not in known]
    if unknown:
        meant = {name: nearest(name, known, MOST_SLIPS) for name in unknown}
        hints = {name: f", did you mean '{near}'? Choose" if near else "; choose" for name, near in meant.items()}
        lines = (f"bench: NAME '{name}': no such measurement{hint}: {', '.join(known)}" for name, hint in hints.items())
        raise UnknownMeasurementError("\n".join(lines))
    return tuple(one for one in table if not names or one.name in names)
