"""What is shown of soils: forces on bodies, where they end, their surface, smoothed pressure."""

import numpy as np
import pytest
from numpy.typing import NDArray

from blocksim.world.systems.soils import SOILS, body_contacts, connected_span, final_table, pressure, surface
from blocksim.world.systems.system import SystemInScene, Track
from tests.soils import LEFT, Soil, column, right, scene

SPACING = 0.005
SCENE = scene(column(0.05, 0.05, SPACING), walls=[LEFT])


def still(**changed: NDArray[np.float64]) -> Track:
    """Return the track of a column that rests for two frames, some quantities of which are changed in the last."""
    present = SystemInScene(SOILS, SOILS.elements(SCENE))
    values = np.stack([present.elements.start, present.elements.start])
    track = Track(present, values)
    for name, new in changed.items():
        track[name][1] = new
    return track


def test_contacts_with_bodies_add_up_to_the_forces_on_them() -> None:
    soil = Soil(SCENE)
    soil.to_time(0.02)
    found = body_contacts(soil.soils, soil.world)
    ground = soil.world.bodies.size - 1
    for body in (1, ground):
        own = found.body == body
        nx, ny = found.normal[own].T
        push, rub = found.normal_force[own], found.shear_force[own]
        force = [(push * nx - rub * ny).sum(), (push * ny + rub * nx).sum()]
        assert force == pytest.approx(soil.force_on(body), rel=1e-9)
        assert abs(soil.force_on(body)).max() > 0.3
    assert found.place[found.body == 1, 0] == pytest.approx(0.0, abs=1e-12)  # on the face of the wall
    assert found.place[found.body == ground, 1] == pytest.approx(0.0, abs=1e-12)
    assert set(found.part.tolist()) == {0}


def test_the_front_ends_at_the_first_gap_and_the_last_particle_is_told_beside_it() -> None:
    x = np.array([0.0, 0.01, 0.02, 0.03, 0.045, 0.2, -0.3])
    assert connected_span(x, 0.02) == (0.0, 0.045)
    track = still()
    places = track["x"][0].copy()
    places[places > 0.045] += 0.03  # the last column has left
    moved = final_table(SCENE, still(x=places, vx=np.where(places > 0.045, 1.0, 0.0)))
    assert moved["soil"] == ["column"]
    assert [moved[name][0] for name in ("left_mm", "right_mm", "first_mm", "last_mm")] == pytest.approx([0, 45, 0, 80])
    assert (moved["back"], moved["at_rest"]) == (["left"], [0.9])
    assert moved["back_height_mm"] == pytest.approx([50.0])


def test_the_back_of_a_soil_is_the_same_however_little_its_ends_have_moved() -> None:
    apart = 1e-6 * np.sign(still()["x"][0] - 0.025)  # m
    places = still()["x"][0]
    end = right(0.05)
    for walls, back in (([LEFT], "left"), ([end], "right"), ([LEFT, end], "left"), ([], "left")):
        walled = scene(column(0.05, 0.05, SPACING), walls=walls)
        for one_end in (0.0 * apart, np.maximum(apart, 0.0), np.minimum(apart, 0.0)):
            assert final_table(walled, still(x=places + one_end))["back"] == [back]


def test_the_surface_is_the_top_of_columns_and_gaps_interrupt_it() -> None:
    (whole,) = surface(still(), 0)
    assert whole[:, 1] == pytest.approx(0.05)
    track = still()
    track["x"][1][track["x"][0] > 0.03] += 0.1
    one, other = surface(track, 1)
    assert (one[-1, 0], other[0, 0]) == pytest.approx((0.025, 0.135))


def test_smoothed_pressure_of_a_constant_is_that_and_of_a_checkerboard_is_flat() -> None:
    flat = {name: np.full(100, -300.0) for name in ("sxx", "syy", "szz")}
    assert pressure(still(**flat))[1] == pytest.approx(300.0)
    track = still()
    column_of, row_of = ((track[name][0] / SPACING).astype(int) for name in ("x", "y"))
    signs = 1 - 2 * ((column_of + row_of) % 2)
    rough = pressure(still(**{name: values * (1.0 + signs) for name, values in flat.items()}))[1]
    assert np.abs(rough - 300.0).max() < 0.35 * 300.0
    assert np.abs(rough - 300.0).mean() < 0.1 * 300.0
