"""What holds for every contact model and law: momentum, energy, mirror images, restitution."""

from __future__ import annotations

from math import cos, sin
from typing import TYPE_CHECKING, Any, get_args

import numpy as np
import pytest

from blocksim.kernels.explicit.models import MODEL_CODES
from blocksim.scenario.laws import LAWS
from blocksim.scenario.models.contact import Contact

if TYPE_CHECKING:
    from tests.conftest import PaperBlock, Simulation, Start

SPACING = 2e-3
STEPS = 600
# near corners the stiffness of the kernel model's contacts follows the pose, which does no work and creates or destroys
# some energy; the other two have potentials
CONSERVATIVE = ("surface", "particles")
BOTH = pytest.mark.parametrize("law", LAWS)
ALL_MODELS = pytest.mark.parametrize("model", MODEL_CODES)


def test_every_model_a_scenario_may_name_has_a_code() -> None:
    model: Any = Contact.model_fields["model"].annotation
    assert set(get_args(model)) == set(MODEL_CODES)
    assert len(set(MODEL_CODES.values())) == len(MODEL_CODES)


def contact_of(model: str, law: str, scale: float = 1e-3) -> dict[str, object]:
    return {"model": model, "law": law, "particle_spacing": SPACING, "stiffness_scale": scale, "max_overlap": 5e-3}


COLLIDING = [
    {"x": 0.0, "y": 0.2, "velocity": [0.6, 0.1], "spin": 6.0},
    {"x": 0.0335, "y": 0.212, "velocity": [-0.8, 0.0], "angle": 0.1, "spin": -9.0, "width": 0.03},
    {"x": -0.002, "y": 0.228, "velocity": [0.0, -0.5], "angle": -0.03},
]


def momenta(scene: Simulation) -> np.ndarray:
    """Return momentum along x and y and the angular momentum about the origin."""
    b = scene.bodies
    spin = b.inertia * b.spin + b.mass * (b.x * b.vy - b.y * b.vx)
    return np.array([(b.mass * b.vx).sum(), (b.mass * b.vy).sum(), spin.sum()])


@ALL_MODELS
@BOTH
@pytest.mark.parametrize("e", [0.1, 1.0])
def test_free_collision_keeps_momenta_and_tallies_all_energy(start: Start, model: str, law: str, e: float) -> None:
    scene = start(COLLIDING, restitution=e, gravity=0.0, contact=contact_of(model, law))
    before, energy = momenta(scene), scene.kinetic
    scene.to_step(STEPS)
    assert scene.world.ledger[0].friction > 0.0
    size = np.array([1.0, 1.0, 0.2]) * float(scene.bodies.mass.sum())  # arms of 0.2 m, speeds of 1 m/s
    assert np.all(np.abs(momenta(scene) - before) < STEPS * np.finfo(float).eps * size)
    assert scene.kinetic < energy
    if model in CONSERVATIVE:
        assert scene.residual() < 1e-3


def mirrored(bodies: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the bodies as a mirror along x = 0 shows them."""
    return [
        {
            **body,
            "x": -body["x"],
            "angle": -body.get("angle", 0.0),
            "spin": -body.get("spin", 0.0),
            "velocity": [-body["velocity"][0], body["velocity"][1]],
        }
        for body in bodies
    ]


@ALL_MODELS
@BOTH
def test_mirrored_scene_moves_as_the_mirror_shows(start: Start, model: str, law: str) -> None:
    lowered = [{**body, "y": body["y"] - 0.18} for body in COLLIDING]  # type: ignore[operator]
    one, other = (start(bodies, contact=contact_of(model, law)) for bodies in (lowered, mirrored(lowered)))
    signs = np.array([-1.0, 1.0, -1.0, -1.0, 1.0, -1.0])
    for step in (100, 300, STEPS):
        assert other.to_step(step).state() * signs == pytest.approx(one.to_step(step).state(), abs=1e-9), step
    assert one.world.ledger[0].friction > 0.0


@ALL_MODELS
@BOTH
@pytest.mark.parametrize("e", [0.0, 0.3, 0.7, 1.0])
def test_flat_landing_rebounds_as_asked(start: Start, paper_block: PaperBlock, model: str, law: str, e: float) -> None:
    for speed in (0.05, 2.0):
        lying = {"x": 1e-3, "y": paper_block.height / 2 + 1e-8, "velocity": [0.0, -speed]}
        scene = start([lying], restitution=e, gravity=0.0, ground_friction=0.0, contact=contact_of(model, law, 1.0))
        while (scene.contacts or scene.bodies[0].vy < 0.0) and scene.steps < STEPS:
            scene.to_step(scene.steps + 1)
        assert scene.bodies[0].vy == pytest.approx(e * speed, abs=0.01 * speed)


@pytest.mark.usefixtures("compiler")
@pytest.mark.parametrize("spacing", [0.5e-3, 1e-3, 2e-3, 4e-3])
@BOTH
def test_rebound_does_not_depend_on_the_spacing_of_the_kernel_model(
    start: Start, paper_block: PaperBlock, law: str, spacing: float
) -> None:
    contact = {**contact_of("kernel", law, 1.0), "particle_spacing": spacing}
    lying = {"y": paper_block.height / 2 + 1e-8, "velocity": [0.0, -1.0]}
    scene = start([lying], restitution=0.4, gravity=0.0, ground_friction=0.0, contact=contact)
    while (scene.contacts or scene.bodies[0].vy < 0.0) and scene.steps < STEPS:
        scene.to_step(scene.steps + 1)
    assert scene.contacts == 0
    assert scene.bodies[0].vy == pytest.approx(0.4, abs=0.01)


@ALL_MODELS
@BOTH
def test_no_friction_force_leaves_the_cone(start: Start, model: str, law: str) -> None:
    friction = 0.25
    lowered = [{**body, "y": body["y"] - 0.18} for body in COLLIDING]  # type: ignore[operator]
    scene = start(lowered, friction=friction, ground_friction=friction, contact=contact_of(model, law))
    greatest = 0.0
    for _ in range(STEPS):
        touching = scene.to_step(scene.steps + 1).contact_records
        assert (np.abs(touching.shear_force) <= friction * touching.normal_force * (1.0 + 1e-12)).all()
        assert (touching.normal_force >= 0.0).all()
        assert (touching.depth > 0.0).all()
        greatest = max(greatest, float(touching.normal_force.max(initial=0.0)))
    assert greatest > 1.0


@ALL_MODELS
@BOTH
def test_block_stands_by_friction_on_a_slope_below_its_friction_angle(start: Start, model: str, law: str) -> None:
    tilt, friction = 0.25, 0.3
    lying = {"y": 0.0125, "x": 0.5e-3 * SPACING}
    contact = contact_of(model, law, {"linear": 1e-4, "hertz-mindlin": 1e-2}[law])
    scene = start([lying], restitution=0.0, tilt=-tilt, ground_friction=friction, contact=contact).to_time(0.04)
    assert float(np.hypot(scene.bodies[0].vx, scene.bodies[0].vy)) < 2e-3
    assert abs(scene.bodies[0].x) < 2e-4
    weight = float(scene.bodies[0].mass) * 9.81
    touching = scene.contact_records
    nx, ny = (touching.nx, touching.ny) if model != "surface" else (0.0, 1.0)
    push = [
        (touching.normal_force * nx + touching.shear_force * ny).sum(),
        (touching.normal_force * ny - touching.shear_force * nx).sum(),
    ]
    assert push == pytest.approx([-weight * sin(tilt), weight * cos(tilt)], rel=0.02)
