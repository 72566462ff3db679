"""What a stepping scheme is to the rest of the simulation."""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

from blocksim.kernels.common.arrays import World
from blocksim.kernels.common.systems import Coupled
from blocksim.kernels.nonsmooth.arrays import Nonsmooth
from blocksim.simulation.contacts import Rows, empty_rows
from blocksim.world.scenes import Construction

AnyScene = World | Nonsmooth
"""The arrays of a scene under way; `world` are those that all schemes share."""
Scene = TypeVar("Scene", bound=World | Nonsmooth | Coupled)

COUNTED = ("contact_count", "largest_overlap")
"""What every scheme measures beside its energies: number of contacts, m."""


def _same(scene: Any, *_: Any) -> Any:
    return scene


def _no_contacts(*_: Any) -> Rows:
    return empty_rows(0)


@dataclass(frozen=True)
class Scheme:
    """How scenes of one type are built, advanced by threads and in ensembles, and measured.

    All functions take the scheme's own scenes. The defaults are those of a scheme for one thread, without contacts,
    whose members of ensembles are advanced one by one.
    """

    name: str  # time.scheme
    scene_type: type
    ledger: tuple[str, ...]  # energies (J) that are measured
    construction: Construction  # of its scenes at time zero
    advance: Callable[[Any, int], int]  # to a step with one thread: status code
    measure: Callable[[Any, Any], None]  # writes energies, number of contacts and largest overlap into a row
    kernels: Callable[[str], str]  # set of machine code that it needs with a contact model; see compilation.py
    least_bodies: int = sys.maxsize  # a thread; with fewer, threads wait for one another longer than they work
    advance_in_team: Callable[[Any, int, int], int] = _same  # the same as thread k of several
    advance_members: Callable[..., None] | None = None
    # of stacked scenes: members, last steps, first rows (output), codes (output)
    with_more_room: Callable[[Any], Any] = _same  # for pairs
    with_threads: Callable[[Any, int], Any] = _same  # with room for what they exchange
    threads_of: Callable[[Any], int] = lambda _: 1  # for how many threads there is such room
    for_another_thread: Callable[[Any], Any] = _same  # the same scene with work space of its own
    contacts: Callable[[Any, int], Rows] = _no_contacts  # of a scene with so many blocks
    with_systems: "Scheme | None" = None  # the same for scenes with systems beside blocks and supports

    @property
    def measured(self) -> tuple[str, ...]:
        """Names of the entries of a measured row of a scene without further systems."""
        return (*self.ledger, *COUNTED)
