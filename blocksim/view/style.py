"""Colours, fonts and pages: sizes that people ask for, panels with title, notes and legend, picture files."""

import functools
import re
import warnings
from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import KW_ONLY, dataclass
from io import BytesIO
from itertools import accumulate
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any
from unicodedata import east_asian_width

from blocksim.errors import InvalidInputError
from blocksim.options import Option
from blocksim.simulation.files import write_bytes

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib import artist, axes, axis, figure

    Axes = axes.Axes  # all files of this room annotate with these
    Axis = axis.Axis
    Figure = figure.Figure


# Okabe & Ito (2008), distinguishable with every common colour blindness; vermilion is for measured values.
BLOCK_COLOURS = ("#56B4E9", "#E69F00", "#009E73", "#F0E442", "#0072B2", "#CC79A7")
MEASURED_COLOUR = "#D55E00"
INK = "#222222"
FAINT_INK = "#777777"
GROUND_COLOUR = "#D9D9D9"
BRIGHT = 0.4  # from which dark text reads better than white

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
MOST_LETTERS = 600  # of a text in lines
SURE = 0.98  # letters are put on whole pixels

# A fixed salt and no dates: the same picture is the same file.
SETTINGS: dict[Any, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": FONT,
    "font.size": FONT_SIZE,
    "axes.titlesize": FONT_SIZE,
    "axes.titley": 1.0,  # else measured from all labels above a panel, where there are none
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
    return INK if brightness(fill) > BRIGHT else "#FFFFFF"


def brightness(fill: str) -> float:
    """Return how bright a colour (#rrggbb) is in grey, 0 to 1: luma after ITU-R BT.601."""
    red, green, blue = (int(fill[start : start + 2], 16) / 255.0 for start in (1, 3, 5))
    return 0.299 * red + 0.587 * green + 0.114 * blue


def picture_path(path: Path | str) -> Path:
    """Return the path of a picture; raises InvalidInputError for a format that is not written."""
    path = Path(path)
    if path.suffix.lower() not in METADATA:
        raise InvalidInputError(f"{path}: '{path.suffix}' unsupported picture format; use {', '.join(METADATA)}")
    return path


are_docstrings_read = True  # those of matplotlib, in this process; not in that of a command, which says so


@contextmanager
def open_figure(width: float, height: float, dots: float | None = None) -> Iterator["Figure"]:
    """Give an empty figure of `width` x `height` inches, in this style; needs no display. `dots` are those an inch."""
    from matplotlib import artist

    if not are_docstrings_read:  # they list properties: a quarter of what importing the rest takes
        artist.kwdoc = lambda _: ""  # type: ignore[assignment]  # an argument without a name
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


KEPT: "ContextVar[list[Figure] | None]" = ContextVar("KEPT", default=None)


@contextmanager
def keep_figures() -> Iterator["list[Figure]"]:
    """Give a list that receives all figures drawn meanwhile, which are not written."""
    kept: list[Figure] = []
    token = KEPT.set(kept)
    try:
        yield kept
    finally:
        KEPT.reset(token)


def save_figure(figure: "Figure", path: Path) -> None:
    """Write the figure as PNG, SVG or PDF after its suffix; raises OutputError when it cannot be written."""
    if (kept := KEPT.get()) is not None:
        kept.append(figure)
    else:
        write_bytes(path, figure_bytes(figure, picture_path(path).suffix.lower()))


def figure_bytes(figure: "Figure", suffix: str) -> bytes:
    """Return the figure in the format of a suffix, one of those that are written."""
    buffer = BytesIO()
    for side in (side for axes in figure.axes for side in (axes.xaxis, axes.yaxis) if not side.get_label_text()):
        side.set_label_coords(0.0, 0.0)  # else all numbers are measured for the place of a name that is not there
    with silence_missing_glyphs():
        figure.savefig(buffer, format=suffix[1:], metadata=METADATA[suffix])
    return buffer.getvalue()


@contextmanager
def silence_missing_glyphs() -> Iterator[None]:
    """Draw letters that the font lacks as boxes and do not warn: the reader sees it."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from font", category=UserWarning)
        yield


def shorten(text: str, letters: int) -> str:
    """Return a name in one line, no wider than this many letters; signs that are no letters become boxes."""
    line = "".join(sign if sign.isprintable() or sign == "\N{NO-BREAK SPACE}" else "\N{WHITE SQUARE}" for sign in text)
    ends = list(accumulate(1 + (east_asian_width(sign) in "WF") for sign in line))
    if not ends or ends[-1] <= letters:
        return line
    return f"{line[: bisect_right(ends, letters - 1)]}…"


@functools.cache
def width_of(text: str, size: float, *, bold: bool = False) -> float:
    """Return the width (points) of one line of text at a font size (points), as it is on paper."""
    from matplotlib import font_manager, textpath

    font = font_manager.FontProperties(family=FONT, size=size, weight="bold" if bold else "normal")
    with silence_missing_glyphs():
        return float(textpath.text_to_path.get_text_width_height_descent(text, font, ismath=False)[0])


def cut_to(text: str, room: float, size: float, *, bold: bool = False) -> str:
    """Return a text in one line that is no wider than `room` (points), with an ellipsis where it is cut."""
    room *= SURE
    line = shorten(text, max(1, int(room / (NARROWEST * size))))
    if width_of(line, size, bold=bold) <= room:
        return line
    fits = bisect_left(range(len(line)), 1, key=lambda count: width_of(f"{line[:count]}…", size, bold=bold) > room)
    return f"{line[: max(fits - 1, 0)]}…"


def break_lines(text: str, room: float, size: float = FONT_SIZE, *, bold: bool = False) -> list[str]:
    """Return a text in lines no wider than `room` (inches), broken after spaces and the dots of names.

    A part that is too wide by itself is broken after hyphens and underscores; what is still too wide is cut.
    """
    points = room * POINTS_PER_INCH

    def is_wide(line: str) -> bool:
        return width_of(line.rstrip(), size, bold=bold) > points

    lines = [""]
    text = shorten(text, MOST_LETTERS)
    for part in PARTS.findall(text) if is_wide(text) else [text]:
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
LINE, TITLE_LINE = 0.15, 0.19  # inches, of a row of text or of a legend, and of the title
MANY = 5  # numbers along an axis
SIZE = re.compile(r"([0-9]+(?:\.[0-9]*)?)\s*[x×]\s*([0-9]+(?:\.[0-9]*)?)\s*(mm|cm|in|px)?")
INCHES = {"mm": 1.0 / MILLIMETRES_PER_INCH, "cm": 10.0 / MILLIMETRES_PER_INCH, "in": 1.0}
LEAST_SIDE, MOST_SIDE = 20.0 / 25.4 - 1e-9, 2000.0 / 25.4 + 1e-9  # inches
SPARE_PIXEL = 0.25  # so that no round-off removes a whole one
MOST_PIXELS = 1e8
MOST_SHOWN = 40  # letters of a value in a message


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
class PageSize:
    """Width and height of a picture in a unit."""

    width: float
    height: float
    unit: str

    @classmethod
    def read(cls, text: str) -> "PageSize":
        """Read WxH with mm, cm, in or px. Raises ValueError, also for sides that no page has."""
        match = SIZE.fullmatch(text.strip())
        if match is None:
            raise ValueError(f"{text[:MOST_SHOWN]!r} is not a picture size; write it as in 180x120mm or 1600x900px")
        size = cls(float(match[1]), float(match[2]), match[3] or "mm")
        if not all(LEAST_SIDE <= side <= MOST_SIDE for side in size.inches(150.0)):
            raise ValueError("each side of a picture must be 20 to 2000 mm (about 120 to 12 000 px)")
        return size

    def inches(self, dots: float) -> tuple[float, float]:
        """Return width and height in inches; pixels are those of a PNG with so many dots per inch."""
        if self.unit == "px":
            return (self.width + SPARE_PIXEL) / dots, (self.height + SPARE_PIXEL) / dots
        return self.width * INCHES[self.unit], self.height * INCHES[self.unit]


@dataclass(frozen=True)
class PageOptions:
    """Size and resolution of a picture."""

    _: KW_ONLY
    size: Annotated[
        tuple[float, float] | PageSize | None,
        Option(
            "Size of the picture: 180x120mm, 7x5in or 1600x900px.",
            python="Width and height of the picture in mm.",
            metavar="WxH",
            read=PageSize.read,
        ),
    ] = None
    dpi: Annotated[
        float | None, Option("Dots per inch of a PNG (default: 150).", metavar="N", least=20.0, most=1200.0)
    ] = None

    def __post_init__(self) -> None:
        """Raise ValueError for more than MOST_PIXELS."""
        if not isinstance(self.size, PageSize):
            return
        dots = self.dpi or DOTS_PER_INCH
        width, height = self.size.inches(dots)
        if width * height * dots**2 > MOST_PIXELS:
            raise ValueError(f"--size and --dpi make more than {MOST_PIXELS / 1e6:.0f} million pixels")

    @property
    def paper(self) -> Paper:
        """The page that these ask for."""
        if isinstance(self.size, PageSize):
            return Paper(self.size.inches(self.dpi or DOTS_PER_INCH), self.dpi)
        size = self.size
        return Paper(size and (size[0] / MILLIMETRES_PER_INCH, size[1] / MILLIMETRES_PER_INCH), self.dpi)


def add_axes(figure: "Figure", left: float, bottom: float, width: float, height: float) -> "Axes":
    """Return axes at a place given in inches."""
    across, up = (float(size) for size in figure.get_size_inches())
    return figure.add_axes((left / across, bottom / up, width / across, height / up))


def size_of(axes: "Axes") -> tuple[float, float]:
    """Return width and height of a panel (inches)."""
    figure: Any = axes.get_figure(root=True)
    width, height = axes.get_position().size * figure.get_size_inches()
    return float(width), float(height)


def write_text(figure: "Figure", left: float, bottom: float, text: str, **look: Any) -> None:
    """Write text at a place given in inches."""
    figure.text(left, bottom, text, transform=figure.dpi_scale_trans, **look)


def write_legend(figure: "Figure", handles: "Sequence[artist.Artist]", left: float, bottom: float, **look: Any) -> None:
    """Draw a legend without a frame, its lower left corner at a place given in inches."""
    own: dict[str, Any] = {"loc": "lower left", "frameon": False, "borderpad": 0.0, "borderaxespad": 0.0}
    own |= {"labelspacing": 0.25, "handlelength": 1.4, "columnspacing": 1.2}
    place = {"bbox_to_anchor": (left, bottom), "bbox_transform": figure.dpi_scale_trans}
    figure.legend(handles=handles, **own | place | look)


def add_lines(axes: "Axes", lines: Iterable[Any], **look: Any) -> None:
    """Draw lines, each points (k, 2), as one artist."""
    from matplotlib.collections import LineCollection

    axes.add_collection(LineCollection(list(lines), **look))


def add_polygons(axes: "Axes", outlines: Iterable[Any], **look: Any) -> None:
    """Draw polygons, each corners (k, 2), as one artist."""
    from matplotlib.collections import PolyCollection

    axes.add_collection(PolyCollection(list(outlines), **look))


def legend_entry(label: str, **look: Any) -> "artist.Artist":
    """Return an entry of a legend: a patch where it has a `facecolor`, else a line or mark."""
    from matplotlib import lines, patches

    return patches.Patch(label=label, **look) if "facecolor" in look else lines.Line2D([], [], label=label, **look)


Sides = tuple[float, float, float, float]
"""Inches at left, right, top and bottom of all panels, for numbers, names of axes and headings."""


@contextmanager
def open_panels(
    paper: Paper,
    counts: "Sequence[int]",
    panel: tuple[float, float],
    least: tuple[float, float],
    sides: Sides,
    gaps: tuple[float, float] = (0.0, 0.0),
    *,
    title: str | None = None,
    notes: str = "",
    handles: "Sequence[artist.Artist]" = (),
    columns: int = 1,
) -> Iterator[tuple["Figure", list[list["Axes"]]]]:
    """Give a figure with rows and columns of panels, a title above them, a legend and notes below them.

    `counts` are the panels of each row, `panel` is the width and height of one, `least` that on a page whose size was
    asked for, `gaps` those between columns and rows, `columns` those of the legend. All lengths in inches. Raises
    InvalidInputError for too small a page.
    """
    (left, right, head, foot), rows, across = sides, len(counts), max(counts)
    beside = left + right + (across - 1) * gaps[0]
    width = paper.width(beside + across * panel[0], beside + across * least[0])
    inside = SURE * (width - 2.0 * EDGE)
    heading = break_lines(title, inside, TITLE_SIZE) if title else []
    lines = break_lines(notes, inside) if notes else []
    head, foot = head + EDGE, foot + EDGE + LINE * (len(lines) - (-len(handles) // columns))
    others = head + foot + (rows - 1) * gaps[1]
    if paper.size is not None and heading:  # no more lines than leave room for the panels
        most = max(1, int((paper.size[1] - others - rows * least[1]) / TITLE_LINE))
        rest = cut_to(" ".join(heading[most - 1 :]), inside * POINTS_PER_INCH, TITLE_SIZE)
        heading = [*heading[: most - 1], rest]
    head, others = head + TITLE_LINE * len(heading), others + TITLE_LINE * len(heading)
    row = paper.panel(panel[1], rows, others, least[1])
    column, height = (width - beside) / across, paper.height(others + rows * row)
    with open_figure(width, height, paper.dots) as figure:
        panels = [
            [
                add_axes(figure, left + k * (column + gaps[0]), height - head - row - n * (row + gaps[1]), column, row)
                for k in range(count)
            ]
            for n, count in enumerate(counts)
        ]
        write_text(figure, EDGE, height - EDGE, "\n".join(heading), va="top", fontsize=TITLE_SIZE)
        write_text(figure, EDGE, EDGE, "\n".join(lines), va="bottom", color=FAINT_INK)
        if handles:
            write_legend(figure, handles, EDGE, EDGE + LINE * len(lines), ncols=columns)
        yield figure, panels


def name_axes(figure: "Figure", panels: list[list["Axes"]], x: str, y: str, depth: float) -> None:
    """Write the names of both axes once: `depth` inches below all panels, and at the left edge of the figure."""
    across, up = (float(size) for size in figure.get_size_inches())
    first, last = panels[0][0].get_position(), panels[-1][-1].get_position()
    lines = "\n".join(break_lines(x, across * (1.0 - first.x0)))
    write_text(figure, 0.5 * across * (first.x0 + last.x1), up * last.y0 - depth, lines, ha="center", va="top")
    lines = "\n".join(break_lines(y, up * (first.y1 - last.y0)))
    write_text(figure, EDGE, 0.5 * up * (first.y1 + last.y0), lines, va="center", rotation=90.0)


def write_heading(figure: "Figure", title: str | None, left: float, right: float | None = None) -> None:
    """Write a title in one line at the top, cut where it would come nearer to the sides than `left` and `right`."""
    across, up = (float(size) for size in figure.get_size_inches())
    room = across - left - (left if right is None else right)
    shown = cut_to(title or "", room * POINTS_PER_INCH, TITLE_SIZE)
    write_text(figure, left, up - EDGE, shown, va="top", fontsize=TITLE_SIZE)


def limits_around(values: Any, share: float, least: float) -> tuple[float, float]:
    """Return the ends of an axis around values: a share of their span beyond them, and at least so far apart."""
    low, high = float(values.min()), float(values.max())
    margin = max(share * (high - low), 0.5 * (least - (high - low)))
    return low - margin, high + margin


def number_axis(side: "Axis", most: int = MANY, *, is_log: bool = False) -> None:
    """Write numbers along an axis as they are, with a proper minus sign, and not in powers of ten."""
    from matplotlib.ticker import FuncFormatter, MaxNLocator, NullFormatter

    side.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.6g}".replace("-", "−")))
    side.set_minor_formatter(NullFormatter())
    if not is_log:
        side.set_major_locator(MaxNLocator(nbins=most, steps=[1, 2, 2.5, 5, 10]))
