"""Pictures of sweeps on pages of any size: nothing cut, nothing covered, long names whole."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from blocksim.errors import InvalidInputError
from blocksim.view.kinds import SWEEP_KINDS
from blocksim.view.layout import Paper
from blocksim.view.sweeps.data import Input, SweepData
from blocksim.view.tornado import Bars, draw_tornado
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


@pytest.mark.parametrize("size", [None, (5.0, 8.0), (9.0, 9.0)])
@pytest.mark.parametrize("kind", ["lines", "map", "matrix", "histogram"])
def test_no_text_is_cut_or_covered(caught: list[Figure], kind: str, size: tuple[float, float] | None) -> None:
    SWEEP_KINDS[kind].draw(of_two_keys() if kind == "lines" else sweep(), Path("sweep.png"), Paper(size))
    assert overlapping(caught[0]) == []
    assert size is None or caught[0].get_size_inches().tolist() == pytest.approx(list(size))


@pytest.mark.parametrize("kind", ["lines", "map", "matrix"])
def test_long_names_are_written_in_lines_and_not_cut(caught: list[Figure], kind: str) -> None:
    SWEEP_KINDS[kind].draw(of_two_keys() if kind == "lines" else sweep(), Path("sweep.png"))
    texts = [text.replace("\n", "") for text, _ in boxes_of(caught[0])]
    name = "restitution" if kind == "matrix" else KEY
    assert any(name in text for text in texts)
    assert not any("…" in text for text in texts)
    assert all(any(word in text for text in texts) for word in WORDS)


@pytest.mark.parametrize("size", [None, (4.0, 5.0)])
def test_long_keys_of_a_tornado_are_written_in_lines(caught: list[Figure], size: tuple[float, float] | None) -> None:
    keys = (KEY, KEY.replace("restitution", "static"), "contact.particle_spacing_of_the_boundary_layer")
    bars = Bars("x of block 2 (mm)", keys, np.array([3.0, 2.0, 1.0]), np.array([9.0, 0.5, 0.1]))
    draw_tornado([bars, bars], ("mean change", ""), "tornado.png", "Which inputs matter", Paper(size))
    assert overlapping(caught[0]) == []
    texts = [text.replace("\n", "") for text, _ in boxes_of(caught[0])]
    assert "contact.particle_spacing_of_the_boundary_layer".rpartition(".")[2] in texts
    beyond = [line for line in caught[0].axes[0].lines if line.get_marker() == ">"]
    assert [len(np.asarray(line.get_xdata())) for line in beyond] == [1]  # the first interval does not end on the axis


@pytest.mark.parametrize("kind", ["lines", "map", "matrix", "histogram"])
def test_a_page_that_is_too_small_is_refused(caught: list[Figure], kind: str) -> None:
    with pytest.raises(InvalidInputError, match=r"--size .* mm is too small for this picture: at least \d+ mm"):
        SWEEP_KINDS[kind].draw(of_two_keys() if kind == "lines" else sweep(), Path("sweep.png"), Paper((2.0, 1.0)))
    assert caught == []


def test_values_are_reported_in_the_unit_in_which_they_are_best_read() -> None:
    told = Input("structures.0.overlap", "m", np.array([0.009, 0.01]))
    assert told.label(0.009) == "9 mm"
    assert Input("ground.tilt", "rad", np.array([0.1])).label(np.radians(-5.0)) == "−5 °"
    assert Input("gravity", "", np.array([5.0])).label(5.0) == "5"
