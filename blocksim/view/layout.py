"""Layout of a page: its size and dots per inch, and places on it in inches from its lower left corner."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from blocksim.errors import InvalidInputError
from blocksim.view.style import FONT_SIZE, POINTS_PER_INCH, TITLE_SIZE, cut_to

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

MILLIMETRES_PER_INCH = 25.4
COLUMN_WIDTH, PAGE_WIDTH = 3.54, 7.2  # inches: one column of a journal's page, and both
EDGE = 0.08  # inches, between text and the figure's edge
TITLE_LINE, TITLE_GAP = 0.19, 0.12  # inches
WIDE_LETTER = 0.56  # of the font size, a mean of letters
MANY = 5  # numbers along an axis
LINE = 0.145  # inches, of a row of text


@dataclass(frozen=True)
class Paper:
    """Width and height of a picture (inches), None for the picture's own, and its dots per inch, None for 150.

    Letters and lines keep their size: a smaller page has smaller panels.
    """

    size: tuple[float, float] | None = None
    dots: float | None = None

    def width(self, own: float, least: float = 0.0) -> float:
        """Return the width (inches). Raises InvalidInputError where the page is narrower than `least`."""
        if self.size is None:
            return own
        if self.size[0] < least:
            raise InvalidInputError(self._refusal("wide", least))
        return self.size[0]

    def height(self, own: float) -> float:
        """Return the height (inches)."""
        return own if self.size is None else self.size[1]

    def panel(self, own: float, count: int, others: float, least: float) -> float:
        """Return the height (inches) of each of `count` panels in addition to `others` inches of text, axes and gaps.

        Raises InvalidInputError where panels would be lower than `least`.
        """
        if self.size is None:
            return own
        height = (self.size[1] - others) / count
        if height < least:
            raise InvalidInputError(self._refusal("high", others + count * least))
        return height

    def _refusal(self, side: str, least: float) -> str:
        width, height = (MILLIMETRES_PER_INCH * side for side in self.size or (0.0, 0.0))
        needed = MILLIMETRES_PER_INCH * least
        return f"--size {width:.4g}x{height:.4g} mm is too small for this picture: at least {needed:.0f} mm {side}"


OWN = Paper()


@dataclass(frozen=True)
class PanelPage:
    """A page with panels side by side and a legend below, in inches."""

    width: float
    height: float
    panel: float  # width of a panel
    row: float  # its height
    foot: float
    columns: int  # of the legend


def add_axes(figure: "Figure", left: float, bottom: float, width: float, height: float) -> "Axes":
    """Return axes at a place given in inches."""
    across, up = (float(size) for size in figure.get_size_inches())
    return figure.add_axes((left / across, bottom / up, width / across, height / up))


def write_text(figure: "Figure", left: float, bottom: float, text: str, **look: object) -> None:
    """Write text at a place given in inches."""
    across, up = (float(size) for size in figure.get_size_inches())
    figure.text(left / across, bottom / up, text, **look)  # type: ignore[arg-type]


def write_legend(figure: "Figure", handles: "Sequence[Artist]", left: float, bottom: float, **look: Any) -> None:
    """Draw a legend without a frame, its lower left corner at a place given in inches."""
    across, up = (float(size) for size in figure.get_size_inches())
    own: dict[str, Any] = {"loc": "lower left", "frameon": False, "borderpad": 0.0, "borderaxespad": 0.0}
    figure.legend(handles=handles, bbox_to_anchor=(left / across, bottom / up), **{**own, **look})


def title_height(title: str, width: float) -> float:
    """Return the height (inches) that a title takes with the gap below it."""
    return EDGE + TITLE_LINE * len(wrapped([title], width - 2.0 * EDGE, TITLE_SIZE)) + TITLE_GAP


def write_title(figure: "Figure", title: str) -> None:
    """Write the title at the top, in as many lines as it needs."""
    across, up = (float(size) for size in figure.get_size_inches())
    lines = wrapped([title], across - 2.0 * EDGE, TITLE_SIZE)
    for number, line in enumerate(lines):
        write_text(figure, EDGE, up - EDGE - number * TITLE_LINE, line, va="top", fontsize=TITLE_SIZE)


def write_heading(figure: "Figure", title: str | None, side: float, top: float = 0.06) -> None:
    """Write a title in one line, cut where it is too long, `side` and `top` inches from the edges of the figure."""
    if title:
        across, up = (float(size) for size in figure.get_size_inches())
        shown = cut_to(title, (across - 2.0 * side) * POINTS_PER_INCH, TITLE_SIZE)
        figure.text(side / across, 1.0 - top / up, shown, va="top", fontsize=TITLE_SIZE)


def plain_numbers(side: "Axis") -> None:
    """Write numbers along an axis as they are, with a proper minus sign, and not in powers of ten."""
    from matplotlib.ticker import FuncFormatter

    side.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.6g}".replace("-", "−")))


def number_axis(side: "Axis", most: int = MANY, *, is_log: bool = False) -> None:
    """Write plain numbers along an axis."""
    from matplotlib.ticker import MaxNLocator, NullFormatter

    plain_numbers(side)
    side.set_minor_formatter(NullFormatter())
    if not is_log:
        side.set_major_locator(MaxNLocator(nbins=most, steps=[1, 2, 2.5, 5, 10]))


def wrapped(texts: list[str], width: float, font: float = FONT_SIZE) -> list[str]:
    """Fill lines of `width` inches with sentences, words kept whole."""
    letters = int(width * POINTS_PER_INCH / (WIDE_LETTER * font))
    lines = [""]
    for word in " ".join(texts).split():
        if lines[-1] and len(lines[-1]) + 1 + len(word) > letters:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return [line for line in lines if line]
