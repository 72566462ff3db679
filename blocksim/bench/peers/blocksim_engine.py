"""blocksim: contacts are springs, so its step follows from their stiffness."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from blocksim.bench.peers.scene import Final, Scene
from blocksim.simulation.loop import last_step_of
from blocksim.simulation.outcome import BY_CODE
from blocksim.simulation.team import ALONE
from blocksim.world.build import build_world


@dataclass(frozen=True)
class Blocksim:
    """One stiffness and safety of the step."""

    scale: float  # stiffness_scale
    safety: float

    @property
    def setting(self) -> str:
        """For people."""
        return f"stiffness {self.scale:g}"

    def solve(self, scene: Scene) -> Final:
        """Compute the scene. Not counted: building the world, as the others' scenes are not.

        A run that breaks off, such as when soft blocks overlap too far, ends nowhere: at positions that are no numbers.
        """
        times = {"safety": self.safety, "end": scene.end, "stop_at_rest": False}
        world = build_world(scene.make(contact={"stiffness_scale": self.scale}, time=times))
        world.bodies.x[:-1] += scene.shift
        last = last_step_of(scene.end, float(world.controls[0].step))
        began = time.process_time()
        world, status = ALONE.advance(world, last)
        seconds = time.process_time() - began
        found = np.array([world.bodies.x[:-1], world.bodies.y[:-1]])
        if not BY_CODE[status].is_finished:
            found[:] = np.nan
        return Final(found[0], found[1], seconds)
