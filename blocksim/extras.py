"""Packages of the extras, imported when something needs them."""

from importlib import import_module
from typing import Any

from blocksim.errors import UnavailableError

STUDY, CLUSTER, BENCH = "study", "cluster", "bench"


def loaded(module: str, purpose: str, extra: str = STUDY, package: str = "") -> Any:
    """Return a module; the message says what needs it, and its `package` if that has another name.

    Raises UnavailableError.
    """
    try:
        return import_module(module)
    except ImportError as error:
        name = package or module.partition(".")[0]
        message = f"{purpose} needs the package {name} ({error}); install the extra: pip install 'blocksim[{extra}]'"
        raise UnavailableError(message) from None
