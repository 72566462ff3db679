"""scipy, which only sampled sweeps need."""

from importlib import import_module
from typing import Any

from blocksim.errors import UnavailableError


def scipy_stats() -> Any:
    """Return the module scipy.stats; raises UnavailableError."""
    return _loaded("scipy.stats")


def scipy_qmc() -> Any:
    """Return the module scipy.stats.qmc; raises UnavailableError."""
    return _loaded("scipy.stats.qmc")


def _loaded(module: str) -> Any:
    try:
        return import_module(module)
    except ImportError as error:
        message = f"sampled sweeps need the package scipy ({error}); install the extra: pip install 'blocksim[study]'"
        raise UnavailableError(message) from None
