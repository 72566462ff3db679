"""What a run does against being interrupted, none of which changes its bits."""

from dataclasses import dataclass

CHECKPOINT_SECONDS = 60.0


@dataclass(frozen=True)
class Precautions:
    """When a run writes checkpoints, and after which wall time it stops by itself.

    Checkpoints are written at whatever comes first. A run that is stopped writes one anyway.
    """

    checkpoint_seconds: float = CHECKPOINT_SECONDS  # of wall time between two
    checkpoint_steps: int | None = None  # between two
    checkpoint_time: float | None = None  # s of simulated time between two
    wall_time: float | None = None  # s after which the run stops, as a signal would stop it

    def periods(self, step: float) -> tuple[int, ...]:
        """Return the numbers of steps (s) after which checkpoints are due."""
        simulated = None if self.checkpoint_time is None else max(1, round(self.checkpoint_time / step))
        return tuple(period for period in (self.checkpoint_steps, simulated) if period is not None)


DEFAULTS = Precautions()
