"""Where the panels of a strip lie: columns, rows, scale and the size of the page."""

from dataclasses import dataclass, replace

from blocksim.view import style
from blocksim.view.layout import Paper
from blocksim.view.panel import room_below
from blocksim.view.window import Extent

WIDTH = 10.0  # inches, of the whole strip
SIDE, GAP = 0.25, 0.25  # inches, at the left and right end and between columns
_HEAD, TITLE, FOOT = 0.22, 0.30, 0.52  # inches: time above a panel, title of the strip, axis and legend below
LINE = 0.155  # inches, of each further line of text above a panel or below the strip
LEAST_WIDTH, NARROWEST_PANEL, LOWEST_PANEL = 1.75, 1.25, 0.25  # inches, on a page whose size was asked for
POINTS = style.POINTS_PER_INCH
TICKS = 0.26  # inches, for the numbers under a row of panels
TALLEST_PANEL = 4.0  # inches
WIDEST_IN_FOURS, WIDEST_IN_PAIRS = 2.5, 6.0  # width over height, so that a panel stays about an inch tall
LOW_ENOUGH = 1.6  # width over height from which four rows of pairs fit on a page


@dataclass(frozen=True)
class Lines:
    """Lines of text above each panel and below the strip, rows of measured ranges, height of the key (inches)."""

    captions: int = 1
    notes: int = 1
    measured_rows: int = 0
    key: float = 0.0


@dataclass(frozen=True)
class Layout:
    """How the panels are arranged, in inches; `points_per_mm` is the scale of all of them."""

    columns: int
    rows: int
    panel_width: float
    panel_height: float
    points_per_mm: float
    height: float
    extent: Extent
    head: float = _HEAD
    foot: float = FOOT
    width: float = WIDTH

    @property
    def ticks(self) -> float:
        """Height of the numbers under a row of panels; tilted panels have theirs inside."""
        return 0.0 if self.extent.tilt else TICKS

    def place(self, index: int) -> tuple[float, float, float, float]:
        """Return left, bottom, width, height of a panel as parts of the figure."""
        row, column = divmod(index, self.columns)
        used = self.columns * self.panel_width + (self.columns - 1) * GAP
        left = 0.5 * (self.width - used) + column * (self.panel_width + GAP)
        bottom = self.foot + (self.rows - 1 - row) * (self.panel_height + self.head + self.ticks)
        return left / self.width, bottom / self.height, self.panel_width / self.width, self.panel_height / self.height


def arrangement(extent: Extent, readable: float = 0.0) -> tuple[int, int]:
    """Return the number of columns and the number of panels: flat and long scenes get few columns.

    So do scenes in between where names are `readable`, from that many points a mm on, in two columns but not in four.
    """
    aspect = extent.width / extent.height
    if aspect <= WIDEST_IN_FOURS:
        fours, pairs = (style.POINTS_PER_INCH * _panel_width(columns) / extent.width for columns in (4, 2))
        return (2, 8) if aspect >= LOW_ENOUGH and fours < readable <= pairs else (4, 8)
    return (2, 8) if aspect <= WIDEST_IN_PAIRS else (1, 6)


def plan(paper: Paper, extent: Extent, columns: int, panels: int, lines: Lines) -> Layout:
    """Fit the panels into a page. Where its size was asked for, as many columns as make them largest.

    Raises InvalidInputError for a page that is too small.
    """
    width = paper.width(WIDTH, LEAST_WIDTH)
    if paper.size is None:
        columns = min(columns, panels)
        scale = min(_panel_width(columns, width) / extent.width, TALLEST_PANEL / extent.height)  # inches per mm
        return _laid_out(extent, columns, panels, lines, (width, scale))
    most = max(1, min(panels, int((width - 2.0 * SIDE + GAP) / (NARROWEST_PANEL + GAP))))
    scale, columns = max((_scale_on(paper, extent, columns, panels, lines), columns) for columns in range(1, most + 1))
    rows = -(-panels // columns)
    paper.panel(0.0, rows, _others(extent, columns, panels, lines), LOWEST_PANEL)  # refuses a page that is too small
    narrow = 0.5 * max(NARROWEST_PANEL / scale - extent.width, 0.0)  # so that captions do not run into each other
    extent = replace(extent, left=extent.left - narrow, right=extent.right + narrow)
    layout = _laid_out(extent, columns, panels, lines, (width, scale))
    spare = paper.size[1] - layout.height
    return replace(layout, height=paper.size[1], head=layout.head + spare / layout.rows)


def _scale_on(paper: Paper, extent: Extent, columns: int, panels: int, lines: Lines) -> float:
    """Return the largest scale (inches per mm) at which so many columns fit into a page of a given size; 0 if none."""
    rows = -(-panels // columns)
    below = room_below(extent, lines.measured_rows) / style.POINTS_PER_INCH
    height = (paper.height(0.0) - _others(extent, columns, panels, lines)) / rows
    if height < LOWEST_PANEL:
        return 0.0
    tallest = min(height / (extent.top - extent.lowest), (height + below) / (extent.top - extent.bottom))
    return min(_panel_width(columns, paper.width(WIDTH)) / extent.width, tallest)


def _others(extent: Extent, columns: int, panels: int, lines: Lines) -> float:
    """Return the height (inches) of everything but the part of panels above the lowest ground."""
    rows = -(-panels // columns)
    ticks, head, foot = _heights(extent, lines)
    below = room_below(extent, lines.measured_rows) / style.POINTS_PER_INCH
    return TITLE + rows * (head + below) + (rows - 1) * ticks + foot


def _laid_out(extent: Extent, columns: int, panels: int, lines: Lines, page: tuple[float, float]) -> Layout:
    """Return the layout for a width (inches) and a scale (inches per mm)."""
    width, scale = page
    rows = -(-panels // columns)
    below = max((extent.lowest - extent.bottom) * scale, room_below(extent, lines.measured_rows) / POINTS)
    panel_height = (extent.top - extent.lowest) * scale + below
    ticks, head, foot = _heights(extent, lines)
    height = TITLE + rows * (panel_height + head) + (rows - 1) * ticks + foot
    return Layout(columns, rows, extent.width * scale, panel_height, scale * POINTS, height, extent, head, foot, width)


def _heights(extent: Extent, lines: Lines) -> tuple[float, float, float]:
    """Return the heights (inches) of the numbers below a panel, the text above it, and all below the strip."""
    ticks = 0.0 if extent.tilt else TICKS
    return ticks, _HEAD + (lines.captions - 1) * LINE, FOOT - TICKS + ticks + (lines.notes - 1) * LINE + lines.key


def _panel_width(columns: int, width: float = WIDTH) -> float:
    """Return the width that a panel may have (inches)."""
    return (width - 2.0 * SIDE - (columns - 1) * GAP) / columns
