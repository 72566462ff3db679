"""Samples the world at the output times. It names the next step it wants and never changes the motion."""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from blocksim.kernels.arrays import World
from blocksim.kernels.energy import LEDGER_ROW, measure
from blocksim.scenario import PlacedBody
from blocksim.simulation.frames import Frames

MOTION = ("x", "y", "angle", "vx", "vy", "spin")
MEASURED = (*LEDGER_ROW, "contact_count", "largest_overlap")


class Frame(NamedTuple):
    """One recorded state of b bodies, SI."""

    step: int
    motion: NDArray[np.float64]  # (6, b) as MOTION
    measured: NDArray[np.float64]  # (10,) as MEASURED


class FrameSink(Protocol):
    """Whatever keeps frames while the run goes on, such as a file."""

    def append(self, frame: Frame) -> None:
        """Keep one frame."""


class Recorder:
    """Frames, growing as the run goes on."""

    def __init__(self, placed: Sequence[PlacedBody], every: float, step: float, sink: FrameSink | None = None) -> None:
        """Record every `every` seconds, at the nearest step of length `step` (s); `sink` gets all frames too."""
        self.placed = tuple(placed)
        self.time_step = step
        self.sink = sink
        self.steps_per_frame = max(every / step, 1.0)
        self.steps: list[int] = []
        self.motion: list[NDArray[np.float64]] = []
        self.measured: list[NDArray[np.float64]] = []

    def next_step(self, done: int) -> int:
        """Return the next step to record after `done` steps."""
        number = int(done / self.steps_per_frame + 0.5) + 1
        while round(number * self.steps_per_frame) <= done:
            number += 1
        return round(number * self.steps_per_frame)

    def sample(self, world: World) -> None:
        """Add a frame of the present state, unless this step has one already."""
        step = int(world.clock[0].steps)
        if self.steps and self.steps[-1] == step:
            return
        row = np.zeros(len(MEASURED))
        measure(world, row)
        motion = np.stack([world.bodies[name][: len(self.placed)] for name in MOTION])
        self.steps.append(step)
        self.motion.append(motion)
        self.measured.append(row)
        if self.sink is not None:
            self.sink.append(Frame(step, motion, row))

    def frames(self) -> Frames:
        """Return all frames so far."""
        steps = np.array(self.steps, dtype=np.int64)
        return frames_from_rows(self.placed, steps, self.time_step, np.stack(self.motion), np.stack(self.measured))


def frames_from_rows(
    placed: Sequence[PlacedBody],
    steps: NDArray[np.int64],
    time_step: float,
    motion: NDArray[np.float64],
    measured: NDArray[np.float64],
) -> Frames:
    """Return frames from step numbers (n,), motion (n, 6, b) and measured values (n, 10)."""
    columns = measured.T
    x, y, angle, vx, vy, spin = motion.swapaxes(0, 1)
    return Frames(
        step=steps,
        time=np.multiply(steps, time_step, dtype=np.float64),
        x=x,
        y=y,
        angle=angle,
        vx=vx,
        vy=vy,
        spin=spin,
        energy=dict(zip(LEDGER_ROW, columns, strict=False)),
        contact_count=columns[-2],
        largest_overlap=columns[-1],
        names=tuple(body.name for body in placed),
        size_x=np.array([body.size_x for body in placed]),
        size_y=np.array([body.size_y for body in placed]),
        start_angle=np.array([body.angle for body in placed]),
    )
