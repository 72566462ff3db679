"""When a run writes its checkpoints and when it stops by itself, none of which changes its bits.

Checkpoints are written into two files by turns, so that a whole one is always there.
"""

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from blocksim.options import Option
from blocksim.scenario.quantities import TIME, Quantity
from blocksim.simulation.checkpoint import Origin, Position, write_checkpoint
from blocksim.simulation.folder import CHECKPOINTS
from blocksim.simulation.schemes import AnyScene
from blocksim.simulation.settled import Settled

CHECKPOINT_SECONDS = 60.0
NEVER = sys.maxsize  # steps
SECONDS = Quantity(TIME, above=0.0)


@dataclass(frozen=True)
class CheckpointPolicy:
    """When a run writes checkpoints, and after which wall time it stops by itself.

    Checkpoints are written at whatever comes first. A run that is stopped writes one anyway.
    """

    checkpoint_seconds: Annotated[
        float,
        Option(
            "Wall time between checkpoints (default: 60 s).",
            flags=("--checkpoint-every",),
            metavar="TIME",
            read=SECONDS.read,
            show_default=False,
        ),
    ] = CHECKPOINT_SECONDS  # of wall time between two
    checkpoint_steps: Annotated[int | None, Option("Steps between checkpoints.", metavar="N", least=1)] = None
    checkpoint_time: Annotated[
        float | None, Option("Simulated time between checkpoints.", metavar="TIME", read=SECONDS.read)
    ] = None  # s
    wall_time: Annotated[
        float | None,
        Option('Stop after this wall time, e.g. "90 min", as Ctrl-C does.', metavar="TIME", read=SECONDS.read),
    ] = None  # s
    time_over: float = 0.0  # s of them that are over before the run begins

    def periods(self, step: float) -> tuple[int, ...]:
        """Return the numbers of steps (s) after which checkpoints are due."""
        simulated = None if self.checkpoint_time is None else max(1, round(self.checkpoint_time / step))
        return tuple(period for period in (self.checkpoint_steps, simulated) if period is not None)


DEFAULTS = CheckpointPolicy()


@dataclass(frozen=True)
class Past:
    """What the parts of a run before this one have left."""

    seconds: float = 0.0  # of wall time
    resumed_from: tuple[int, ...] = ()
    checkpoint: Path | None = None  # from which this part continues
    step: int | None = None  # of that checkpoint
    settled: Settled | None = None  # how it came to rest before time zero, where it did

    @classmethod
    def of(cls, path: Path, position: Position) -> "Past":
        """Return the past of a run that continues from a checkpoint."""
        parts = (*position.resumed_from, position.step)
        return cls(position.total_seconds, parts, path, position.step, position.settled)


NO_PAST = Past()


@dataclass
class CheckpointWriter:
    """Writes the checkpoints of one run into its folder."""

    folder: Path
    origin: Origin
    sync: Callable[[], None]  # brings all frames so far to the disk
    periods: tuple[int, ...] = ()  # in steps
    seconds: float = CHECKPOINT_SECONDS  # of wall time between two
    past: Past = NO_PAST

    def __post_init__(self) -> None:
        """Write nothing yet; the checkpoint that the run continues from is the last one to be replaced."""
        self.paths = sorted((self.folder / name for name in CHECKPOINTS), key=lambda path: path == self.past.checkpoint)
        self.last_step = self.past.step
        self.began = self.written_at = time.monotonic()

    def next_step(self, done: int) -> int:
        """Return the step after `done` at which the loop has to stop for a checkpoint."""
        return min(((done // period + 1) * period for period in self.periods), default=NEVER)

    def is_due(self, done: int) -> bool:
        """Return True if one is to be written now."""
        return any(done % period == 0 for period in self.periods) or (
            time.monotonic() - self.written_at >= self.seconds
        )

    def write(self, scene: AnyScene, position: Position) -> None:
        """Write one, once the frames before it are on the disk. Raises OutputError.

        `position` is what the time loop knows; what earlier parts have left is added.
        """
        if position.step == self.last_step:
            return
        self.sync()
        whole = {"settled": self.past.settled, "resumed_from": self.past.resumed_from}
        total = self.past.seconds + time.monotonic() - self.began
        position = position.model_copy(update={**whole, "total_seconds": total})
        write_checkpoint(self.paths[0], scene, position, self.origin)
        self.paths.reverse()
        self.last_step, self.written_at = position.step, time.monotonic()
