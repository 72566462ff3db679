"""The linear recurrence of the dashpots: what world/stable_step.py claims about it, and that the kernels follow it.

One mode of motion x of unit mass, p pairs that act on it with a spring of stiffness w^2 and a dashpot c = 2 z w each,
accelerated by a constant g. One step of length h from (x, u, f), f the force of one pair:

    u_half = u + h/2 a                          with a = g - p f
    x'     = x + h u_half
    free   = u_half + h/2 a + h/2 (f - w^2 x')  rate predicted with the old acceleration, the pair's own spring corrected
    d      = c (free - h/2 d)                   dashpot, implicit in the pair's own force
    f'     = w^2 x' + d
    u'     = u_half + h/2 (g - p f')
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from scipy.optimize import brentq

from blocksim.kernels.arrays import REACHED
from blocksim.world.restitution import damping_ratio

if TYPE_CHECKING:
    from blocksim.kernels.arrays import World
    from tests.conftest import PaperBlock, Simulation, Start


def recurrence(w: float, z: float, pairs: int, h: float) -> np.ndarray:
    """Return the matrix of one step on (x, u, f), without g."""
    c = 2.0 * z * w
    columns = []
    for x, u, f in np.eye(3):
        half = u - 0.5 * h * pairs * f
        moved = x + h * half
        free = half - 0.5 * h * pairs * f + 0.5 * h * (f - w * w * moved)
        force = w * w * moved + c * free / (1.0 + 0.5 * h * c)
        columns.append((moved, half - 0.5 * h * pairs * force, force))
    return np.array(columns).T


def spectral_radius(w: float, z: float, pairs: int, h: float) -> float:
    return float(np.abs(np.linalg.eigvals(recurrence(w, z, pairs, h))).max())


def first_unstable(z: float, pairs: int) -> float:
    """Return the smallest w h with a root of modulus one."""
    steps = np.linspace(1e-3, 2.5, 5000)
    above = next(i for i, h in enumerate(steps) if spectral_radius(1.0, z, pairs, h) > 1.0 + 1e-9)
    return float(
        brentq(lambda h: spectral_radius(1.0, z, pairs, h) - 1.0 - 1e-9, steps[above - 1], steps[above], xtol=1e-9)
    )


@pytest.mark.parametrize("z", [0.0, 0.1, 0.7, 1.0, 2.0, 5.3, 20.0])
def test_a_pair_alone_is_stable_up_to_the_undamped_limit(z: float) -> None:
    assert all(spectral_radius(1.0, z, 1, h) <= 1.0 + 1e-9 for h in np.linspace(0.001, 1.999, 400))


@pytest.mark.parametrize("z", [1.0, 1.5, 3.0, 5.3, 20.0])
@pytest.mark.parametrize("pairs", [2, 3, 4, 6])
def test_several_pairs_become_unstable_at_the_documented_product(z: float, pairs: int) -> None:
    assert z * first_unstable(z, pairs) == pytest.approx(1.0 / (2.0 * (pairs - 1)), rel=1e-3)


@pytest.mark.parametrize("z", [0.0, 0.1, 0.5, 1.0, 1.9, 2.1, 5.3, 50.0])
def test_default_step_is_stable_with_two_pairs_and_for_a_brick_in_a_bond(z: float) -> None:
    shortening = max(1.0, 0.5 * z)
    h = 0.05 * 2.0 / shortening  # as stable_step does, for w = 1
    assert z * h <= 0.2 + 1e-12
    assert spectral_radius(1.0, z, 1, h) <= 1.0 + 1e-12
    assert spectral_radius(1.0, z, 2, h) <= 1.0 + 1e-12
    assert spectral_radius(0.5, z, 4, h) <= 1.0 + 1e-12


def squeezed(start: Start, block: PaperBlock, e: float, product: float | None) -> tuple[Simulation, float]:
    """Put a block between the ground and a fixed lid; return it and the frequency of one of the two pairs."""
    squeeze, offset = 1e-6, 1e-8
    w = float(np.sqrt(2.0 * block.point_stiffness / block.mass))

    def press(world: World) -> None:
        world.bodies[0].y += offset - squeeze
        world.bodies[1].y -= 2.0 * squeeze

    lid = {"y": 1.5 * block.height, "width": 0.05, "fixed": True}
    time = {} if product is None else {"step": product / (damping_ratio(e) * w), "force_step": True}
    scene = start([{"y": 0.5 * block.height}, lid], restitution=e, gravity=0.0, time=time, change=press)
    return scene, w


@pytest.mark.parametrize("e", [0.0, 0.1, 0.5])
def test_two_pairs_move_a_block_as_the_recurrence_says(start: Start, paper_block: PaperBlock, e: float) -> None:
    scene, w = squeezed(start, paper_block, e, None)
    middle = 0.5 * paper_block.height - 1e-6
    matrix = recurrence(w, damping_ratio(e), 2, scene.step)
    # the first evaluation has a step of no length: full dashpots at the speed zero
    state = np.array([1e-8, 0.0, w * w * 1e-8])
    for _ in range(300):
        assert scene.bodies[0].y - middle == pytest.approx(state[0], abs=1e-13)
        assert scene.bodies[0].vy == pytest.approx(state[1], abs=1e-13 * w)
        state = matrix @ state
        scene.to_step(scene.steps + 1)


def test_block_between_two_others_is_stable_up_to_the_documented_product_only(
    start: Start, paper_block: PaperBlock
) -> None:
    speeds = {}
    for product in (0.45, 0.55):
        scene, w = squeezed(start, paper_block, 0.0, product)
        assert scene.to_step(400).status == REACHED
        speeds[product] = abs(float(scene.bodies[0].vy)) / (w * 1e-8)
    assert speeds[0.45] < 1e-3
    assert speeds[0.55] > 10.0
