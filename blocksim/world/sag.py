"""What rigid contacts give way by at rest: the position pass holds blocks apart like springs, stiffer for small steps.

At rest s = -F A / w^2 for a contact point that carries F, A = J M^-1 J^T, w = 2 pi f / h (blocksim.kernels.nonsmooth):
a spring of w^2 / A, which goes with 1 / h^2. Of two blocks in face contact A = sum of 1/m + r^2/I over both, with half
a side as the lever arm r, as far as the point is from the middle.
"""

from collections.abc import Iterable

from blocksim.scenario import PlacedBody
from blocksim.world.nonsmooth import soft_contact


def inverse_mass(body: PlacedBody) -> float:
    """Return A (1/kg) of one block for a point at the end of its lower face, as it was made; zero where it is fixed."""
    return 0.0 if body.fixed else 1.0 / body.mass + (0.5 * body.size_x) ** 2 / body.inertia


def point_stiffness(substep: float, blocks: Iterable[PlacedBody]) -> float:
    """Return the stiffness (N/m) of one contact point of one block with the ground, or of two with each other."""
    total = sum(map(inverse_mass, blocks))
    return soft_contact(substep).frequency ** 2 / total if total > 0.0 else float("inf")


def column_sag(substep: float, body: PlacedBody, count: int, gravity: float) -> float:
    """Return by how much (m) the top of a column of `count` such blocks sinks.

    A face shares its load between two points; the ground carries all blocks, the face above it one less, and so on.
    """
    weight = 0.5 * body.mass * gravity
    ground, block = point_stiffness(substep, [body]), point_stiffness(substep, [body, body])
    return weight * (count / ground + 0.5 * count * (count - 1) / block)
