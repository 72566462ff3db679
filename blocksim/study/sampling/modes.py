"""The modes of a sweep by the word that the file has for them."""

from collections.abc import Callable

from blocksim.scenario import Sweep
from blocksim.study.sampling.design import Design
from blocksim.study.sampling.grid import grid
from blocksim.study.sampling.lhs import lhs
from blocksim.study.sampling.listed import listed
from blocksim.study.sampling.normal import normal
from blocksim.study.sampling.sobol import sobol
from blocksim.study.sampling.table import table

MODES: dict[str, Callable[[Sweep], Design]] = {
    "grid": grid,
    "list": listed,
    "table": table,
    "lhs": lhs,
    "sobol": sobol,
    "normal": normal,
}


def design_of(sweep: Sweep) -> Design:
    """Return the settings of all cases, the same for the same sweep on every machine.

    Raises what reading a table raises, UnavailableError where a sampled mode has no scipy.
    """
    return MODES[sweep.mode](sweep)


def remarks(sweep: Sweep) -> list[str]:
    """Return what whoever chose this sweep may want to know."""
    if sweep.mode == "sobol" and sweep.samples & (sweep.samples - 1):
        below = 1 << (sweep.samples.bit_length() - 1)
        return [f"{sweep.samples} Sobol points are not balanced; {below} or {2 * below} are"]
    return []
