"""pymunk (Chipmunk2D): rigid contacts, impulses by Gauss-Seidel iterations, double precision."""

from __future__ import annotations

import math
from importlib import import_module
from typing import TYPE_CHECKING, Any

from blocksim.bench.harness import FRICTION
from tests.bench.peers.engine import Stepper

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.bench.peers.engine import Scene

# Overlap that is left alone so that contacts last. The default of 0.1 is a tenth of a pixel; here it would be 0.1 m.
SLOP = 1e-6  # m
GROUND = ((-50.0, -1.0), (100.0, -1.0), (100.0, 0.0), (-50.0, 0.0))  # m


class Pymunk(Stepper):
    """One step length and number of iterations."""

    def call(self, world: Any) -> tuple[Callable[..., object], tuple[Any, ...]]:
        """Return the function of a step, and its arguments."""
        return world.step, (self.step,)

    def made(self, scene: Scene) -> tuple[Any, list[Any]]:
        """Sleeping is off by default, and so is any damping of free motion.

        `collision_bias` stays as it is: a tenth of the overlap beyond the slop goes in a sixtieth of a second, by
        velocities that are forgotten after the step, so that it brings no energy in.
        """
        pymunk = import_module("pymunk")
        space = empty_space()
        space.iterations = self.iterations
        # Both coefficients of a pair are products: blocks a and ground b with a*a and a*b as wanted.
        friction = math.sqrt(FRICTION["block_block"])
        bounce = math.sqrt(scene.restitution)
        ground = pymunk.Poly(space.static_body, GROUND)
        ground.friction = FRICTION["block_ground"] / friction
        ground.elasticity = bounce
        space.add(ground)
        bodies = []
        placed = scene.placed()
        for block in placed:
            body = pymunk.Body(block.mass / placed[0].mass, block.inertia / placed[0].mass)
            body.position = (block.x, block.y)
            body.velocity = (block.vx, block.vy)
            shape = pymunk.Poly(body, block.corners)  # its corners are sharp: radius 0
            shape.friction, shape.elasticity = friction, bounce
            space.add(body, shape)
            bodies.append(body)
        return space, bodies


def empty_space() -> Any:
    """Return an empty space."""
    space = import_module("pymunk").Space()
    space.gravity = (0.0, -9.81)
    space.collision_slop = SLOP
    return space
