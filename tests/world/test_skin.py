"""The skin of the list of neighbours: by default, as given, and never so small that a contact is missed."""

from math import hypot, sqrt
from typing import Any

import pytest

from blocksim.errors import ExitCode
from blocksim.kernels.common.arrays import REACHED
from blocksim.kernels.explicit.broad_phase import list_reach
from blocksim.scenario import Scenario
from blocksim.verification.scene import HEIGHT, WIDTH, Simulation, scenario_of
from blocksim.world.build import build_world
from blocksim.world.nonsmooth import build_nonsmooth
from blocksim.world.step import SkinTooSmallError

H = HEIGHT
FALL = 0.2  # m, from the highest point of a block to the ground
BODY = {"y": FALL - hypot(WIDTH, HEIGHT) / 2}
SOFT = 1e-4  # of the stiffness


def scenario(*more: dict[str, Any], contact: dict[str, Any] | None = None, **tables: Any) -> Scenario:
    return scenario_of([BODY, *more], contact={"stiffness_scale": SOFT, **(contact or {})}, **tables)


def test_by_default_the_skin_is_a_quarter_of_the_smallest_side_of_all_blocks() -> None:
    plate = {"width": 0.3, "height": 0.01, "x": 1.0, "y": 0.1, "fixed": True}
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
    assert controls.cell_width == 2.0 * controls.cell_radius + list_reach(controls) >= 2.0 * controls.cell_radius + 7e-3


def test_a_skin_that_blocks_can_outrun_is_refused_with_the_least_one() -> None:
    step = float(build_world(scenario()).controls[0].step)
    speed = sqrt(2 * 9.81 * FALL)
    least = 5.0 * speed * step  # as the automatic step leaves it: a block moves by a fifth of the skin
    assert build_world(scenario(contact={"skin": 1.001 * least})).controls[0].skin == 1.001 * least
    with pytest.raises(SkinTooSmallError) as refusal:
        build_world(scenario(contact={"skin": 0.999 * least}))
    assert refusal.value.exit_code == ExitCode.INVALID_INPUT
    assert refusal.value.least == pytest.approx(least, rel=1e-12)
    assert f"{speed:.4g} m/s each come {400 * least:.4g} mm closer in {step:.4g} s" in str(refusal.value)
    cure = float(str(refusal.value).split("at least ")[1].split()[0])
    assert build_world(scenario(contact={"skin": 1e-3 * cure})).controls[0].skin == 1e-3 * cure


def test_a_skin_that_a_shaken_support_outruns_is_refused_and_the_least_one_runs_to_the_end() -> None:
    motion = {"kind": "harmonic", "amplitude": "0.2 m", "frequency": "10 Hz", "duration": "0.5 s"}
    with pytest.raises(SkinTooSmallError) as refusal:
        build_world(scenario(contact={"skin": 1e-3 * H}, motion=motion))
    run = Simulation(build_world(scenario(contact={"skin": refusal.value.least}, motion=motion)))
    assert run.to_time(0.1).status == REACHED


@pytest.mark.parametrize("share", [0.999, 1.001])
def test_rigid_contacts_refuse_a_skin_with_which_impacts_are_found_late(share: float) -> None:
    time = {"scheme": "nonsmooth"}
    step = build_nonsmooth(scenario(time=time)).world.controls[0].step
    least = 2.0 * sqrt(2 * 9.81 * FALL) * step
    thin = scenario(contact={"skin": share * least}, time=time)
    if share < 1.0:
        with pytest.raises(SkinTooSmallError):
            build_nonsmooth(thin)
    else:
        assert build_nonsmooth(thin).contacts.stepping[0].least_reach == 0.5 * share * least
