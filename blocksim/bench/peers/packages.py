"""The optional packages of the other engines."""

from typing import Any

from blocksim import extras

PACKAGES = {"pymunk": "pymunk", "Box2D": "box2d"}  # module: name of its package


def loaded(module: str) -> Any:
    """Return the module of an engine; raises UnavailableError."""
    return extras.loaded(module, "bench --peers", extras.BENCH, PACKAGES[module])


def require_all() -> None:
    """Raise UnavailableError before anything is measured."""
    for module in PACKAGES:
        loaded(module)
