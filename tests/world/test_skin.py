"""The skin of the list of neighbours: by default, as given, and never so small that a contact is missed."""

from math import sqrt
from typing import Any

import pytest

from blocksim.errors import ExitCode
from blocksim.scenario import Scenario, scenario_from_mapping
from blocksim.world import build_world
from blocksim.world.skin import SkinTooSmallError

W, H, D = 0.032, 0.025, 0.05
FALL = 0.2  # m, from the highest point of a block to the ground
BODY = {"block": "brick", "x": 0.1, "y": FALL - sqrt(W**2 + H**2) / 2}
SOFT = 1e-4  # of the stiffness


def scenario(*more: dict[str, Any], contact: dict[str, Any] | None = None, **tables: Any) -> Scenario:
    sides = {"length": D, "material": "aluminium"}
    return scenario_from_mapping(
        {
            "schema": 1,
            "name": "skin",
            "materials": {"aluminium": {"unit_weight": 26.7e3, "young_modulus": 69e9, "poisson_ratio": 0.3}},
            "blocks": {"brick": {"width": W, "height": H, **sides}, "plate": {"width": 0.3, "height": 0.01, **sides}},
            "bodies": [BODY, *more],
            "contact": {"stiffness_scale": SOFT, **(contact or {})},
            **tables,
        }
    )


def test_by_default_the_skin_is_a_quarter_of_the_smallest_side_of_all_blocks() -> None:
    plate = {"block": "plate", "x": 1.0, "y": 0.1, "fixed": True}
    assert build_world(scenario()).controls[0].skin == 0.25 * H
    assert build_world(scenario(plate)).controls[0].skin == 0.25 * 0.01
    walls = [{"from": [2, 0], "to": [2, 0.001]}]
    assert build_world(scenario(walls=walls)).controls[0].skin == 0.25 * H  # boundaries are no blocks


@pytest.mark.parametrize("model", ["particles", "kernel"])
def test_with_particles_the_default_skin_is_a_twentieth_as_each_particle_within_it_costs(model: str) -> None:
    contact = {"model": model, "particle_spacing": 4e-3}
    assert build_world(scenario(contact=contact)).controls[0].skin == 0.05 * H


@pytest.mark.parametrize("model", ["surface", "particles", "kernel"])
def test_a_given_skin_is_used_as_it_is_and_cells_are_wider_by_it(model: str) -> None:
    contact = {"skin": "7 mm", "model": model, "particle_spacing": 4e-3}
    controls = build_world(scenario(contact=contact)).controls[0]
    assert controls.skin == 7e-3
    assert controls.cell_width == 2.0 * controls.cell_radius + 7e-3


def test_a_skin_that_two_blocks_can_cross_in_a_step_is_refused_with_the_least_one() -> None:
    step = float(build_world(scenario()).controls[0].step)
    speed = sqrt(2 * 9.81 * FALL)
    least = 2.0 * speed * step
    assert build_world(scenario(contact={"skin": 1.001 * least})).controls[0].skin == 1.001 * least
    with pytest.raises(SkinTooSmallError) as refusal:
        build_world(scenario(contact={"skin": 0.999 * least}))
    assert refusal.value.exit_code == ExitCode.INVALID_INPUT
    assert str(refusal.value) == (
        f"{999 * least:.4g} mm is too small for this time step: two blocks that meet at {speed:.4g} m/s each come "
        f"{1e3 * least:.4g} mm nearer in {step:.4g} s, and the contact would be missed"
    )


def test_a_small_skin_goes_with_a_small_step() -> None:
    step = float(build_world(scenario()).controls[0].step)
    thin = {"skin": 1e-4 * H}
    with pytest.raises(SkinTooSmallError):
        build_world(scenario(contact=thin))
    assert build_world(scenario(contact=thin, time={"step": 0.01 * step})).controls[0].skin == thin["skin"]
