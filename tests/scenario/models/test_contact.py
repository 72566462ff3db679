"""Short and long forms of friction and restitution."""

import math

import pytest

from blocksim.scenario import PairFriction, Restitution


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
    ("given", "block_block", "block_ground"),
    [(0.5, 0.5, 0.5), (1, 1.0, 1.0), ({"block_ground": 0.1}, 0.2, 0.1), ({}, 0.2, 0.2)],
)
def test_forms_of_restitution(given: object, block_block: float, block_ground: float) -> None:
    restitution = Restitution.model_validate(given)
    assert (restitution.block_block, restitution.block_ground) == (block_block, block_ground)
