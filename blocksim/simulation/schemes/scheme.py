"""What a stepping scheme is to the rest of the simulation."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

from blocksim.kernels.arrays import World
from blocksim.kernels.nonsmooth.arrays import Nonsmooth
from blocksim.simulation.contacts import Rows
from blocksim.world.scenes import Construction

AnyScene = World | Nonsmooth
"""The arrays of a scene under way; `world` are those that all schemes share."""
Scene = TypeVar("Scene", bound=AnyScene)

COUNTED = ("contact_count", "largest_overlap")
"""What every scheme measures beside its energies: number of contacts, m."""


@dataclass(frozen=True)
class Scheme:
    """How scenes of one type are built, advanced by threads and in ensembles, and measured.

    All functions take the scheme's own scenes.
    """

    name: str  # time.scheme
    scene_type: type
    ledger: tuple[str, ...]  # energies (J) that are measured
    least_bodies: int  # a thread; with fewer, threads wait for one another longer than they work
    construction: Construction  # of its scenes at time zero
    advance: Callable[[Any, int], int]  # to a step with one thread: status code
    advance_in_team: Callable[[Any, int, int], int]  # the same as thread k of several
    advance_members: Callable[..., None]  # of stacked scenes: members, last steps, first rows (output), codes (output)
    with_more_room: Callable[[Any], Any]  # for pairs
    with_threads: Callable[[Any, int], Any]  # with room for what they exchange
    threads_of: Callable[[Any], int]  # for how many threads there is such room
    for_another_thread: Callable[[Any], Any]  # the same scene with work space of its own
    contacts: Callable[[Any, int], Rows]  # of a scene with so many blocks
    measure: Callable[[Any, Any], None]  # writes energies, number of contacts and largest overlap into a row

    @property
    def measured(self) -> tuple[str, ...]:
        """Names of the entries of a measured row."""
        return (*self.ledger, *COUNTED)
