"""How a run can end, in words and exit codes, and the diagnosis of one that failed: the step and the block.

The block is found in the arrays as they were when the run stopped.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from blocksim.errors import ExitCode
from blocksim.kernels.common import arrays
from blocksim.kernels.common.arrays import NOT_FINITE, OVERLAP_LIMIT, World
from blocksim.scenario import PlacedBody
from blocksim.simulation.ledger import RESIDUAL_LIMIT
from blocksim.simulation.recorder import MOTION
from blocksim.simulation.schemes import AnyScene, scheme_of

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
        scheme = scheme_of(scene)
        reason = scheme.lost_contact(scene, scheme.overlaps(scene)) if code == OVERLAP_LIMIT else ""
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
    world, found = scene.world, scheme_of(scene).overlaps(scene)
    worst = int(np.nanargmax(found.depth / found.limit))
    pair = " and ".join(_name(world, names, int(i[worst])) for i in (found.a, found.b))
    is_capped = found.limit[worst] < world.controls[0].max_overlap
    most = f", more than half of a side of {MILLI * 2.0 * found.limit[worst]:.3g} mm" if is_capped else ""
    return f"{pair} by {MILLI * found.depth[worst]:.3g} mm{most}"


def _name(world: World, names: Sequence[str], body: int) -> str:
    if body < len(names):
        return f"block {names[body]}"
    is_wall = body < world.bodies.size - 1 and math.isfinite(world.bodies[-1].y)
    return WALL if is_wall else GROUND


_FINDERS = {NOT_FINITE: _not_finite, OVERLAP_LIMIT: _deepest}
