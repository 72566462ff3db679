"""Walls of 100 and 1000 bricks by engines with rigid contacts: time a brick and step, and time at equal accuracy.

The walls are pushed in proportion to height. For 0.2 s small differences hardly grow, so accuracy is judged brick by
brick, by the mean distance of the centres from where the same engine has them with its finest setting. At equal
accuracy every engine takes the longest step with which it is as near to its own finest answer as the non-smooth scheme
is to its own at steps of 1 ms in 4 substeps.
"""

import functools
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from blocksim.bench.harness import (
    LOW_COURSES,
    WALL_RESTITUTION,
    Benchmark,
    Effort,
    Number,
    Readings,
    TimeSteps,
    pushed_wall,
    single,
)
from tests.bench.peers import box2d_v3
from tests.bench.peers.engine import Box2D, Final, Nonsmooth, Pymunk, Scene, Solver, raced
from tests.bench.peers.series import BOX2D, BOX2D_V3, NONSMOOTH, PYMUNK, RACE_STEP


class Size(NamedTuple):
    """A wall, and how long it is watched."""

    columns: int
    rows: int
    end: float  # s

    def scene(self) -> Scene:
        """Return it, let go."""
        make = functools.partial(pushed_wall, self.columns, self.rows, upright=LOW_COURSES)
        return Scene(make, np.zeros(self.columns * self.rows), WALL_RESTITUTION, self.end)


WALLS, SMALL = (Size(10, 10, 1.0), Size(40, 25, 1.0)), (Size(5, 4, 0.1),)
SOON = 0.2  # s
STEPS, FINEST = (4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4, 1.25e-4), 6.25e-5  # s
ROUNDS = 5
AS_NEAR = 1.05  # times the mean distance of the first engine


def engines() -> dict[str, tuple[Callable[[float], Solver], Solver]]:
    """Return engines at a step (s) by name, with their finest settings, the non-smooth scheme first."""
    found: dict[str, tuple[Callable[[float], Solver], Solver]] = {
        f"{NONSMOOTH}, 4 substeps": (lambda step: Nonsmooth(TimeSteps(step, 4)), Nonsmooth(TimeSteps(FINEST, 4))),
        f"{PYMUNK}, 10 iterations": (lambda step: Pymunk(step, 10), Pymunk(FINEST, 30)),
        f"{BOX2D}, 10 iterations": (lambda step: Box2D(step, 10), Box2D(FINEST, 50)),
    }
    if box2d_v3.library() is not None:
        stiff = box2d_v3.STIFF
        found[f"{BOX2D_V3}, 4 substeps"] = (
            lambda step: box2d_v3.Box2Dv3(step, 4, stiff),
            box2d_v3.Box2Dv3(FINEST, 4, stiff),
        )
        found[f"{BOX2D_V3}, 4 substeps, contacts of 30 Hz"] = (
            lambda step: box2d_v3.Box2Dv3(step, 4),
            box2d_v3.Box2Dv3(FINEST, 4, stiff),
        )
    return found


def measure(effort: Effort) -> Readings:
    """Measure all engines in turns."""
    numbers: list[Number] = []
    rounds = min(ROUNDS, effort.repeats)
    for size in SMALL if effort.quick else WALLS:
        count, steps = size.columns * size.rows, round(size.end / RACE_STEP)
        racers = {name: at(RACE_STEP) for name, (at, _) in engines().items()}
        own, *others = raced(racers, size.scene, rounds)[0]
        each = Number(f"{count} bricks: {own.quantity}", "µs", tuple(1e6 * s / count / steps for s in own.samples))
        numbers += [each, *(replace(one, quantity=f"{count} bricks: {one.quantity}") for one in others)]
        numbers += _at_equal_accuracy(size._replace(end=min(SOON, size.end)), rounds)
    meaning = (
        "µs: CPU time a brick and step of 1 ms; distance: mean of the centres from the engine's own finest setting"
    )
    return Readings(tuple(numbers), notes=(meaning,))


def _at_equal_accuracy(size: Size, rounds: int) -> list[Number]:
    """Return how far off engines are at the chosen steps, and how long they take in turns."""
    count, scene = size.columns * size.rows, size.scene()
    off: dict[str, float] = {}
    chosen: dict[str, Solver] = {}
    for name, (at, finest) in engines().items():
        reference = finest.solve(scene)
        wanted = np.inf if not off else AS_NEAR * next(iter(off.values()))
        for step in (RACE_STEP,) if not off else STEPS:
            distance = mean_distance(at(step).solve(scene), reference)
            if distance <= wanted:
                off[name], chosen[name] = distance, at(step)
                break
    named: Mapping[str, Solver] = {
        name if name == next(iter(chosen)) else f"{name}, {solver.setting}": solver for name, solver in chosen.items()
    }
    own, *others = raced(named, size.scene, rounds)[0]
    times = [replace(own, unit="CPU ms", samples=tuple(1e3 * one for one in own.samples)), *others]
    distances = [single(f"{name}: distance", "mm", distance) for name, distance in off.items()]
    return [replace(one, quantity=f"{count} bricks, as near: {one.quantity}") for one in (*distances, *times)]


def mean_distance(one: Final, other: Final) -> float:
    """Return the mean distance (mm) of the centres of two ends of a scene."""
    return float(1e3 * np.hypot(one.x - other.x, one.y - other.y).mean())


BRICKS = Benchmark(
    "bricks",
    "pushed walls of 100 and 1000 bricks at one step and at equal accuracy, by all engines with rigid contacts",
    measure,
    quick="20 bricks for 0.1 s instead of 100 and 1000 for 1 s",
)
