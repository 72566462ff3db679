"""Drawn stones that share a corner, or of which one ends on a face of another: no NaN, no energy out of nothing.

A convex piece is cut in four by two lines that cross, so that all corners that meet are one, to the last digit: what
the places of two bodies make of them is off by round-off, either way. SI units.
"""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from blocksim.kernels.common.arrays import REACHED
from blocksim.kernels.common.mechanics import renew_rotations
from blocksim.scenario import Model
from blocksim.scenario.geometry import centre_outline, centroid
from blocksim.simulation.schemes import build
from blocksim.verification.scene import CaseScene, SteppedScene
from blocksim.world.build import arrays_of
from tests.sizes import in_all

Points = NDArray[np.float64]
SIZE, CELL = 0.05, 0.2  # m: radius of a piece, and room for it
BATCH = 48  # pieces a scene
THROWS = 10  # of a scene
HELD, MOVES = 5, 0.8  # every so many pieces has a fixed stone; share of the others that move
LAWS = ("linear", "hertz-mindlin")
SHARPEST = 0.06  # of the stones: sine of an angle between two sides, at least
SHORTEST = 0.05  # m, of a side, over the size
LOOKS, APART = {"explicit": 12, "nonsmooth": 6}, 20  # looks at a scene, and steps between them
GAIN = 1e-3  # of the energy: impacts on springs are no more exact, see kernels/explicit/test_polygons.py
LEAST = 1e-17  # J: what stones of 0.1 kg have at 1e-8 m/s, at which places no longer change in a step
KINDS = ("crossing", "T-joint", "corner")
Stones = tuple[Points, ...]


def halved(outline: Points, place: Points, normal: Points) -> tuple[Points, Points]:
    """Cut an outline by a line through a place; both parts get the same corners there."""
    sides: tuple[list[Points], list[Points]] = ([], [])
    over = (outline - place) @ normal
    for k in range(len(outline)):
        nxt = (k + 1) % len(outline)
        for side in sides if over[k] == 0.0 else (sides[int(over[k] < 0.0)],):
            side.append(outline[k])
        if over[k] * over[nxt] < 0.0:
            cut = outline[k] + over[k] / (over[k] - over[nxt]) * (outline[nxt] - outline[k])
            for side in sides:
                side.append(cut)
    return np.array(sides[0]), np.array(sides[1])


def with_corner(part: Points, place: Points, normal: Points) -> Points:
    """Return a part that a line has cut off, with the place on that line as one of its corners."""
    for k in range(len(part)):
        ends = part[k], part[(k + 1) % len(part)]
        if all(abs((end - place) @ normal) < 1e-12 for end in ends):
            return np.insert(part, k + 1, place, axis=0)
    raise AssertionError("the cut is a side")


def without_flat(part: Points) -> Points:
    """Return an outline without corners in the middle of a side."""
    before, after = np.roll(part, 1, axis=0) - part, np.roll(part, -1, axis=0) - part
    sines = np.abs(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0])
    return np.asarray(part[sines > 1e-9 * np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)])


def is_stone(part: Points) -> bool:
    """Return True for an outline that is no needle."""
    if len(part) < 3:
        return False
    ways = np.roll(part, -1, axis=0) - part
    lengths = np.linalg.norm(ways, axis=1)
    last = np.roll(ways, 1, axis=0)
    sines = (last[:, 0] * ways[:, 1] - last[:, 1] * ways[:, 0]) / (lengths * np.roll(lengths, 1))
    return bool(lengths.min() > SHORTEST * SIZE and sines.min() > SHARPEST)


def stones_of(random: np.random.Generator, kind: str) -> Stones:
    """Draw the stones of a piece that is cut at random."""
    while True:
        angles = np.sort(random.uniform(0.0, 2.0 * np.pi, random.integers(4, 9)))
        outline = SIZE * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        place = random.uniform(-0.4, 0.4, 2) * SIZE
        first = random.uniform(0.0, np.pi) if random.random() < 0.7 else 0.0
        second = first + random.choice([0.5 * np.pi, random.uniform(0.2, 2.9)])
        ways = [np.array([np.cos(angle), np.sin(angle)]) for angle in (first, second)]
        upper, lower = halved(outline, place, ways[0])
        if min(len(upper), len(lower)) < 3:
            continue
        quarters = [
            quarter for half in (upper, lower) for quarter in halved(with_corner(half, place, ways[0]), place, ways[1])
        ]
        ends = [without_flat(part) for part in (lower, *quarters) if len(part) > 2]
        if len(ends) < 5 or not all(map(is_stone, ends)):
            continue
        whole, *four = ends
        shares = [min(np.abs(part - place).sum(axis=1)) == 0.0 for part in four]
        if not all(shares):
            continue
        match kind:
            case "crossing":
                return tuple(four)
            case "T-joint":
                return (*four[:2], whole)
            case _:  # two of them across, as nothing else than the corner
                return four[0], four[3]


class Pieces:
    """Pieces that are far from one another, to be thrown again and again."""

    def __init__(self, random: np.random.Generator, scheme: str) -> None:
        """Draw them around the corners of a grid; of some the first stone is fixed."""
        bodies: list[dict[str, Any]] = []
        numbers: list[int] = []
        for piece in range(BATCH):
            stones = stones_of(random, KINDS[piece % len(KINDS)])
            for number, stone in enumerate(stones):
                drawn = [(float(x), float(y)) for x, y in stone + origin_of(piece)]
                x, y = centroid(drawn)
                outline = [list(corner) for corner in centre_outline(drawn)]
                is_fixed = number == 0 and piece % HELD == 0
                speed = {"fixed": True} if is_fixed else {"velocity": [3.0, 0.0]}  # that steps are chosen for
                bodies.append({"x": x, "y": y, "outline": outline, **speed})
            numbers += [piece] * len(stones)
        law = LAWS[int(random.integers(len(LAWS)))]
        springs = scheme == "explicit"
        scene = CaseScene(
            bodies,
            gravity=0.0,
            restitution=float(random.choice([0.0, 0.5, 1.0 if springs else 0.9])),
            friction=float(random.choice([0.0, 0.6])),
            contact={"law": law, "max_overlap": 2e-3} if springs else {},
            time={} if springs else {"scheme": scheme, "step": 1e-4, "force_step": True, "velocity_tolerance": 1e-12},
        )
        self.numbers = np.array(numbers)
        self.scene = build(Model(scene.scenario()))
        self.fresh = [array.copy() for array in arrays_of(self.scene)]

    def throw(self, random: np.random.Generator) -> SteppedScene:
        """Turn and shift each piece as a whole, or leave it as it is drawn, and give its stones velocities."""
        for array, fresh in zip(arrays_of(self.scene), self.fresh, strict=True):
            array[...] = fresh
        bodies: Any = self.scene.world.bodies[:-1]
        for piece in range(BATCH):
            own = np.flatnonzero(self.numbers == piece)
            speed = 10.0 ** random.uniform(-9.0, 0.0)
            middle = origin_of(piece)
            turn = random.choice([0.0, random.uniform(-np.pi, np.pi)])
            shift = random.choice([0.0, 1.0]) * random.uniform(-1.0, 1.0, 2) * (0.5 * CELL - 1.1 * SIZE)
            cos, sin = np.cos(turn), np.sin(turn)
            for i in own:
                x, y = bodies.x[i] - middle[0], bodies.y[i] - middle[1]
                if turn or shift.any():
                    bodies.x[i], bodies.y[i] = middle + shift + (cos * x - sin * y, sin * x + cos * y)
                bodies.angle[i] = turn
                moves = bodies.inverse_mass[i] > 0.0 and random.random() < MOVES
                vx, vy, spin = speed * random.normal(size=3) if moves else (0.0, 0.0, 0.0)
                bodies.vx[i], bodies.vy[i], bodies.spin[i] = vx, vy, spin / SIZE
        renew_rotations(self.scene.world.bodies)
        return SteppedScene(self.scene)


def origin_of(piece: int) -> Points:
    """Return the place (m) of the middle of a piece."""
    return np.array([piece % 8 - 4, 2 + piece // 8]) * CELL


def energies_of(run: SteppedScene, pieces: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return kinetic energy, and what springs along normals hold, of each piece (J)."""
    bodies, world = run.bodies, run.world
    kinetic = 0.5 * (bodies.mass * (bodies.vx**2 + bodies.vy**2) + bodies.inertia * bodies.spin**2)
    held = np.bincount(pieces, kinetic, BATCH)
    if "stiffness" in (world.pairs.dtype.names or ()):
        count, power = int(world.clock[0].pair_count), float(world.controls[0].exponent) + 1.0
        pairs: Any = world.pairs[:count]
        contacts: Any = world.contacts[:count]
        is_active = np.arange(contacts.shape[1]) < pairs.active[:, np.newaxis]
        stored = pairs.stiffness[:, np.newaxis] * np.where(is_active, contacts.depth, 0.0) ** power / power
        held += np.bincount(pieces[pairs.a], stored.sum(axis=1), BATCH)
    return np.asarray(held)


@pytest.mark.parametrize("scheme", ["explicit", "nonsmooth"])
@pytest.mark.parametrize("tried", [1, pytest.param(in_all(21), marks=pytest.mark.long)], ids=str)
def test_stones_that_share_corners_part_without_nan_and_without_more_energy(scheme: str, tried: int) -> None:
    """What springs hold is a part of the energy: it bounds their forces."""
    for number in range(tried):
        random = np.random.default_rng(number)
        pieces = Pieces(random, scheme)
        for throw in range(THROWS):
            run = pieces.throw(random)
            most = energies_of(run, pieces.numbers) * (1.0 + GAIN) + LEAST
            for look in range(LOOKS[scheme]):
                run.to_step((look + 1) * APART)
                energies = energies_of(run, pieces.numbers)
                where = number, throw, look
                assert np.isfinite(run.state()).all(), (where, np.flatnonzero(~np.isfinite(energies)))
                assert (energies <= most).all(), (where, np.flatnonzero(energies > most), (energies / most).max())
            assert run.code == REACHED
