"""Equilibrium of blocks on springs with friction, without time: displacements at which all forces are in balance.

Forces are those of the kernels of a run, after one step without dashpots, with static friction, that drifts by the
displacements: contacts, shares of stiffness, every law, and shear springs that are drawn by all of the way and slide at
Coulomb's limit. So there are no other rules of contacts than theirs. What is solved for is one step of a load. Where
loads grow in proportion from nothing so do the displacements, and one step is as good as many.

Newton's method with the tangent of the present contacts (unsymmetric where they slide: dT = mu dN) fails far from an
equilibrium. Steps of backward Euler lead there: f(u) = R (u - u_k)/h, R in proportion to masses, so that blocks creep
to where they rest. h grows with success and shrinks with failure, and at equilibrium is large. Shear springs are drawn
from where the step of the load began, not from u_k: what slipped only on the way there leaves nothing behind.

The first guess has all contacts closed and none that slides. A step of Newton's method that does not bring down the
squares of what is left is halved where half of it leaves less.

Where there is no equilibrium blocks creep on: the unrest, the greatest acceleration over that of the loads, falls no
more, or grows, while they come many times as far as contacts give way. An elastic structure that comes to rest, however
slender, creeps ever slower.
"""

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from blocksim.kernels.common import tolerances
from blocksim.kernels.common.arrays import REACHED, World
from blocksim.world.joints import places_of

BALANCE = 1e-8  # of gravity and loads: unrest at rest
ROUND_OFF = 4.0  # of the last digit of a place, by which springs are always out of balance
NEARLY = 1e-3, 1e-2  # unrest, share of it: what is left of a step of creep that need not be solved better
DRAG = 1e-3  # of the stiffest contact, at h = 1
FIRST, LEAST = 1e2, 1e-9  # h
GROWTH, SHRINKAGE, CAREFUL = 10.0, 0.1, 2.0  # of h after success, after failure, and after the next success
ITERATIONS, PATIENCE = 15, 5  # of Newton's method in a step, and without halving what is left
SHORTENINGS, HALF = 2, 0.5  # lengths of a step of Newton's method that are tried, each half of the one before
LONGEST = 10.0  # of the overlap of one contact that bears all: a step of Newton's method
EVALUATIONS = 2000  # calibrated: beyond it time steps are as fast
SLIGHT, FAILURES = 1e-3, 3  # unrest that steps of a run end, after steps of creep that fail one after the other: forces
# jump by less where an end of a contact passes another
LOOKS_BACK = 4  # steps of creep over which unrest is compared
FAR = 50.0  # calibrated: times the deepest overlap, where creep grows faster
FADES = 0.95  # of the unrest LOOKS_BACK steps before, or at first: what comes to rest has less
VELOCITIES, ACCELERATIONS = ("vx", "vy", "spin"), ("ax", "ay", "spin_rate")
DASHPOTS = ("normal_left", "shear_left")
PIVOT = 0.1  # of the largest in a column: a smaller diagonal is none
SLIDING = 1e-12  # of the friction: round-off
NEVER = 1 << 60  # step
Floats = NDArray[np.float64]
Advance = Callable[[Any, int], tuple[Any, int]]
"""Advances a scene to a step; returns it, and a status code."""


class SpringRest(NamedTuple):
    """A scene after a search, its velocities zero, and what was found."""

    scene: Any
    holds: bool | None  # True: all is in equilibrium; False: nothing carries the blocks near where they were
    change: Floats  # (3, b) m, m, rad: displacements of all blocks
    unrest: float


class _Newton(NamedTuple):
    """Where Newton's method has come to: (n, 3) each, and whether what is left is small enough."""

    displacements: Floats
    accelerations: Floats | None
    is_solved: bool


class _Forces:
    """The forces of a scene after any displacements from where a step of its load begins."""

    def __init__(self, scene: Any, advance: Advance, is_free: NDArray[np.bool_]) -> None:
        self.advance, self.count = advance, is_free.size
        self.free = np.flatnonzero(is_free)
        self.interactions, self.step = scene.world.interactions.copy(), scene.world.controls["step"].copy()
        self.interactions_now = scene.world.interactions
        for name in ("normal_damping", "shear_damping"):
            scene.world.interactions[name] = 0.0
        scene.world.interactions["kinetic_friction"] = scene.world.interactions["static_friction"]
        scene.world.controls["step"] = 1.0  # s: so displacements are velocities
        self.evaluations = 0
        self.scene = self._evaluated(scene)
        self._stop()
        clock = self.world.clock
        clock["next_update"] = clock["next_share"] = NEVER
        self.steps, pairs = int(clock[0].steps), int(clock[0].pair_count)
        self.pairs, self.contacts = self.world.pairs[:pairs].view(np.ndarray), self.world.contacts[:pairs]
        self.bodies = self.world.bodies.view(np.ndarray)
        present = [self.bodies, self.pairs, self.contacts, clock]
        self.start = [(array, array.copy()) for array in present]
        blocks = self.bodies[self.free]
        self.masses = np.stack([blocks["mass"], blocks["mass"], blocks["inertia"]], axis=1)
        self.reach = np.stack([np.ones(self.free.size), np.ones(self.free.size), blocks["radius"]], axis=1)
        self._place_pairs()

    @property
    def world(self) -> World:
        """The arrays."""
        world: World = self.scene.world
        return world

    def _evaluated(self, scene: Any) -> Any:
        """Return a scene with its pairs listed and their contacts found where it is."""
        clock = scene.world.clock
        clock["is_started"] = 0
        clock["next_update"] = clock["steps"]
        scene.world.bodies["is_asked"] = 1
        for name in DASHPOTS:
            scene.world.pairs[name] = 0
        return self.advance(scene, int(clock[0].steps))[0]

    def _stop(self) -> None:
        for name in (*VELOCITIES, *ACCELERATIONS):
            self.world.bodies[name] = 0.0
        for name in DASHPOTS:
            self.world.pairs[name] = 0  # stiffness is measured with them

    def at(self, displacements: Floats) -> Floats | None:
        """Return accelerations (m/s2, m/s2, rad/s2; (n, 3)) of the free blocks; None where contacts are lost."""
        for array, values in self.start:
            array[...] = values
        for name, values in zip(VELOCITIES, displacements.T, strict=True):
            self.bodies[name][self.free] = values
        self.evaluations += 1
        scene, status = self.advance(self.scene, self.steps + 1)
        blocks = self.bodies[self.free]
        found = np.stack([blocks[name] for name in ACCELERATIONS], axis=1)
        return found if status == REACHED and scene is self.scene and np.isfinite(found).all() else None

    def _place_pairs(self) -> None:
        """Find the places of all pairs in the tangent, whose columns are compressed."""
        place = np.full(self.bodies.size, self.free.size)
        place[self.free] = np.arange(self.free.size)
        size = 3 * self.free.size
        ends = place[np.stack([self.pairs["a"], self.pairs["b"]], axis=1).astype(np.intp)]
        rows = (3 * ends[:, :, None] + np.arange(3)).reshape(len(ends), 6)
        keys = (rows[:, None, :] * (size + 3) + rows[:, :, None]).reshape(-1)  # columns first
        held = (rows[:, None, :] >= size).repeat(6, axis=1) | (rows[:, :, None] >= size).repeat(6, axis=2)
        diagonal = np.arange(size) * (size + 4)
        keys = np.concatenate([np.where(held.reshape(-1), (size + 3) ** 2, keys), diagonal])
        known, found = np.unique(keys, return_inverse=True)
        known = known[known < (size + 3) ** 2]
        self.entries, self.diagonal = found[:-size].reshape(len(ends), 36), found[-size:]
        self.rows, self.columns = known % (size + 3), np.searchsorted(known // (size + 3), np.arange(size + 1))

    def tangent(self, drag: Floats) -> Any:
        """Return how forces grow against displacements, with those of a drag (n, 3): a matrix (3 n, 3 n), factorised.

        Of a contact that slides the shear goes with the normal force.
        """
        pair, number = np.nonzero(np.arange(self.contacts.shape[1]) < self.pairs["active"][:, None])
        contacts = self.contacts[pair, number]
        a, b = self.pairs["a"][pair].astype(np.intp), self.pairs["b"][pair].astype(np.intp)
        x, y, nx, ny = places_of(self.world, contacts, a, b)
        values = self.interactions_now[self.bodies["contact_class"][a], self.bodies["contact_class"][b]]
        normal, shear, friction = contacts["normal_force"], contacts["shear_force"], values["static_friction"]
        slope = float(self.world.controls[0].exponent) * normal / contacts["depth"]
        slides = np.abs(shear) >= friction * normal * (1.0 - SLIDING)
        across, along = np.empty((len(contacts), 6)), np.empty((len(contacts), 6))
        is_block = b != self.bodies.size - 1  # the half-plane has no centre
        for body, sign, first, counts in ((a, 1.0, 0, True), (b, -1.0, 3, is_block)):
            rx, ry = (x - self.bodies["x"][body]) * counts, (y - self.bodies["y"][body]) * counts
            across[:, first : first + 3] = (sign * np.stack([nx, ny, rx * ny - ry * nx])).T
            along[:, first : first + 3] = (sign * np.stack([-ny, nx, rx * nx + ry * ny])).T
        push = slope[:, None] * across
        hold = np.where(slides, 0.0, values["shear_ratio"] * slope)[:, None] * along
        hold -= np.where(slides, np.sign(shear) * friction, 0.0)[:, None] * push
        blocks = across[:, :, None] * push[:, None, :] + along[:, :, None] * hold[:, None, :]
        size = len(self.rows)
        data = np.bincount(self.entries[pair].ravel(), blocks.reshape(-1), size + 1)[:size].astype(np.float64)
        data[self.diagonal] += drag.ravel()
        shape = (len(self.columns) - 1, len(self.columns) - 1)
        matrix = sparse.csc_array((data, self.rows, self.columns), shape=shape)
        return splu(matrix, "MMD_AT_PLUS_A", PIVOT, options={"SymmetricMode": True})

    def unrest(self, accelerations: Floats) -> float:
        """Return the greatest acceleration (m/s2) of a corner."""
        turning = self.reach[:, 2] * np.abs(accelerations[:, 2])
        return float((np.hypot(accelerations[:, 0], accelerations[:, 1]) + turning).max())

    @property
    def deepest(self) -> float:
        """The deepest overlap (m)."""
        is_active = np.arange(self.contacts.shape[1]) < self.pairs["active"][:, None]
        return float(np.where(is_active, self.contacts["depth"], 0.0).max(initial=0.0))

    def end(self) -> None:
        """Give dashpots, kinetic friction and step back; nothing moves."""
        world = self.world
        world.interactions[...] = self.interactions
        world.controls["step"] = self.step
        for name in VELOCITIES:
            world.bodies[name] = 0.0
        for name in DASHPOTS:
            world.pairs[name] = 0
        world.bodies["is_asked"] = 1
        world.clock["next_update"] = world.clock["next_share"] = world.clock["steps"]


class _Search:
    """The creep of blocks from where they are until they rest, or certainly do not."""

    def __init__(self, forces: _Forces, scale: float, smallest: float) -> None:
        self.forces, self.scale, self.smallest = forces, scale, smallest
        controls, blocks = forces.world.controls[0], forces.bodies[forces.free]
        exponent, stiffest = float(controls.exponent), float(forces.interactions["normal_stiffness"].max())
        weight = float(blocks["mass"].sum()) * scale
        deep = self.deep = (weight / stiffest) ** (1.0 / exponent)  # m, where one contact bears all
        self.drag = DRAG * exponent * stiffest * deep ** (exponent - 1.0) * forces.masses / forces.masses[:, :1]
        size = float(max(np.abs(blocks["x"]).max(), np.abs(blocks["y"]).max()))
        digit = float(np.finfo(np.float64).eps) * size * stiffest / float(blocks["mass"].min()) / scale
        self.balance = max(BALANCE, ROUND_OFF * digit)
        self.most = 0.5 * tolerances.TRAVELLED * float(controls.skin)  # m: pairs farther apart are not listed
        self.closed = self._closed(float(controls.gravity_x), float(controls.gravity_y), deep)

    def _closed(self, gravity_x: float, gravity_y: float, deep: float) -> Floats:
        """Return displacements down gravity, in proportion to height, that close all contacts across it."""
        guess: Floats = np.zeros_like(self.drag)
        pull = math.hypot(gravity_x, gravity_y)
        if pull > 0.0:
            blocks = self.forces.bodies[self.forces.free]
            height = -(blocks["x"] * gravity_x + blocks["y"] * gravity_y) / pull
            way = deep / len(blocks) * (1.0 + (height - height.min()) / self.smallest)
            guess[:, :2] = np.outer(way, (gravity_x / pull, gravity_y / pull))
        return guess

    def way(self, displacements: Floats) -> float:
        """Return the way (m) of the corner that comes farthest."""
        return self.forces.unrest(displacements)

    def solved(self, before: Floats, guess: Floats, drag: Floats) -> _Newton:
        """Return displacements whose forces are those of a drag (kg/s2 or kg m2/s2; (n, 3)) from `before`."""
        now, best, patience = guess, np.inf, PATIENCE
        found = self.forces.at(now)
        for _ in range(ITERATIONS):
            if found is None:
                break
            left = found - drag * (now - before) / self.forces.masses
            error, unrest = (self.forces.unrest(one) / self.scale for one in (left, found))
            if error <= max(self.balance, min(NEARLY[0], NEARLY[1] * unrest)):
                return _Newton(now, found, is_solved=True)
            best, patience = (error, PATIENCE) if error < 0.5 * best else (best, patience - 1)
            if patience == 0:
                break
            try:
                change = self.forces.tangent(drag).solve((left * self.forces.masses).ravel()).reshape(-1, 3)
            except RuntimeError:  # exactly singular
                break
            longest = min(self.most, max(LONGEST * self.deep, self.way(now)))
            change *= min(1.0, longest / max(self.way(change), longest))
            now, found = self._shortened(now, change, drag, before, self._square(left))
        return _Newton(now, None, is_solved=False)

    def _square(self, accelerations: Floats) -> float:
        """Return the sum of m a^2 (N2/kg) of what is left."""
        return float((self.forces.masses * accelerations**2).sum())

    def _shortened(
        self, now: Floats, change: Floats, drag: Floats, before: Floats, left: float
    ) -> tuple[Floats, Floats | None]:
        """Return where a step of Newton's method ends, all of it or the better of that and half, and accelerations."""
        share, best = 1.0, tuple[float, Floats, Floats | None]((math.inf, now, None))
        for _ in range(SHORTENINGS):
            after = now + share * change
            found = self.forces.at(after)
            if found is not None:
                square = self._square(found - drag * (after - before) / self.forces.masses)
                if square < best[0]:
                    best = square, after, found
                if square < (1.0 - 0.2 * share) * left:  # of what is left, by which a whole step has to bring it down
                    break
            share *= HALF
        return best[1:]

    def _sticky(self) -> Floats:
        """Return displacements at which nothing slides, or those from which they were looked for."""
        values, names = self.forces.interactions_now, ["static_friction", "kinetic_friction"]
        friction = values[names].copy()
        for name in names:
            values[name] = 1e3 * friction[name]  # times the friction, in a first guess without slip
        result = self.solved(np.zeros_like(self.drag), self.closed, 1e-4 * self.drag)  # of the drag, in that guess
        for name in names:
            values[name] = friction[name]
        return result.displacements if result.is_solved else self.closed

    def creep(self) -> tuple[bool | None, Floats, float]:
        """Return whether an equilibrium holds, the displacements (n, 3), and the unrest there."""
        now, guess, unrest, h, growth = np.zeros_like(self.drag), self._sticky(), np.inf, FIRST, GROWTH
        history: list[tuple[float, float]] = []
        failures = 0
        while h > LEAST and self.forces.evaluations < EVALUATIONS:
            result = self.solved(now, guess, self.drag / h)
            if result.accelerations is None:
                failures += 1
                if unrest <= SLIGHT and failures == FAILURES:
                    return True, now, unrest
                h, growth = SHRINKAGE * h, CAREFUL
                continue
            failures = 0
            now = guess = result.displacements
            unrest = self.forces.unrest(result.accelerations) / self.scale
            if unrest <= self.balance:
                return True, now, unrest
            history.append((unrest, self.way(now)))
            if self._falls(history):
                return False, now, unrest
            if history[-1][1] > self.most:
                break
            h, growth = h * growth, min(CAREFUL * growth, GROWTH)
        return None, now, unrest

    def _falls(self, history: list[tuple[float, float]]) -> bool:
        """Return True where unrest grew from step to step, far from the start, or faded too little very far from it."""
        last = history[-LOOKS_BACK - 1 :]
        (unrest, way), rests = last[-1], [one for one, _ in last]
        if way > self.most:
            return len(last) > 1 and unrest >= FADES * rests[0]
        is_far = way > max(FAR * self.forces.deepest, 2e-4 * self.smallest)
        return len(last) > LOOKS_BACK and is_far and all(one < other for one, other in pairwise(rests))


def equilibrium(scene: Any, advance: Advance, is_free: NDArray[np.bool_], scale: float, smallest: float) -> SpringRest:
    """Bring a scene on springs to equilibrium with its gravity and loads, which stay as they are.

    `is_free` (b,) tells which blocks move, `scale` (m/s2) is the acceleration by gravity and loads, `smallest` (m) the
    smallest side of a block. Shear springs of contacts go on from what they hold. Where nothing is found the arrays of
    the scene are not as they were.
    """
    forces = _Forces(scene, advance, is_free)
    holds, displacements, unrest = _Search(forces, scale, smallest).creep()
    forces.end()
    change = np.zeros((3, is_free.size))
    change[:, forces.free] = displacements.T
    return SpringRest(forces.scene, holds, change, unrest)
