"""The package scipy of the extra `study`, imported when it is needed."""

from importlib import import_module
from typing import Any

from blocksim.errors import UnavailableError


def scipy_special() -> Any:
    """Return the module scipy.special. Raises UnavailableError where scipy is not installed."""
    try:
        return import_module("scipy.special")
    except ImportError as error:
        message = f"judging a sweep needs the package scipy ({error}); install the extra: pip install 'blocksim[study]'"
        raise UnavailableError(message) from None
