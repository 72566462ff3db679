"""Which side of a block goes where, and the density of a material."""

import pytest
from pydantic import ValidationError

from blocksim.scenario.models.geometry import Block, Material


@pytest.mark.parametrize(
    ("turned", "sizes"),
    [
        ({}, (0.032, 0.025, 0.05)),
        ({"upright": "height"}, (0.032, 0.025, 0.05)),
        ({"upright": "length"}, (0.032, 0.05, 0.025)),
        ({"upright": "width"}, (0.05, 0.032, 0.025)),
        ({"upright": "height", "along": "length"}, (0.05, 0.025, 0.032)),
        ({"upright": "length", "along": "height"}, (0.025, 0.05, 0.032)),
        ({"along": "length"}, (0.05, 0.025, 0.032)),
    ],
)
def test_sides_along_upright_and_deep(turned: dict[str, str], sizes: tuple[float, float, float]) -> None:
    block = Block.model_validate({"width": "32 mm", "height": "25 mm", "length": "50 mm", "material": "a", **turned})
    assert (block.size_x, block.size_y, block.depth) == sizes


def test_a_unit_weight_is_a_density_times_standard_gravity() -> None:
    material = Material(unit_weight=9810.0, young_modulus=1.0, poisson_ratio=0.0)
    assert material.density == 1000.0


def test_a_given_density_is_used_as_it_is() -> None:
    assert Material(density=2700.5, young_modulus=1.0, poisson_ratio=0.0).density == 2700.5


@pytest.mark.parametrize("given", [{}, {"density": 1.0, "unit_weight": 9.81}])
def test_exactly_one_density(given: dict[str, float]) -> None:
    with pytest.raises(ValidationError, match="density"):
        Material.model_validate({"young_modulus": 1.0, "poisson_ratio": 0.0, **given})
