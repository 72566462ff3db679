"""The scenes that are measured, made here so that they need no file, and how they are timed again and again."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.errors import BlocksimError, ExitCode
from blocksim.scenario import Scenario, scenario_from_mapping
from blocksim.scenario.models.timeline import IMPULSES, Nonsmooth
from blocksim.simulation.loop import BY_CODE, Outcome
from blocksim.simulation.schemes import ALONE, AnyScene, Team, build_scene
from blocksim.world.build import arrays_of

Table = Mapping[str, object]

MATERIAL = {"unit_weight": 26.7e3, "young_modulus": 69e9, "poisson_ratio": 0.3}  # N/m3, Pa, -
SIDES = {"width": 0.032, "height": 0.025, "length": 0.05}  # m, the paper's block
FRICTION = {"block_block": 0.31, "block_ground": 0.38}
OVERLAP = 0.01  # m
RESTITUTION = 0.2
WALL_RESTITUTION = 0.1
PUSH = 1.0  # m/s, of the upper edge of a wall
LOW_COURSES = "height"  # `upright` of the wall that non-smooth engines are compared on: bricks of 32 x 25 mm
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
        return {"scheme": IMPULSES, **self.keys, **more}


def three_blocks(contact: Table | None = None, time: Table | None = None, friction: Table = FRICTION) -> Scenario:
    """Return the three blocks of scenarios/three_blocks_nominal.toml; more keys of [contact] and [time]."""
    stairs = {"kind": "staircase", "block": "brick", "count": 3, "overlap": OVERLAP}
    more = {"contact": {"restitution": RESTITUTION, **(contact or {})}, "time": {"end": 2.0, **(time or {})}}
    blocks = {"brick": {**SIDES, "upright": "length", "material": "aluminium"}}
    return one_structure("three_blocks", blocks, stairs, {**more, "friction": friction})


def pushed_wall(
    columns: int, rows: int, contact: Table | None = None, time: Table | None = None, *, upright: str = "width"
) -> Scenario:
    """Return a wall in running bond, of the same blocks.

    They lie on their sides of 50 x 25 mm, 32 mm high; with upright "height" on those of 32 x 50 mm, 25 mm high. At the
    start a block at height y moves along x with 1 m/s y / H, H the height of the wall.
    """
    wall = {"kind": "wall", "block": "brick", "columns": columns, "rows": rows, "shear_velocity": PUSH}
    more = {"contact": {"restitution": WALL_RESTITUTION, **(contact or {})}}
    more["time"] = {"end": 1.0, "stop_at_rest": False, **(time or {})}
    blocks = {"brick": {**SIDES, "upright": upright, "material": "aluminium"}}
    return one_structure("pushed_wall", blocks, wall, {**more, "friction": FRICTION})


def one_structure(name: str, blocks: Table, structure: Table, more: Table) -> Scenario:
    """Return the scenario of one structure of aluminium blocks; `more` are other tables."""
    data: dict[str, Any] = {
        "schema": 1,
        "name": name,
        "materials": {"aluminium": MATERIAL},
        "blocks": blocks,
        "structures": [structure],
        "ground": {"material": "aluminium"},
        **more,
    }
    return scenario_from_mapping(data)


class RunFailedError(BlocksimError):
    """The overlap limit was reached, or something was not finite."""

    exit_code = ExitCode.NUMERICAL_FAILURE


class TimedRun(NamedTuple):
    """The scene at the end, and the seconds that it took to get there."""

    scene: AnyScene
    seconds: float  # CPU time of this process
    waited: float  # of the clock
    outcome: Outcome

    @property
    def steps(self) -> int:
        """Steps done."""
        return int(self.scene.world.clock[0].steps)

    @property
    def bodies(self) -> Any:
        """All bodies without the ground."""
        return self.scene.world.bodies[:-1]


class Rerun:
    """A scene after its first contacts were found, to be advanced from there any number of times.

    It starts again in the same memory: where arrays lie changes times by some per cent.
    """

    def __init__(self, scenario: Scenario, shift: NDArray[np.float64] | float = 0.0) -> None:
        """Build the scene with its blocks shifted along x (m), and keep its state."""
        scene = build_scene(scenario)
        scene.world.bodies.x[:-1] += shift
        self.scene, _ = ALONE.advance(scene, 0)
        self.step = float(self.scene.world.controls[0].step)  # s
        self._arrays = arrays_of(self.scene)
        self.bytes = sum(array.nbytes for array in self._arrays)  # memory of the scene
        self.keep()

    def keep(self) -> None:
        """Start from the present state from now on."""
        self._saved = [array.copy() for array in self._arrays]

    def run(self, last_step: int, team: Team = ALONE) -> TimedRun:
        """Advance from the start to a step, or until all rests; more room for pairs is part of it.

        Raises RunFailedError: the time of a failed run is meaningless.
        """
        timed = self.attempt(last_step, team)
        if timed.outcome.status != "finished":
            raise RunFailedError(f"a run that was to be timed failed: {timed.outcome.reason}")
        return timed

    def attempt(self, last_step: int, team: Team = ALONE) -> TimedRun:
        """Do the same, but return a failed run too."""
        for array, saved in zip(self._arrays, self._saved, strict=True):
            np.copyto(array, saved)
        cpu, clock = time.process_time(), time.perf_counter()
        scene, status = team.advance(self.scene, last_step)
        return TimedRun(scene, time.process_time() - cpu, time.perf_counter() - clock, BY_CODE[status])
