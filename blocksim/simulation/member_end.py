"""Where members of ensembles ended, and how: tables, ledgers and outcomes of a stack of scenes at their last states."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from blocksim.errors import BlocksimError
from blocksim.kernels.common.systems import Coupled
from blocksim.scenario import PlacedBody
from blocksim.simulation.frames import Frames
from blocksim.simulation.ledger import EnergyLedger, InPlay, ledger_of
from blocksim.simulation.loop import outcome_of
from blocksim.simulation.movement import OBSERVABLES, Value, Watch, observe
from blocksim.simulation.outcome import Outcome, diagnosed
from blocksim.simulation.recorder import Rows, frames_from_rows
from blocksim.simulation.schemes import AnyScene, ledger_names, mass_of_systems
from blocksim.simulation.table import COLUMNS, Columns, as_frame, final_values
from blocksim.world.scenes import member
from blocksim.world.systems.blocks import blocks_placed, motion_of, outlines_of

if TYPE_CHECKING:
    import pandas as pd

Placed = tuple[PlacedBody, ...]


@dataclass(frozen=True)
class MemberEnd:
    """Where one member ended and how."""

    outcome: Outcome
    ledger: EnergyLedger
    seconds: float  # simulated
    columns: Columns  # the final table, as `final.csv` has it
    placed: Placed = field(repr=False)
    time_step: float  # s
    rows: Rows = field(repr=False)  # one: the last
    observables: dict[str, Value] = field(default_factory=dict)  # observables of rows, by name

    @cached_property
    def frames(self) -> Frames:
        """One: the last."""
        return frames_from_rows((blocks_placed(self.placed),), self.time_step, self.rows)

    @property
    def final(self) -> "pd.DataFrame":
        """The final table for people who know pandas."""
        return as_frame(self.columns)


@dataclass(frozen=True)
class MemberFailure:
    """A member that could not be built, or for whose contacts there was no room."""

    error: BlocksimError

    @property
    def outcome(self) -> Outcome:
        """The same words and code as where it had been run by itself."""
        return Outcome("failed", str(self.error), self.error.exit_code)


Ended = MemberEnd | MemberFailure


def in_play_of(scenes: AnyScene | Coupled, members: Sequence[int]) -> list[InPlay]:
    """Return what decides the energy in play, of some members of a stack."""
    further = mass_of_systems(member(scenes, 0)) if isinstance(scenes, Coupled) else 0.0  # in a stack of one
    mass = scenes.world.bodies.view(np.ndarray)["mass"]
    masses = [float(np.sum(mass[m])) + further for m in members]  # one by one: the order matters
    book = scenes.world.ledger[:, 0]
    moved = book["largest_kinetic"] + book["travel_work"]
    return [*map(InPlay, masses, moved[list(members)].tolist())]


class Closing:
    """The last states of a stack of scenes."""

    def __init__(
        self,
        scenes: AnyScene,
        placed: list[Placed],
        measured: NDArray[np.float64],
        watch: Watch,
        turned: NDArray[np.float64] | None = None,
    ) -> None:
        """Take what is measured (m, e + 2) in the scenes as they are now, as the scheme's `measured`.

        `watch` has seen them on the way; `turned` (m, 1) is their largest rotation (rad), where it was followed.
        """
        world, blocks = scenes.world, len(placed[0])
        self.names = ledger_names(scenes)
        self.scenes, self.placed = scenes, placed
        self.measured = measured
        self.motion = motion_of(world.bodies[:, :blocks])  # (m, 6, b)
        self.steps: NDArray[np.int64] = world.clock["steps"].copy()  # (m, 1)
        self.time_steps: list[float] = world.controls["step"][:, 0].tolist()
        self.in_play = in_play_of(scenes, range(len(placed)))
        self.columns = final_values(self.motion, _shapes(placed), _outlines(placed)).tolist()
        support = np.stack([world.bodies["vx"][:, -1], world.bodies["vy"][:, -1]], axis=1)
        ends = watch.ends(self.motion, support, [self._seconds(m) for m in range(len(placed))], turned)
        self.observables = observe(ends, [one.name for one in OBSERVABLES.values() if one.in_rows])

    def _seconds(self, m: int) -> float:
        return float(self.steps[m, 0]) * self.time_steps[m]

    def end(self, m: int, start: float, code: int) -> MemberEnd:
        """Return the end of one member: energy (J) at the start, status code that it came to."""
        ledger = ledger_of(self.names, self.measured[m], start, self.in_play[m])
        names = [body.name for body in self.placed[m]]
        some = slice(m, m + 1)
        outcome = outcome_of(code, ledger)
        if not outcome.is_finished:
            outcome = diagnosed(outcome, code, member(self.scenes, m), self.placed[m])
        return MemberEnd(
            outcome=outcome,
            ledger=ledger,
            seconds=self._seconds(m),
            columns=dict(zip(COLUMNS, (names, *self.columns[m]), strict=True)),
            placed=self.placed[m],
            time_step=self.time_steps[m],
            rows=Rows(self.steps[m], (self.motion[some],), self.measured[some], self.names),
            observables=self.observables[m],
        )


def _outlines(placed: list[Placed]) -> NDArray[np.float64] | None:
    """Return the corners (m, b, k, 2) of blocks; None where all are rectangles."""
    outlines = outlines_of([one for member in placed for one in member])
    return None if outlines is None else outlines.reshape(len(placed), -1, *outlines.shape[1:])


def _shapes(placed: list[Placed]) -> NDArray[np.float64]:
    """Return sides and angles (m, 3, b) as placed."""
    bodies = ((one.size_x, one.size_y, one.angle) for member in placed for one in member)
    values = np.array([*bodies]).reshape(len(placed), -1, 3)
    return values.swapaxes(1, 2)
