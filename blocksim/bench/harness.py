"""What is measured, and how: scenes that need no file, timed again and again, numbers with their samples, machine."""

import json
import os
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.errors import BlocksimError, ExitCode
from blocksim.scenario import Model, Scenario, scenario_from_mapping
from blocksim.scenario.models.timeline import IMPULSES, Nonsmooth
from blocksim.simulation import loop, provenance
from blocksim.simulation.schemes import ALONE, AnyScene, Team, build
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
class TimeSteps:
    """A step and its parts; each is solved to the default tolerance, or gone through as often as `velocity_sweeps`."""

    step: float  # s
    substeps: int = SUBSTEPS
    velocity_sweeps: int = UNTIL_SOLVED

    @property
    def setting(self) -> str:
        """For people."""
        return f"step {1e3 * self.step:g} ms / {self.substeps}"

    def time(self, **more: object) -> dict[str, object]:
        """Return the table [time], with more keys."""
        return {"scheme": IMPULSES, **asdict(self), **more}


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
    outcome: loop.Outcome

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
        scene = build(Model(scenario))
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
        return TimedRun(scene, time.process_time() - cpu, time.perf_counter() - clock, loop.BY_CODE[status])


REPEATS = 5
BUSY = 0.5  # processes at work on average over the last minute, before anything was measured


@dataclass(frozen=True)
class Number:
    """One measured quantity: the samples of all repeats, in `unit`; a single one where it is counted or computed."""

    quantity: str
    unit: str
    samples: tuple[float, ...]

    @property
    def median(self) -> float:
        """The number that is reported."""
        return statistics.median(self.samples)


@dataclass(frozen=True)
class Effort:
    """Settings of a measurement."""

    quick: bool = False  # its shortened size
    repeats: int = REPEATS


@dataclass(frozen=True)
class Readings:
    """Result of a measurement."""

    numbers: tuple[Number, ...]
    notes: tuple[str, ...] = ()  # notes on the numbers
    details: tuple[Mapping[str, object], ...] = ()  # more of it, for programs


@dataclass(frozen=True)
class Benchmark:
    """One entry of the registry."""

    name: str
    title: str
    measure: Callable[[Effort], Readings]
    quick: str  # what the quick size leaves out

    def run(self, effort: Effort) -> "BenchmarkRun":
        """Run it."""
        began = time.perf_counter()
        findings = self.measure(effort)
        return BenchmarkRun(self, self.quick if effort.quick else "", findings, time.perf_counter() - began)


@dataclass(frozen=True)
class BenchmarkRun:
    """Result of a measurement, and its duration."""

    measurement: Benchmark
    shortened: str  # what was left out; empty for the full size
    findings: Readings
    seconds: float


def repeat(quantity: str, unit: str, sample: Callable[[], float], repeats: int) -> Number:
    """Return a number with its samples."""
    return Number(quantity, unit, tuple(float(sample()) for _ in range(repeats)))


def single(quantity: str, unit: str, value: float) -> Number:
    """Return a number that needs no repeats: counted, or computed from others."""
    return Number(quantity, unit, (float(value),))


def report(machine: Mapping[str, object], outcomes: Sequence[BenchmarkRun]) -> dict[str, object]:
    """Return everything for programs, not rounded; numbers that are not finite become None, as JSON has none."""
    measurements = [
        {
            "name": outcome.measurement.name,
            "title": outcome.measurement.title,
            "shortened": outcome.shortened,
            "seconds": round(outcome.seconds, 2),
            "numbers": [
                {
                    "quantity": one.quantity,
                    "unit": one.unit,
                    "median": one.median,
                    "smallest": min(one.samples),
                    "largest": max(one.samples),
                    "samples": list(one.samples),
                }
                for one in outcome.findings.numbers
            ],
            "notes": list(outcome.findings.notes),
            "details": [dict(one) for one in outcome.findings.details],
        }
        for outcome in outcomes
    ]
    found = {"machine": machine, "measurements": measurements}
    plain: dict[str, object] = json.loads(json.dumps(found), parse_constant=lambda _: None)
    return plain


def this_machine() -> dict[str, Any]:
    """Return processor, system, versions and load at the start, None where the system does not report it.

    Where other processes share the machine it is busy: times are too long and scatter.
    """
    try:
        load = round(os.getloadavg()[0], 2)
    except (AttributeError, OSError):  # some systems have none
        load = None
    found = provenance.environment()
    versions = {name: found[name] for name in ("platform", "python", "numba", "numpy", "blocksim", "code")}
    busy = load is not None and load > BUSY
    return {"processor": found["processor"], "cores": os.cpu_count() or 1, **versions, "load": load, "busy": busy}


def machine_lines(machine: Mapping[str, Any]) -> list[str]:
    """Return a machine as text."""
    load = "unknown" if machine["load"] is None else f"{machine['load']:.2f}"
    programs = ((name, machine[name.lower()]) for name in ("blocksim", "Python", "numba", "numpy"))
    busy = ["Other processes are running: times are upper bounds and scatter."] if machine["busy"] else []
    return [
        f"{machine['processor']}, {machine['cores']} cores, load {load} at the start",
        ", ".join(f"{name} {version}" for name, version in programs),
        machine["platform"],
        *busy,
    ]
