"""Warnings about values that are allowed and hardly meant."""

from pathlib import Path
from typing import Any

import pytest

from blocksim.scenario import Document
from blocksim.scenario.check import implausible_values

THREE_BLOCKS = Path(__file__).parents[2] / "scenarios" / "three_blocks.toml"


@pytest.mark.parametrize(
    ("settings", "suspects"),
    [
        ({"friction.block_block": 33}, ["friction.block_block = 33"]),
        ({"friction.block_ground.static": 20}, ["friction.block_ground = 20"]),
        ({"pairs.aluminium.ground.friction": 30}, ["pairs.aluminium.ground.friction = 30"]),
        ({"sweep": {"friction.block_block": [0.3, 25, 20]}}, ["friction.block_block = 25"]),
        ({"sweep": {"mode": "lhs", "friction.block_block": {"from": 20.0, "to": 30.0}}}, ["friction.block_block = 30"]),
        ({"friction.block_block": "33 deg", "friction.block_ground": 1.2}, []),
        ({"sweep": {"friction.block_block": ["20 deg", "30 deg"]}}, []),
        ({"sweep": {"gravity": [9.81, 20.0]}}, []),
    ],
)
def test_friction_angle_without_its_unit_is_warned_of(settings: dict[str, Any], suspects: list[str]) -> None:
    found = implausible_values(Document.read(THREE_BLOCKS).with_values(settings).build())
    assert [text.partition(" is a friction coefficient; for an angle write ")[0] for text in found] == suspects
