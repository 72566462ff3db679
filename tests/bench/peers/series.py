"""Settings of the engines that are compared: one line per curve."""

from blocksim.bench.harness import UNTIL_SOLVED, TimeSteps
from tests.bench.peers.box2d_v3 import STIFF, Box2Dv3, library
from tests.bench.peers.engine import Box2D, Explicit, Nonsmooth, Pymunk, Series, Solver

PYMUNK, BOX2D, BOX2D_V3, EXPLICIT, NONSMOOTH = "pymunk", "Box2D", "Box2D v3", "explicit", "non-smooth"
STEPS = (4e-3, 2.8e-3, 2e-3, 1.4e-3, 1e-3, 7e-4, 5e-4, 2e-4, 1e-4, 5e-5)  # s
SCALES = (1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 1e-1, 3e-1)
RACE_STEP = 1e-3  # s
QUICK_LEVELS = 3


def three_blocks_series(restitution: float, *, quick: bool) -> tuple[Series, ...]:
    """Return every engine with few and many iterations, explicit with long and short steps, non-smooth with parts.

    Without restitution one velocity sweep is enough for the non-smooth scheme, and is another law than many: it has a
    finest setting of its own.
    """
    steps, scales = (STEPS[:QUICK_LEVELS], SCALES[:QUICK_LEVELS]) if quick else (STEPS, SCALES)
    finest = STEPS[QUICK_LEVELS]
    sweeps = UNTIL_SOLVED if restitution else 1
    # single precision: with steps below 20 µs the answers of Box2D begin to wander
    references: dict[str, Solver] = {
        PYMUNK: Pymunk(finest, 30) if quick else Pymunk(5e-6, 100),
        BOX2D: Box2D(finest, 30) if quick else Box2D(2e-5, 50),
        EXPLICIT: Explicit(SCALES[QUICK_LEVELS], 0.1) if quick else Explicit(1.0, 0.05),
        NONSMOOTH: Nonsmooth(TimeSteps(finest if quick else 5e-6, 1, sweeps)),
    }
    found: list[tuple[str, str, tuple[Solver, ...]]] = [
        *((PYMUNK, f"pymunk, {n} iterations", _stepped(Pymunk, steps, n)) for n in (10, 30)),
        *((BOX2D, f"Box2D, {n} iterations", _stepped(Box2D, steps, n)) for n in (10, 50)),
        *((EXPLICIT, f"explicit, safety {safety:g}", _explicit(scales, safety)) for safety in (0.1, 0.05)),
        *((NONSMOOTH, f"non-smooth, {_parts(n)}", _nonsmooth(steps, n, sweeps)) for n in (1, 3, 4)),
    ]
    if library() is not None:  # single precision, as above
        references[BOX2D_V3] = Box2Dv3(finest, 4, STIFF) if quick else Box2Dv3(2e-5, 4, STIFF)
        found += [(BOX2D_V3, f"Box2D v3, {_parts(n)}", tuple(Box2Dv3(one, n, STIFF) for one in steps)) for n in (1, 4)]
    return tuple(Series(engine, label, levels, references[engine]) for engine, label, levels in found)


def heap_racers() -> dict[str, Solver]:
    """Return those that are timed in turns on the heap, the non-smooth scheme first.

    Box2D v3, where it is at hand, has as many substeps as that.
    """
    return {
        NONSMOOTH: Nonsmooth(TimeSteps(RACE_STEP)),
        f"{BOX2D}, 10 iterations": Box2D(RACE_STEP, 10),
        f"{PYMUNK}, 10 iterations": Pymunk(RACE_STEP, 10),
        **({} if library() is None else {f"{BOX2D_V3}, 4 substeps": Box2Dv3(RACE_STEP, 4, STIFF)}),
    }


def _stepped(engine: type[Pymunk | Box2D], steps: tuple[float, ...], iterations: int) -> tuple[Solver, ...]:
    return tuple(engine(step, iterations) for step in steps)


def _explicit(scales: tuple[float, ...], safety: float) -> tuple[Solver, ...]:
    return tuple(Explicit(scale, safety) for scale in scales)


def _nonsmooth(steps: tuple[float, ...], parts: int, sweeps: int) -> tuple[Solver, ...]:
    return tuple(Nonsmooth(TimeSteps(step, parts, sweeps)) for step in steps)


def _parts(count: int) -> str:
    return f"{count} substep{'s' if count > 1 else ''}"
