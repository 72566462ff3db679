"""Box2D 2.3: rigid contacts, impulses by Gauss-Seidel iterations, single precision.

Its lengths are made for metres: overlap up to 5 mm is left alone (b2_linearSlop), polygons have a skin of twice that,
approaches below 1 m/s do not bounce (b2_velocityThreshold), and nothing moves more than 2 m a step (b2_maxTranslation).
All this is compiled in. So lengths and gravity are scaled up together, which leaves times as they are: 200 units a
metre make that 25 µm, 50 µm, 5 mm/s and 10 mm a step, which a block at 2.5 m/s does not reach in 4 ms. Ten times more
would cut the motion of long steps short, ten times less would end bounces at 50 mm/s.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from blocksim.bench.harness import FRICTION
from blocksim.scenario.geometry import edges_of
from tests.bench.peers.engine import Stepper

if TYPE_CHECKING:
    from collections.abc import Callable

    from blocksim.scenario import PlacedBody
    from tests.bench.peers.engine import Scene

UNITS = 200.0  # a metre
GRAVITY = 9.81  # m/s2
GROUND_LENGTH, GROUND_DEPTH = 150.0, 1.0  # m


class Box2D(Stepper):
    """One step length and numbers of iterations, for velocities and for positions."""

    units = UNITS

    def call(self, world: Any) -> tuple[Callable[..., object], tuple[Any, ...]]:
        """Return the function of a step, and its arguments."""
        return world.Step, (self.step, self.iterations, self.iterations)

    def made(self, scene: Scene) -> tuple[Any, list[Any]]:
        """Return world and blocks, lengths in the engine's units."""
        box2d = import_module("Box2D")
        world = empty_world()
        # Friction of a pair is the root of the product, restitution the larger one.
        blocks = {"friction": FRICTION["block_block"], "restitution": scene.restitution}
        ground = {"friction": FRICTION["block_ground"] ** 2 / FRICTION["block_block"], "restitution": scene.restitution}
        skin = box2d.b2_polygonRadius
        depth = 0.5 * UNITS * GROUND_DEPTH
        slab = box2d.b2PolygonShape(box=(0.5 * UNITS * GROUND_LENGTH, depth, (0.0, -depth - skin), 0.0))
        world.CreateStaticBody().CreateFixture(box2d.b2FixtureDef(shape=slab, **ground))
        bodies = []
        placed = scene.placed()
        for block in placed:
            body = world.CreateDynamicBody(
                position=(UNITS * block.x, UNITS * block.y), linearVelocity=(UNITS * block.vx, UNITS * block.vy)
            )
            shape = box2d.b2PolygonShape(vertices=_inside_of_skin(block, skin))
            body.CreateFixture(box2d.b2FixtureDef(shape=shape, density=1.0, **blocks))
            body.massData = _mass_data(box2d, block, placed[0].mass)
            bodies.append(body)
        return world, bodies


def empty_world() -> Any:
    """Return an empty world.

    Nothing sleeps: a stack has to stand by itself. Continuous physics, which keeps fast bodies from passing through the
    ground, is off: at these steps none does, and without it a step takes 10 to 25 % less time for the same answers.
    """
    world = import_module("Box2D").b2World(gravity=(0.0, -GRAVITY * UNITS), doSleep=False)
    world.continuousPhysics = False
    return world


def _inside_of_skin(block: PlacedBody, skin: float) -> list[tuple[float, float]]:
    """Return corners in the engine's units: the skin is part of the block, what is inside of it smaller by as much."""
    edges = list(edges_of(block.corners))
    found = []
    for (_, _, (ax, ay)), ((x, y), _, (bx, by)) in zip([edges[-1], *edges[:-1]], edges, strict=True):
        reach = skin / (1.0 + ax * bx + ay * by)
        found.append((UNITS * x - reach * (ax + bx), UNITS * y - reach * (ay + by)))
    return found


def _mass_data(box2d: Any, block: PlacedBody, unit: float) -> Any:
    """Return mass, in units of that of a block, and inertia of the whole block, skin included."""
    data = box2d.b2MassData()
    data.mass = block.mass / unit
    data.center = (0.0, 0.0)
    data.I = UNITS**2 * block.inertia / unit
    return data
