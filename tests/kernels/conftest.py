"""What a run without the compiler (NUMBA_DISABLE_JIT=1) leaves out.

Interpreted kernels take a thousand times longer. Tests then have fewer random examples, and one that steps a scene
farther than an interpreter does in seconds is skipped: shorter ones see the same code.
"""

import pytest
from hypothesis import settings

from blocksim.kernels.common.jit import config
from blocksim.simulation.schemes import Scene, Team

IS_INTERPRETED = bool(config.DISABLE_JIT)
BODY_STEPS = 1000  # a test, times bodies: a second or two of an interpreter
PARTICLES_COST = 15  # a step with boundary particles, in steps of the surface model

if IS_INTERPRETED:
    settings.register_profile("interpreted", settings.get_profile("ci"), max_examples=3)
    settings.load_profile("interpreted")


@pytest.fixture
def compiler() -> None:
    """Skip a test that is about compiled code."""
    if IS_INTERPRETED:
        pytest.skip("is about compiled kernels")


@pytest.fixture(scope="session")
def pace() -> int:
    """Return by what a test divides the length of what it steps by itself: one with the compiler."""
    return 10 if IS_INTERPRETED else 1


@pytest.fixture(autouse=True)
def patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the compiler, skip a test that asks for more steps than it is given."""
    if not IS_INTERPRETED:
        return
    spent, advance = [0], Team.advance

    def advance_scene(team: Team, scene: Scene, last_step: int) -> tuple[Scene, int]:
        world = scene.world
        cost = 1 if world.particles is None else PARTICLES_COST
        spent[0] += (last_step - int(world.clock[0].steps)) * (world.bodies.size - 1) * cost
        if spent[0] > BODY_STEPS:
            pytest.skip("steps a scene too far for an interpreter")
        return advance(team, scene, last_step)

    monkeypatch.setattr(Team, "advance", advance_scene)
