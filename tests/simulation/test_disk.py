"""A run that has no room on the disk is refused before it writes anything; both sizes are reported."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING

import pytest

from blocksim.errors import OutputError
from blocksim.simulation import simulate_into
from blocksim.simulation.disk import bytes_needed
from blocksim.simulation.schemes import build_scene
from tests.simulation.sliding import sliding

if TYPE_CHECKING:
    from pathlib import Path


def test_estimate_is_no_less_than_what_a_run_leaves(tmp_path: Path) -> None:
    scenario = sliding({}, end=0.05, every=1e-5)
    simulate_into(scenario, tmp_path / "run")
    needed = bytes_needed(scenario, build_scene(scenario))
    assert 0.5 * needed < (tmp_path / "run" / "run.h5").stat().st_size < 1.3 * needed


def test_too_small_a_disk_is_reported_with_both_sizes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Path] = []

    def usage(place: Path) -> SimpleNamespace:
        asked.append(place)
        return SimpleNamespace(free=1_000_000)

    monkeypatch.setattr("shutil.disk_usage", usage)
    scenario = sliding({}, end=0.05, every=1e-7)
    with pytest.raises(OutputError, match=r"the results may take 1\.84 MB and 1 MB are free on that disk"):
        simulate_into(scenario, tmp_path / "not" / "yet")
    assert asked == [tmp_path]
    assert list(tmp_path.iterdir()) == []
