"""The machine of a measurement, and its load."""

import os
from dataclasses import asdict, dataclass

from blocksim.simulation.provenance import environment

BUSY = 0.5  # processes at work on average over the last minute, before anything was measured


@dataclass(frozen=True)
class Machine:
    """Processor, system, versions, and load at the start."""

    processor: str
    cores: int
    platform: str
    python: str
    numba: str
    numpy: str
    blocksim: str
    code: str
    load: float | None  # None where the system does not report it

    @property
    def is_busy(self) -> bool:
        """Return True if other processes share the machine, so that times are too long and scatter."""
        return self.load is not None and self.load > BUSY

    def lines(self) -> list[str]:
        """Return it as text."""
        load = "unknown" if self.load is None else f"{self.load:.2f}"
        found = [
            f"{self.processor}, {self.cores} cores, load {load} at the start",
            f"blocksim {self.blocksim}, Python {self.python}, numba {self.numba}, numpy {self.numpy}",
            self.platform,
        ]
        if self.is_busy:
            found.append("Other processes are running: times are upper bounds and scatter.")
        return found

    def to_dict(self) -> dict[str, object]:
        """Return it for programs."""
        return {**asdict(self), "busy": self.is_busy}


def this_machine() -> Machine:
    """Return this machine with its present load."""
    found = environment()
    names = ("processor", "platform", "python", "numba", "numpy", "blocksim", "code")
    return Machine(cores=os.cpu_count() or 1, load=_load(), **{name: found[name] for name in names})


def _load() -> float | None:
    try:
        return round(os.getloadavg()[0], 2)
    except (AttributeError, OSError):  # some systems have none
        return None
