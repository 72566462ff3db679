"""The garbage collector is kept away while code is loaded, and comes back."""

import gc
from collections.abc import Iterator

import pytest

from blocksim.cli.app import pause_collector


@pytest.fixture(autouse=True)
def collector() -> Iterator[None]:
    """Leave the collector as it was, and its objects to it."""
    was_enabled = gc.isenabled()
    yield
    gc.unfreeze()
    (gc.enable if was_enabled else gc.disable)()


def failing_load() -> None:
    with pause_collector():
        assert not gc.isenabled()
        raise ImportError


@pytest.mark.parametrize("is_on", [True, False])
def test_collector_is_afterwards_as_it_was(*, is_on: bool) -> None:
    (gc.enable if is_on else gc.disable)()
    with pytest.raises(ImportError):
        failing_load()
    assert gc.isenabled() == is_on
