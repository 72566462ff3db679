"""From a scenario to flat arrays: bodies, contact parameters, admissible step."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from blocksim.world.build import build_world

__all__ = ["build_world"]

# found when first asked for, so that readers of results can look at the memory without waiting for the kernels
_HOMES = {"build_world": "build"}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        message = f"module 'blocksim.world' has no attribute '{name}'"
        raise AttributeError(message)
    return getattr(import_module(f"blocksim.world.{_HOMES[name]}"), name)
