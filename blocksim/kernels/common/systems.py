"""Systems beside the blocks and supports of a world, in every step of the explicit scheme.

A step calls, between the drift of the blocks and their forces,

    start      of every system: half a kick with the forces of the step before, and the drift,
    act        of every pair of systems that act on one another: forces on both, blocks and supports included,
    finish     of every system: accelerations and half a kick,

each by all threads, which meet after each. Forces on blocks are added to `fx`, `fy` and `torque` of the bodies, where
those of their contacts come on top. What a step calls follows from the types of the systems alone: all calls are put
together, one after the other, when the time loop is compiled for these types. So nothing is looked up in a step, and
the loop of a scene without such systems is compiled without all this.

A function of a system gets the number of its thread, and works on a part of its own (`part_of_thread`); to have the
same bits for any number of threads it gathers: what acts on one thing is summed up by one thread, in a fixed order.
"""

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

from numba.extending import overload

from blocksim.kernels.common.arrays import TEAM_SIZE, Floats, World
from blocksim.kernels.common.barrier import barrier
from blocksim.kernels.common.jit import OPTIONS, config, entry_kernel, kernel, njit

Systems = tuple[Any, ...]
"""The arrays of systems, a named tuple of a class of its own for each."""


class Stages(NamedTuple):
    """The compiled functions of one system; `system` is its named tuple of arrays."""

    start: Callable[[Any, World, int, float], None]  # system, world, thread, step (s)
    finish: Callable[[Any, World, int, float], None]  # the same
    survey: Callable[[Any, World], tuple[float, float, float]]
    # highest speed (m/s; infinite where a number is not finite), kinetic energy (J), power of the weights (W), each
    # counted positive
    measure: Callable[[Any, World, Floats], None]  # writes its energies (J), as the system declares them, then kg


class Act(NamedTuple):
    """The function of a pair of systems, by number; where the other is blocks or supports, it gets the world twice."""

    one: int
    other: int | None  # None: blocks or supports
    function: Callable[[Any, Any, World, int, float], None]  # arrays of both, world, thread, step (s)


class Plan(NamedTuple):
    """What a step calls for systems of some types."""

    stages: tuple[Stages, ...]
    acts: tuple[Act, ...]
    energies: tuple[tuple[str, ...], ...]  # names of those (J) of each system


class Coupled(NamedTuple):
    """A world and the systems beside its blocks and supports."""

    world: World
    systems: Systems


PLANS: dict[tuple[type, ...], Plan] = {}
"""By the classes of the arrays, as scenes are built."""


def plan(systems: Systems, wanted: Plan) -> None:
    """Plan what a step calls for systems of these types. Raises ValueError where they were planned otherwise before."""
    types = tuple(type(system) for system in systems)
    if PLANS.setdefault(types, wanted) != wanted:
        message = f"{', '.join(one.__name__ for one in types)}: compiled with other functions in this process"
        raise ValueError(message)


def plan_of(systems: Systems) -> Plan:
    """Return what was planned for systems of these types."""
    return PLANS[tuple(type(system) for system in systems)]


@kernel
def part_of_thread(count: int, world: World, k: int) -> tuple[int, int]:
    """Return where the part of thread k of so many things begins and ends."""
    size = world.team[TEAM_SIZE]
    return count * k // size, count * (k + 1) // size


def _inner(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a part of what a step calls: into its caller, with which it is cached."""
    compiled: Callable[..., Any] = njit(**OPTIONS, forceinline=True)(function)
    return compiled


def _both(first: Callable[..., Any], then: Callable[..., Any]) -> Callable[..., Any]:
    """Return what calls two functions, one after the other; all threads meet between them."""

    def run(systems: Systems, world: World, k: int, step: float) -> None:
        first(systems, world, k, step)
        barrier(world.team)
        then(systems, world, k, step)

    return _inner(run)


def _of_one(function: Callable[..., Any], i: int) -> Callable[..., Any]:
    """Return what calls a function of system i."""

    def run(systems: Systems, world: World, k: int, step: float) -> None:
        function(systems[i], world, k, step)

    return _inner(run)


def _of_pair(function: Callable[..., Any], i: int, j: int) -> Callable[..., Any]:
    """Return what calls the function of systems i and j."""

    def run(systems: Systems, world: World, k: int, step: float) -> None:
        function(systems[i], systems[j], world, k, step)

    return _inner(run)


def _with_world(function: Callable[..., Any], i: int) -> Callable[..., Any]:
    """Return what calls the function of system i and of blocks or supports."""

    def run(systems: Systems, world: World, k: int, step: float) -> None:
        function(systems[i], world, world, k, step)

    return _inner(run)


def _nothing() -> Callable[..., Any]:
    def run(_systems: Systems, _world: World, _k: int, _step: float) -> None:
        pass

    return _inner(run)


def _step(wanted: Plan) -> Callable[..., Any]:
    """Return all calls of a step, one after the other; threads meet after each."""
    calls = [_of_one(stages.start, i) for i, stages in enumerate(wanted.stages)]
    calls += [_with_world(act, i) if j is None else _of_pair(act, i, j) for i, j, act in wanted.acts]
    calls += [_of_one(stages.finish, i) for i, stages in enumerate(wanted.stages)]
    return functools.reduce(_both, [*calls, _nothing()])


def _survey_both(before: Callable[..., Any], survey: Callable[..., Any], i: int) -> Callable[..., Any]:
    def run(systems: Systems, world: World) -> tuple[float, float, float]:
        fastest, kinetic, power = before(systems, world)
        speed, energy, work = survey(systems[i], world)
        return max(fastest, speed), kinetic + energy, power + work

    return _inner(run)


def _survey(wanted: Plan) -> Callable[..., Any]:
    def none(_systems: Systems, _world: World) -> tuple[float, float, float]:
        return 0.0, 0.0, 0.0

    found = _inner(none)
    for i, stages in enumerate(wanted.stages):
        found = _survey_both(found, stages.survey, i)
    return found


def _measure_both(before: Callable[..., Any], measure: Callable[..., Any], i: int, place: slice) -> Callable[..., Any]:
    first, last = place.start, place.stop

    def run(systems: Systems, world: World, row: Floats) -> None:
        before(systems, world, row)
        measure(systems[i], world, row[first:last])

    return _inner(run)


def _measure(wanted: Plan) -> Callable[..., Any]:
    def none(_systems: Systems, _world: World, _row: Floats) -> None:
        pass

    found, first = _inner(none), 0
    for i, (stages, names) in enumerate(zip(wanted.stages, wanted.energies, strict=True)):
        last = first + len(names) + 1
        found = _measure_both(found, stages.measure, i, slice(first, last))
        first = last
    return found


def step_systems(systems: Systems, world: World, k: int, step: float) -> None:
    """Advance all systems by one step (s), as thread k; the blocks have drifted, and their forces come next."""
    _step(PLANS[(*map(type, systems),)])(systems, world, k, step)


def survey_systems(systems: Systems, world: World) -> tuple[float, float, float]:
    """Return the highest speed (m/s), the kinetic energy (J) and the weights' power (W) of all systems."""
    found: tuple[float, float, float] = _survey(PLANS[(*map(type, systems),)])(systems, world)
    return found


def measure_of(systems: Systems, world: World, row: Floats) -> None:
    """Write the energies (J) and the mass (kg) of all systems, one after the other."""
    _measure(PLANS[(*map(type, systems),)])(systems, world, row)


def _compiled_as(stub: Callable[..., Any], write: Callable[[Plan], Callable[..., Any]]) -> None:
    """Have compiled code call what is written out for the types of the systems, instead of a stub."""
    options: Any = {name: OPTIONS[name] for name in ("error_model", "_nrt")}

    def chosen(systems: Any, *_: Any) -> Callable[..., Any]:
        written: Any = write(PLANS[tuple(one.instance_class for one in systems.types)])
        found: Callable[..., Any] = written.py_func
        return found

    overload(stub, jit_options=options, strict=False)(chosen)


if not config.DISABLE_JIT:
    _compiled_as(step_systems, _step)
    _compiled_as(survey_systems, _survey)
    _compiled_as(measure_of, _measure)


@entry_kernel
def measure_systems(scene: Coupled, row: Floats) -> None:
    """Write the energies (J) and the mass (kg) of all systems of a scene, one after the other."""
    measure_of(scene.systems, scene.world, row)
