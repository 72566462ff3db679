"""Limit analysis of rigid blocks: linear programmes for the forces in joints.

At each point of a joint act a compression n >= 0 and a shear t, |t| <= mu n. So the force at a point is a sum of its
two extreme ones, a (1, mu) + b (1, -mu) with a, b >= 0, and the equilibrium of all blocks is E x + dead + factor live =
0 with x >= 0: three rows a block. The greatest factor is a linear programme (Livesley 1978; Ferris & Tin-Loi 2001). Its
dual is the mechanism: velocities in which joints open by mu times what they slip. As real ones do not, the factor is an
**upper bound** of what blocks with Coulomb's friction carry, and exact where nothing slides.

For joints that slip without opening (Gilbert, Casapulla & Ahmed 2006) each friction line is turned flat through the
last normal force, |t| <= c + n tan(psi) with c = n (mu - tan(psi)) and a psi near zero, and the programme is solved
again until |t| <= mu n holds. Normal forces of many programmes are not unique: those nearest to the last ones are
taken. Where that ends depends on where it begins. It begins with the most even forces at some parts of the bound, and
the least factor is an **estimate**: no bound, and not the least there is. Wall 1 of Ferris & Tin-Loi has 0.6400, the
least that is known 0.63982, its bound 0.64286.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse
from scipy.optimize import linprog

from blocksim.errors import InvalidInputError
from blocksim.statics.blockwork import Blockwork
from blocksim.world.joints import Floats

MANY = 500  # blocks, from which on interior points are faster
FEW = 100  # blocks, up to which estimates and islands take seconds
HALF = 0.5
PASSES = 40  # at most, for an estimate
STARTS = (0.0, 0.25, 0.5)  # of the bound: where an estimate begins
FLAT = 1e-3  # of the coefficient of friction: tangent of the angle at which joints of an estimate open
NEAR = 1e-2  # of the factor: what it counts that normal forces differ from the last ones by the whole weight
EVEN = 1e-3  # of the greatest normal force: what the sum of all counts beside it
UNBOUNDED, INFEASIBLE = 3, 2  # as linprog numbers its answers


class Equilibrium(NamedTuple):
    """The greatest factor on the live forces, and an equilibrium with it."""

    factor: float  # -, infinite where every greater one is in equilibrium too; the rest is zero then
    normal: Floats  # (p,) N: compression at the points of joints
    shear: Floats  # (p,) N: on the second body, along the normal turned by +90 degrees
    mechanism: Floats  # (n, 3) m, m, rad: one of those in which blocks begin to move; the largest of its ways is 1 m


class Programme:
    """The linear programmes of a structure, in its weight and its size."""

    def __init__(self, structure: Blockwork) -> None:
        """Take the joints and friction of a structure."""
        self.structure = structure
        assembly, count = structure.assembly, len(structure.names)
        points = np.arange(len(assembly.joint))
        self.scale = np.array([1.0, 1.0, 1.0 / structure.size])
        self.weight = float(np.abs(structure.forces[:, :2]).sum()) or 1.0  # N
        self.method = "highs" if count < MANY else "highs-ipm"

        def columns(rates: Floats) -> Any:
            rows = 3 * assembly.places[:, :, None] + np.arange(3)
            entries = (rates * self.scale).ravel(), (rows.ravel(), np.repeat(points, 6))
            return sparse.coo_array(entries, shape=(3 * count + 3, points.size)).tocsr()[: 3 * count].tocsc()

        self.across, self.along = columns(assembly.across), columns(assembly.along)
        sliding = self.along * structure.friction
        self.extremes = sparse.hstack([self.across + sliding, self.across - sliding], format="csc")

    def carries(self, forces: Floats) -> Equilibrium:
        """Return the greatest factor up to one on forces (n, 3): one where they are in equilibrium, zero where not.

        What is admissible is a cone, so that it carries all of them or nothing.
        """
        found = self._cone(np.zeros_like(forces), forces, (0.0, 1.0))
        if found is None:
            raise AssertionError("nothing is in equilibrium with nothing")
        return found._replace(factor=float(found.factor > HALF))

    def greatest(self, dead: Floats, live: Floats) -> Equilibrium | None:
        """Return the greatest factor on live forces (n, 3) with dead ones; None where none brings equilibrium."""
        return self._cone(dead, live, (-np.inf, np.inf))

    def _cone(self, dead: Floats, live: Floats, span: tuple[float, float]) -> Equilibrium | None:
        friction, points = self.structure.friction, self.structure.friction.size
        matrix = sparse.hstack([self.extremes, self._column(live)], format="csc")
        cost = np.append(np.zeros(2 * points), -1.0)
        result = self._solved(cost, matrix, dead, [(0.0, None)] * (2 * points) + [span])
        if result is None:
            return None
        if result.status == UNBOUNDED:
            nothing = np.zeros(points)
            return Equilibrium(np.inf, nothing, nothing, np.zeros_like(live))
        left, right = np.split(result.x[:-1], 2)
        ways = -result.eqlin.marginals.reshape(-1, 3) * self.scale  # what forces on blocks take away from the factor
        largest = float(np.abs(ways * (1.0, 1.0, self.structure.size)).max()) or 1.0
        normal, shear = self.weight * (left + right), self.weight * friction * (left - right)
        return Equilibrium(float(result.x[-1]), normal, shear, ways / largest)

    def estimate(self, dead: Floats, live: Floats, bound: float) -> float:
        """Return the least factor that was found of joints that slip without opening; the bound where none was less."""
        reach = bound if np.isfinite(bound) else 1.0
        return min([bound, *(self._flat(dead, live, share * reach) for share in STARTS)])

    def missing(self, forces: Floats) -> float:
        """Return the least sum of forces, over the weight, with which these (n, 3) would be in equilibrium."""
        count, rows = self.extremes.shape[1], self.extremes.shape[0]
        one = sparse.identity(rows)
        cost = np.append(np.zeros(count), np.ones(2 * rows))
        matrix = sparse.hstack([self.extremes, one, -one], format="csc")
        return float(self._solved(cost, matrix, forces, [(0.0, None)] * (count + 2 * rows)).fun)

    def _flat(self, dead: Floats, live: Floats, first: float) -> float:
        """Return the factor of joints that slip without opening, from the most even forces at a first factor."""
        friction, points = self.structure.friction, self.structure.friction.size
        flat = FLAT * friction
        one, none = sparse.identity(points, format="csc"), sparse.csc_array((points, points))
        slope, last = sparse.diags_array(flat, format="csc"), sparse.csc_array((points, 1))
        rows = [
            [-slope, one, none, last],
            [-slope, -one, none, last],
            [one, none, -one, last],
            [-one, none, -one, last],
        ]
        cone = sparse.vstack([sparse.hstack(row) for row in rows], format="csc")
        empty = sparse.csc_array((self.across.shape[0], points))
        matrix = sparse.hstack([self.across, self.along, empty, self._column(live)], format="csc")
        cost = np.concatenate([np.zeros(2 * points), np.full(points, NEAR), [-1.0]])
        bounds = [(0.0, None)] * points + [(None, None)] * points + [(0.0, None)] * points + [(None, None)]
        even = self.even(dead + first * live, live)
        if even is None:
            return np.inf
        normal = even[0]
        for _ in range(PASSES):
            cohesion = normal * (friction - flat)
            result = self._solved(cost, matrix, dead, bounds, cone, [cohesion, cohesion, normal, -normal])
            if result is None or result.status == UNBOUNDED:
                break
            normal, shear = result.x[:points], result.x[points : 2 * points]
            if (np.abs(shear) <= friction * normal + 1e-5).all():  # of the weight: excess of shear that is none
                return float(result.x[-1])
        return np.inf

    def even(self, dead: Floats, live: Floats, most: float = 0.0) -> tuple[Floats, float] | None:
        """Return the normal forces (p,) of an equilibrium whose greatest is least, in the weight; None without one.

        And the factor on live forces there, from 0 to `most`.
        """
        points = self.structure.friction.size
        matrix = sparse.hstack([self.extremes, self._column(0.0 * live), self._column(live)], format="csc")
        one = sparse.identity(points)
        rows = sparse.hstack([one, one, -np.ones((points, 1)), sparse.csc_array((points, 1))], format="csc")
        cost = np.append(np.full(2 * points, EVEN), [1.0, 0.0])
        bounds = [(0.0, None)] * (2 * points + 1) + [(0.0, most)]
        result = self._solved(cost, matrix, dead, bounds, rows, [np.zeros(points)])
        return None if result is None else (np.add(*np.split(result.x[:-2], 2)), float(result.x[-1]))

    def _column(self, forces: Floats) -> Any:
        return sparse.csc_array((forces * self.scale).reshape(-1, 1) / self.weight)

    def _solved(
        self,
        cost: Floats,
        matrix: Any,
        forces: Floats,
        bounds: Sequence[tuple[float | None, float | None]],
        rows: Any = None,
        most: Sequence[Floats] = (),
    ) -> Any:
        """Return what the solver finds; None where nothing is in equilibrium with the forces."""
        right = -(forces * self.scale).ravel() / self.weight
        limits = np.concatenate(most) if most else None
        result = linprog(cost, rows, limits, matrix, right, bounds, method=self.method)
        if result.status == INFEASIBLE:
            return None
        if result.status not in (0, UNBOUNDED):
            raise InvalidInputError(f"statics: the solver gives no answer: {result.message}")
        return result


def horizontal_margin(blocks: Blockwork) -> tuple[float, float] | None:
    """Return the least horizontal acceleration, over gravity, that ends the equilibrium; None where there is none.

    The second one is an estimate of joints that slip without opening, where the first one is infinite; else the same.
    """
    programme, ways = Programme(blocks), [way * blocks.horizontal for way in (-1.0, 1.0)]
    if not programme.carries(blocks.forces).factor:
        return None
    ends = (programme.greatest(blocks.forces, way) for way in ways)
    margin = min(0.0 if end is None else end.factor for end in ends)
    if np.isfinite(margin) or len(blocks.names) > FEW:
        return margin, margin
    return margin, min(programme.estimate(blocks.forces, way, margin) for way in ways)
