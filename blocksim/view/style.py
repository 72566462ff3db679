"""Colours, fonts and sizes, and writing of picture files."""

import re
import warnings
from bisect import bisect_left, bisect_right
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from itertools import accumulate
from pathlib import Path
from typing import TYPE_CHECKING, Any
from unicodedata import east_asian_width

from blocksim.errors import InvalidInputError
from blocksim.simulation.atomic import write_bytes

if TYPE_CHECKING:
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
    with no_word_of_missing_letters():
        figure.savefig(buffer, format=suffix[1:], metadata=METADATA[suffix])
    return buffer.getvalue()


@contextmanager
def no_word_of_missing_letters() -> Iterator[None]:
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
    with no_word_of_missing_letters():
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
