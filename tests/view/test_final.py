"""The final state: every block's x, rotation and measured range below it, nothing covered, colours for many blocks."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from blocksim.analysis import load_table
from blocksim.errors import InvalidInputError, OutputError
from blocksim.view import final, style
from blocksim.view.final import draw_final
from blocksim.view.layout import Paper
from blocksim.view.paint import by_turn
from blocksim.view.run_data import Support
from tests.view.made_up import HOSTILE, boxes_of, overlapping, stacked, toppling

TABLE = load_table(Path(final.__file__).parents[2] / "scenarios" / "experiments" / "three_blocks.csv")


@pytest.mark.parametrize("suffix", ["png", "svg", "pdf"])
def test_the_same_run_gives_the_same_bytes(tmp_path: Path, suffix: str) -> None:
    paths = [tmp_path / f"{name}.{suffix}" for name in ("first", "second")]
    for path in paths:
        draw_final(toppling(3), path, title="twice", measured=TABLE)
    assert paths[0].read_bytes() == paths[1].read_bytes()


@pytest.mark.parametrize("blocks", [1, 3, 10, 24])
@pytest.mark.parametrize("tilt", [0.0, 0.3])
def test_no_text_covers_another_or_is_cut(caught: list[Figure], blocks: int, tilt: float) -> None:
    support = Support(tilt=tilt)
    if blocks <= 10:  # beyond that they end on one another, names and all
        draw_final(toppling(blocks), "final.png", title="a title", measured=TABLE, support=support)
    draw_final(stacked(blocks), "final.png", title="a title", measured=TABLE, support=support)
    for figure in caught:
        assert overlapping(figure) == []


def test_every_block_tells_x_rotation_and_what_was_measured(caught: list[Figure]) -> None:
    draw_final(toppling(3), "final.png", measured=TABLE)
    texts = [text for text, _ in boxes_of(caught[0])]
    for told in ("x 60.00 mm", "x 100.00 mm", "x 140.00 mm", "measured 74.41 [71.69, 78.53]", "0.600 s, final"):
        assert told in texts
    assert texts.count("−90.00°") == 3


def test_labels_stand_below_their_blocks(caught: list[Figure]) -> None:
    frames = toppling(3)
    draw_final(frames, "final.png")
    panel = caught[0].axes[0]
    boxes = dict(boxes_of(caught[0]))
    for place in 1000.0 * frames.x[-1]:
        box = boxes[f"x {place:.2f} mm"]
        assert 0.5 * (box[0] + box[2]) == pytest.approx(panel.transData.transform((place, 0.0))[0], abs=1.0)


def test_rotation_counts_from_the_start_and_is_not_wrapped(caught: list[Figure]) -> None:
    frames = toppling(1)
    frames.angle[:, 0] = np.linspace(np.pi, 4.0 * np.pi, len(frames))
    draw_final(frames, "final.png")
    assert "540.00°" in [text for text, _ in boxes_of(caught[0])]


def test_a_measured_range_is_drawn_where_it_was_measured(caught: list[Figure]) -> None:
    draw_final(toppling(3), "final.png", measured=TABLE)
    panel, below = caught[0].axes
    ends = panel.transData.transform([(71.69, 0.0), (78.53, 0.0)])[:, 0]
    bars = [below.transData.transform(line.get_xydata())[:, 0] for line in below.lines]
    assert any(len(bar) == 2 and np.allclose(bar, ends, atol=0.5) for bar in bars)


def test_many_blocks_keep_their_colours_or_take_those_of_their_rotation(caught: list[Figure]) -> None:
    frames = toppling(1000)
    frames.angle[-1, :5] = -10.0  # farther than half a turn
    for paint in (None, by_turn(frames)):
        draw_final(frames, "final.png", title="many", paint=paint)
        assert overlapping(caught[-1]) == []
        assert "1000 blocks: too many to name" in "".join(text for text, _ in boxes_of(caught[-1]))
    own, turned = (fills_of(figure) for figure in caught)
    assert own[:7] == [style.block_colour(index) for index in range(7)]
    assert len(set(turned[:5])) == 1
    assert turned[0] != turned[6] == turned[7]


def fills_of(figure: Figure) -> list[str]:
    """Return the fills of free blocks."""
    drawn = [one for one in figure.axes[0].collections if isinstance(one, PolyCollection)]
    return [to_hex(colour).upper() for colour in np.asarray(drawn[1].get_facecolor())]


def test_another_moment_can_be_drawn_and_has_no_measured_ranges(caught: list[Figure]) -> None:
    draw_final(toppling(3, steps=61), "final.png", measured=TABLE, times=[0.3])
    texts = [text for text, _ in boxes_of(caught[0])]
    assert "0.300 s" in texts
    assert not any(text.startswith("measured") for text in texts)


@pytest.mark.parametrize("size", [(3.2, 4.6), (7.0, 4.2), (12.0, 9.0)])
def test_a_page_has_the_size_that_was_asked_for(caught: list[Figure], size: tuple[float, float]) -> None:
    draw_final(toppling(3), "final.png", title="a title", measured=TABLE, paper=Paper(size))
    assert caught[0].get_size_inches().tolist() == list(size)
    assert overlapping(caught[0]) == []


def test_hostile_names_are_text(caught: list[Figure], tmp_path: Path) -> None:
    frames = replace(toppling(len(HOSTILE)), names=HOSTILE)
    draw_final(frames, tmp_path / "final.png", title="<b>" * 100)
    texts = [text for text, _ in boxes_of(caught[0])]
    assert "$x^2$ \\frac" in texts
    assert "<script>alert…" in texts
    assert "two□lines□" in texts
    assert overlapping(caught[0]) == []


def test_hostile_names_can_be_written(tmp_path: Path) -> None:
    for suffix in ("png", "svg", "pdf"):
        draw_final(replace(toppling(len(HOSTILE)), names=HOSTILE), tmp_path / f"final.{suffix}", title=HOSTILE[3])
        assert (tmp_path / f"final.{suffix}").stat().st_size > 1000


def test_a_run_that_failed_is_drawn_at_its_last_whole_frame(caught: list[Figure]) -> None:
    frames = toppling(2, steps=7)
    frames.x[-1] = np.nan
    draw_final(frames, "final.png")
    assert "0.500 s" in [text for text, _ in boxes_of(caught[0])]


def test_a_table_that_measures_other_blocks_is_no_trouble(caught: list[Figure]) -> None:
    class Other:
        def statistics(self) -> pd.DataFrame:
            return pd.DataFrame([{"block": "9", "quantity": "x", "mean": 1.0, "minimum": 0.0, "maximum": 2.0}])

    draw_final(toppling(2), "final.png", measured=Other())
    assert "measured" not in "".join(text for text, _ in boxes_of(caught[0]))


def test_trouble_is_reported(tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="unsupported picture format"):
        draw_final(toppling(1), tmp_path / "final.bmp")
    with pytest.raises(OutputError, match="cannot be written"):
        draw_final(toppling(1), tmp_path / "none" / "final.png")
