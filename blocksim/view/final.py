"""Where the blocks of a run end, like Figure 3 of the paper: x, rotation and measured range below each block."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, NamedTuple

from blocksim.view import style
from blocksim.view.forces import WithContacts, draw_forces, force_scale
from blocksim.view.labels import LINE, SPACE, Label, arranged, depth, draw_label, labels_of, lines_of, row_height
from blocksim.view.layout import OWN, Paper, add_axes, write_text
from blocksim.view.load_arrows import draw_marks, draw_outside
from blocksim.view.loads import length_in, outside, with_room
from blocksim.view.measured import MeasuredTable, widened
from blocksim.view.paint import Paint, by_block, draw_key
from blocksim.view.panel import Canvas, Page, depth_of, draw_ruler, finish_panel, page_for
from blocksim.view.run_data import FramesLike, Support, drawable_frames, moments_at
from blocksim.view.scene import TOP, Scene, draw_centres, draw_scene
from blocksim.view.window import Extent, extent_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDTH = 7.2  # inches
MARKS = 0.2  # inches, for what acts on all blocks, above the panel
SIDE, HEAD, AXIS, FOOT = 0.25, 0.32, 0.42, 0.24  # inches; AXIS: numbers below the panel, FOOT: the line below all
TALLEST = 5.0  # inches, of the panel
MOST_LINES = 36  # below the panel; more labels fit no page
LETTERS_AN_INCH = 15.0  # in a line below
LEAST_WIDTH, LOWEST = 2.0, 0.6  # inches, of a page and of a panel on a page whose size was asked for
FITTINGS = 4  # a lower panel has labels nearer to each other, so in more rows


def draw_final(
    frames: WithContacts,
    path: Path | str,
    title: str | None = None,
    measured: MeasuredTable | None = None,
    support: Support | None = None,
    *,
    forces: bool = False,
    times: Sequence[float] | None = None,
    paint: Paint | None = None,
    paper: Paper = OWN,
) -> None:
    """Draw the last frame, or the one nearest to the last of `times` (s).

    Labels below each block give x, rotation, and the measured mean and range of its centre, if the labels of all
    blocks fit. `forces` draws those of all contacts, `paint` colours the blocks. The same input gives the
    same bytes. Raises InvalidInputError for an unknown picture format, a time or forces that were not stored, a page
    that is too small or nothing to draw, and OutputError when the file cannot be written.
    """
    path = Path(path)
    style.picture_suffix(path)
    support, paint = support or Support(), paint or by_block(frames)
    drawable = drawable_frames(frames)
    chosen = drawable[-1:] if times is None else moments_at(frames, drawable, times)[-1:]
    frame = int(chosen[0])
    scale = force_scale(frames) if forces else None
    acts = outside(frames, chosen, support)
    told = "\n".join(filter(None, ("" if scale is None else scale.explanation, acts.explanation)))
    around = _Around(HEAD + MARKS * any(acts.marks), paint.height, told)
    extent = extent_of(frames, chosen, support)
    length = length_in(extent)
    extent = widened(with_room(extent, acts, length), [])
    sheet = _sheet(frames, frame, extent, measured if frame == drawable[-1] else None, paper, around)
    page, room = sheet.page, sheet.room
    with style.styled_figure(page.width, sheet.height, paper.dots) as figure:
        bottom = sheet.height - sheet.head - page.panel_height
        canvas = Canvas(
            add_axes(figure, SIDE, bottom, page.panel_width, page.panel_height), page.extent, page.points_per_mm
        )
        draw_scene(canvas, Scene(frames, support, paint), frame)
        finish_panel(canvas, (page.panel_width, page.panel_height), labelled=True)
        if page.extent.tilt:
            draw_ruler(canvas, depth_of(0))
        if sheet.is_labelled and sheet.labels:
            draw_centres(canvas, frames, frame)
            _draw_labels(add_axes(figure, SIDE, sheet.height - page.height - room, page.panel_width, room), sheet)
        draw_outside(canvas, acts, 0, length)
        draw_marks(canvas, acts.marks[0])
        if scale is not None:
            draw_forces(canvas, frames, frame, scale)
        draw_key(figure, paint, SIDE, sheet.foot - paint.height)
        caption = f"{float(frames.time[frame]):.3f} s" + (", final" if frame == len(frames.time) - 1 else "")
        top = sheet.height - 0.08
        write_text(figure, page.width - SIDE, top, caption, ha="right", va="top")
        if title:
            width = page.panel_width * style.POINTS_PER_INCH - style.width_of(caption, style.FONT_SIZE) - SPACE[0]
            shown = style.cut_to(title, width, style.TITLE_SIZE)
            write_text(figure, SIDE, top, shown, va="top", fontsize=style.TITLE_SIZE)
        write_text(figure, SIDE, 0.06, "\n".join(sheet.notes), color=style.FAINT_INK, va="bottom")
        style.save_figure(figure, path)


class _Around(NamedTuple):
    """What is above and below: heights (inches) of the head and of the key of colours, explanations."""

    head: float
    key: float
    told: str


@dataclass(frozen=True)
class Sheet:
    """The page: its panel, the labels and lines below it; heights of all, of the head and of what is below (inches)."""

    page: Page
    labels: tuple[Label, ...]
    notes: tuple[str, ...]
    height: float
    head: float
    foot: float

    @property
    def is_labelled(self) -> bool:
        """Whether the labels are drawn."""
        return lines_of(self.labels) <= MOST_LINES

    @property
    def room(self) -> float:
        """Height of the labels (inches)."""
        return depth(self.labels) / style.POINTS_PER_INCH if self.is_labelled else 0.0


def _sheet(
    frames: FramesLike,
    frame: int,
    extent: Extent,
    measured: MeasuredTable | None,
    paper: Paper,
    around: _Around,
) -> Sheet:
    """Return the page; if its size is given, the panel takes the room that the labels leave."""
    width, tallest = paper.width(WIDTH, LEAST_WIDTH), TALLEST
    margins = SIDE, around.head, AXIS
    sheet = _tried(frames, frame, page_for(extent, width, tallest, margins), measured, around)
    for _ in range(FITTINGS if paper.size is not None else 0):
        tallest = min(paper.panel(0.0, 1, sheet.height - sheet.page.panel_height, LOWEST), tallest)
        sheet = _tried(frames, frame, page_for(extent, width, tallest, margins), measured, around)
        tallest -= max(sheet.height - paper.height(0.0), 0.0)
    return replace(sheet, height=paper.height(sheet.height))


def _tried(frames: FramesLike, frame: int, page: Page, measured: MeasuredTable | None, around: _Around) -> Sheet:
    """Return the page for a panel."""
    labels = tuple(arranged(labels_of(frames, frame, page, measured), page))
    text = _legend(labels, is_labelled=lines_of(labels) <= MOST_LINES)
    text = "\n".join(filter(None, (text, around.told)))
    notes = tuple(line for part in text.split("\n") for line in wrap(part, int(LETTERS_AN_INCH * page.width)))
    foot = FOOT + (len(notes) - 1) * LINE / style.POINTS_PER_INCH + around.key
    sheet = Sheet(page, labels, notes, 0.0, around.head, foot)
    return replace(sheet, height=page.height + sheet.room + foot)


def _draw_labels(axes: "Axes", sheet: Sheet) -> None:
    """Draw the labels below the axis, on a scale of points."""
    axes.set_axis_off()
    axes.set_xlim(0.0, sheet.page.panel_width * style.POINTS_PER_INCH)
    axes.set_ylim(-sheet.room * style.POINTS_PER_INCH, 0.0)
    apart = row_height(sheet.labels)
    for label in sheet.labels:
        draw_label(axes, label, -label.row * apart)


def _legend(labels: Sequence[Label], *, is_labelled: bool) -> str:
    if not labels:
        return ""
    if not is_labelled:
        return f"{len(labels)} blocks: too many to name x and rotation of each. {TOP}"
    is_listed = any(label.left == label.right for label in labels)
    where = "Listed by block" if is_listed else "Below each block"
    texts = [f"{where}: x of the centre (marked on the ground), rotation.", TOP]
    if any(label.bar for label in labels):
        texts.insert(1, "Dot and bar: measured mean and range of the centre (mm).")
    return " ".join(texts)
