"""Samples the world at the output times. It names the next step it wants and never changes the motion."""

import hashlib
from bisect import bisect_right
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario import PlacedBody
from blocksim.simulation.contacts import Contacts, joined
from blocksim.simulation.contacts import Rows as ContactRows
from blocksim.simulation.frames import Frames
from blocksim.simulation.movement import Watch

if TYPE_CHECKING:
    from blocksim.simulation.schemes import AnyScene

POSITION = ("x", "y", "angle")
MOTION = (*POSITION, "vx", "vy", "spin")


class Frame(NamedTuple):
    """One recorded state of b bodies, SI."""

    step: int
    motion: NDArray[np.float64]  # (6, b) as MOTION
    measured: NDArray[np.float64]  # as the scheme's `measured`
    contacts: ContactRows | None = None  # where they are recorded

    def digest(self, before: bytes = b"") -> bytes:
        """Return the SHA-256 of all its bits, and of the digest of the frame before it."""
        parts = (np.int64(self.step).tobytes(), self.motion.tobytes(), self.measured.tobytes())
        contacts = b"" if self.contacts is None else self.contacts.tobytes()
        return hashlib.sha256(b"".join((before, *parts, contacts))).digest()


class FrameSink(Protocol):
    """Whatever keeps frames while the run continues, such as a file."""

    def append(self, frame: Frame) -> None:
        """Keep one frame."""


def steps_per_frame(every: float, step: float) -> float:
    """Return the number of steps (s) between two frames that are wanted `every` seconds; at least one, not rounded."""
    return max(every / step, 1.0)


def next_frame(done: int, period: float) -> int:
    """Return the next step to record after `done` steps, given `steps_per_frame`."""
    number = int(done / period)
    while round(number * period) <= done:
        number += 1
    return round(number * period)


class Recorder:
    """Frames, growing as the run continues; with a sink only the last one, so that long runs need no more memory."""

    def __init__(
        self,
        placed: Sequence[PlacedBody],
        every: float,
        step: float,
        sink: FrameSink | None = None,
        *,
        contacts: bool = False,
    ) -> None:
        """Record every `every` seconds, at the nearest step of length `step` (s); where there is a `sink`, in there.

        With `contacts` the contacts of every frame are recorded as well.
        """
        self.placed = tuple(placed)
        self.time_step = step
        self.sink = sink
        self.steps_per_frame = steps_per_frame(every, step)
        self.steps: list[int] = []
        self.digests: list[bytes] = []  # of each frame and all before it
        self.altered: list[int] = []  # steps of frames of an earlier part that have come out otherwise when repeated
        self.held: list[Frame] = []  # the last ones: all, or one
        self.ledger: tuple[str, ...] = ()
        self.with_contacts = contacts
        self.watch = Watch(self.placed)

    def next_step(self, done: int) -> int:
        """Return the next step to record after `done` steps, wherever those end."""
        return next_frame(done, self.steps_per_frame)

    def is_output_time(self, step: int) -> bool:
        """Return True if a step is recorded wherever the run ends."""
        return step == 0 or self.next_step(step - 1) == step

    def count_until(self, step: int) -> int:
        """Return the number of frames up to a step."""
        return bisect_right(self.steps, step)

    def digest_until(self, step: int) -> str:
        """Return the SHA-256 of all frames up to a step."""
        count = self.count_until(step)
        return self.digests[count - 1].hex() if count else ""

    def take_over(self, rows: "Rows") -> None:
        """Begin with the frames of an earlier part of the run; what it recorded is not recorded again."""
        self.ledger = rows.ledger
        self.steps = rows.steps.tolist()
        contacts = [None] * len(self.steps) if rows.contacts is None else rows.contacts.tables()
        for step, motion in zip(self.steps, rows.motion, strict=True):
            self.watch.see(motion, step * self.time_step)
        self.held = [Frame(*one) for one in zip(self.steps, rows.motion, rows.measured, contacts, strict=True)]
        self.digests = []
        for frame in self.held:
            self._note_digest(frame)

    def _note_digest(self, frame: Frame) -> None:
        self.digests.append(frame.digest(self.digests[-1] if self.digests else b""))

    def pour_into(self, sink: FrameSink) -> None:
        """Hold no more than the last frame from now on; `sink` has those so far, and gets all others."""
        self.sink = sink
        del self.held[:-1]

    def sample(self, scene: "AnyScene") -> None:
        """Add a frame of the present state, unless this step has one already: then look whether that is the same."""
        from blocksim.simulation.schemes import measured_row, scheme_of  # noqa: PLC0415 - numba, not for readers

        step = int(scene.world.clock[0].steps)
        row = measured_row(scene)
        motion = np.stack([scene.world.bodies[name][: len(self.placed)] for name in MOTION])
        self.watch.see(motion, step * self.time_step)
        scheme = scheme_of(scene)
        self.ledger = scheme.ledger
        touching = scheme.contacts(scene, len(self.placed)) if self.with_contacts else None
        frame = Frame(step, motion, row, touching)
        if self.steps and self.steps[-1] >= step:
            self._compare(frame)
            return
        self.steps.append(step)
        self._note_digest(frame)
        if self.sink is not None:
            self.sink.append(frame)
            self.held.clear()
        self.held.append(frame)

    def _compare(self, frame: Frame) -> None:
        """Note a frame that is not the one that was recorded for its step, if any was."""
        place = self.count_until(frame.step) - 1
        before = self.digests[place - 1] if place > 0 else b""
        if self.steps[place] == frame.step and frame.digest(before) != self.digests[place]:
            self.altered.append(frame.step)

    def frames(self) -> Frames:
        """Return all frames that are held: those so far, or, with a sink, the last one."""
        steps, motion, measured, tables = zip(*self.held, strict=True)
        contacts = joined(tables) if self.with_contacts else None
        rows = Rows(np.array(steps, dtype=np.int64), np.stack(motion), np.stack(measured), self.ledger, contacts)
        return frames_from_rows(self.placed, self.time_step, rows)


class Rows(NamedTuple):
    """What n frames of b bodies consist of."""

    steps: NDArray[np.int64]  # (n,)
    motion: NDArray[np.float64]  # (n, 6, b) as MOTION
    measured: NDArray[np.float64]  # (n, e + 2): energies, number of contacts, largest overlap
    ledger: tuple[str, ...]  # names of the e energies
    contacts: Contacts | None = None  # of all frames

    def chosen(self, which: NDArray[np.bool_]) -> "Rows":
        """Return some of the frames."""
        contacts = None if self.contacts is None else self.contacts.chosen(which)
        return Rows(self.steps[which], self.motion[which], self.measured[which], self.ledger, contacts)


def rows_of_frames(frames: Frames) -> Rows:
    """Return what frames consist of: the other way round than `frames_from_rows`."""
    motion = np.stack([getattr(frames, name) for name in MOTION], axis=1)
    measured = np.stack([*frames.energy.values(), frames.contact_count, frames.largest_overlap], axis=1)
    return Rows(frames.step, motion, measured, tuple(frames.energy), frames.contacts)


def frames_from_rows(placed: Sequence[PlacedBody], time_step: float, rows: Rows) -> Frames:
    """Return frames of bodies with these steps (s)."""
    columns = rows.measured.T
    x, y, angle, vx, vy, spin = rows.motion.swapaxes(0, 1)
    return Frames(
        step=rows.steps,
        time=np.multiply(rows.steps, time_step, dtype=np.float64),
        x=x,
        y=y,
        angle=angle,
        vx=vx,
        vy=vy,
        spin=spin,
        energy=dict(zip(rows.ledger, columns, strict=False)),
        contact_count=columns[-2],
        largest_overlap=columns[-1],
        names=tuple(body.name for body in placed),
        size_x=np.array([body.size_x for body in placed]),
        size_y=np.array([body.size_y for body in placed]),
        start_angle=np.array([body.angle for body in placed]),
        contacts=rows.contacts,
    )
