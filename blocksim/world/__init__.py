"""From a scenario to flat arrays: bodies, contact parameters, admissible step."""

from blocksim.world.build import build_world
from blocksim.world.stable_step import stable_step

__all__ = ["build_world", "stable_step"]
