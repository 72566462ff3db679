"""Places on a figure in inches from its lower left corner, and common parts of pictures of sweeps."""

from typing import TYPE_CHECKING

from blocksim.view import style
from blocksim.view.series import ValueAxis

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

COLUMN_WIDTH, PAGE_WIDTH = 3.54, 7.2  # inches: one column of a journal's page, and both
EDGE = 0.08  # inches, between text and the figure's edge
TITLE_LINE, TITLE_GAP = 0.19, 0.12  # inches
WIDE_LETTER = 0.56  # of the font size, a mean of letters
MANY = 5  # numbers along an axis
LINE = 0.145  # inches, of a row of text


def add_axes(figure: "Figure", left: float, bottom: float, width: float, height: float) -> "Axes":
    """Return axes at a place given in inches."""
    across, up = (float(size) for size in figure.get_size_inches())
    return figure.add_axes((left / across, bottom / up, width / across, height / up))


def write_text(figure: "Figure", left: float, bottom: float, text: str, **look: object) -> None:
    """Write text at a place given in inches."""
    across, up = (float(size) for size in figure.get_size_inches())
    figure.text(left / across, bottom / up, text, **look)  # type: ignore[arg-type]


def title_height(title: str, width: float) -> float:
    """Return the height (inches) that a title takes with the gap below it."""
    return EDGE + TITLE_LINE * len(wrapped([title], width - 2.0 * EDGE, style.TITLE_SIZE)) + TITLE_GAP


def write_title(figure: "Figure", title: str) -> None:
    """Write the title at the top, in as many lines as it needs."""
    across, up = (float(size) for size in figure.get_size_inches())
    lines = wrapped([title], across - 2.0 * EDGE, style.TITLE_SIZE)
    for number, line in enumerate(lines):
        write_text(figure, EDGE, up - EDGE - number * TITLE_LINE, line, va="top", fontsize=style.TITLE_SIZE)


def number_axis(side: "Axis", shown: ValueAxis | None = None, most: int = MANY) -> None:
    """Write plain numbers along an axis."""
    from matplotlib.ticker import FuncFormatter, MaxNLocator, NullFormatter  # noqa: PLC0415 - see style

    side.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.6g}".replace("-", "−")))
    side.set_minor_formatter(NullFormatter())
    if shown is None or not shown.is_log:
        side.set_major_locator(MaxNLocator(nbins=most, steps=[1, 2, 2.5, 5, 10]))


def wrapped(texts: list[str], width: float, font: float = style.FONT_SIZE) -> list[str]:
    """Fill lines of `width` inches with sentences, words kept whole."""
    letters = int(width * style.POINTS_PER_INCH / (WIDE_LETTER * font))
    lines = [""]
    for word in " ".join(texts).split():
        if lines[-1] and len(lines[-1]) + 1 + len(word) > letters:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return [line for line in lines if line]
