"""Colours, fonts and pages: places in inches, titles, legends, plain numbers, and writing of picture files."""

import re
import warnings
from bisect import bisect_left, bisect_right
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import BytesIO
from itertools import accumulate
from pathlib import Path
from typing import TYPE_CHECKING, Any
from unicodedata import east_asian_width

from blocksim.errors import InvalidInputError
from blocksim.simulation.atomic import write_bytes

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure


# Okabe & Ito (2008), distinguishable with every common colour blindness; vermilion is for measured values.
BLOCK_COLOURS = ("#56B4E9", "#E69F00", "#009E73", "#F0E442", "#0072B2", "#CC79A7")
MEASURED_COLOUR = "#D55E00"
INK = "#222222"
FAINT_INK = "#777777"
GROUND_COLOUR = "#D9D9D9"

POINTS_PER_INCH = 72.0
DOTS_PER_INCH = 150
FONT_SIZE = 8.0  # points
TITLE_SIZE = 10.0
SMALLEST_FONT = 4.0  # smaller text is left out
LETTER = 0.64, 1.2  # width and height of a digit in units of the font size
LINE_WIDTH = 0.8  # points

FONT = ["DejaVu Sans"]
NARROWEST = 0.25  # width of the narrowest letters over the font size
PARTS = re.compile(r"(?:[^. ]|\.(?=\d))+(?: +|\.|$)|[. ]+")  # what a name is broken into; numbers stay whole
PIECES = re.compile(r"[^_-]*[_-]+|[^_-]+")  # what a part that is too wide is broken into
MOST_LETTERS = 200  # of a name in lines
SURE = 0.98  # letters are put on whole pixels

# A fixed salt and no dates: the same picture is the same file.
SETTINGS: dict[Any, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": FONT,
    "font.size": FONT_SIZE,
    "axes.titlesize": FONT_SIZE,
    "axes.linewidth": LINE_WIDTH,
    "axes.edgecolor": FAINT_INK,
    "axes.labelcolor": INK,
    "text.color": INK,
    "text.parse_math": False,
    "xtick.color": FAINT_INK,
    "xtick.labelcolor": INK,
    "hatch.linewidth": 0.6,
    "svg.hashsalt": "blocksim",
    "savefig.dpi": DOTS_PER_INCH,
}
METADATA: dict[str, dict[str, str | None]] = {
    ".png": {"Software": "blocksim"},
    ".svg": {"Date": None, "Creator": "blocksim"},
    ".pdf": {"CreationDate": None, "Creator": "blocksim", "Producer": None},
}


def block_colour(index: int) -> str:
    """Return the fill of block number `index` (from 0); the palette repeats."""
    return BLOCK_COLOURS[index % len(BLOCK_COLOURS)]


def text_colour(fill: str) -> str:
    """Return black or white, whichever reads better on `fill` (#rrggbb)."""
    bright = 0.4
    return INK if brightness(fill) > bright else "#FFFFFF"


def brightness(fill: str) -> float:
    """Return how bright a colour (#rrggbb) is in grey, 0 to 1: luma after ITU-R BT.601."""
    red, green, blue = (int(fill[start : start + 2], 16) / 255.0 for start in (1, 3, 5))
    return 0.299 * red + 0.587 * green + 0.114 * blue


def picture_suffix(path: Path) -> str:
    """Return the suffix in lower case; raises InvalidInputError for a format that is not written."""
    suffix = path.suffix.lower()
    if suffix not in METADATA:
        message = f"{path}: '{path.suffix}' unsupported picture format; use {', '.join(METADATA)}"
        raise InvalidInputError(message)
    return suffix


@contextmanager
def styled_figure(width: float, height: float, dots: float | None = None) -> Iterator["Figure"]:
    """Give an empty figure of `width` x `height` inches, in this style; needs no display. `dots` are those an inch."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with in_style(dots):
        figure = Figure(figsize=(width, height))
        FigureCanvasAgg(figure)
        yield figure


@contextmanager
def in_style(dots: float | None = None) -> Iterator[None]:
    """Draw in this style, a PNG with so many dots per inch."""
    from matplotlib import rc_context, rcParamsDefault

    # A user's own matplotlibrc must not change the file, but the backend is the user's choice.
    settings: dict[Any, Any] = {key: value for key, value in rcParamsDefault.items() if not key.startswith("backend")}
    resolution: dict[Any, Any] = {} if dots is None else {"savefig.dpi": dots}
    with rc_context(settings | SETTINGS | resolution):
        yield


def save_figure(figure: "Figure", path: Path) -> None:
    """Write the figure as PNG, SVG or PDF after its suffix; raises OutputError when it cannot be written."""
    write_bytes(path, figure_bytes(figure, picture_suffix(path)))


def figure_bytes(figure: "Figure", suffix: str) -> bytes:
    """Return the figure in the format of a suffix, one of those that are written."""
    buffer = BytesIO()
    with silence_missing_glyphs():
        figure.savefig(buffer, format=suffix[1:], metadata=METADATA[suffix])
    return buffer.getvalue()


@contextmanager
def silence_missing_glyphs() -> Iterator[None]:
    """Draw letters that the font lacks as boxes and do not warn: the reader sees it."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from font", category=UserWarning)
        yield


def shortened(text: str, letters: int) -> str:
    """Return a name in one line, no wider than this many letters; signs that are no letters become boxes."""
    line = "".join(sign if sign.isprintable() else "\N{WHITE SQUARE}" for sign in text)
    ends = list(accumulate(1 + (east_asian_width(sign) in "WF") for sign in line))
    if not ends or ends[-1] <= letters:
        return line
    return f"{line[: bisect_right(ends, letters - 1)]}…"


def width_of(text: str, size: float, *, bold: bool = False) -> float:
    """Return the width (points) of one line of text at a font size (points), as it is on paper."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    font = FontProperties(family=FONT, size=size, weight="bold" if bold else "normal")
    with silence_missing_glyphs():
        return float(text_to_path.get_text_width_height_descent(text, font, ismath=False)[0])


def cut_to(text: str, room: float, size: float, *, bold: bool = False) -> str:
    """Return a text in one line that is no wider than `room` (points), with an ellipsis where it is cut."""
    room *= SURE
    line = shortened(text, max(1, int(room / (NARROWEST * size))))
    if width_of(line, size, bold=bold) <= room:
        return line
    fits = bisect_left(range(len(line)), 1, key=lambda count: width_of(f"{line[:count]}…", size, bold=bold) > room)
    return f"{line[: max(fits - 1, 0)]}…"


def broken(text: str, room: float, size: float = FONT_SIZE, *, bold: bool = False) -> list[str]:
    """Return a name in lines no wider than `room` (inches), broken after dots and spaces.

    A part that is too wide by itself is broken after hyphens and underscores; what is still too wide is cut.
    """
    points = room * POINTS_PER_INCH

    def is_wide(line: str) -> bool:
        return width_of(line.rstrip(), size, bold=bold) > points

    lines = [""]
    for part in PARTS.findall(shortened(text, MOST_LETTERS)):
        for piece in PIECES.findall(part) if is_wide(part) else [part]:
            if lines[-1] and is_wide(f"{lines[-1]}{piece}"):
                lines.append("")
            lines[-1] += piece
    return [cut_to(line.rstrip(), points / SURE, size, bold=bold) for line in lines]


def fitting_font(text: str, room: tuple[float, float], largest: float = FONT_SIZE) -> float:
    """Return the font size (points) that fits `text` into `room` (width, height; points); 0 if unreadable."""
    size = min(largest, room[0] / (LETTER[0] * max(len(text), 1)), room[1] / LETTER[1])
    return size if size >= SMALLEST_FONT else 0.0


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
