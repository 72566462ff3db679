"""The energy ledger of a run: where the energy went, and how much of it is unaccounted for."""

import math
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import BaseModel, BeforeValidator, computed_field

if TYPE_CHECKING:
    from blocksim.simulation.schemes import AnyScene

SMALLEST_HEIGHT = 1e-3  # m; the energy in play is at least that of lifting everything by this much
STANDARD_GRAVITY = 9.81

Number = Annotated[float, BeforeValidator(lambda value: math.nan if value is None else value)]  # JSON has no NaN


class EnergyLedger(BaseModel, frozen=True):
    """All in J. The residual is what total + losses has drifted since the start.

    `to_support` is the work done on a support that moves; negative where the support drives the scene. What a scheme
    does not know is zero: springs, dashpots and contacts that break are of the explicit one, impacts and correction
    (blocksim.kernels.nonsmooth.energy) of the non-smooth one.
    """

    kinetic: Number
    potential: Number
    stored_normal: Number = 0.0
    stored_shear: Number = 0.0
    dashpot: Number = 0.0
    friction: Number
    broken: Number = 0.0
    impacts: Number = 0.0
    correction: Number = 0.0
    to_support: Number = 0.0
    start: Number
    in_play: Number

    @computed_field  # type: ignore[prop-decorator]  # mypy knows no decorated properties
    @property
    def residual(self) -> float:
        """Energy now plus all losses, minus the energy at the start (J)."""
        now = self.kinetic + self.potential + self.stored_normal + self.stored_shear
        lost = self.dashpot + self.friction + self.broken + self.impacts + self.correction + self.to_support
        return now + lost - self.start

    @computed_field  # type: ignore[prop-decorator]
    @property
    def relative_residual(self) -> float:
        """Size of the residual as a share of the energy in play."""
        return abs(self.residual) / self.in_play if self.in_play else abs(self.residual)


def start_energy(scene: "AnyScene") -> float:
    """Return all energy (J) that a scene holds and has lost: constant, if the ledger is complete."""
    from blocksim.simulation.schemes import measured_row, scheme_of  # noqa: PLC0415 - numba, not for readers

    return float(measured_row(scene)[: len(scheme_of(scene).ledger)].sum())


def energy_ledger(scene: "AnyScene", start: float) -> EnergyLedger:
    """Return the ledger of the present state; `start` is the energy (J) at the start.

    Energy in play: largest kinetic energy + sum of the weights' travel |m g v| dt + |work of the support|, at least
    m_total g 1 mm.
    """
    from blocksim.simulation.schemes import measured_row, scheme_of  # noqa: PLC0415 - numba, not for readers

    ledger = scene.world.ledger[0]
    row = measured_row(scene)
    entries = {name: float(value) for name, value in zip(scheme_of(scene).ledger, row, strict=False)}
    weight = float(np.sum(scene.world.bodies.mass)) * STANDARD_GRAVITY
    driven = float(ledger.largest_kinetic + ledger.travel_work) + abs(entries["to_support"])
    in_play = max(driven, weight * SMALLEST_HEIGHT)
    return EnergyLedger(**entries, start=start, in_play=in_play)
