"""Short sweeps and runs."""

from pathlib import Path

import pytest

from blocksim.scenario import Document, Scenario

SCENARIOS = Path(__file__).parents[2] / "scenarios"


@pytest.fixture(scope="session")
def nominal() -> Document:
    """Give the nominal scenario, at a thousandth of the stiffness: a run takes some hundredths of a second."""
    return Document.read(SCENARIOS / "three_blocks_nominal.toml").with_values({"contact.stiffness_scale": 0.001})


@pytest.fixture(scope="session")
def scenario(nominal: Document) -> Scenario:
    """Give the same, checked."""
    return nominal.build()


@pytest.fixture(scope="session")
def quick() -> Document:
    """Give rigid blocks that have hardly begun to fall: a case takes less than a millisecond."""
    return Document.read(SCENARIOS / "three_blocks_nonsmooth.toml").with_values({"time.end": 0.01})
