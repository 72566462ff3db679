"""What a sweep keeps of a case: one row, the same from whatever ran it."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from blocksim.errors import BlocksimError
from blocksim.scenario import PlacedBody
from blocksim.simulation.movement import FirstMove, from_start_to_end
from blocksim.simulation.table import Columns

Row = dict[str, object]
X = ".x_mm"
MOVEMENT = ("outcome", "first_mover", "first_moved_s", "displacement_mm", "turn_deg")
"""As in run.json, but displacement and rotation are the largest of all blocks from start to end."""
KEPT = ("x_mm", "y_mm", "rotation_deg", "left_mm", "right_mm")  # of the final table, for every block


class Course(NamedTuple):
    """How a case that was run has gone; `seconds` are simulated, so they are the same on every machine."""

    status: str
    reason: str
    seconds: float
    first_move: FirstMove | None


def row_of(course: Course, final: Columns, placed: Sequence[PlacedBody]) -> Row:
    """Return the row of a case that was run; `placed` are the blocks at the start."""
    row: Row = {"status": course.status, "reason": course.reason, "seconds": course.seconds}
    manner, displacement, rotation = from_start_to_end(placed, final, course.first_move)
    mover, moved = course.first_move or (None, None)
    row |= dict(zip(MOVEMENT, (manner.value, mover, moved, displacement, rotation), strict=True))
    for block, *values in zip(final["block"], *(final[name] for name in KEPT), strict=True):
        row |= {f"{block}.{name}": value for name, value in zip(KEPT, values, strict=True)}
    return row


def row_of_error(error: Exception) -> Row:
    """Return the row of a case that could not be run."""
    told = isinstance(error, BlocksimError)
    reason = str(error) if told else f"internal error: {type(error).__name__}: {error}"
    return {"status": "failed", "reason": reason, "seconds": 0.0}


def invalid_row(problem: str) -> Row:
    """Return the row of a case whose values do not go together."""
    return {"status": "invalid", "reason": problem, "seconds": 0.0}


def blocks_in(names: Iterable[str]) -> tuple[str, ...]:
    """Return the blocks that a row, or a table of rows, tells of."""
    return tuple(name.removesuffix(X) for name in names if name.endswith(X))
