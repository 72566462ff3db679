"""One block thrown at the ground again and again, without gravity, in a world that is built once.

Building a world from a scenario takes milliseconds, an impact a tenth of one; thousands of impacts are measured by
restoring the arrays of one world.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin
from typing import TYPE_CHECKING, Any

import numpy as np

from blocksim.simulation.schemes import build_scene, scheme_of
from blocksim.verification import closed_forms as forms
from blocksim.verification.scene import HEIGHT, WIDTH
from blocksim.world.scenes import arrays_of

if TYPE_CHECKING:
    from blocksim.verification.case import Setting

POLL = 40  # steps; an impact on springs takes thirty and more; a rigid one a part of one, so that others may follow
MOST_STEPS = 4_000_000
STEPS_BEFORE = 2.0  # of free flight
GOLDEN = 0.6180339887498949  # its multiples, modulo 1, spread phases evenly over a step


@dataclass(frozen=True)
class Throw:
    """How a block comes down, straight."""

    angle: float = 0.0  # rad
    friction: float = 0.0
    phase: float = 0.5  # of a step, at which the contact begins


class Thrower:
    """A world with one block, ready to be thrown."""

    def __init__(self, setting: Setting, restitution: float, speed: float = 1.0, **values: Any) -> None:
        """Build the world for impacts at `speed` (m/s), on which its step may depend; `values` go to Scene."""
        body = {"y": 1.0, "velocity": [0.0, -speed]}
        scene = setting.scene([body], restitution=restitution, gravity=0.0, **values)
        self.speed = speed
        self.scene = build_scene(scene.scenario())
        self.world = self.scene.world
        self.scheme = scheme_of(self.scene)
        self.fresh = [array.copy() for array in arrays_of(self.scene)]
        self.row = np.zeros(len(self.scheme.measured))

    @property
    def step(self) -> float:
        """Length of a step (s)."""
        return float(self.world.controls[0].step)

    def throw(self, throw: Throw, poll: int = POLL) -> Any:
        """Throw the block; return its record after the impact, once it has no contact at the end of `poll` steps."""
        self._place(throw)
        body = self.world.bodies[0]
        steps, before = 0, float(body.vy)
        while steps < MOST_STEPS:
            steps += poll
            self.scheme.advance(self.scene, steps)
            self.scheme.measure(self.scene, self.row)
            if self.row[len(self.scheme.ledger)] == 0.0 and body.vy != before:
                break
        return body

    def _place(self, throw: Throw) -> None:
        for array, fresh in zip(arrays_of(self.scene), self.fresh, strict=True):
            array[...] = fresh
        body = self.world.bodies[0]
        lowest = forms.lowest_corner(WIDTH, HEIGHT, throw.angle)[1]
        body.y = self.speed * self.step * (STEPS_BEFORE + throw.phase) - lowest
        body.angle, body.cos, body.sin = throw.angle, cos(throw.angle), sin(throw.angle)
        self.world.interactions.static_friction[...] = throw.friction
        self.world.interactions.kinetic_friction[...] = throw.friction


def kinetic_energy(body: Any) -> float:
    """Return the kinetic energy (J) of one body."""
    return float(0.5 * (body.mass * (body.vx**2 + body.vy**2) + body.inertia * body.spin**2))
