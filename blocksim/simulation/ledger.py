"""The energy ledger of a run: where the energy went, and how much of it is unaccounted for."""

import math
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, BeforeValidator, computed_field

from blocksim.kernels.arrays import World
from blocksim.kernels.energy import LEDGER_ROW, measure

SMALLEST_HEIGHT = 1e-3  # m; the energy in play is at least that of lifting everything by this much
STANDARD_GRAVITY = 9.81
ROW_LENGTH = len(LEDGER_ROW) + 2

Number = Annotated[float, BeforeValidator(lambda value: math.nan if value is None else value)]  # JSON has no NaN


class EnergyLedger(BaseModel, frozen=True):
    """All in J. The residual is what total + losses has drifted since the start.

    `to_support` is the work done on a support that moves; negative where the support drives the scene.
    """

    kinetic: Number
    potential: Number
    stored_normal: Number
    stored_shear: Number
    dashpot: Number
    friction: Number
    broken: Number
    to_support: Number = 0.0
    start: Number
    in_play: Number

    @computed_field  # type: ignore[prop-decorator]  # mypy knows no decorated properties
    @property
    def residual(self) -> float:
        """Energy now plus all losses, minus the energy at the start (J)."""
        now = self.kinetic + self.potential + self.stored_normal + self.stored_shear
        return now + self.dashpot + self.friction + self.broken + self.to_support - self.start

    @computed_field  # type: ignore[prop-decorator]
    @property
    def relative_residual(self) -> float:
        """Size of the residual as a share of the energy in play."""
        return abs(self.residual) / self.in_play if self.in_play else abs(self.residual)


def energy_row(world: World) -> NDArray[np.float64]:
    """Return the measured row of the present state (see `measure`)."""
    row = np.zeros(ROW_LENGTH)
    measure(world, row)
    return row


def start_energy(world: World) -> float:
    """Return the energy (J) of a world that has not moved yet."""
    return float(energy_row(world)[: len(LEDGER_ROW)].sum())


def energy_ledger(world: World, start: float) -> EnergyLedger:
    """Return the ledger of the present state; `start` is the energy (J) at the start.

    Energy in play: largest kinetic energy + sum of the weights' travel |m g v| dt + |work of the support|, at least
    m_total g 1 mm.
    """
    ledger = world.ledger[0]
    row = energy_row(world)
    weight = float(np.sum(world.bodies.mass)) * STANDARD_GRAVITY
    driven = float(ledger.largest_kinetic + ledger.travel_work) + abs(float(ledger.to_support))
    in_play = max(driven, weight * SMALLEST_HEIGHT)
    entries = {name: float(value) for name, value in zip(LEDGER_ROW, row, strict=False)}
    return EnergyLedger(**entries, start=start, in_play=in_play)
