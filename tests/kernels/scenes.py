"""Scenes of the tests of kernels: single bodies, blocks in any poses and in crowds, with contacts of either scheme.

SI units, angles in rad.
"""

import copy
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from math import cos, hypot, pi, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from blocksim.bench.harness import pushed_wall
from blocksim.kernels.common.arrays import ALL, BODY, MOTION_PIECE, TEAM_SIZE, Record, Records, World, zeros
from blocksim.kernels.common.mechanics import renew_rotations
from blocksim.kernels.common.shapes import place_corners
from blocksim.kernels.explicit.broad_phase import rebuild_pairs
from blocksim.kernels.explicit.models import contact_points
from blocksim.kernels.nonsmooth.arrays import Nonsmooth
from blocksim.kernels.nonsmooth.flush_joints import decide_all
from blocksim.kernels.nonsmooth.motion import load_states
from blocksim.kernels.nonsmooth.narrow_phase import find_manifolds
from blocksim.kernels.nonsmooth.neighbours import update_pairs
from blocksim.kernels.nonsmooth.packs import gather, pack_all
from blocksim.kernels.nonsmooth.step import substep
from blocksim.scenario import Model, Scenario
from blocksim.scenario.geometry import Corners, centre_outline, regular
from blocksim.scenario.models.timeline import Nonsmooth as Stepping
from blocksim.simulation.schemes import build
from blocksim.verification.scene import HEIGHT, WIDTH, CaseScene, SteppedScene, scenario_of
from blocksim.world.build import build_world
from blocksim.world.nonsmooth import with_more_constraints
from tests.kernels.references import turning

STEP = 1e-3  # s, unless a test says otherwise
ENDLESS = 1e3  # s: tests step as far as they want
RIGID = {"scheme": "nonsmooth"}
RADIUS = 0.02
HEXAGON = regular(6, RADIUS)
NAMES = ("x", "y", "angle", "vx", "vy", "spin")


def make_body(
    x: float = 0.0,
    y: float = 0.0,
    angle: float = 0.0,
    *,
    width: float = WIDTH,
    height: float = HEIGHT,
    mass: float = 0.1,
) -> Record:
    """Make the record of one body at rest from its pose (m, rad), sides (m) and mass (kg)."""
    body = zeros(1, BODY)[0]
    body.x, body.y, body.angle = x, y, angle
    body.cos, body.sin = cos(angle), sin(angle)
    body.faces = body.corners = ALL
    body.half_x, body.half_y, body.radius = width / 2, height / 2, hypot(width, height) / 2
    body.mass, body.inertia = mass, mass * (width**2 + height**2) / 12
    body.inverse_mass, body.inverse_inertia = 1.0 / body.mass, 1.0 / body.inertia
    place_corners(body)
    return body


@cache
def blocks_apart(count: int, tables: str) -> World:
    """Return a world of blocks that do not touch, to be copied; `tables` of the scenario in JSON."""
    apart: list[Mapping[str, object]] = [{"x": 0.1 * i, "y": 0.1} for i in range(count)]
    return build_world(Model(scenario_of(apart, **json.loads(tables))))


def pose(*poses: tuple[float, float, float], **tables: object) -> World:
    """Return the paper's blocks in any poses (m, m, rad), overlapping ones too; nothing has moved, pairs are listed."""
    world = copy.deepcopy(blocks_apart(len(poses), json.dumps(tables)))
    for body, (x, y, angle) in zip(world.bodies, poses, strict=False):
        body.x, body.y, body.angle = x, y, angle
    renew_rotations(world.bodies)
    assert rebuild_pairs(world)
    return world


def rigid(scenario: Scenario, **stepping: Any) -> Scenario:
    """Return a scenario with rigid contacts; keywords are keys of [time]."""
    kept = {"stop_at_rest": scenario.time.stop_at_rest, "end": scenario.time.end}
    time = Stepping(**{"scheme": "nonsmooth", "step": STEP, "force_step": True, **kept, **stepping})
    return scenario.model_copy(update={"time": time})


def begin(scenario: Scenario, **stepping: Any) -> SteppedScene:
    """Start a scenario with rigid contacts; keywords are keys of [time]."""
    return SteppedScene(build(Model(rigid(scenario, **stepping))))


def single(bodies: Sequence[Mapping[str, object]], **values: Any) -> SteppedScene:
    """Start single bodies with rigid contacts; keywords of [time] go there, all others to the scene."""
    stepping = {name: values.pop(name) for name in list(values) if name in Stepping.model_fields}
    return begin(CaseScene(bodies, time=RIGID, **values).scenario(), end=ENDLESS, **stepping)


@dataclass(frozen=True)
class Block:
    """A block in any pose, with its velocities."""

    x: float = 0.0
    y: float = 0.0
    angle: float = 0.0
    vx: float = 0.0
    vy: float = 0.0
    spin: float = 0.0
    width: float = WIDTH
    height: float = HEIGHT
    fixed: bool = False
    outline: tuple[tuple[float, float], ...] = ()  # m, in place of width and height

    @property
    def shape(self) -> dict[str, object]:
        """Return what its body table has for it in a CaseScene."""
        sides: dict[str, object] = {"width": self.width, "height": self.height}
        return {"outline": [list(corner) for corner in self.outline]} if self.outline else sides


def posed(blocks: Sequence[Block], **values: Any) -> Nonsmooth:
    """Return blocks in any poses, overlapping ones too, before their first step; keywords of [time] go there."""
    stepping = {name: values.pop(name) for name in list(values) if name in Stepping.model_fields}
    size = max([1.0, *(abs(place) for one in blocks for corner in one.outline for place in corner)])
    apart = [{"x": 3.0 * size * i, "y": 2.0 * size, "fixed": one.fixed, **one.shape} for i, one in enumerate(blocks)]
    scene: Any = build(Model(rigid(CaseScene(apart, time=RIGID, **values).scenario(), end=ENDLESS, **stepping)))
    place(scene, blocks)
    load_states(scene)
    scene.world.clock[0].is_started = 1
    scene.world.team[TEAM_SIZE] = 1
    return scene  # type: ignore[no-any-return]


def place(scene: Nonsmooth, blocks: Sequence[Block]) -> None:
    """Put the blocks of a scene elsewhere, with their velocities."""
    for body, block in zip(scene.world.bodies, blocks, strict=False):
        for name in NAMES:
            body[name] = getattr(block, name)
    renew_rotations(scene.world.bodies)


def listed(scene: Nonsmooth) -> Nonsmooth:
    """Return a scene with the pairs of its bodies as they are now, in arrays large enough."""
    while not update_pairs(scene):
        scene = with_more_constraints(scene)
    return scene


def find_all(scene: Nonsmooth, part: int | None = None) -> None:
    """Find the manifolds of all pairs of a scene, so many at a time."""
    count = int(scene.contacts.stepping[0].constraint_count)
    begins = range(0, count, part or max(count, 1))
    undecided = [find_manifolds(scene, k, min(k + (part or count), count)) for k in begins]
    scene.contacts.residuals[0, 0] = sum(undecided)
    decide_all(scene)


def collided(scene: Nonsmooth) -> Nonsmooth:
    """Return a scene with the manifolds of its pairs, packed in packs."""
    scene = listed(scene)
    find_all(scene)
    gather(scene.contacts, scene.begins)
    pack_all(scene.contacts, 0, int(scene.contacts.stepping[0].pack_count))
    return scene


def after_substep(blocks: Sequence[Block], **values: Any) -> Nonsmooth:
    """Return blocks after the first substep of a step; the impulses are in the packs, velocities in the states."""
    scene = collided(posed(blocks, **values))
    substep(scene, 0, 0, False, scene.contacts.impact_lanes)
    return scene


def pairs_of(scene: Nonsmooth) -> set[tuple[int, int]]:
    """Return the bodies of all listed pairs."""
    constraints = listed_constraints(scene)
    return set(zip(constraints.a.tolist(), constraints.b.tolist(), strict=True))


def listed_constraints(scene: Nonsmooth) -> Any:
    """Return the constraints there are."""
    return scene.contacts.constraints[: scene.contacts.stepping[0].constraint_count]


def velocities(states: Records) -> NDArray[np.float64]:
    """Return vx, vy and spin of all records, a row each."""
    return np.array([states[name] for name in ("vx", "vy", "spin")]).T.copy()


def pile(random: np.random.Generator, columns: int, rows: int) -> list[Block]:
    """Return blocks in columns on the ground that nearly touch or overlap a little, and move at random (m/s)."""
    return [
        Block(
            1.01 * WIDTH * i + float(random.uniform(-3e-4, 3e-4)),
            HEIGHT * (j + 0.5) + float(random.uniform(-2e-5, 4e-5)),
            float(random.uniform(-2e-3, 2e-3)),
            0.3 * float(random.normal()),
            0.3 * float(random.normal()),
            1.5 * float(random.normal()),
        )
        for j in range(rows)
        for i in range(columns)
    ]


def rectangle(width: float = WIDTH, height: float = HEIGHT) -> Corners:
    """Return the outline of a rectangle."""
    return centre_outline([(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)])


def turned(outline: Corners, angle: float) -> NDArray[np.float64]:
    """Return the corners (n, 2) of an outline turned by an angle (rad)."""
    return np.asarray(np.array(outline) @ turning(angle))


def depth_below(outline: Corners, angle: float = 0.0) -> float:
    """Return how far (m) a polygon reaches below its centroid."""
    return -float(turned(outline, angle)[:, 1].min())


def random_outline(random: Any, size: float = RADIUS) -> Corners:
    """Return a convex polygon of 3 to 9 corners, some of them sharp, at random."""
    while True:
        angles = np.sort(random.uniform(0.0, 2.0 * pi, int(random.integers(3, 10))))
        steps = np.diff([*angles, angles[0] + 2.0 * pi])
        if steps.min() > 0.15 and steps.max() < 2.8:
            stretch = random.uniform(0.4, 1.0)
            return centre_outline([(size * cos(one), stretch * size * sin(one)) for one in angles.tolist()])


@dataclass(frozen=True)
class Touching:
    """A block on a fixed one, or on the ground, and the points between them; normals point towards the upper one."""

    world: World
    upper: Record  # the block above
    points: Any  # (n,) POINT: a record array

    @property
    def normals(self) -> np.ndarray:
        """Normals (n, 2)."""
        return np.stack([self.points.nx, self.points.ny], axis=1)

    def wrench(self) -> np.ndarray:
        """Return force along x and y and torque (m) about the upper block's centre for springs of one corner each."""
        points = self.points
        pushes = points.share * points.depth
        arms = (points.x - self.upper.x) * points.ny - (points.y - self.upper.y) * points.nx
        return np.array([(pushes * points.nx).sum(), (pushes * points.ny).sum(), (pushes * arms).sum()])


@cache
def world_of(model: str, spacing: float, width: float, below: float | None) -> World:
    """Return the world of two blocks far apart; calls with the same arguments share it."""
    ground = [] if below is None else [{"y": 0.5 * HEIGHT, "width": below, "fixed": True}]
    bodies = [{"y": 0.5, "width": width}, *ground]
    return build_world(Model(scenario_of(bodies, contact={"model": model, "particle_spacing": spacing})))


def touch(
    model: str,
    *,
    shift: float = 0.0,
    depth: float = 1e-6,
    angle: float = 0.0,
    spacing: float = 1e-3,
    width: float = WIDTH,
    below: float | None = WIDTH,
) -> Touching:
    """Let a block `width` wide touch the one `below`, or the ground (None); all in m but `angle` (rad)."""
    world = world_of(model, spacing, width, below)
    upper = world.bodies[0]
    upper.angle, upper.cos, upper.sin = angle, cos(angle), sin(angle)
    upper.x = shift
    upper.y = 0.0 if below is None else HEIGHT
    upper.y += abs(upper.sin) * upper.half_x + upper.cos * upper.half_y - depth
    place_corners(upper)
    assert rebuild_pairs(world)
    assert world.clock[0].pair_count <= 1
    count = contact_points(world, 0) if world.clock[0].pair_count else 0
    return Touching(world, upper.copy(), world.points[:count].copy())


SOFT = {"stiffness_scale": 1e-4, "max_overlap": 5e-3}  # a hundredth of the steps


def rows(columns: int, count: int, **more: Any) -> list[dict[str, Any]]:
    """Return blocks in rows that lie on one another, a few of them already moving."""
    return [
        {"x": 0.034 * i + 0.008 * row, "y": HEIGHT * (row + 0.5), "velocity": [0.3 * row + 0.1 * (i % 3), 0.0], **more}
        for row in range(count)
        for i in range(columns)
    ]


def shake(world: World) -> World:
    """Return a world whose support moves to and fro once."""
    pieces = zeros(3, MOTION_PIECE)
    pieces.start = 0.0, 0.03, 0.06
    pieces.c0, pieces.c1 = (0.0, 9e-3, 0.0), (0.3, -0.3, 0.0)
    world.controls.motion_x = 1.0
    return world._replace(motion=pieces)


def soft_world(bodies: list[dict[str, Any]], **tables: Any) -> World:
    contact: Mapping[str, object] = {"restitution": 0.2, **SOFT, **tables.pop("contact", {})}
    friction = {"block_block": 0.31, "block_ground": 0.38}
    time = {"stop_at_rest": False, **tables.pop("time", {})}
    return build_world(Model(scenario_of(bodies, contact=contact, friction=friction, time=time, **tables)))


def wall(**contact: object) -> World:
    """Return a wall that falls to pieces: four groups of bodies, all of which touch others."""
    return build_world(Model(pushed_wall(8, 8, contact={**SOFT, **contact})))


def among_fixed() -> World:
    """Return rows of blocks between fixed ones, whose numbers are before, among and after theirs."""
    fixed = [{"x": 0.034 * i - 0.002, "y": HEIGHT * 6.5 + 0.0016, "fixed": True, "angle": 0.1} for i in range(9)]
    post = {"x": 0.034 * 9 + 0.01, "y": 0.5 * HEIGHT, "fixed": True}
    blocks = rows(9, 6)
    return soft_world([*fixed[:5], *blocks[:20], post, *blocks[20:], *fixed[5:]])


def on_hills() -> World:
    """Return blocks that fall onto hills: the pieces of ground are bodies of their own."""
    profile = [[0.1 * i - 0.3, 0.02 * (i % 2)] for i in range(12)]
    blocks = [
        {
            "x": 0.0375 * i + 0.004 * row,
            "y": 0.04 + 0.033 * row,
            "velocity": [0.2, -0.3 * row],
            "angle": 0.2 * (i % 3 - 1),
        }
        for row in range(5)
        for i in range(9)
    ]
    return soft_world(blocks, ground={"profile": profile})


SCENES: dict[str, tuple[Callable[[], World], int]] = {  # and steps
    "wall with Hertz law": (lambda: wall(law="hertz-mindlin"), 1500),
    "among moving supports": (lambda: shake(among_fixed()), 1500),
    "on moving hills": (lambda: shake(on_hills()), 1500),
    "discs": (lambda: soft_world(rows(9, 6), contact={"model": "particles", "particle_spacing": 8e-3}), 600),
}
