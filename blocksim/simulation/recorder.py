"""Samples the world at the output times. It names the next step it wants and never changes the motion."""

import hashlib
from bisect import bisect_right
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario import PlacedBody
from blocksim.simulation.frames import Contacts, Frames, Rows as ContactRows, join_contacts
from blocksim.simulation.ledger import compiled
from blocksim.simulation.observables import Watch
from blocksim.simulation.probes import AT_REST, NO_PROBES, MovingSupport, Probes
from blocksim.world.systems.blocks import BLOCKS, blocks_placed
from blocksim.world.systems.system import Floats, SystemInScene, Track

if TYPE_CHECKING:
    from blocksim.simulation.schemes import AnyScene
    from blocksim.simulation.stores.hdf5 import FrameFile

MOTION = tuple(one.name for one in BLOCKS.quantities)
POSITION = MOTION[:3]


class Frame(NamedTuple):
    """One recorded state of all systems, SI."""

    step: int
    states: tuple[Floats, ...]  # (q, b) of each system, as its `quantities`; blocks first
    measured: NDArray[np.float64]  # energies, number of contacts, largest overlap
    contacts: ContactRows | None = None  # where they are recorded

    def digest(self, before: bytes = b"") -> bytes:
        """Return the SHA-256 of all its bits, and of the digest of the frame before it."""
        states = (state.tobytes() for state in self.states)
        contacts = b"" if self.contacts is None else self.contacts.tobytes()
        parts = (before, np.int64(self.step).tobytes(), *states, self.measured.tobytes(), contacts)
        return hashlib.sha256(b"".join(parts)).digest()


class Recorder:
    """Frames, growing as the run continues; with a sink only the last one, so that long runs need no more memory."""

    def __init__(
        self,
        placed: Sequence[PlacedBody],
        every: float,
        step: float,
        *,
        others: Sequence[SystemInScene] = (),
        contacts: bool = False,
        probes: Probes = NO_PROBES,
        support: MovingSupport = AT_REST,
    ) -> None:
        """Record every `every` seconds, at the nearest step of length `step` (s).

        `others` are the systems beside the blocks. With `contacts` the contacts of every frame are recorded as well.
        `probes` are sampled at steps of their own. What has moved is seen from the `support`.
        """
        self.placed = tuple(placed)
        self.systems = (blocks_placed(placed), *others)
        self.time_step = step
        self.sink: FrameFile | None = None  # where frames go but the last, from when on it is there
        self.steps_per_frame = max(every / step, 1.0)
        self.steps: list[int] = []
        self.digests: list[bytes] = []  # of each frame and all before it
        self.altered: list[int] = []  # steps of frames of an earlier part that have come out otherwise when repeated
        self.held: list[Frame] = []  # the last ones: all, or one
        self.ledger: tuple[str, ...] = ()
        self.with_contacts = contacts
        self.probes = probes
        self.watch = Watch([self.placed], [support])

    def next_step(self, done: int) -> int:
        """Return the next step to record after `done` steps, wherever those end."""
        return int(compiled("kernels.common.frame_times").next_frame(done, self.steps_per_frame))

    def count_until(self, step: int) -> int:
        """Return the number of frames up to a step."""
        return bisect_right(self.steps, step)

    def digest_until(self, step: int) -> str:
        """Return the SHA-256 of all frames up to a step."""
        count = self.count_until(step)
        return self.digests[count - 1].hex() if count else ""

    def take_over(self, rows: "Rows") -> None:
        """Begin with the frames of an earlier part of the run at output times, which are not recorded again.

        Those after its checkpoint are among them, as the run would only repeat them; that of the moment at which it was
        stopped is not.
        """
        tables = [None if rows.contacts is None else rows.contacts.at(k) for k in range(len(rows.steps))]
        states = zip(*rows.values, strict=True)
        frames = (Frame(*one) for one in zip(rows.steps.tolist(), states, rows.measured, tables, strict=True))
        self.held = [one for one in frames if one.step == 0 or self.next_step(one.step - 1) == one.step]
        self.steps, self.digests, self.ledger = [frame.step for frame in self.held], [], rows.ledger
        for frame in self.held:
            self.watch.follow([0], frame.states[0][None], [frame.step * self.time_step])
            self.digests.append(frame.digest(self.digests[-1] if self.digests else b""))

    def sample(self, scene: "AnyScene") -> None:
        """Add a frame of the present state, unless this step has one already: then look whether that is the same."""
        schemes, step = compiled("simulation.schemes"), int(scene.world.clock[0].steps)
        row = schemes.measure_row(scene)
        arrays = (scene.world, *getattr(scene, "systems", ()))
        states = tuple(one.system.state(its, one.count) for one, its in zip(self.systems, arrays, strict=True))
        self.watch.follow([0], states[0][None], [step * self.time_step])
        self.ledger = schemes.ledger_names(scene)
        touching = schemes.scheme_of(scene).contacts(scene, len(self.placed)) if self.with_contacts else None
        frame = Frame(step, states, row, touching)
        if self.steps and self.steps[-1] >= step:
            place = self.count_until(step) - 1
            before = self.digests[place - 1] if place > 0 else b""
            if self.steps[place] == step and frame.digest(before) != self.digests[place]:
                self.altered.append(step)
            return
        self.steps.append(step)
        self.digests.append(frame.digest(self.digests[-1] if self.digests else b""))
        if self.sink is not None:
            self.sink.append(frame)
            self.held.clear()
        self.held.append(frame)

    def frames(self) -> Frames:
        """Return all frames that are held: those so far, or, with a sink, the last one."""
        steps, states, measured, tables = zip(*self.held, strict=True)
        contacts = join_contacts(tables) if self.with_contacts else None
        values = tuple(np.stack(one) for one in zip(*states, strict=True))
        rows = Rows(np.array(steps, dtype=np.int64), values, np.stack(measured), self.ledger, contacts)
        return frames_from_rows(self.systems, self.time_step, rows)


class Rows(NamedTuple):
    """What n frames of all systems consist of."""

    steps: NDArray[np.int64]  # (n,)
    values: tuple[Floats, ...]  # (n, q, b) of each system, as its `quantities`; blocks first
    measured: NDArray[np.float64]  # (n, e + 2): energies, number of contacts, largest overlap
    ledger: tuple[str, ...]  # names of the e energies
    contacts: Contacts | None = None  # of all frames


def frames_from_rows(systems: Sequence[SystemInScene], time_step: float, rows: Rows) -> Frames:
    """Return frames of systems, blocks first, with these steps (s)."""
    columns = rows.measured.T
    blocks, *others = (Track(one, values) for one, values in zip(systems, rows.values, strict=True))
    return Frames(
        step=rows.steps,
        time=np.multiply(rows.steps, time_step, dtype=np.float64),
        **{name: blocks[name] for name in (*MOTION, "size_x", "size_y", "mass", "inertia")},
        energy=dict(zip(rows.ledger, columns, strict=False)),
        contact_count=columns[-2],
        largest_overlap=columns[-1],
        names=blocks.names,
        start_angle=blocks.at_start("angle"),
        contacts=rows.contacts,
        others=tuple(others),
        outlines=blocks.present.elements.outlines,
    )
