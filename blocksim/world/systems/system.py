"""What a system is to all rooms: declared once, and looped over by recorder, files, ledger, exports and pictures.

See blocksim/world/README.md. Nothing in here needs the compiler: stored runs are read without it.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario import Model

if TYPE_CHECKING:
    from blocksim.kernels.common.systems import Stages

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]
Table = dict[str, list[Any]]  # columns of a table by their names
UNIT_CORNERS = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])


@dataclass(frozen=True)
class Dataset:
    """A number of every element that frames or files keep."""

    name: str
    unit: str  # SI, as in "m/s"


def datasets(**units: str) -> tuple[Dataset, ...]:
    """Return numbers by their names and units."""
    return tuple(Dataset(name, unit) for name, unit in units.items())


@dataclass(frozen=True)
class Channel:
    """A number of every element that exports, tables and pictures of histories show."""

    name: str
    unit: str  # SI
    meaning: str
    column: str  # in tables, with its unit there
    factor: float = 1.0  # from SI to the unit of the column
    formula: Callable[["Track"], Floats] | None = None  # (n, b), SI; None: the quantity of this name as it is stored

    def of(self, track: "Track") -> Floats:
        """Return it for all elements in all frames, (n, b), SI."""
        return track[self.name] if self.formula is None else self.formula(track)


@dataclass(frozen=True)
class Elements:
    """What the b elements of a system are in one scenario, whatever happens to them."""

    names: tuple[str, ...]
    constants: Floats  # (c, b), as `constants` of the system
    start: Floats  # (q, b) at time zero, as `quantities` of the system
    outlines: Floats | None = None  # (b, k, 2) m, own axes, counter-clockwise, the last corner repeated; of polygons


class BodyContacts(NamedTuple):
    """Where k elements of a system press against bodies of the world; the normal points from them to the body."""

    body: Indices  # (k,) blocks first, then supports
    part: Indices  # (k,) which of the `parts` of the system the element belongs to
    place: Floats  # (k, 2) m
    normal: Floats  # (k, 2)
    normal_force: Floats  # (k,) N
    shear_force: Floats  # (k,) N, on the body, along the normal turned by +90 degrees
    friction: Floats  # (k,) static


@dataclass(frozen=True)
class Shade:
    """A number of every element by which it can be coloured in pictures."""

    name: str
    label: str  # with its unit
    of: Callable[["Track"], Floats]  # (n, b), in that unit


@dataclass(frozen=True)
class Cost:
    """What an element takes of a run, as `blocksim check` estimates it."""

    seconds: float = 100e-9  # of a step on one core
    memory: int = 400  # bytes of its arrays


class Relaxation(NamedTuple):
    """What bringing a scene to rest needs of the arrays of a system."""

    kinetic: Callable[[Any], float]  # J
    unrest: Callable[[Any, Any], float]  # mean force that is not balanced over the mean weight, given the world too
    halt: Callable[[Any], None]  # takes all velocities away, and books what they held as a loss
    begin: Callable[[Any], None]  # begins its books anew, at rest
    lifts: Callable[[Model], int]  # in how many it is filled in
    with_lift: Callable[[Model, Any, int], Any]
    # arrays of its first lifts, so many, given those of one fewer, or None; what these hold goes on


@dataclass(frozen=True)
class System:
    """One kind of thing that fills a scene.

    `arrays` of a scene are what its kernels work on: the world for blocks and supports, else a named tuple of its own.
    """

    name: str  # in files, the ledger and the table of interactions
    element: str  # what one of them is called
    quantities: tuple[Dataset, ...]  # kept of every element in every frame
    constants: tuple[Dataset, ...]  # kept of every element once
    outputs: tuple[Channel, ...]
    elements: Callable[[Model], Elements]
    state: Callable[[Any, int], Floats]  # of the arrays of a scene with so many elements, (q, b)
    outlines: Callable[["Track", Indices], Floats]  # corners (m, counter-clockwise) in some frames, (f, b, k, 2)
    energies: tuple[str, ...] = ()  # J, that it adds to the ledger
    build: Callable[[Model], Any] | None = None  # its arrays at time zero, where they are not in the world
    largest_step: Callable[[Model], float] | None = None  # s; None: the scheme knows
    stages: Callable[[], "Stages"] | None = None  # its compiled functions, where they are not those of a scheme
    relaxation: Relaxation | None = None  # None: a scene with it cannot be brought to rest
    cost: Cost = field(default_factory=Cost)  # of every element, where it is not part of the blocks'
    dearer: Callable[[Model], float] = lambda _: 1.0  # time of a step of the elements of a scene over that, at most
    parts: Callable[[Model], tuple[str, ...]] | None = None  # names of its tables, which probes of force may name
    touching: Callable[[Any, Any], BodyContacts] | None = None  # of its arrays and the world
    shades: tuple[Shade, ...] = ()  # the first one is the default
    ending: Callable[[Model, "Track"], Table] | None = None  # of the last frame, one row a part
    profile: Callable[["Track", int], list[Floats]] | None = None  # lines (m, (k, 2)) of its surface in a frame
    warnings: Callable[[Model], Iterator[str]] | None = None  # of results that are known to be off


@dataclass(frozen=True)
class SystemInScene:
    """A system in one scene."""

    system: System
    elements: Elements

    @property
    def count(self) -> int:
        """Number of elements."""
        return len(self.elements.names)

    def constants(self) -> Iterator[tuple[Dataset, Floats]]:
        """Yield what is kept of every element once, (b,), and outlines (b, k, 2) where any block is a polygon."""
        yield from zip(self.system.constants, self.elements.constants, strict=True)
        if self.elements.outlines is not None:
            yield Dataset("outlines", "m"), self.elements.outlines


@dataclass(frozen=True)
class Track:
    """What n frames hold of one system; `track["x"]` is (n, b) for a quantity and (b,) for a constant."""

    present: SystemInScene
    values: Floats  # (n, q, b)

    @property
    def system(self) -> System:
        """Whose it is."""
        return self.present.system

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the elements."""
        return self.present.elements.names

    def __getitem__(self, name: str) -> Floats:
        """Return a quantity over time, or a constant. Raises KeyError."""
        for number, one in enumerate(self.system.quantities):
            if one.name == name:
                return np.asarray(self.values[:, number])
        for one, values in self.present.constants():
            if one.name == name:
                return np.asarray(values)
        raise KeyError(name)

    def some(self, chosen: Indices) -> "Track":
        """Return the same of some frames."""
        return Track(self.present, self.values[chosen])

    def at_start(self, name: str) -> Floats:
        """Return a quantity at time zero, (b,)."""
        numbers = [one.name for one in self.system.quantities]
        return np.asarray(self.present.elements.start[numbers.index(name)])

    def columns(self) -> dict[str, Floats]:
        """Return what tables show, (n, b) by the name of the column."""
        return {one.column: one.factor * one.of(self) for one in self.system.outputs}


def local_corners(size_x: Floats, size_y: Floats, outlines: Floats | None) -> Floats:
    """Return the corners (m) of blocks along their own axes, counter-clockwise, (b, k, 2).

    A rectangle (4 corners) begins at its lower left one. Where there are `outlines` they are returned as they are: a
    block with fewer corners than others has its last one several times.
    """
    if outlines is not None:
        return outlines
    return np.asarray(UNIT_CORNERS * np.stack([size_x, size_y], axis=-1)[:, None])


def discs(track: Track, chosen: Indices, radius: Floats, corners: int = 8) -> Floats:
    """Return outlines (m) of round elements of these radii (m, (b,)) with places x, y in some frames."""
    angles = 2.0 * np.pi * np.arange(corners) / corners
    around = radius[:, None, None] * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    centres = np.stack([track["x"][chosen], track["y"][chosen]], axis=-1)
    return np.asarray(centres[:, :, None] + around)
