"""Trouble with the folder of compiled kernels has its name."""

import errno

import pytest

from blocksim.errors import OutputError
from blocksim.simulation import compilation


def test_full_disk_of_the_kernel_cache_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(compilation, "build_scene", fail)
    monkeypatch.setattr("blocksim.simulation.compilation.jit.cache_folder", lambda: "/disk/blocksim/0123")
    compilation.compile_kernels.cache_clear()
    with pytest.raises(
        OutputError, match=r"^/disk/blocksim/0123: the compiled solver cannot be stored there: No space"
    ):
        compilation.compile_kernels()
