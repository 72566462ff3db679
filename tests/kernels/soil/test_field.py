"""Lists, gradients and forces of particles, against sums over all pairs and against one another."""

from typing import Any

import numpy as np
import pytest

from blocksim.kernels.common.arrays import TEAM_SIZE
from blocksim.kernels.soil.arrays import NEIGHBOURS, Soils
from blocksim.kernels.soil.gradient import correction, raw_gradient
from blocksim.kernels.soil.momentum import forces_on
from blocksim.kernels.soil.step import renew_lists, stress_group
from blocksim.simulation.schemes import build_scene
from tests.soils import column, scene

SPACING = 0.005


@pytest.fixture
def soils() -> Soils:
    """Return two soils of 96 particles in disorder, with velocities and stresses at random, and their lists."""
    clay = {**column(0.04, 0.03, SPACING, material="clay"), "name": "upper", "y": [0.03, 0.06]}
    built: Any = build_scene(scene(column(0.04, 0.03, SPACING), clay))
    found: Soils = built.systems[0]
    built.world.team[TEAM_SIZE] = 1
    random = np.random.default_rng(5)
    for name, size in (("x", 1e-3), ("y", 1e-3), ("vx", 1.0), ("vy", 1.0)):
        found.points[name] += size * random.uniform(-1.0, 1.0, found.points.size)
    for name in ("sxx", "syy", "szz", "sxy"):
        found.states[name] = -1e3 * random.uniform(0.9, 1.0, found.points.size)
    found.states["sxy"] *= 0.1
    found.points.y[7] += 0.5  # one that is alone
    renew_lists(found, built.world, 0)
    return found


def distances(soils: Soils) -> Any:
    x, y = soils.points["x"], soils.points["y"]
    return np.hypot(x[:, None] - x, y[:, None] - y)


def test_lists_hold_all_neighbours_within_the_skin_and_each_once(soils: Soils) -> None:
    reach = soils.controls.reach[0] + soils.controls.skin[0]
    near = distances(soils) < reach
    for i, row in enumerate(near):
        listed = soils.lists[i, : soils.lengths[i]].tolist()
        assert sorted(listed) == [j for j in np.flatnonzero(row).tolist() if j != i]


def test_sorting_keeps_every_particle_whole(soils: Soils) -> None:
    assert sorted(soils.states["number"].tolist()) == list(range(soils.points.size))
    (alone,) = np.flatnonzero(soils.states["number"] == 7)
    assert soils.points.y[alone] > 0.5
    assert soils.lengths[alone] == 0
    assert set(soils.states["kind"][soils.states["number"] < 48].tolist()) == {0}


def test_a_list_without_room_is_noticed(soils: Soils) -> None:
    soils.points["x"], soils.points["y"] = 0.0, np.linspace(0.0, SPACING, soils.points.size)
    built: Any = build_scene(scene(column(0.04, 0.03, SPACING)))
    built.world.team[TEAM_SIZE] = 1
    renew_lists(soils, built.world, 0)
    assert soils.points.size > NEIGHBOURS
    assert soils.controls.is_full[0] == 1


def gradients(soils: Soils) -> Any:
    """Return the velocity gradients (n, 2, 2) and the corrections (n, 2, 2) of all particles."""
    n = soils.points.size
    raw = np.array([raw_gradient(soils, i) for i in range(n)]).reshape(n, 2, 2)
    corrected = soils.kinds["is_corrected"][soils.states["kind"]] == 1
    xx, xy, yy = np.array([correction(soils, i) if corrected[i] else (1.0, 0.0, 1.0) for i in range(n)]).T
    return raw, np.stack([np.stack([xx, xy], 1), np.stack([xy, yy], 1)], 1)


def test_a_corrected_gradient_is_exact_for_linear_fields_at_surfaces_too(soils: Soils) -> None:
    soils.points["vx"] = 3.0 * soils.points["x"] - 2.0 * soils.points["y"]
    soils.points["vy"] = 0.5 * soils.points["x"] + 4.0 * soils.points["y"]
    raw, by = gradients(soils)
    upper = (soils.kinds["is_corrected"][soils.states["kind"]] == 1) & (soils.lengths > 0)
    found = (raw @ by)[upper]
    np.testing.assert_allclose(found, np.broadcast_to([[3.0, -2.0], [0.5, 4.0]], found.shape), rtol=1e-9)


def test_forces_are_the_adjoint_of_the_gradient_and_give_no_momentum(soils: Soils) -> None:
    for g in range(soils.tallies.size):
        stress_group(soils, g, 0.0)  # no strain; what neighbours feel is made
    raw, by = gradients(soils)
    state = soils.states
    stress = np.stack([np.stack([state["sxx"], state["sxy"]], 1), np.stack([state["sxy"], state["syy"]], 1)], 1)
    found = np.array([forces_on(soils, i) for i in range(soils.points.size)])
    velocity = np.stack([soils.points["vx"], soils.points["vy"]], 1)
    volume = soils.kinds["volume"][state["kind"]]
    power = np.einsum("n,nab,nab->", volume, stress, raw @ by)
    assert np.sum(found[:, :2] * velocity) == pytest.approx(-power, rel=1e-12)
    for forces in (found[:, :2], found[:, 2:]):
        assert np.abs(forces.sum(axis=0)).max() < 1e-13 * np.abs(forces).sum()
    assert np.sum(found[:, 2:] * velocity) < 0.0  # viscosity takes energy
