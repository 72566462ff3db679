"""The energy ledger of a run: where the energy went, and how much of it is unaccounted for.

At some steps a run checks whether its energy adds up, so that one that blows up ends soon. They follow from the scene
alone: where outputs, checkpoints and signals interrupt a run must not decide where it fails.
"""

import math
from collections.abc import Sequence
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, BeforeValidator, computed_field, model_validator

from blocksim.scenario.units import USUAL_GRAVITY

if TYPE_CHECKING:
    from blocksim.simulation.schemes import AnyScene

SMALLEST_HEIGHT = 1e-3  # m; the energy in play is at least that of lifting everything by this much
RESIDUAL_LIMIT = 0.05  # of the energy in play; a run beyond this has no meaning
RESIDUAL_PROMISE = 1e-3  # of the energy in play; beyond this a warning is due
FIRST_CHECK = 1000  # steps
BODY_STEPS = 200_000  # of bodies between two checks; before, each is four times as far from the last one as that was

Number = Annotated[float, BeforeValidator(lambda value: math.nan if value is None else value)]  # JSON has no NaN


class EnergyLedger(BaseModel, frozen=True, extra="allow"):
    """All in J. The residual is what total + losses has drifted since the start.

    `to_support` is the work done on supports and driven bodies that move; negative where they drive the scene.
    `to_loads` is that done on loads; negative where they drive it. `events`
    is what events have taken out of it, with bodies removed or fixed, and negative where they bring some in. What a
    scheme does not know is zero: springs, dashpots and contacts that break are of the explicit one, impacts and
    correction (blocksim.kernels.nonsmooth.energy) of the non-smooth one. Systems beside the blocks add entries of their
    own, whose names begin with theirs.
    """

    kinetic: Number
    potential: Number
    stored_normal: Number = 0.0
    stored_shear: Number = 0.0
    dashpot: Number = 0.0
    friction: Number = 0.0
    broken: Number = 0.0
    impacts: Number = 0.0
    correction: Number = 0.0
    to_support: Number = 0.0
    to_loads: Number = 0.0
    events: Number = 0.0
    start: Number
    in_play: Number
    __pydantic_extra__: dict[str, Number]

    @model_validator(mode="before")
    @classmethod
    def _without_computed(cls, data: object) -> object:
        """Leave out what run.json has beside the entries."""
        computed = cls.model_computed_fields
        return {key: one for key, one in data.items() if key not in computed} if isinstance(data, dict) else data

    @computed_field  # type: ignore[prop-decorator]  # mypy knows no decorated properties
    @property
    def residual(self) -> float:
        """Energy now plus all losses, minus the energy at the start (J)."""
        now = self.kinetic + self.potential + self.stored_normal + self.stored_shear
        lost = self.dashpot + self.friction + self.broken + self.impacts + self.correction + self.to_support
        lost += self.to_loads + self.events
        further = sum((self.model_extra or {}).values())
        residual: float = now + lost + further - self.start
        return residual

    @computed_field  # type: ignore[prop-decorator]
    @property
    def relative_residual(self) -> float:
        """Size of the residual as a share of the energy in play."""
        return abs(self.residual) / self.in_play if self.in_play else abs(self.residual)


@cache
def solver_module(module: str) -> Any:
    """Return a module of blocksim that needs the compiler: who reads stored runs never asks for it."""
    return import_module(f"blocksim.{module}")


def start_energy(scene: "AnyScene") -> float:
    """Return all energy (J) that a scene holds and has lost: constant, if the ledger is complete."""
    schemes = solver_module("simulation.schemes")
    return float(schemes.measure_row(scene)[: len(schemes.ledger_names(scene))].sum())


def energy_ledger(scene: "AnyScene", start: float) -> EnergyLedger:
    """Return the ledger of the present state; `start` is the energy (J) at the start."""
    schemes, book = solver_module("simulation.schemes"), scene.world.ledger[0]
    mass = float(np.sum(scene.world.bodies.mass)) + schemes.system_totals(scene)[1]
    moved = float(book.largest_kinetic + book.travel_work)
    return ledger_of(schemes.ledger_names(scene), schemes.measure_row(scene), start, mass, moved)


def ledger_of(names: Sequence[str], row: NDArray[np.float64], start: float, mass: float, moved: float) -> EnergyLedger:
    """Return the ledger of a state in which energies (J) of these names were measured; `mass` (kg) is of all bodies.

    Energy in play: `moved` (J), the largest kinetic energy + sum of the weights' travel |m g v| dt, and |work of
    support and loads|, at least m_total g 1 mm.
    """
    entries = dict(zip(names, row.tolist(), strict=False))
    driven = moved + abs(entries.get("to_support", 0.0)) + abs(entries.get("to_loads", 0.0))
    return EnergyLedger(**entries, start=start, in_play=max(driven, mass * USUAL_GRAVITY * SMALLEST_HEIGHT))


def next_energy_check(done: int, bodies: int) -> int:
    """Return the first step after `done` at which the energy is checked, in a scene of so many bodies."""
    period = FIRST_CHECK
    while period <= done and period * bodies < BODY_STEPS:
        period *= 4
    return (done // period + 1) * period


def adds_up(ledger: EnergyLedger) -> bool:
    """Return True if a run may continue; not so where the residual is no number."""
    return ledger.relative_residual <= RESIDUAL_LIMIT and not creates(ledger)


def creates(ledger: EnergyLedger) -> bool:
    """Return True if impacts have made energy, which none does: those of a velocity pass that ended unsolved may."""
    return ledger.impacts < -RESIDUAL_LIMIT * ledger.in_play
