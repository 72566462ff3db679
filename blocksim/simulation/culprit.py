"""Which block a failed run failed at: found in the arrays as they were when it stopped."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from blocksim.kernels.arrays import ALL, NOT_FINITE, OVERLAP_LIMIT, World
from blocksim.kernels.nonsmooth.arrays import TOUCHING
from blocksim.scenario import PlacedBody
from blocksim.simulation.outcome import Outcome
from blocksim.simulation.recorder import MOTION
from blocksim.simulation.schemes import AnyScene

GROUND = "the ground"
MILLI = 1e3


def told(outcome: Outcome, code: int, scene: AnyScene, placed: Sequence[PlacedBody]) -> Outcome:
    """Return the outcome of a run that failed with the step and the block in its reason; of others as it is."""
    if outcome.status != "failed":
        return outcome
    names = [body.name for body in placed]
    with np.errstate(all="ignore"):  # what is not finite is just what is looked for
        who = _FINDERS.get(code, _fastest)(scene, names)
    return replace(outcome, reason=f"{outcome.reason} ({who}, step {int(scene.world.clock[0].steps)})")


def _not_finite(scene: AnyScene, names: Sequence[str]) -> str:
    bodies = scene.world.bodies[: len(names)]
    lost = ~np.all([np.isfinite(bodies[name]) for name in MOTION], axis=0)
    return f"block {names[int(np.argmax(lost))]}" if lost.any() else _fastest(scene, names)


def _fastest(scene: AnyScene, names: Sequence[str]) -> str:
    bodies = scene.world.bodies[: len(names)]
    speed = np.hypot(bodies["vx"], bodies["vy"])
    fastest = int(np.argmax(speed))
    return f"the fastest is block {names[fastest]} with {speed[fastest]:.3g} m/s"


def _deepest(scene: AnyScene, names: Sequence[str]) -> str:
    one, other, overlap = _overlaps_of_springs(scene) if isinstance(scene, World) else _overlaps_of_rows(scene)
    limit = 1.0 if scene.world.controls[0].max_overlap > 0.0 else _smallest_sides(scene.world, one, other)
    worst = int(np.nanargmax(overlap / limit))
    pair = (f"block {names[i]}" if i < len(names) else GROUND for i in (int(one[worst]), int(other[worst])))
    return f"{' and '.join(pair)} by {MILLI * overlap[worst]:.3g} mm"


Pairs = tuple[NDArray[Any], NDArray[Any], NDArray[np.float64]]  # bodies a and b, m


def _overlaps_of_springs(world: World) -> Pairs:
    count = int(world.clock[0].pair_count)
    pairs, contacts = world.pairs[:count], world.contacts[:count]
    is_active = np.arange(contacts.shape[1]) < pairs["active"][:, np.newaxis]
    return pairs["a"], pairs["b"], np.where(is_active, contacts["depth"], 0.0).max(axis=1)


def _overlaps_of_rows(scene: Any) -> Pairs:
    rows = scene.contacts.rows[: int(scene.contacts.stepping[0].row_count)]
    depth = np.maximum(-rows["gap_one"], -rows["gap_two"])
    return rows["a"], rows["b"], np.where(rows["reach"] == TOUCHING, depth, 0.0)


def _smallest_sides(world: World, one: NDArray[Any], other: NDArray[Any]) -> NDArray[np.float64]:
    half = np.minimum(world.bodies["half_x"], world.bodies["half_y"])
    side = np.where((half > 0.0) & (world.bodies["faces"] == ALL), 2.0 * half, np.inf)
    smallest: NDArray[np.float64] = np.minimum(side[one], side[other])
    return smallest


_FINDERS = {NOT_FINITE: _not_finite, OVERLAP_LIMIT: _deepest}
