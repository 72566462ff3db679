"""Memory that a run needs, known before anything is allocated.

Sizes follow from the types in blocksim.kernels.common.arrays, so that they change with them.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from blocksim.errors import InvalidInputError
from blocksim.kernels.common import arrays
from blocksim.kernels.common.simd import WIDTH
from blocksim.kernels.nonsmooth import arrays as rigid
from blocksim.world.free_memory import available_bytes, chunk_rows, readable
from blocksim.world.systems.system import SystemInScene

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
ROUNDING = 1e-9  # of a step, by which the time between frames may miss it


class SceneTooLargeError(InvalidInputError):
    """A scene needs more memory than is available; both in bytes."""

    def __init__(self, size: "Size", available: int) -> None:
        """Report both, and the parts of the need."""
        self.needed = size.bytes
        self.available = available
        super().__init__(
            f"this scene is too large: it needs about {readable(self.needed)} of memory, and {readable(available)} are "
            f"free; {readable(size.bytes)} for {size.bodies} bodies and {size.pairs} pairs of neighbours"
        )


class Size(NamedTuple):
    """Quantities that determine the memory of a scene."""

    bodies: int
    pairs: int  # of neighbours that there is room for
    bytes: int  # of its arrays, and of the bodies as they were placed


def scene_size(bodies: int, pairs: int, slots: int, *, has_particles: bool = False) -> Size:
    """Return the size of a scene of the explicit scheme; `slots` of a pair can come into contact."""
    if has_particles:
        contacts, candidates = slots * arrays.PARTICLE_CONTACT.itemsize, slots * INDEX
    else:
        contacts, candidates = arrays.CONTACTS * arrays.CONTACT.itemsize, slots
    pair = arrays.PAIR.itemsize + candidates + OPERATORS * arrays.OPERATOR.itemsize + contacts
    work = (slots + 1) * arrays.POINT.itemsize + contacts
    return Size(bodies, pairs, bodies * (arrays.BODY.itemsize + OBJECT_BYTES) + pairs * pair + work)


def rigid_size(bodies: int, pairs: int) -> Size:
    """Return the size of a scene of the non-smooth scheme."""
    kinds = (arrays.BODY, rigid.STATE, rigid.BEFORE, rigid.IMPACT)
    body = sum(kind.itemsize for kind in kinds) + 3 * VALUE + OBJECT_BYTES
    pack = rigid.PACK.itemsize + rigid.IMPACT_LANES.itemsize
    pair = rigid.CONSTRAINT.itemsize + rigid.KEPT.itemsize + -(-pack // WIDTH)
    pair += -(-rigid.TALLY.itemsize // (WIDTH * rigid.TALLY_PACKS))
    return Size(bodies, pairs, bodies * body + pairs * pair)


def run_bytes(bodies: int, frames: int, contacts: int = 0, others: Sequence[SystemInScene] = ()) -> int:
    """Return the bytes of run.h5 with so many frames, the room of the last chunk included, and contacts in each."""
    rows = chunk_rows(max([bodies, *(one.count for one in others)]))
    whole = -(-frames // rows) * rows
    values = FRAME_VALUES + MOTION_VALUES * bodies + sum(one.count * len(one.system.quantities) for one in others)
    return FILE_BYTES + VALUE * (whole * values + frames * CONTACT_VALUES * contacts)


def refuse_if_too_large(size: Size) -> None:
    """Raise SceneTooLargeError where a scene needs more memory than is available, if that is known."""
    available = available_bytes()
    if available is not None and size.bytes > available:
        raise SceneTooLargeError(size, available)
