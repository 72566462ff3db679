"""Memory that a run needs, known before anything is allocated.

Sizes follow from the types in blocksim.kernels.common.arrays, so that they change with them.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from blocksim.errors import InvalidInputError
from blocksim.kernels.common.arrays import BODY, CONTACT, CONTACTS, OPERATOR, PAIR, PARTICLE_CONTACT, POINT
from blocksim.kernels.common.simd import WIDTH
from blocksim.kernels.nonsmooth.arrays import ASIDE, BEFORE, CONSTRAINT, GROUP, IMPACT, KEPT, LISTED, PART, STATE, TALLY
from blocksim.world.free_memory import available_bytes, readable
from blocksim.world.systems.system import Present

LISTS = 2  # of candidate pairs: the present one and the one being built
OPERATORS = 2  # of a pair: along the normal and along the tangent
INDEX = np.dtype(np.uint32).itemsize
VALUE = np.dtype(np.float64).itemsize
OBJECT_BYTES = 450  # a placed body with its name, and its places in lists; measured 410
MOTION_VALUES = 6  # of a body in a frame: place, angle, velocity, spin
FRAME_VALUES = 14  # of a frame in addition: step, time, energies, number of contacts, largest overlap
CONTACT_VALUES = 8  # of a recorded contact: two bodies in one, place, normal, overlap, forces
CONTACTS_OF_A_BODY = 4  # recorded in a frame, of corners and rigid faces: hardly ever more
PROCESS_BYTES = 210_000_000  # Python, packages and compiled kernels; measured 207 to 210 MB
FILE_BYTES = 35_000  # of run.h5 beside its values; measured 25 to 39 kB
MOST_CHUNK_ROWS = 64  # frames in a chunk of run.h5
CHUNK_VALUES = 1 << 17  # a megabyte
ROUNDING = 1e-9  # of a step, by which the time between frames may miss it
COPIES = 2  # of all frames at the end of a run: as they came, and joined


class SceneTooLargeError(InvalidInputError):
    """A scene needs more memory than is available; both in bytes."""

    def __init__(self, size: "Size", available: int) -> None:
        """Report both, and the parts of the need."""
        self.needed = size.bytes_needed
        self.available = available
        frames = f", {readable(size.record_bytes)} for {size.frames} frames (output.every)" if size.frames else ""
        super().__init__(
            f"this scene is too large: it needs about {readable(self.needed)} of memory, and {readable(available)} are "
            f"free; {readable(size.world_bytes)} for {size.bodies} bodies and {size.pairs} pairs of neighbours{frames}"
        )


class Size(ABC):
    """Quantities that determine the memory of a run."""

    bodies: int
    pairs: int  # of neighbours that there is room for
    frames: int  # recorded, at most
    contacts: int  # recorded in every frame, at most

    @property
    @abstractmethod
    def world_bytes(self) -> int:
        """Bytes of the arrays of a scene and of the bodies as they were placed."""

    @property
    def record_bytes(self) -> int:
        """Bytes that all frames take until the end of a run."""
        return COPIES * file_bytes(self.bodies, self.frames, self.contacts)

    @property
    def bytes_needed(self) -> int:
        """Bytes that a run needs at most."""
        return self.world_bytes + self.record_bytes


@dataclass(frozen=True)
class SceneSize(Size):
    """Of the explicit scheme."""

    bodies: int
    pairs: int
    slots: int  # corners or particles of a pair that can come into contact
    frames: int = 0
    has_particles: bool = False
    contacts: int = 0

    @property
    def world_bytes(self) -> int:
        """As Size."""
        if self.has_particles:
            contacts, candidates = self.slots * PARTICLE_CONTACT.itemsize, self.slots * INDEX
        else:
            contacts, candidates = CONTACTS * CONTACT.itemsize, self.slots
        pair = LISTS * (PAIR.itemsize + candidates) + OPERATORS * OPERATOR.itemsize + contacts
        work = (self.slots + 1) * POINT.itemsize + contacts
        return self.bodies * (BODY.itemsize + OBJECT_BYTES) + self.pairs * pair + work


@dataclass(frozen=True)
class RigidSize(Size):
    """Of the non-smooth scheme."""

    bodies: int
    pairs: int
    frames: int = 0
    contacts: int = 0

    @property
    def world_bytes(self) -> int:
        """As Size."""
        body = (
            BODY.itemsize
            + STATE.itemsize
            + BEFORE.itemsize
            + IMPACT.itemsize
            + LISTED.itemsize
            + 2 * VALUE
            + OBJECT_BYTES
        )
        group = GROUP.itemsize + ASIDE.itemsize
        pair = CONSTRAINT.itemsize + KEPT.itemsize + -(-group // WIDTH) + -(-TALLY.itemsize // (WIDTH * PART))
        return self.bodies * body + self.pairs * pair


def output_count(steps: int, end: float, every: float) -> int:
    """Return how many frames follow the first, one every `every` (s) until `end` (s), but at most one a step."""
    return round(min(steps, end / every))


def is_shorter_than_step(every: float, step: float) -> bool:
    """Return True if frames every `every` (s) would be closer than steps (s), so that there is one at every step."""
    return every < (1.0 - ROUNDING) * step


def file_bytes(bodies: int, frames: int, contacts: int = 0, further: int = 0) -> int:
    """Return the bytes in a file of frames with so many contacts, and values of further systems, each."""
    return frames * VALUE * (FRAME_VALUES + MOTION_VALUES * bodies + CONTACT_VALUES * contacts + further)


def chunk_rows(elements: int) -> int:
    """Return how many frames of so many elements, the most of any system, run.h5 takes room for at a time."""
    return min(MOST_CHUNK_ROWS, max(1, CHUNK_VALUES // max(elements, 1)))


def run_bytes(bodies: int, frames: int, contacts: int = 0, others: Sequence[Present] = ()) -> int:
    """Return the bytes of run.h5 with so many frames, the room of the last chunk included, and contacts in each."""
    rows = chunk_rows(max([bodies, *(one.count for one in others)]))
    whole = -(-frames // rows) * rows
    values = sum(one.values for one in others)
    return FILE_BYTES + file_bytes(bodies, whole, 0, values) + frames * VALUE * CONTACT_VALUES * contacts


def recorded_contacts(bodies: int, particles: int) -> int:
    """Return how many contacts a frame hardly ever has more of, where they are recorded."""
    return max(CONTACTS_OF_A_BODY * bodies, particles)


def refuse_if_too_large(size: Size) -> None:
    """Raise SceneTooLargeError where a run needs more memory than is available, if that is known."""
    available = available_bytes()
    if available is not None and size.bytes_needed > available:
        raise SceneTooLargeError(size, available)
