"""Scenes of a few blocks, started and stepped: what the tests of kernels, world and verification share.

Blocks are the paper's: 32 x 25 x 50 mm, the height upright, unless a test says otherwise. SI units.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Protocol

import pytest
from hypothesis.internal.conjecture import providers

from blocksim.kernels.common.arrays import World
from blocksim.scenario import Model, load_scenario
from blocksim.verification.scene import CaseScene, PaperBlock, SteppedScene
from blocksim.world.build import build_world
from tests import site

__all__ = ["PaperBlock", "SteppedScene"]  # defined elsewhere, used by all tests

pytest_plugins = ["tests.golden", "pytester"]  # texts kept in files; pytester for the tests of that

# Hypothesis takes constants for its examples from whatever modules a process has loaded by then: others for every order
# of the tests, and with them failures that nobody can repeat. There is no setting for it.
providers._get_local_constants = lambda: providers._local_constants

SCENARIOS = Path(__file__).parents[1] / "scenarios"
ROOM = SimpleNamespace(free=10**9)  # bytes


class Start(Protocol):
    """Start a scene of single bodies; the signature of the fixture `start`."""

    def __call__(
        self,
        bodies: Sequence[Mapping[str, object]],
        *,
        restitution: float = 0.2,
        friction: float = 0.31,
        ground_friction: float = 0.38,
        gravity: float = 9.81,
        tilt: float = 0.0,
        contact: Mapping[str, object] = ...,
        time: Mapping[str, object] = ...,
        change: Callable[[World], None] | None = None,
    ) -> SteppedScene:
        """`change` edits the world before it starts."""


@pytest.fixture(scope="session", autouse=True)
def same_disk() -> Iterator[None]:
    """Let runs find a gigabyte on every disk: a test that asks for more fails on all machines, not on small ones."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("blocksim.simulation.run.shutil", SimpleNamespace(disk_usage=lambda _: ROOM))
        yield


@pytest.fixture(scope="session")
def start() -> Start:
    """Start a scene of single bodies."""

    def start_scene(
        bodies: Sequence[Mapping[str, object]],
        *,
        change: Callable[[World], None] | None = None,
        **values: Any,
    ) -> SteppedScene:
        return CaseScene(bodies, **values).start(change)

    return start_scene


@pytest.fixture(scope="session")
def start_shipped() -> Callable[..., SteppedScene]:
    """Start a scenario file that ships, by its name, with other values for some keys."""

    def start_file(name: str, **values: object) -> SteppedScene:
        overrides = {key.replace("__", "."): value for key, value in values.items()}
        return SteppedScene(build_world(Model(load_scenario(SCENARIOS / f"{name}.toml", overrides))))

    return start_file


@pytest.fixture(scope="session")
def paper_block() -> PaperBlock:
    """Return the paper's block."""
    return PaperBlock()


@pytest.fixture(scope="session", params=sorted(SCENARIOS.glob("*.toml")), ids=lambda path: path.stem)
def shipped(request: pytest.FixtureRequest) -> Path:
    """Return every scenario file that ships, one a test."""
    path: Path = request.param
    return path


@pytest.fixture(scope="session")
def quick_site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a site without runs."""
    for needed in ("mkdocs", "material", "latex2mathml"):
        pytest.importorskip(needed)
    folder = tmp_path_factory.mktemp("site") / "site"
    site.build(folder, quick=True)
    return folder
