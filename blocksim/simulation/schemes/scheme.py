"""What a stepping scheme is to the rest of the simulation; each is a file of this folder.

Nothing outside this folder and the kernels asks which scheme a scene is of: it asks the scheme.
"""

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from blocksim.kernels.common.arrays import ALL, OUTLINE, Records, World
from blocksim.kernels.common.systems import Coupled
from blocksim.kernels.nonsmooth.arrays import Nonsmooth
from blocksim.scenario import PlacedBody, Scenario
from blocksim.scenario.overlap import Outlines
from blocksim.simulation.frames import Rows, empty_rows
from blocksim.world.build import Construction

AnyScene = World | Nonsmooth
"""The arrays of a scene under way; `world` are those that all schemes share."""
Scene = TypeVar("Scene", bound=World | Nonsmooth | Coupled)

BODIES_A_THREAD = 100
"""With fewer, threads of the usual schemes wait for one another longer than they work."""
COUNTED = ("contact_count", "largest_overlap")
"""What every scheme measures beside its energies: number of contacts, m."""
Floats = NDArray[np.float64]


class Overlaps(NamedTuple):
    """Pairs of bodies that overlap, and how deep they may."""

    a: NDArray[Any]  # numbers of bodies
    b: NDArray[Any]
    depth: Floats  # m
    limit: Floats  # m, or 1 where any depth is judged alike


NO_OVERLAPS = Overlaps(*(np.zeros(0) for _ in Overlaps._fields))


class SettlingSteps(NamedTuple):
    """How settling before time zero goes on with a scheme."""

    call: int = 20  # steps between two looks at the kinetic energy
    part: int = 1000  # at most, for one part of the loads
    most: int = 1_000_000  # in all
    least_share: float = 2e-4  # of the smallest side of a block: way of a mechanism


SHORT_STEPS = SettlingSteps()


def outlines_of(world: World) -> Outlines:
    """Return the outlines of all bodies, those of polygons in boxes about their centroids."""
    bodies = world.bodies
    outlines = Outlines.rectangles(*(bodies[name] for name in ("x", "y", "half_x", "half_y", "cos", "sin")))
    polygons = np.flatnonzero(bodies["faces"] == OUTLINE)
    if not polygons.size:
        return outlines
    shapes, shape_of = np.unique(bodies[["first_corner", "corner_count"]][polygons], return_inverse=True)
    most = max(4, int(shapes["corner_count"].max()))
    last = shapes["corner_count"][:, np.newaxis] - 1  # repeated up to a common number
    rows = world.corners[shapes["first_corner"][:, np.newaxis] + np.minimum(np.arange(most), last)]
    outlines.kinds[polygons] = shape_of
    return outlines._replace(polygons=np.stack([rows["x"], rows["y"]], axis=-1))


def smallest_sides(world: World, one: NDArray[Any], other: NDArray[Any]) -> Floats:
    """Return the smallest side (m) of each pair of bodies, infinite where neither has any."""
    half = np.minimum(world.bodies["half_x"], world.bodies["half_y"])
    side = np.where((half > 0.0) & (world.bodies["faces"] == ALL), 2.0 * half, np.inf)
    smallest: Floats = np.minimum(side[one], side[other])
    return smallest


def corner_ways(change: Floats, radius: Floats) -> Floats:
    """Return a bound of the ways (m) of the corners of blocks whose x, y, angle changed so, (3, b)."""
    dx, dy, turned = change
    return np.asarray(np.hypot(dx, dy) + radius * np.abs(turned))


def _same(scene: Any, *_: Any) -> Any:
    return scene


def _nothing(*_: Any) -> None:
    """Do nothing."""


def _unrest_of_accelerations(
    scene: Any, is_free: NDArray[np.bool_], _change: Floats, _side: float, scale: float
) -> float:
    """Return the largest acceleration of a corner of a free block, over that of gravity and loads (m/s2)."""
    bodies = scene.world.bodies[: is_free.size][is_free]
    rates = np.hypot(bodies["ax"], bodies["ay"]) + bodies["radius"] * np.abs(bodies["spin_rate"])
    return float(rates.max()) / scale if scale > 0.0 else np.inf


@dataclass(frozen=True, kw_only=True)
class Scheme:
    """How scenes of one type are built, advanced by threads and in ensembles, brought to rest, and measured.

    All functions take the scheme's own scenes. The defaults are those of a scheme for one thread, without contacts,
    whose members of ensembles are advanced one by one, and which is at rest where no block has an acceleration.
    """

    # building
    name: str  # time.scheme
    scene_type: type
    construction: Construction  # of its scenes at time zero
    with_systems: "Scheme | None" = None  # the same for scenes with systems beside blocks and supports

    # advancing
    advance: Callable[[Any, int], int]  # to a step with one thread: status code
    advance_in_team: Callable[[Any, int, int], int] = _same  # the same as thread k of several
    advance_members: Callable[..., None] | None = None
    # of stacked scenes: members, last steps, first rows (output), codes (output)
    least_bodies: int = sys.maxsize  # a thread; with fewer, threads wait for one another longer than they work
    with_more_room: Callable[[Any], Any] = _same  # for pairs
    with_threads: Callable[[Any, int], Any] = _same  # with room for what they exchange
    threads_of: Callable[[Any], int] = lambda _: 1  # for how many threads there is such room
    for_another_thread: Callable[[Any], Any] = _same  # the same scene with work space of its own
    after_event: Callable[[Any, Records], bool] = lambda *_: False
    # brings its arrays up to date with bodies that an event has changed, given these before; whether a call that goes
    # to no further step is to evaluate contacts anew

    # compiling: sets of machine code by name, see compilation.py
    kernels: Callable[[str], str]  # that it needs with a contact model
    of_outlines: Mapping[str, str] = field(default_factory=dict)  # the set instead of another, with any polygon
    kernel_variant: Callable[[str, Scenario, Sequence[PlacedBody] | None], str] = _same  # of a set, for a scenario
    kernel_sets: Mapping[str, Mapping[str, object]] = field(default_factory=dict)  # changes of the smallest scene

    # settling before time zero
    settling: SettlingSteps = SHORT_STEPS
    halt: Callable[[Any, int], None] = _nothing  # takes velocities of so many blocks from arrays beside the bodies
    begin: Callable[[Any], None] = _nothing  # begins its own books anew, at rest
    unrest: Callable[[Any, NDArray[np.bool_], Floats, float, float], float] = _unrest_of_accelerations
    # how far a scene is from rest, over gravity and loads, given which blocks are free, (b,), their change of x, y,
    # angle by the last call, (3, b), the smallest side of a block (m), the acceleration by gravity and loads (m/s2)
    give: Callable[[Any], float] = lambda _: 0.0  # m, by which contacts have given way at most

    # recording and diagnosis
    ledger: tuple[str, ...]  # energies (J) that are measured
    measure: Callable[[Any, Any], None]  # writes energies, number of contacts and largest overlap into a row
    contacts: Callable[[Any, int], Rows] = lambda *_: empty_rows(0)  # of a scene with so many blocks
    overlaps: Callable[[Any], Overlaps] = lambda _: NO_OVERLAPS  # of a scene that an overlap has ended
    lost_contact: Callable[[Any, Overlaps], str] = lambda *_: ""
    # why it has ended, where not by contact.max_overlap
    warning: Callable[[Any, float, float], str] = lambda *_: ""
    # of contacts in a scene that has finished, given the largest overlap and the smallest side of a block (m)

    @property
    def measured(self) -> tuple[str, ...]:
        """Names of the entries of a measured row of a scene without further systems."""
        return (*self.ledger, *COUNTED)
