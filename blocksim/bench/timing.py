"""CPU time of the solver: a world that starts again and again from the same state."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from blocksim.errors import BlocksimError, ExitCode
from blocksim.simulation.outcome import BY_CODE
from blocksim.simulation.schemes import build_scene
from blocksim.simulation.team import ALONE, Team
from blocksim.world.scenes import arrays_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from blocksim.kernels.common.arrays import World
    from blocksim.scenario import Scenario
    from blocksim.simulation.outcome import Outcome
    from blocksim.simulation.schemes import AnyScene


class RunFailedError(BlocksimError):
    """The overlap limit was reached, or something was not finite."""

    exit_code = ExitCode.NUMERICAL_FAILURE


class Timed(NamedTuple):
    """The scene at the end, and the CPU seconds of this process that it took to get there."""

    scene: AnyScene
    seconds: float
    outcome: Outcome

    @property
    def world(self) -> World:
        """The arrays that all schemes have."""
        return self.scene.world

    @property
    def steps(self) -> int:
        """Steps done."""
        return int(self.world.clock[0].steps)

    @property
    def bodies(self) -> Any:
        """All bodies without the ground."""
        return self.world.bodies[:-1]


class Rerun:
    """A scene after its first contacts were found, to be advanced from there any number of times.

    It starts again in the same memory: where arrays lie changes times by some per cent.
    """

    def __init__(self, scenario: Scenario, shift: NDArray[np.float64] | float = 0.0) -> None:
        """Build the scene with its blocks shifted along x (m), and keep its state."""
        scene = build_scene(scenario)
        scene.world.bodies.x[:-1] += shift
        self.scene, _ = ALONE.advance(scene, 0)
        self._arrays = arrays_of(self.scene)
        self.keep()

    def keep(self) -> None:
        """Start from the present state from now on."""
        self._saved = [array.copy() for array in self._arrays]

    @property
    def step(self) -> float:
        """Length of a step (s)."""
        return float(self.scene.world.controls[0].step)

    @property
    def bytes(self) -> int:
        """Memory of all arrays of the scene."""
        return sum(array.nbytes for array in self._arrays)

    def run(self, last_step: int) -> Timed:
        """Advance from the start to a step, or until all rests; more room for pairs is part of it.

        Raises RunFailedError: the time of a failed run is meaningless.
        """
        timed = self.attempt(last_step)
        _refuse_failed(timed.outcome)
        return timed

    def attempt(self, last_step: int) -> Timed:
        """Do the same, but return a failed run too."""
        self.restore()
        began = time.process_time()
        scene, status = ALONE.advance(self.scene, last_step)
        return Timed(scene, time.process_time() - began, BY_CODE[status])

    def restore(self) -> None:
        """Go back to the start."""
        for array, saved in zip(self._arrays, self._saved, strict=True):
            np.copyto(array, saved)

    def advance(self, last_step: int, team: Team) -> None:
        """Continue from the present state. Raises RunFailedError."""
        _, status = team.advance(self.scene, last_step)
        _refuse_failed(BY_CODE[status])


def _refuse_failed(outcome: Outcome) -> None:
    if not outcome.is_finished:
        raise RunFailedError(f"a run that was to be timed failed: {outcome.reason}")
