"""The linear recurrence of the dashpots: what world/stable_step.py claims about it, and that the kernels follow it.

One mode of motion x of unit mass, p pairs that act on it with a spring of stiffness w^2 and a dashpot c = 2 z w each,
accelerated by a constant g. One step of length h from (x, u, f), f the force of one pair:

    u_half = u + h/2 a                          with a = g - p f
    x'     = x + h u_half
    free   = u_half + h/2 a + q h/2 (f - w^2 x')  rate predicted with the old acceleration and the new spring
    d      = c (free - q h/2 d)                 dashpot, implicit in the pair's own force, q = max(1, p/2)
    f'     = w^2 x' + d
    u'     = u_half + h/2 (g - p f')
"""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING

import numpy as np
import pytest

from blocksim.kernels.arrays import REACHED
from blocksim.world.restitution import damping_ratio

if TYPE_CHECKING:
    from blocksim.kernels.arrays import World
    from tests.conftest import PaperBlock, Simulation, Start


SQUEEZE, OFFSET = 1e-4, 1e-8  # m: overlap of a block between two others, and its start off the middle


def recurrence(w: float, z: float, pairs: int, h: float) -> np.ndarray:
    """Return the matrix of one step on (x, u, f), without g."""
    c = 2.0 * z * w
    own = max(1.0, 0.5 * pairs)
    columns = []
    for x, u, f in np.eye(3):
        half = u - 0.5 * h * pairs * f
        moved = x + h * half
        free = half - 0.5 * h * pairs * f + 0.5 * own * h * (f - w * w * moved)
        force = w * w * moved + c * free / (1.0 + 0.5 * own * h * c)
        columns.append((moved, half - 0.5 * h * pairs * force, force))
    return np.array(columns).T


def spectral_radius(w: float, z: float, pairs: int, h: float) -> float:
    return float(np.abs(np.linalg.eigvals(recurrence(w, z, pairs, h))).max())


def flip_limit(z: float, pairs: int) -> float:
    """Return the h at which the root is -1, for w = 1: z h = (1 - p h^2/4)/(2 (p - q)).

    Put x' = -x, u' = -u, f' = -f into the recurrence: u = 0, x = p h^2 f/4, and what remains is a quadratic in h.
    Without damping that is p h^2 = 4, with strong damping z h = 1/(2 (p - q)).
    """
    sign_change = 2.0 * (pairs - max(1.0, 0.5 * pairs)) * z
    return 2.0 * (sqrt(sign_change**2 + pairs) - sign_change) / pairs


@pytest.mark.parametrize("z", [0.0, 0.1, 0.7, 1.0, 2.0, 5.3, 20.0])
def test_a_pair_alone_is_stable_up_to_the_undamped_limit(z: float) -> None:
    assert all(spectral_radius(1.0, z, 1, h) <= 1.0 + 1e-9 for h in np.linspace(0.001, 1.999, 400))


@pytest.mark.parametrize("z", [0.05, 0.2, 0.7, 1.0, 1.5, 3.0, 5.3, 20.0])
@pytest.mark.parametrize("pairs", [2, 3, 4, 6])
def test_several_pairs_become_unstable_where_the_root_flips_sign(z: float, pairs: int) -> None:
    limit = flip_limit(z, pairs)
    assert all(spectral_radius(1.0, z, pairs, h) <= 1.0 + 1e-9 for h in limit * np.linspace(0.001, 1.0 - 1e-6, 200))
    assert spectral_radius(1.0, z, pairs, limit * (1.0 + 1e-5)) > 1.0 + 1e-9


@pytest.mark.parametrize(("pairs", "product"), [(2, 1 / 2), (3, 1 / 3), (4, 1 / 4), (6, 1 / 6)])
def test_strong_damping_leaves_a_product_of_one_over_the_pairs(pairs: int, product: float) -> None:
    assert 5.3 * flip_limit(5.3, pairs) == pytest.approx(product, rel=2e-2)
    assert all(z * flip_limit(z, pairs) < product for z in (0.1, 1.0, 2.0, 5.3))


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
    matrix = recurrence(w, damping_ratio(e), 2, scene.step)
    state = np.array([OFFSET, 0.0, w * w * OFFSET])
    for _ in range(300):
        assert scene.bodies[0].y - middle == pytest.approx(state[0], abs=1e-16)
        assert scene.bodies[0].vy == pytest.approx(state[1], abs=1e-16 * w)
        state = matrix @ state
        scene.to_step(scene.steps + 1)


def test_block_between_two_others_is_stable_up_to_that_product_only(start: Start, paper_block: PaperBlock) -> None:
    swings = {}
    for product in (0.4, 0.55):
        scene, w = squeezed(start, paper_block, 0.0, product)
        speeds = [abs(float(scene.to_step(step).bodies[0].vy)) / (w * OFFSET) for step in range(2000)]
        assert scene.status == REACHED
        swings[product] = (max(speeds), speeds[-1])
    assert swings[0.4][0] < 1.0
    assert swings[0.4][1] < 1e-3
    assert swings[0.55][0] > 10.0
