"""The linear recurrence of the dashpots: what world/step.py claims about it, and that the kernels follow it.

One mode of motion x of unit mass, p pairs that act on it with a spring of stiffness w^2 each, accelerated by a constant
g. The dashpots of a pair stand for a share 1/q of the mass, c = 2 z w/q^(1/2); where all pairs of a body act alike,
q = p. One step of length h from (x, u, f), f the force of one pair:

    u_half = u + h/2 a                          with a = g - p f
    x'     = x + h u_half
    free   = u_half + h/2 a + q h/2 (f - w^2 x')  rate predicted with the old acceleration and the new spring
    d      = c (free - q h/2 d)                 dashpot, implicit in the pair's own force
    f'     = w^2 x' + d
    u'     = u_half + h/2 (g - p f')
"""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING

import numpy as np
import pytest

from blocksim.kernels.common.arrays import REACHED
from blocksim.world.interactions import damping_ratio

if TYPE_CHECKING:
    from blocksim.kernels.common.arrays import World
    from tests.conftest import PaperBlock, Simulation, Start


SQUEEZE, OFFSET = 1e-4, 1e-8  # m: overlap of a block between two others, and its start off the middle
RATIOS = [0.0, 0.05, 0.2, 0.7, 1.0, 2.0, 5.3, 20.0]


def recurrence(w: float, z: float, acting: float, pairs: int, h: float, *, whole: bool = False) -> np.ndarray:
    """Return the matrix of one step on (x, u, f), without g.

    `whole`: as with particles, where dashpots stand for all of the mass and count their own force max(1, p/2) times.
    """
    c = 2.0 * z * w / (1.0 if whole else sqrt(pairs))
    own = max(1.0, 0.5 * pairs) if whole else pairs
    columns = []
    for x, u, f in np.eye(3):
        half = u - 0.5 * h * acting * f
        moved = x + h * half
        free = half - 0.5 * h * acting * f + 0.5 * own * h * (f - w * w * moved)
        force = w * w * moved + c * free / (1.0 + 0.5 * own * h * c)
        columns.append((moved, half - 0.5 * h * acting * force, force))
    return np.array(columns).T


def spectral_radius(z: float, acting: float, pairs: int, h: float, *, whole: bool = False) -> float:
    """Return that of the recurrence for w = 1."""
    return float(np.abs(np.linalg.eigvals(recurrence(1.0, z, acting, pairs, h, whole=whole))).max())


@pytest.mark.parametrize("z", RATIOS)
@pytest.mark.parametrize("pairs", [1, 2, 3, 4, 6])
def test_pairs_that_act_alike_are_stable_up_to_the_undamped_limit(z: float, pairs: int) -> None:
    limit = 2.0 / sqrt(pairs)
    assert all(spectral_radius(z, pairs, pairs, h) <= 1.0 + 1e-9 for h in limit * np.linspace(0.001, 0.999, 200))
    assert spectral_radius(0.0, pairs, pairs, 1.001 * limit) > 1.0 + 1e-3


@pytest.mark.parametrize("z", RATIOS)
@pytest.mark.parametrize("pairs", [2, 3, 4, 6, 20])
def test_pairs_that_act_apart_are_stable_up_to_the_bound(z: float, pairs: int) -> None:
    bound = sqrt(2.0 / pairs)
    for acting in (0.01, 0.1, 0.5, 1.0, 1.5):
        assert all(spectral_radius(z, acting, pairs, h) <= 1.0 + 1e-9 for h in bound * np.linspace(0.001, 1.0, 100))
    assert z == 0.0 or z > 1.0 or spectral_radius(z, 0.01, pairs, 1.1 * bound) > 1.0 + 1e-9


@pytest.mark.parametrize("z", [0.05, 0.7, 1.5, 5.3, 20.0])
@pytest.mark.parametrize("pairs", [2, 3, 4, 6])
def test_pairs_of_particles_become_unstable_where_the_root_flips_sign(z: float, pairs: int) -> None:
    """Put x' = -x, u' = -u, f' = -f into the recurrence: z h = (1 - p h^2/4)/(2 (p - q)), a quadratic in h."""
    change = 2.0 * (pairs - max(1.0, 0.5 * pairs)) * z
    limit = 2.0 * (sqrt(change**2 + pairs) - change) / pairs
    radii = (spectral_radius(z, pairs, pairs, limit * part, whole=True) for part in np.linspace(0.001, 1.0 - 1e-6, 100))
    assert all(radius <= 1.0 + 1e-9 for radius in radii)
    assert spectral_radius(z, pairs, pairs, limit * (1.0 + 1e-5), whole=True) > 1.0 + 1e-9


def squeezed(start: Start, block: PaperBlock, e: float, product: float | None) -> tuple[Simulation, float]:
    """Put a block between the ground and a fixed lid; return it and the frequency of one of the two pairs."""
    w = sqrt(2.0 * block.point_stiffness / block.mass)

    def press(world: World) -> None:
        world.bodies[0].y += OFFSET - SQUEEZE
        world.bodies[1].y -= 2.0 * SQUEEZE

    lid = {"y": 1.5 * block.height, "width": 0.05, "fixed": True}
    time = {} if product is None else {"step": product / (damping_ratio(e) * w), "force_step": True}
    bodies = [{"y": 0.5 * block.height}, lid]
    far = {"max_overlap": 0.5 * block.height}  # what is unstable swings far
    scene = start(bodies, restitution=e, gravity=0.0, time=time, contact=far, change=press)
    return scene, w


@pytest.mark.parametrize("e", [0.0, 0.1, 0.5])
def test_two_pairs_move_a_block_as_the_recurrence_says(start: Start, paper_block: PaperBlock, e: float) -> None:
    scene, w = squeezed(start, paper_block, e, None)
    middle = 0.5 * paper_block.height - SQUEEZE
    matrix = recurrence(w, damping_ratio(e), 2, 2, scene.step)
    state = np.array([OFFSET, 0.0, w * w * OFFSET])
    for _ in range(300):
        assert scene.bodies[0].y - middle == pytest.approx(state[0], abs=1e-16)
        assert scene.bodies[0].vy == pytest.approx(state[1], abs=1e-16 * w)
        state = matrix @ state
        scene.to_step(scene.steps + 1)


def test_block_between_two_others_is_stable_at_any_damping(start: Start, paper_block: PaperBlock) -> None:
    """With the dashpots of the whole block for each pair it was unstable from a product of 0.5 on."""
    scene, w = squeezed(start, paper_block, 0.0, 2.5)
    speeds = [abs(float(scene.to_step(step).bodies[0].vy)) / (w * OFFSET) for step in range(2000)]
    assert scene.status == REACHED
    assert max(speeds) < 1.0
    assert speeds[-1] < 1e-3
