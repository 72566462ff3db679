"""The stepping schemes: what each is to the rest of the simulation; building, compiling and advancing scenes of any.

A new one is one file of this folder and one line in `blocksim.scenario.models.timeline.SCHEMES`. Nothing outside this
folder and the kernels asks which scheme a scene is of: it asks the scheme.
"""

import functools
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from importlib import import_module
from types import TracebackType
from typing import Any, NamedTuple, Self, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from blocksim.errors import BlocksimError, InvalidInputError, OutputError
from blocksim.kernels.common import arrays, compiler, jit, systems
from blocksim.kernels.nonsmooth.arrays import Nonsmooth
from blocksim.options import silent
from blocksim.scenario import Model, Scenario, overlap
from blocksim.scenario.models.timeline import SCHEMES as TABLES
from blocksim.scenario.structures.base import PolygonStructure
from blocksim.simulation import trajectory
from blocksim.world import build as scenes
from blocksim.world.systems import others_of

AnyScene = arrays.World | Nonsmooth
"""The arrays of a scene under way; `world` are those that all schemes share."""
Scene = TypeVar("Scene", bound=arrays.World | Nonsmooth | systems.Coupled)

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


def outlines_of(world: arrays.World) -> overlap.Outlines:
    """Return the outlines of all bodies, those of polygons in boxes about their centroids."""
    bodies = world.bodies
    outlines = overlap.Outlines.rectangles(*(bodies[name] for name in ("x", "y", "half_x", "half_y", "cos", "sin")))
    polygons = np.flatnonzero(bodies["faces"] == arrays.OUTLINE)
    if not polygons.size:
        return outlines
    shapes, shape_of = np.unique(bodies[["first_corner", "corner_count"]][polygons], return_inverse=True)
    most = max(4, int(shapes["corner_count"].max()))
    last = shapes["corner_count"][:, np.newaxis] - 1  # repeated up to a common number
    rows = world.corners[shapes["first_corner"][:, np.newaxis] + np.minimum(np.arange(most), last)]
    outlines.kinds[polygons] = shape_of
    return outlines._replace(polygons=np.stack([rows["x"], rows["y"]], axis=-1))


def corner_ways(change: Floats, radius: Floats) -> Floats:
    """Return a bound of the ways (m) of the corners of blocks whose x, y, angle changed so, (3, b)."""
    dx, dy, turned = change
    return np.asarray(np.hypot(dx, dy) + radius * np.abs(turned))


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
    construction: scenes.Construction  # of its scenes at time zero
    with_systems: "Scheme | None" = None  # the same for scenes with systems beside blocks and supports

    # advancing
    advance: Callable[[Any, int], int]  # to a step with one thread: status code
    advance_in_team: Callable[[Any, int, int], int] = lambda scene, *_: scene  # the same as thread k of several
    advance_members: Callable[..., None] | None = None
    # of stacked scenes: members, last steps, first rows (output), codes (output)
    least_bodies: int = sys.maxsize  # a thread; with fewer, threads wait for one another longer than they work
    with_more_room: Callable[[Any], Any] = lambda scene, *_: scene  # for pairs
    with_threads: Callable[[Any, int], Any] = lambda scene, *_: scene  # with room for what they exchange
    threads_of: Callable[[Any], int] = lambda _: 1  # for how many threads there is such room
    for_another_thread: Callable[[Any], Any] = lambda scene, *_: scene  # the same scene with work space of its own
    after_event: Callable[[Any, arrays.Records], bool] = lambda *_: False
    # brings its arrays up to date with bodies that an event has changed, given these before; whether a call that goes
    # to no further step is to evaluate contacts anew

    # compiling: sets of machine code by name
    kernels: Callable[[str], str]  # that it needs with a contact model
    of_outlines: Mapping[str, str] = field(default_factory=dict)  # the set instead of another, with any polygon
    kernel_variant: Callable[[str, Scenario], str] = lambda kernels, _: kernels  # of a set, for a scenario
    kernel_sets: Mapping[str, Mapping[str, object]] = field(default_factory=dict)  # changes of the smallest scene

    # settling before time zero
    settling: SettlingSteps = SHORT_STEPS
    equilibrium: Callable[..., Any] | None = None  # without time: statics/spring_equilibrium.py
    halt: Callable[[Any, int], None] = silent  # takes velocities of so many blocks from arrays beside the bodies
    begin: Callable[[Any], None] = silent  # begins its own books anew, at rest
    unrest: Callable[[Any, NDArray[np.bool_], Floats, float, float], float] = _unrest_of_accelerations
    # how far a scene is from rest, over gravity and loads, given which blocks are free, (b,), their change of x, y,
    # angle by the last call, (3, b), the smallest side of a block (m), the acceleration by gravity and loads (m/s2)
    give: Callable[[Any], float] = lambda _: 0.0  # m, by which contacts have given way at most

    # recording and diagnosis
    ledger: tuple[str, ...]  # energies (J) that are measured
    measure: Callable[[Any, Any], None]  # writes energies, number of contacts and largest overlap into a row
    contacts: Callable[[Any, int], trajectory.Rows] = lambda *_: np.zeros(0, trajectory.CONTACT_ROW)
    # of a scene with so many blocks
    overlaps: Callable[[Any], Overlaps] = lambda _: NO_OVERLAPS  # of a scene that an overlap has ended
    lost_contact: Callable[[Any, Overlaps], str] = lambda *_: ""
    # why it has ended, where not by contact.max_overlap
    convergence: Callable[..., Mapping[str, float] | None] = lambda *_: None
    # how well the equations of a scene, or of a member of a stack, were solved so far: results.ImpulseConvergence
    warning: Callable[[Any, float, float], str] = lambda *_: ""
    # of contacts in a scene that has finished, given the largest overlap and the smallest side of a block (m)

    @property
    def row_names(self) -> tuple[str, ...]:
        """Names of the entries of a measured row of a scene without further systems."""
        return (*self.ledger, *COUNTED)


class _Schemes(Mapping[str, Scheme]):
    """Scheme as written in a scenario, and what it does: as the models of `time` declare it."""

    def __getitem__(self, name: str) -> Scheme:
        module, _, declared = TABLES[name].declared_in.partition(":")
        scheme: Scheme = getattr(import_module(module), declared)
        return scheme

    def __iter__(self) -> Iterator[str]:
        return iter(TABLES)

    def __len__(self) -> int:
        return len(TABLES)


SCHEMES: Mapping[str, Scheme] = _Schemes()


KNOWN: dict[type, Scheme] = {}  # by types of scenes: every frame asks several times


def scheme_of(scene: AnyScene | systems.Coupled) -> Scheme:
    """Return the scheme that a scene is of."""
    if type(scene) not in KNOWN:
        schemes = (one for scheme in SCHEMES.values() for one in (scheme, scheme.with_systems) if one is not None)
        KNOWN[type(scene)] = next(scheme for scheme in schemes if isinstance(scene, scheme.scene_type))
    return KNOWN[type(scene)]


def build(model: Model) -> AnyScene:
    """Return the scene of a scenario at time zero. Raises what the scheme raises for a scenario that it cannot run."""
    scene: AnyScene = scenes.build_one(model, SCHEMES[model.scenario.time.scheme].construction)
    others = others_of(model)
    return cast("AnyScene", scenes.couple(model, scene, others)) if others else scene


def build_stacks(models: Sequence[Model]) -> Iterator[scenes.SceneStack | scenes.Refusal]:
    """Build the scenes of scenarios at time zero, those of one scheme and shape together.

    A scene with systems beside blocks and supports, one of a scheme without a way to advance members together, and one
    with events or that settles before it begins, is a stack of its own.
    """
    keys: list[str | None] = []
    for model in models:
        scheme = SCHEMES[model.scenario.time.scheme]
        is_alone = model.scenario.systems or model.scenario.events or scheme.advance_members is None or model.settles
        keys.append(None if is_alone else scheme.name)
    for places in scenes.group_equal(keys):
        key = keys[places[0]]
        if key is not None:
            some = [models[i] for i in places]
            yield from scenes.build_stacks(some, SCHEMES[key].construction, places)
            continue
        for i in places:
            try:
                scene = build(models[i])
            except BlocksimError as error:
                yield scenes.Refusal(i, error)
            else:
                yield scenes.SceneStack([i], scenes.stack_of_one(scene))


def ledger_names(scene: AnyScene | systems.Coupled) -> tuple[str, ...]:
    """Return the names of the energies (J) of a scene: those of its scheme, then of its further systems."""
    names = scheme_of(scene).ledger
    if not isinstance(scene, systems.Coupled):
        return names
    return (*names, *(name for energies in systems.plan_of(scene.systems).energies for name in energies))


def measure_row(scene: AnyScene | systems.Coupled) -> NDArray[np.float64]:
    """Return energies (J) as `ledger_names` has them, number of contacts and largest overlap (m)."""
    scheme = scheme_of(scene)
    row = np.zeros(len(scheme.row_names))
    scheme.measure(scene, row)
    if not isinstance(scene, systems.Coupled):
        return row
    return np.concatenate([row[: -len(COUNTED)], system_totals(scene)[0], row[-len(COUNTED) :]])


def system_totals(scene: AnyScene | systems.Coupled) -> tuple[Floats, float]:
    """Return energies (J) of the systems beside the blocks, one after the other, and the mass (kg) of them all."""
    if not isinstance(scene, systems.Coupled):
        return np.zeros(0), 0.0
    counts = [len(names) + 1 for names in systems.plan_of(scene.systems).energies]
    row, masses = np.zeros(sum(counts)), np.cumsum(counts) - 1  # a mass after the energies of each
    systems.measure_systems(scene, row)
    return np.delete(row, masses), sum(row[masses].tolist(), 0.0)


def useful_threads(threads: int, bodies: int, least_bodies: int = BODIES_A_THREAD) -> int:
    """Return how many of `threads` are of use for a scene; the result is the same for any number, bit for bit.

    `bodies` are blocks and elements of further systems, `least_bodies` is the scheme's.
    """
    most = 1 if jit.config.DISABLE_JIT else max(1, bodies // least_bodies)
    return min(threads, most)


def team_for(scene: AnyScene, threads: int, elements: int = 0) -> "Team":
    """Return a team of as many of `threads` as are of use for a scene with so many elements of further systems.

    Raises ValueError for less than one.
    """
    bodies = scene.world.bodies.size - 1 + elements
    return Team(useful_threads(threads, bodies, scheme_of(scene).least_bodies))


class Team:
    """A fixed number of threads that advance a world, this one among them."""

    def __init__(self, threads: int = 1) -> None:
        """Take as many as are asked for, however many cores there are. Raises ValueError for less than one."""
        if threads < 1:
            raise ValueError(f"threads must be at least 1, not {threads}")
        self.threads = threads
        self._pool = ThreadPoolExecutor(threads - 1) if threads > 1 else None

    def __enter__(self) -> Self:
        """Start the other threads. Raises InvalidInputError where the system does not give that many."""
        if self._pool is not None:
            everybody = threading.Barrier(self.threads, timeout=60.0)
            try:
                for _ in range(self.threads - 1):
                    self._pool.submit(everybody.wait)
                everybody.wait()
            except RuntimeError as error:  # no more threads, or one that does not start
                everybody.abort()
                raise InvalidInputError(f"{self.threads} threads cannot be started here: {error}") from error
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the other threads."""
        if self._pool is not None:
            self._pool.shutdown()

    def advance(self, scene: Scene, last_step: int) -> tuple[Scene, int]:
        """Advance to a step, giving the pair lists more room as often as needed; return scene and status code."""
        scheme = scheme_of(scene)
        if scheme.threads_of(scene) != self.threads:
            scene = scheme.with_threads(scene, self.threads)
        status = self._advance(scene, last_step)
        while status == arrays.PAIRS_FULL:
            scene = scheme.with_more_room(scene)
            status = self._advance(scene, last_step)
        return scene, status

    def _advance(self, scene: Scene, last_step: int) -> int:
        scheme = scheme_of(scene)
        if self._pool is None:
            return scheme.advance(scene, last_step)
        scene.world.team[arrays.TEAM_SIZE] = self.threads
        others = [scheme.for_another_thread(scene) for _ in range(1, self.threads)]
        for k, other in enumerate(others, start=1):
            self._pool.submit(scheme.advance_in_team, other, last_step, k)
        return int(scheme.advance_in_team(scene, last_step, 0))


ALONE = Team()


DEFAULT = "surface"  # the set without a mark of its own in the cache
SMALLEST_SCENE = {
    "schema": 1,
    "name": "compile",
    "materials": {"any": {"density": 1000.0, "young_modulus": 1e9, "poisson_ratio": 0.3}},
    "blocks": {"any": {"width": 1.0, "height": 1.0, "length": 1.0, "material": "any"}},
    "bodies": [{"block": "any", "x": 0.0, "y": 0.5}],
}


def kernels_of(scenario: Scenario) -> str:
    """Return which set of kernels a scenario needs."""
    scheme = SCHEMES[scenario.time.scheme]
    kernels = scheme.kernels(scenario.contact.model)
    are_shaped = any(isinstance(structure, PolygonStructure) for structure in scenario.structures)
    if are_shaped or any(block.polygon for block in scenario.blocks.values()):
        kernels = scheme.of_outlines.get(kernels, kernels)
    return scheme.kernel_variant(kernels, scenario)


@functools.cache
def compile_kernels(kernels: str = DEFAULT) -> float:
    """Compile a set of kernels, or load it from the cache on disk; return the seconds it took.

    Works once a process. Raises OutputError where the disk of the cache fails.
    """
    began = time.perf_counter()
    try:
        with compiler.compiling():
            changes = next(
                scheme.kernel_sets.get(kernels, {"time": {"scheme": scheme.name}})
                for scheme in SCHEMES.values()
                if kernels in (*scheme.kernel_sets, scheme.kernels(""))
            )
            scene, _ = ALONE.advance(build(Model({**SMALLEST_SCENE, **changes})), 0)
            measure_row(scene)
            if kernels != DEFAULT:
                jit.mark(kernels)
    except OSError as error:
        raise OutputError(
            f"{jit.cache_folder()}: the compiled solver cannot be stored there: {error.strerror or error}; "
            "free some space, or set BLOCKSIM_CACHE_DIR to a folder on another disk"
        ) from error
    return time.perf_counter() - began


def is_compiled(kernels: str = DEFAULT) -> bool:
    """Return True if a set of kernels lies in the cache (or nothing has to be compiled)."""
    return jit.is_compiled() if kernels == DEFAULT else jit.is_marked(kernels)
