"""How a run can end, in words and exit codes, and the diagnosis of one that failed: the step and the block.

The block is found in the arrays as they were when the run stopped.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from blocksim.errors import ExitCode
from blocksim.kernels.common import arrays
from blocksim.kernels.common.arrays import ALL, NOT_FINITE, OUTLINE, OVERLAP_LIMIT, World
from blocksim.kernels.explicit.depth import MIDDLE, ROWS_APART
from blocksim.kernels.explicit.models import KERNEL, SURFACE
from blocksim.kernels.nonsmooth.arrays import TOUCHING
from blocksim.scenario import PlacedBody
from blocksim.scenario.overlap import Outlines, Rectangles, penetration
from blocksim.simulation.ledger import RESIDUAL_LIMIT
from blocksim.simulation.recorder import MOTION
from blocksim.simulation.schemes import AnyScene

GROUND = "the ground"
WALL = "a wall"
MILLI = 1e3


@dataclass(frozen=True)
class Outcome:
    """What a run came to; `reason` says why it ended."""

    status: Literal["finished", "failed", "interrupted"]
    reason: str
    exit_code: ExitCode

    @property
    def is_finished(self) -> bool:
        """Return True if the run came to its proper end."""
        return self.status == "finished"


END_OF_TIME = Outcome("finished", "end of simulated time", ExitCode.SUCCESS)
REST = Outcome("finished", "at rest", ExitCode.SUCCESS)
RESIDUAL = Outcome(
    "failed", f"energy residual above {RESIDUAL_LIMIT:.0%} of the energy in play", ExitCode.NUMERICAL_FAILURE
)

BY_CODE = {
    arrays.REACHED: END_OF_TIME,
    arrays.AT_REST: REST,
    arrays.NOT_FINITE: Outcome("failed", "a position or velocity is no longer finite", ExitCode.NUMERICAL_FAILURE),
    arrays.TOO_FAST: Outcome(
        "failed", "a block moves too far in one step for its contacts to be detected", ExitCode.NUMERICAL_FAILURE
    ),
    arrays.OVERLAP_LIMIT: Outcome("failed", "an overlap exceeds contact.max_overlap", ExitCode.NUMERICAL_FAILURE),
}


def interrupted(why: str) -> Outcome:
    """Return what a run comes to that is stopped, and can continue."""
    return Outcome("interrupted", why, ExitCode.STOPPED_EARLY)


def diagnosed(outcome: Outcome, code: int, scene: AnyScene, placed: Sequence[PlacedBody]) -> Outcome:
    """Return the outcome of a run that failed with the step and the block in its reason; of others as it is."""
    if outcome.status != "failed":
        return outcome
    names = [body.name for body in placed]
    with np.errstate(all="ignore"):  # not finite numbers are what is searched for
        who = _FINDERS.get(code, _fastest)(scene, names)
        reason = _lost_particles(scene) if code == OVERLAP_LIMIT else ""
    return replace(outcome, reason=f"{reason or outcome.reason} ({who}, step {int(scene.world.clock[0].steps)})")


def _not_finite(scene: AnyScene, names: Sequence[str]) -> str:
    bodies = scene.world.bodies[: len(names)]
    lost = ~np.all([np.isfinite(bodies[name]) for name in MOTION], axis=0)
    if lost.any():
        return f"block {names[int(np.argmax(lost))]}"
    return _lost_system(scene) or _fastest(scene, names)


def _lost_system(scene: AnyScene) -> str:
    """Return the first of the further systems that has a number which is not finite; empty where none has."""
    for system in getattr(scene, "systems", ()):
        for array in system:
            fields = [array] if array.dtype.names is None else [array[name] for name in array.dtype.names]
            if not all(np.isfinite(one).all() for one in fields):
                return type(system).__name__.lower()
    return ""


def _fastest(scene: AnyScene, names: Sequence[str]) -> str:
    bodies = scene.world.bodies[: len(names)]
    speed = np.hypot(bodies["vx"], bodies["vy"])
    fastest = int(np.argmax(speed))
    return f"the fastest is block {names[fastest]} with {speed[fastest]:.3g} m/s"


def _deepest(scene: AnyScene, names: Sequence[str]) -> str:
    world = scene.world
    one, other, overlap, limit = (
        _overlaps_of_springs(scene) if isinstance(scene, World) else _overlaps_of_constraints(scene)
    )
    worst = int(np.nanargmax(overlap / limit))
    pair = " and ".join(_name(world, names, int(i[worst])) for i in (one, other))
    is_capped = limit[worst] < world.controls[0].max_overlap
    most = f", more than half of a side of {MILLI * 2.0 * limit[worst]:.3g} mm" if is_capped else ""
    return f"{pair} by {MILLI * overlap[worst]:.3g} mm{most}"


def _lost_particles(scene: AnyScene) -> str:
    """Return what limits the deepest overlap where that is how far particles reach; nothing where it is not."""
    if not isinstance(scene, World) or scene.controls[0].model == SURFACE:
        return ""
    _, _, overlap, limit = _overlaps_of_springs(scene)
    worst = int(np.nanargmax(overlap / limit))
    reach = _reach(scene)
    if limit[worst] != reach:
        return ""
    what = (
        "the reach of the kernel" if scene.controls[0].model == KERNEL else f"{ROWS_APART:g} contact.particle_spacing"
    )
    return f"an overlap exceeds {what}, {MILLI * reach:.3g} mm, beyond which particles lose one another"


def _reach(world: World) -> float:
    """Return how deep (m) the particles of boundaries may lie in one another; see blocksim.kernels.explicit.depth."""
    controls = world.controls[0]
    return float(controls.support if controls.model == KERNEL else ROWS_APART * controls.particle_size)


def _name(world: World, names: Sequence[str], body: int) -> str:
    if body < len(names):
        return f"block {names[body]}"
    is_wall = body < world.bodies.size - 1 and math.isfinite(world.bodies[-1].y)
    return WALL if is_wall else GROUND


# bodies a and b; overlap in m, what it is judged by
Pairs = tuple[NDArray[Any], NDArray[Any], NDArray[np.float64], NDArray[np.float64]]


def _overlaps_of_springs(world: World) -> Pairs:
    count = int(world.clock[0].pair_count)
    pairs, contacts = world.pairs[:count], world.contacts[:count]
    is_active = np.arange(contacts.shape[1]) < pairs["active"][:, np.newaxis]
    deepest = np.where(is_active, contacts["depth"], 0.0).max(axis=1)
    is_pressed = deepest > pairs["limit"]
    lost = np.where(is_pressed, 0.0, _penetrations(world, pairs))
    limit = pairs["limit"]
    if world.controls[0].model != SURFACE:
        middle = MIDDLE * _smallest_sides(world, pairs["a"], pairs["b"])
        limit = np.where(is_pressed, limit, np.minimum(_reach(world), middle))
    return pairs["a"], pairs["b"], np.maximum(deepest, lost), limit


def deepest_overlap(world: World) -> float:
    """Return the largest overlap (m) of contacts of springs."""
    count = int(world.clock[0].pair_count)
    pairs, contacts = world.pairs[:count], world.contacts[:count]
    is_active = np.arange(contacts.shape[1]) < pairs["active"][:, np.newaxis]
    return float(np.where(is_active, contacts["depth"], 0.0).max(initial=0.0))


def _penetrations(world: World, pairs: NDArray[Any]) -> NDArray[np.float64]:
    """Return how deep (m) the bodies of pairs overlap, or the block lies below the ground."""
    bodies = world.bodies
    outlines = outlines_of(world)
    is_ground = pairs["b"] == bodies.size - 1
    below = bodies[-1].y - outlines.bottom[pairs["a"]]
    return np.where(is_ground, below, penetration(outlines.some(pairs["a"]), outlines.some(pairs["b"])))


def outlines_of(world: World) -> Outlines:
    """Return the outlines of all bodies, those of polygons in boxes about their centroids."""
    bodies = world.bodies
    boxes = Rectangles(*(bodies[name] for name in ("x", "y", "half_x", "half_y", "cos", "sin")))
    outlines = Outlines.rectangles(boxes)
    polygons = np.flatnonzero(bodies["faces"] == OUTLINE)
    if not polygons.size:
        return outlines
    shapes, shape_of = np.unique(bodies[["first_corner", "corner_count"]][polygons], return_inverse=True)
    most = max(4, int(shapes["corner_count"].max()))
    last = shapes["corner_count"][:, np.newaxis] - 1  # repeated up to a common number
    rows = world.corners[shapes["first_corner"][:, np.newaxis] + np.minimum(np.arange(most), last)]
    outlines.kinds[polygons] = shape_of
    return outlines._replace(polygons=np.stack([rows["x"], rows["y"]], axis=-1))


def _overlaps_of_constraints(scene: Any) -> Pairs:
    constraints = scene.contacts.constraints[: int(scene.contacts.stepping[0].constraint_count)]
    depth = np.maximum(-constraints["gap_one"], -constraints["gap_two"])
    limit = np.ones(constraints.size)
    if not scene.world.controls[0].max_overlap > 0.0:
        limit = _smallest_sides(scene.world, constraints["a"], constraints["b"])
    return constraints["a"], constraints["b"], np.where(constraints["reach"] == TOUCHING, depth, 0.0), limit


def _smallest_sides(world: World, one: NDArray[Any], other: NDArray[Any]) -> NDArray[np.float64]:
    half = np.minimum(world.bodies["half_x"], world.bodies["half_y"])
    side = np.where((half > 0.0) & (world.bodies["faces"] == ALL), 2.0 * half, np.inf)
    smallest: NDArray[np.float64] = np.minimum(side[one], side[other])
    return smallest


_FINDERS = {NOT_FINITE: _not_finite, OVERLAP_LIMIT: _deepest}
