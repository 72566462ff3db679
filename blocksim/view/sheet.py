"""A sheet with one panel, a title above and notes below: what pictures of studies are drawn on."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from blocksim.view import style
from blocksim.view.layout import EDGE, LINE, Paper, add_axes, wrapped, write_heading, write_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_WIDTH, PANEL_HEIGHT = 5.2, 3.0  # inches
_RIGHT, _HEAD, _FOOT = 0.15, 0.38, 0.48  # inches
_NARROWEST, _LOWEST = 1.8, 1.0  # inches, of the panel on a page whose size was asked for


@contextmanager
def sheet(path: Path | str, title: str | None, notes: Sequence[str], paper: Paper, left: float) -> "Iterator[Axes]":
    """Give the panel, `left` inches from the edge; then write the picture as PNG, SVG or PDF.

    The same input gives the same bytes. Raises InvalidInputError for an unknown picture format or too small a page,
    before the panel is given, and OutputError when the file cannot be written.
    """
    path = Path(path)
    style.picture_suffix(path)
    width = paper.width(_WIDTH, left + _RIGHT + _NARROWEST)
    lines = wrapped(list(notes), width - left - EDGE)
    foot = _FOOT + LINE * len(lines)
    row = paper.panel(PANEL_HEIGHT, 1, _HEAD + foot, _LOWEST)
    with style.styled_figure(width, paper.height(_HEAD + row + foot), paper.dots) as figure:
        axes = add_axes(figure, left, foot, width - left - _RIGHT, row)
        axes.spines[["right", "top"]].set_visible(False)
        yield axes
        for number, line in enumerate(reversed(lines)):
            write_text(figure, left, EDGE + LINE * number, line, color=style.FAINT_INK)
        write_heading(figure, title, EDGE)
        style.save_figure(figure, path)
