"""Stresses of a geostatic start beside faces: those in which the rows of particles along a face are in equilibrium.

Next to a face the kernel is cut off, and a contact pushes the first row alone. With a_k what a particle has from a row
k spacings away (half of sum V f d (x) d across the face, a_1 + a_2 = 1/2), a row inside is in equilibrium where

    sum_k a_k/k (s_(i+k) - s_(i-k)) = 0,

which constant stresses solve and those that go as z^i, z + 1/z = -2 a_1/a_2. The first rows, which have no others on
one side, then want 1 - 2 z^i/(1 + z^2) times the stress inside, i = 1, 2, ...: 1.45, 0.89, 1.03 for this kernel. That
times all components leaves a stress on a yield surface without cohesion where it is, and balances what crosses these
rows along the face, too, as a row misses the same neighbours there. Otherwise rows would find their balance by a shock
that makes soil flow, and leaves more pressure sideways than it had (4.0 % with 20 rows, 3.0 % with 40).

Forces of corrected gradients are those of P = s B (gradient.py), B across the face one over the part of the kernel that
a row has: 1/2 of it, 1/2 + a_1, all. So P is what the stress is with raw gradients, and the stress across the face is
that times the part: 0.73, 0.75, 1.03 of the one inside. Along the face forces are in balance where the stress is that
inside, to 0.08 of the weight of a particle. Where the yield surface does not let the two differ so much, beside upright
faces without cohesion, the stress along the face is the largest that it allows, 0.87 and 0.90 of that inside; the rest
of the weight of these rows hangs on the others, which a soil of few columns shows as a K that is larger by this.

That is for rows that stand against an upright or level face as the lattice of a soil does.
"""

import math

from blocksim.kernels.common.arrays import Record, World
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.soil.arrays import Soils
from blocksim.kernels.soil.shapes import from_body, is_near
from blocksim.kernels.soil.stress import invariants, strength

DECAY = 0.2383014  # -z, for Wendland's C2 with h = 1.5 spacings
ROWS = 5  # the next one wants 1.0003
OUT_OF_LINE = 1e-3  # spacings; rows nearer than this to where they ought to be stand against a face


@kernel
def share_of_row(row: float) -> float:
    """Return the stress of a row beside a face, counted from 1, over that inside; 1 beyond those that differ."""
    if row > ROWS:
        return 1.0
    return 1.0 - 2.0 * (-DECAY) ** int(row) / (1.0 + DECAY * DECAY)


@kernel
def part_of_kernel(row: float) -> float:
    """Return which part of sum V f d (x) d across a face a row beside it has, counted from 1."""
    if row > 2.0:
        return 1.0
    squared = (1.0 + DECAY) ** 2
    return 0.5 if row < 2.0 else 0.5 + 0.5 * (1.0 + DECAY * DECAY) / squared  # 1/2 + a_1, of a_1 + a_2 = 1/2


@kernel
def share_across(row: float, is_corrected: bool) -> float:
    """Return the stress across a face in a row beside it, counted from 1, over that inside."""
    return share_of_row(row) * (part_of_kernel(row) if is_corrected else 1.0)


@rare_kernel
def row_beside(body: Record, is_ground: bool, x: float, y: float, spacing: float) -> tuple[float, float, float]:
    """Return the row along a face of a body in which a place (m) is, and the normal; 0 if it is in none."""
    if not is_near(body, is_ground, x, y, ROWS * spacing):
        return 0.0, 0.0, 1.0
    distance, nx, ny = from_body(body, is_ground, x, y, 0.5 * spacing)
    if math.isinf(distance) or min(abs(nx), abs(ny)) > OUT_OF_LINE:
        return 0.0, nx, ny
    row = distance / spacing + 0.5
    nearest = math.floor(row + 0.5)
    return (nearest if nearest >= 1.0 and abs(row - nearest) < OUT_OF_LINE else 0.0), nx, ny


@rare_kernel
def shares_of_place(world: World, x: float, y: float, spacing: float, is_corrected: bool) -> tuple[float, float]:
    """Return the stresses across upright and level faces at a place (m) over those far from all faces.

    Of faces to the same side, such as those of blocks on one another, the nearest counts.
    """
    left = right = below = above = ROWS + 1.0
    for b in range(world.bodies.size):
        row, nx, ny = row_beside(world.bodies[b], b == world.bodies.size - 1, x, y, spacing)
        if row > 0.0:
            left = min(left, row) if nx > 0.5 else left
            right = min(right, row) if nx < -0.5 else right
            below = min(below, row) if ny > 0.5 else below
            above = min(above, row) if ny < -0.5 else above
    along_x = share_across(left, is_corrected) * share_across(right, is_corrected)
    return along_x, share_across(below, is_corrected) * share_across(above, is_corrected)


@rare_kernel
def keep_within_surface(state: Record, kind: Record) -> None:
    """Bring a compressed particle without shear stress within the yield surface, by the larger of its stresses.

    With the stress out of the plane midway, as where it fails, the larger pressure T and the smaller N have
    (T - N)/2 = k + 3 a (T + N)/2.
    """
    total, deviator = invariants(state.sxx, state.syy, state.szz, state.sxy)
    if deviator <= strength(kind, total):
        return
    smaller = -max(state.sxx, state.syy)
    largest = (2.0 * kind.cohesion + smaller * (1.0 + 3.0 * kind.slope)) / (1.0 - 3.0 * kind.slope)
    state.sxx = max(state.sxx, -largest)
    state.syy = max(state.syy, -largest)
    state.szz = 0.5 * (state.sxx + state.syy)


@rare_kernel
def balance(state: Record, kind: Record, along_x: float, along_y: float) -> None:
    """Bring the stress of a particle to these shares across upright and level faces."""
    if kind.is_corrected:
        state.sxx *= along_x
        state.syy *= along_y
        keep_within_surface(state, kind)
    else:
        share = along_x * along_y
        state.sxx *= share
        state.syy *= share
        state.szz *= share
        state.sxy *= share


@rare_kernel
def balance_rows(soils: Soils, world: World) -> None:
    """Bring the stresses of all rows along faces into equilibrium; a particle in a corner is in a row of both."""
    spacing = 2.0 * soils.controls[0].radius
    for i in range(soils.points.size):
        point, state = soils.points[i], soils.states[i]
        kind = soils.kinds[state.kind]
        if state.syy < 0.0:
            along_x, along_y = shares_of_place(world, point.x, point.y, spacing, kind.is_corrected != 0)
            balance(state, kind, along_x, along_y)
