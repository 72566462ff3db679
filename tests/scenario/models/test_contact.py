"""Short and long forms of friction and restitution."""

import math

import pytest

from blocksim.scenario import Contact, PairFriction, Restitution


@pytest.mark.parametrize(
    ("given", "static", "kinetic", "speed"),
    [
        (0.31, 0.31, 0.31, 0.005),
        (0, 0.0, 0.0, 0.005),
        ("21 deg", math.tan(math.radians(21)), math.tan(math.radians(21)), 0.005),
        ({"static": 0.3}, 0.3, 0.3, 0.005),
        (
            {"static": "45 deg", "kinetic": 0.5, "transition_speed": "1 mm/s"},
            math.tan(math.pi / 4),
            0.5,
            0.001,
        ),
    ],
)
def test_forms_of_friction(given: object, static: float, kinetic: float, speed: float) -> None:
    pair = PairFriction.model_validate(given)
    assert (pair.static, pair.kinetic, pair.transition_speed) == (static, kinetic, speed)


def test_equal_friction_is_equal_however_it_was_written() -> None:
    assert PairFriction.model_validate(0.3) == PairFriction.model_validate({"static": 0.3, "kinetic": 0.3})


@pytest.mark.parametrize(
    ("given", "length", "support"),
    [
        ({}, 0.0013, 0.0026),
        ({"particle_spacing": 0.002}, 0.0026, 0.0052),
        ({"particle_spacing": 0.002, "kernel": "cubic-spline"}, 0.0026, 0.0052),
        ({"particle_spacing": 0.002, "kernel": "quintic-spline"}, 0.0026, 0.0078),
        ({"particle_spacing": 0.002, "smoothing_length": 0.0016}, 0.0016, 0.0032),
    ],
)
def test_smoothing_length_and_reach_of_the_kernel(given: dict[str, object], length: float, support: float) -> None:
    contact = Contact.model_validate({"model": "kernel", **given})
    assert [contact.resolved_smoothing_length, contact.support_radius] == pytest.approx([length, support])


@pytest.mark.parametrize("model", ["surface", "particles"])
def test_a_short_smoothing_length_only_matters_to_the_kernel(model: str) -> None:
    contact = Contact.model_validate({"model": model, "smoothing_length": 1e-6})
    assert contact.smoothing_length == 1e-6


@pytest.mark.parametrize(
    ("given", "block_block", "block_ground"),
    [(0.5, 0.5, 0.5), (1, 1.0, 1.0), ({"block_ground": 0.1}, 0.2, 0.1), ({}, 0.2, 0.2)],
)
def test_forms_of_restitution(given: object, block_block: float, block_ground: float) -> None:
    restitution = Restitution.model_validate(given)
    assert (restitution.block_block, restitution.block_ground) == (block_block, block_ground)
