"""The optional packages of the other engines."""

from importlib import import_module
from typing import Any

from blocksim.errors import BlocksimError, ExitCode

PACKAGES = {"pymunk": "pymunk", "Box2D": "box2d"}  # module: name of its package


class MissingPackageError(BlocksimError):
    """An optional package is not installed."""

    exit_code = ExitCode.UNAVAILABLE


def loaded(module: str) -> Any:
    """Return the module of an engine; raises MissingPackageError."""
    try:
        return import_module(module)
    except ImportError as error:
        raise MissingPackageError(
            f"bench --peers needs the package {PACKAGES[module]} ({error}); "
            "install the extra: pip install 'blocksim[bench]'"
        ) from None


def require_all() -> None:
    """Raise MissingPackageError before anything is measured."""
    for module in PACKAGES:
        loaded(module)
