"""Short sweeps and runs, and a study of each kind, of which all tests ask their questions."""

from pathlib import Path

import pytest

from blocksim.scenario import Document, Scenario
from blocksim.study.fragility import FragilityAnswer, fragility
from blocksim.study.limit import limit
from blocksim.study.limit_answer import LimitAnswer
from tests.study.plans import SCATTER, SLIDES, SLOPE, SQUAT, TILTED, TILTS, block_on_a_slope

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


@pytest.fixture(scope="session")
def whole(tmp_path_factory: pytest.TempPathFactory) -> FragilityAnswer:
    """Give a fragility study of a block on a slope that was run in one go; its folder is not to be changed."""
    out = tmp_path_factory.mktemp("fragility") / "study"
    return fragility(SLOPE, TILTS, SCATTER, members=8, fails=SLIDES, jobs=1, out=out)


@pytest.fixture(scope="session")
def slid(tmp_path_factory: pytest.TempPathFactory) -> LimitAnswer:
    """Give the limit of the tilt of a squat block to 2 %, with its runs; its folder is not to be changed."""
    return limit(block_on_a_slope(SQUAT), TILTED, tolerance=0.02, out=tmp_path_factory.mktemp("limit") / "study")
