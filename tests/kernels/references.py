"""What kernels have to find, worked out in NumPy another way: geometry, and dense matrices of rigid contacts."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.kernels.common.arrays import BODY, NORMAL, Record, Records, zeros
from blocksim.kernels.nonsmooth import arrays
from blocksim.kernels.nonsmooth.arrays import FAR, Nonsmooth
from blocksim.kernels.nonsmooth.narrow_phase import Lists, collide_one, manifold_of, pairs_at, write

Vector = NDArray[np.float64]

SIGNS = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])


class Side(NamedTuple):
    """A face of a rectangle: outward normal and both ends."""

    normal: Vector
    begin: Vector
    end: Vector


class Meeting(NamedTuple):
    """How two rectangles meet: normal from b to a, places of the points on the reference face and their gaps (m).

    Points are sorted along the tangent; there is none where the rectangles are farther apart than the margin.
    """

    normal: Vector
    places: Vector
    gaps: Vector
    is_of_b: bool


def turning(angle: float) -> Vector:
    """Return the matrix that points of a body as rows are multiplied with, from its frame to the world."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, s], [-s, c]])


def corners(body: Record) -> Vector:
    """Return the corners (n, 2) of a body, counter-clockwise: its `places`, or those of a rectangle."""
    if hasattr(body, "places"):
        return np.asarray(body.places)
    return np.asarray(SIGNS * (body.half_x, body.half_y) @ turning(body.angle) + (body.x, body.y))


def in_frame(points: Vector, body: Record) -> Vector:
    """Return points (n, 2) as the frame of a body has them."""
    return np.asarray((points - (body.x, body.y)) @ turning(body.angle).T)


def distances(points: Vector, body: Record) -> Vector:
    """Return the distances (m) of points to a rectangle, zero inside."""
    outside = np.maximum(np.abs(in_frame(points, body)) - (body.half_x, body.half_y), 0.0)
    return np.asarray(np.hypot(outside[:, 0], outside[:, 1]))


def sides(body: Record) -> list[Side]:
    """Return the four faces of a body."""
    ends = corners(body)
    found = []
    for begin, end in zip(ends, np.roll(ends, -1, axis=0), strict=True):
        along = (end - begin) / np.linalg.norm(end - begin)
        found.append(Side(np.array([along[1], -along[0]]), begin, end))
    return found


def beyond(side: Side, body: Record) -> float:
    """Return how far (m) a body is beyond a face, all of it; negative where it reaches below."""
    return float(((corners(body) - side.begin) @ side.normal).min())


def apart(a: Record, b: Record) -> float:
    """Return the largest gap (m) of two bodies along any face normal."""
    return max(*(beyond(side, a) for side in sides(b)), *(beyond(side, b) for side in sides(a)))


def clipped(side: Side, other: Side) -> list[Vector]:
    """Return the ends of what of another face lies over a face, cut by the states at its two ends."""
    along = (side.end - side.begin) / np.linalg.norm(side.end - side.begin)
    ends = [other.begin, other.end]
    for place, sign in ((side.begin, 1.0), (side.end, -1.0)):
        heights = [sign * float((end - place) @ along) for end in ends]
        if max(heights) <= 0.0:
            return []
        if min(heights) < 0.0:
            cut = ends[0] + (ends[1] - ends[0]) * heights[0] / (heights[0] - heights[1])
            ends = [end if height >= 0.0 else cut for end, height in zip(ends, heights, strict=True)]
    return ends


def meeting(a: Record, b: Record, margin: float) -> Meeting:
    """Return how two rectangles meet: the face beyond which the other reaches least, and what lies over it."""
    of_b, side_b = max(((beyond(side, a), k) for k, side in enumerate(sides(b))), default=(0.0, 0))
    of_a, side_a = max(((beyond(side, b), k) for k, side in enumerate(sides(a))), default=(0.0, 0))
    is_of_b = of_b >= of_a
    side = sides(b)[side_b] if is_of_b else sides(a)[side_a]
    opposite = min(sides(a if is_of_b else b), key=lambda one: float(one.normal @ side.normal))
    normal = side.normal if is_of_b else -side.normal
    ends = clipped(side, opposite)
    gaps = [float((end - side.begin) @ side.normal) for end in ends]
    near = [(end - gap * side.normal, gap) for end, gap in zip(ends, gaps, strict=True) if gap <= margin]
    near.sort(key=lambda point: float(point[0] @ np.array([-normal[1], normal[0]])))
    return Meeting(normal, np.array([p for p, _ in near]), np.array([gap for _, gap in near]), is_of_b)


def places_of(constraint: Record, body: Record, *, of_a: bool) -> Vector:
    """Return the places (2, 2) of both points of a constraint, from its arms about one of its bodies."""
    n = np.array([constraint.nx, constraint.ny])
    t = np.array([-constraint.ny, constraint.nx])
    arm, shear_arm = (constraint.arm_a, constraint.shear_arm_a) if of_a else (constraint.arm_b, constraint.shear_arm_b)
    one = (body.x, body.y) + shear_arm * n - arm * t  # arm = r x n = -r t, shear arm = r x t = r n
    return np.array([one, one + constraint.width * t])


def meet(
    a: Record,
    b: Record,
    margin: float,
    constraint: Record | None = None,
    states: Records | None = None,
    *,
    ahead: float = 0.0,
    is_ground: bool = False,
    stepping: Mapping[str, float] | None = None,
) -> Record:
    """Return the constraint of two bodies, or of a body and the ground, as it is after its manifold was found."""
    bodies, constraints, all_stepping = (
        zeros(2 if is_ground else 3, BODY),
        zeros(1, arrays.CONSTRAINT),
        zeros(1, arrays.STEPPING),
    )
    bodies[0], bodies[1] = a, b
    if constraint is not None:
        constraints[0] = constraint
    constraints[0].b = 1
    for name, value in {"margin": margin, **(stepping or {})}.items():
        all_stepping[0][name] = value
    lists = Lists(constraints, zeros(2, arrays.STATE) if states is None else states, bodies, all_stepping[0])
    if collide_one(lists, 0, ahead, None):  # no third body presses
        places = (0, 0, 0, 0)
        pair = pairs_at(lists, places, ahead, None, 0)
        write(lists, places, manifold_of(pair, margin), True, pair, 0)
    return constraints[0]


class Dense(NamedTuple):
    """All points and constraints of a scene, with matrices over all velocities (vx, vy, spin of every body)."""

    normals: Vector  # (2 r, 3 n) J of the points, two a constraint
    tangents: Vector  # (r, 3 n)
    inverse_mass: Vector  # (3 n,) diagonal
    impulses: Vector  # (2 r,) N s
    shears: Vector  # (r,) N s
    targets: Vector  # (2 r,) m/s: what J v has to reach at least
    friction: Vector  # (r,) kinetic coefficients
    gaps: Vector  # (2 r,) m, when the step began

    @property
    def counts(self) -> Any:
        """Which points the velocity pass looks at."""
        return self.targets > -FAR / 2

    def pushed(self) -> Vector:
        """Return what all impulses together change velocities by."""
        return np.asarray(self.inverse_mass * (self.normals.T @ self.impulses + self.tangents.T @ self.shears))


def jacobian(n: Vector, r_a: Vector, r_b: Vector, a: int, b: int, bodies: int) -> Vector:
    """Return what all velocities are multiplied by to get that of a at r_a against b at r_b, along a direction."""
    state = np.zeros(3 * bodies)
    state[3 * a : 3 * a + 3] = n[0], n[1], r_a[0] * n[1] - r_a[1] * n[0]
    state[3 * b : 3 * b + 3] = -n[0], -n[1], -(r_b[0] * n[1] - r_b[1] * n[0])
    return state


def dense(scene: Nonsmooth) -> Dense:
    """Return the matrices of the packed packs of a scene; its bodies have not been placed since they were made."""
    contacts, bodies = scene.contacts, scene.world.bodies
    points, tangents, constraints, targets, impulses, shears = [], [], [], [], [], []
    for pack in contacts.packs[: contacts.stepping[0].pack_count]:
        for k in range(pack["count"]):
            constraint = contacts.constraints[pack.constraint[k]]
            constraints.append(constraint)
            n, t = np.array([constraint.nx, constraint.ny]), np.array([-constraint.ny, constraint.nx])
            a, b = bodies[constraint.a], bodies[constraint.b]
            of_a, of_b = (
                (place - (a.x, a.y) for place in places_of(constraint, a, of_a=True)),
                places_of(constraint, b, of_a=False),
            )
            ends = [(r_a, place - (b.x, b.y)) for r_a, place in zip(of_a, of_b, strict=True)]
            points += [jacobian(n, r_a, r_b, constraint.a, constraint.b, bodies.size) for r_a, r_b in ends]
            tangents.append(jacobian(t, *ends[0], constraint.a, constraint.b, bodies.size))
            impulses += [pack.normal_one[k], pack.normal_two[k]]
            targets += [pack.target_one[k], pack.target_two[k]]
            shears.append(pack.shear[k])
    states = contacts.states
    inverse = np.array([states.inverse_mass, states.inverse_mass, states.inverse_inertia]).T.ravel()
    materials = contacts.materials[[int(constraint.material) for constraint in constraints]]
    gaps = [gap for constraint in constraints for gap in (constraint.gap_one, constraint.gap_two)]
    columns = (impulses, shears, targets, materials["kinetic_friction"], gaps)
    return Dense(np.array(points), np.array(tangents), inverse, *(np.array(one) for one in columns))


def dashpots_by_definition(points: Records, masses: Vector, ratio: float, step: float) -> Vector:
    """Return the dashpot forces from d = C (u + dt/2 A (f_before - f_spring - d)), solved by numpy.

    `masses` (1/kg) are the inverse ones that the points see of one another.
    """
    root, weighted = np.sqrt(points.stiffness), np.sqrt(points.stiffness * points.weight)
    values, vectors = np.linalg.eigh(root[:, None] * masses * root)
    powers = [value**-0.5 if value > 1e-4 * values.max() else 0.0 for value in values]
    c = 2.0 * ratio * weighted[:, None] * ((vectors * powers) @ vectors.T) * weighted
    free = points.rate + 0.5 * step * masses @ (points.before - points.force)
    return np.asarray(np.linalg.solve(np.eye(points.size) + 0.5 * step * c @ masses, c @ free))


def rates_of_points(points: Records, a: Record, b: Record, direction: int) -> Vector:
    """Return the closing or slip rates of all points as rows of (v_a, w_a, v_b, w_b)."""
    rows = []
    for point in points:
        ax = (-point.nx, -point.ny) if direction == NORMAL else (-point.ny, point.nx)
        arms = [ax[1] * (point.x - body.x) - ax[0] * (point.y - body.y) for body in (a, b)]
        rows.append([*ax, arms[0], -ax[0], -ax[1], -arms[1]])
    return np.array(rows)


def delassus(points: Records, a: Record, b: Record, direction: int) -> Vector:
    """Return the inverse masses (1/kg) that points see of one another."""
    masses = [a.inverse_mass] * 2 + [a.inverse_inertia] + [b.inverse_mass] * 2 + [b.inverse_inertia]
    rows = rates_of_points(points, a, b, direction)
    return np.asarray((rows * masses) @ rows.T)
