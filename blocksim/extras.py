"""Packages of the extras, imported when something needs them."""

from importlib import import_module
from typing import Any

from blocksim.errors import UnavailableError

STUDY, CLUSTER = "study", "cluster"


def loaded(module: str, purpose: str, extra: str = STUDY) -> Any:
    """Return a module; `purpose` says in the message what needs it. Raises UnavailableError."""
    try:
        return import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        message = f"{purpose} needs the package {package} ({error}); install the extra: pip install 'blocksim[{extra}]'"
        raise UnavailableError(message) from None
