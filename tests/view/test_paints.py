"""Colours of blocks: the same in every picture, by material, by speed on one scale, by turn on both sides of none."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from blocksim.scenario import load_scenario
from blocksim.view import paints, style
from blocksim.view.paints import PAINTS, by_speed, by_turn
from blocksim.view.sweeps.outcome_map import CLASS_COLOURS
from tests.view.made_up import toppling

SCENARIOS = Path(paints.__file__).parents[2] / "scenarios"


def test_speeds_have_one_scale_for_the_whole_run() -> None:
    frames = toppling(2)
    frames.vx[:], frames.vy[:] = 0.0, 0.0
    frames.vx[:, 1] = np.linspace(0.0, 2.0, len(frames))
    found = by_speed(frames)
    assert found.fills(0)[0] == found.fills(len(frames) - 1)[0] == found.fills(0)[1]
    shades = [style.brightness(found.fills(frame)[1]) for frame in range(0, len(frames), 4)]
    assert shades == sorted(shades, reverse=True)
    assert found.scale is not None
    assert (found.scale.label, found.scale.low, found.scale.high) == ("speed (m/s)", 0.0, 2.0)
    many = toppling(20, steps=100)
    many.vx[50, 3] = 100.0  # one impact, beside which all else would look like rest
    scale = by_speed(many).scale
    assert scale is not None
    assert scale.high < 1.0
    assert scale.extend == "max"


def test_turns_to_either_side_differ_and_none_lies_between() -> None:
    frames = replace(toppling(3))
    frames.angle[:] = np.linspace(0.0, 1.0, len(frames))[:, None] * np.array([-1.0, 0.0, 1.0])
    left, none, right = (style.brightness(fill) for fill in by_turn(frames).fills(len(frames) - 1))
    assert none > max(left, right)
    assert len(set(by_turn(frames).fills(len(frames) - 1))) == 3


def test_classes_of_a_map_are_reported_apart_in_grey() -> None:
    shades = sorted(style.brightness(colour) for colour in CLASS_COLOURS)
    assert min(np.diff(shades)) > 0.12


@pytest.mark.parametrize("name", PAINTS)
def test_blocks_that_never_move_have_colours_too(name: str) -> None:
    frames = toppling(5)
    for field in (frames.vx, frames.vy, frames.angle):
        field[:] = 0.0
    fills = PAINTS[name](frames, load_scenario(SCENARIOS / "shaking_table.toml")).fills(0)
    assert all(len(fill) == 7 for fill in fills)
