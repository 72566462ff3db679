"""The non-smooth scheme at one setting, for measurements."""

from __future__ import annotations

from dataclasses import dataclass

from blocksim.scenario.models.stepping import Nonsmooth

SUBSTEPS = 4
UNTIL_SOLVED = int(Nonsmooth.model_fields["velocity_sweeps"].default)


@dataclass(frozen=True)
class Stepping:
    """A step and its parts; each is solved to the default tolerance, or gone through as often as `sweeps` says."""

    step: float  # s
    substeps: int = SUBSTEPS
    sweeps: int = UNTIL_SOLVED

    @property
    def setting(self) -> str:
        """For people."""
        return f"step {1e3 * self.step:g} ms / {self.substeps}"

    @property
    def keys(self) -> dict[str, float]:
        """Its keys of [time], all of them numbers."""
        return {"step": self.step, "substeps": self.substeps, "velocity_sweeps": self.sweeps}

    def time(self, **more: object) -> dict[str, object]:
        """Return the table [time], with more keys."""
        return {"scheme": "nonsmooth", **self.keys, **more}
