"""Pictures of sweeps with long keys and words: nothing cut, nothing covered."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from blocksim.view.kinds import SWEEP_KINDS
from blocksim.view.studies import Bars, draw_tornado
from blocksim.view.style import Paper
from blocksim.view.sweeps.data import Input, SweepData
from tests.view.made_up import boxes_of, overlapping
from tests.view.sweeps.made_up import grid, made_up

KEY = "pairs.very_hard_granite_of_the_quarry.very_soft_rubber_of_the_mat.restitution"
WORDS = ("nonsmooth_contacts", "explicit_with_springs")


def sweep() -> SweepData:
    """Return a grid over a key with a long name and words that are long."""
    friction, scale, word = grid(2)
    return made_up((replace(friction, key=KEY), scale, replace(word, levels=WORDS)))


def of_two_keys() -> SweepData:
    """Return a grid of a number over two words."""
    values, word = np.tile(np.linspace(0.1, 0.3, 6), 2), np.repeat([0.0, 1.0], 6)
    return made_up((Input(KEY, "m", values), Input("time.scheme", "", word, WORDS)))


@pytest.mark.parametrize("size", [None, (9.0, 9.0)])
@pytest.mark.parametrize("kind", ["lines", "map", "matrix", "histogram"])
def test_long_names_are_written_in_lines_and_neither_cut_nor_covered(
    caught: list[Figure], kind: str, size: tuple[float, float] | None
) -> None:
    SWEEP_KINDS[kind].draw(of_two_keys() if kind == "lines" else sweep(), Path("sweep.png"), Paper(size))
    assert overlapping(caught[0]) == []
    texts = [text.replace("\n", "") for text, _ in boxes_of(caught[0])]
    assert not any("…" in text for text in texts)
    if kind != "histogram":
        assert any(("restitution" if kind == "matrix" else KEY) in text for text in texts)
        assert all(any(word in text for text in texts) for word in WORDS)


@pytest.mark.parametrize("size", [None, (4.0, 5.0)])
def test_long_keys_of_a_tornado_are_written_in_lines(caught: list[Figure], size: tuple[float, float] | None) -> None:
    keys = (KEY, KEY.replace("restitution", "static"), "contact.particle_spacing_of_the_boundary_layer")
    bars = Bars("x of block 2 (mm)", keys, np.array([3.0, 2.0, 1.0]), np.array([9.0, 0.5, 0.1]))
    draw_tornado([bars, bars], ("mean change", ""), "tornado.png", "Which inputs matter", Paper(size))
    assert overlapping(caught[0]) == []
    texts = [text.replace("\n", "") for text, _ in boxes_of(caught[0])]
    assert "contact.particle_spacing_of_the_boundary_layer" in texts
    beyond = [line for line in caught[0].axes[0].lines if line.get_marker() == ">"]
    assert [len(np.asarray(line.get_xdata())) for line in beyond] == [1]  # the first interval does not end on the axis
