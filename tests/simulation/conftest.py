"""Short runs for the tests of what a run leaves behind."""

import shutil
from pathlib import Path
from typing import Protocol

import pytest

from blocksim.scenario import Scenario, load_scenario
from blocksim.simulation import Result, simulate_into

SCENARIOS = Path(__file__).parents[2] / "scenarios"


class Shipped(Protocol):
    """Load a scenario that ships, softer and so faster, with other values for some keys."""

    def __call__(self, name: str = "three_blocks_nominal", **values: object) -> Scenario:
        """Double underscores in names stand for dots."""


@pytest.fixture(scope="session")
def soft() -> Shipped:
    """Load a scenario that ships, at a thousandth of the stiffness."""

    def load(name: str = "three_blocks_nominal", **values: object) -> Scenario:
        overrides = {key.replace("__", "."): value for key, value in values.items()}
        return load_scenario(SCENARIOS / f"{name}.toml", {"contact.stiffness_scale": 0.001, **overrides})

    return load


@pytest.fixture(scope="session")
def kept(soft: Shipped, tmp_path_factory: pytest.TempPathFactory) -> Result:
    """Give one finished run in its folder; not to be changed."""
    return simulate_into(soft(), tmp_path_factory.mktemp("kept") / "run")


@pytest.fixture(scope="session")
def folder(kept: Result) -> Path:
    """Give the folder of that run; not to be changed."""
    assert kept.folder is not None
    return kept.folder


@pytest.fixture
def copy(folder: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(folder, tmp_path / "run"))
