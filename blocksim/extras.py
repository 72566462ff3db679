"""Packages of the extras, imported when something needs them."""

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from blocksim.errors import UnavailableError

STUDY, CLUSTER = "study", "cluster"


def load_module(module: str, purpose: str, extra: str = STUDY) -> Any:
    """Return a module; the message says what needs it.

    Raises UnavailableError.
    """
    try:
        with _without_settings():
            return import_module(module)
    except ImportError as error:
        name = module.partition(".")[0]
        message = f"{purpose} needs the package {name} ({error}); install the extra: pip install 'blocksim[{extra}]'"
        raise UnavailableError(message) from None


@contextmanager
def _without_settings() -> Iterator[None]:
    """Keep packages from reading settings while they are imported.

    ezdxf looks for some in the current folder, which may be a stranger's.
    """
    from configparser import ConfigParser  # noqa: PLC0415 - few commands need a package of an extra

    settings: Any = ConfigParser
    settings.read = lambda *_, **__: []  # in place of what it inherits
    try:
        yield
    finally:
        del settings.read
