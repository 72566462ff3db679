"""Lists, gradients and forces of particles, against sums over all pairs and against one another."""

from typing import Any

import numpy as np
import pytest

from blocksim.kernels.common.arrays import TEAM_SIZE, Floats, Integers
from blocksim.kernels.common.jit import entry_kernel
from blocksim.kernels.common.simd import fields_0, split
from blocksim.kernels.soil.arrays import CLUSTER, GROUP, NEIGHBOURS, Soils
from blocksim.kernels.soil.neighbours import places_of
from blocksim.kernels.soil.step import correction, forces_on, raw_gradient, renew_lists, stress_group
from blocksim.simulation.schemes import build_scene
from tests.soils import column, scene

SPACING = 0.005


@pytest.fixture
def soils() -> Soils:
    """Return two soils of 54 and 63 particles in disorder, with velocities and stresses at random, and their lists."""
    clay = {**column(0.045, 0.03, SPACING, material="clay"), "name": "upper", "y": [0.03, 0.065]}
    built: Any = build_scene(scene(column(0.045, 0.03, SPACING), clay))
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


def lists_of(soils: Soils) -> list[Any]:
    """Return the list of every cluster."""
    found = []
    for c in range(-(-soils.points.size // CLUSTER)):
        g = CLUSTER * c // GROUP
        begin = int(soils.lengths[GROUP // CLUSTER * g : c].sum())
        found.append(soils.lists[g, begin : begin + int(soils.lengths[c])])
    return found


def test_lists_hold_all_that_are_near_to_any_particle_of_a_cluster_and_each_once(soils: Soils) -> None:
    assert soils.points.size % CLUSTER != 0  # the last cluster is not full
    near = distances(soils) < soils.controls.reach[0] + soils.controls.skin[0]
    for c, listed in enumerate(lists_of(soils)):
        wanted = near[CLUSTER * c : CLUSTER * (c + 1)].any(axis=0)
        assert sorted(listed.tolist()) == np.flatnonzero(wanted).tolist()


def test_a_list_without_room_is_noticed(soils: Soils) -> None:
    soils.points["x"], soils.points["y"] = 0.0, np.linspace(0.0, SPACING, soils.points.size)
    built: Any = build_scene(scene(column(0.04, 0.03, SPACING)))
    built.world.team[TEAM_SIZE] = 1
    renew_lists(soils, built.world, 0)
    assert soils.points.size > CLUSTER * NEIGHBOURS
    assert soils.controls.is_full[0] == 1


@entry_kernel
def write_gradients(soils: Soils, c: int, near: Integers, found: Floats) -> None:
    """Write the gradients, the corrections and the forces of the particles of a cluster."""
    places = places_of(soils, c)
    x, y, vx, vy = fields_0(None, soils.points, places)
    gradient = raw_gradient(soils.controls[0], soils.points, near, x, y, vx, vy, 0.0)
    by = correction(soils.controls[0], soils.points, near, x, y, vx, vy, 0.0)
    forces = forces_on(soils, near, places)
    for lane in range(CLUSTER):
        i = places[lane]
        for k in range(4):
            found[i, k] = split(gradient[k])[lane]
            found[i, 7 + k] = split(forces[k])[lane]
        for k in range(3):
            found[i, 4 + k] = split(by[k])[lane]


def fields(soils: Soils) -> Any:
    """Return velocity gradients (n, 2, 2), corrections (n, 2, 2) and forces (n, 4) of all particles."""
    n = soils.points.size
    found = np.empty((n, 11))
    for c, near in enumerate(lists_of(soils)):
        write_gradients(soils, c, near, found)
    corrected = soils.kinds["is_corrected"][soils.states["kind"]] == 1
    xx, xy, yy = np.where(corrected[:, None], found[:, 4:7], [1.0, 0.0, 1.0]).T
    by = np.stack([np.stack([xx, xy], 1), np.stack([xy, yy], 1)], 1)
    return found[:, :4].reshape(n, 2, 2), by, soils.kinds["volume"][soils.states["kind"]][:, None] * found[:, 7:]


def test_a_corrected_gradient_is_exact_for_linear_fields_at_surfaces_too(soils: Soils) -> None:
    soils.points["vx"] = 3.0 * soils.points["x"] - 2.0 * soils.points["y"]
    soils.points["vy"] = 0.5 * soils.points["x"] + 4.0 * soils.points["y"]
    raw, by, _ = fields(soils)
    upper = (soils.kinds["is_corrected"][soils.states["kind"]] == 1) & (soils.points["y"] < 0.5)
    found = (raw @ by)[upper]
    np.testing.assert_allclose(found, np.broadcast_to([[3.0, -2.0], [0.5, 4.0]], found.shape), rtol=1e-9)


def test_forces_are_the_adjoint_of_the_gradient_and_give_no_momentum(soils: Soils) -> None:
    for g in range(soils.tallies.size):
        stress_group(soils, g, 0.0)  # no strain; what neighbours feel is made
    raw, by, found = fields(soils)
    state = soils.states
    stress = np.stack([np.stack([state["sxx"], state["sxy"]], 1), np.stack([state["sxy"], state["syy"]], 1)], 1)
    velocity = np.stack([soils.points["vx"], soils.points["vy"]], 1)
    volume = soils.kinds["volume"][state["kind"]]
    power = np.einsum("n,nab,nab->", volume, stress, raw @ by)
    assert np.sum(found[:, :2] * velocity) == pytest.approx(-power, rel=1e-12)
    for forces in (found[:, :2], found[:, 2:]):
        assert np.abs(forces.sum(axis=0)).max() < 1e-13 * np.abs(forces).sum()
    assert np.sum(found[:, 2:] * velocity) < 0.0  # viscosity takes energy
