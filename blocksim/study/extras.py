"""Packages of the extra `study`, loaded when something needs them."""

from importlib import import_module
from typing import Any

from blocksim.errors import UnavailableError

EXTRA = "study"


def loaded(module: str, purpose: str) -> Any:
    """Return a module; `purpose` says in the message what needs it. Raises UnavailableError."""
    try:
        return import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        message = f"{purpose} needs the package {package} ({error}); install the extra: pip install 'blocksim[{EXTRA}]'"
        raise UnavailableError(message) from None
