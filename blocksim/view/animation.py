"""A run as an animation: choice of frames, and one picture after the other."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from blocksim.errors import InvalidInputError
from blocksim.view import style
from blocksim.view.animation_files import write_gif, write_mp4
from blocksim.view.forces import WithContacts, draw_forces, force_scale
from blocksim.view.load_arrows import draw_marks, draw_outside
from blocksim.view.loads import length_in, outside, with_room
from blocksim.view.paint import Paint, by_block, draw_key
from blocksim.view.panel import Canvas, Page, depth_of, draw_ruler, finish_panel, page_for
from blocksim.view.run_data import Floats, FramesLike, Indices, Support, drawable_frames
from blocksim.view.scene import Scene, draw_blocks, draw_standing
from blocksim.view.window import MILLIMETRES, extent_of, together

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Pixels = NDArray[np.uint8]  # (height, width, 3), red, green, blue
Flags = NDArray[np.bool_]
Writer = Callable[[Path, Iterator[Pixels], Floats], None]

WRITERS: dict[str, Writer] = {".gif": write_gif, ".mp4": write_mp4}  # by suffix; one function and one line a format
DOTS_PER_INCH = 100.0  # letters of 11 pixels
MARGINS = 0.15, 0.50, 0.42  # inches: at the sides, above and below the panel
HIGHEST = 1.25  # height of the panel over its width
KEY_FOOT = 0.04  # inches, below what explains the colours
HELD = 1.5  # s that the last picture stays
MOST_PICTURES = 10_000
TIME_ROOM, MARKS_ROOM = 60.0, 70.0  # points: for the time, and for a mark of what acts on all bodies
FEW_NAMES = 2  # of blocks that leave the view
FEW_BLOCKS = 30  # up to which trails are drawn by default
TRAIL: dict[str, Any] = {"linewidths": 1.0, "alpha": 0.5, "zorder": 2.5}  # below names


@dataclass(frozen=True)
class Pace:
    """Speed of an animation: seconds of the run per second of animation, and pictures per second."""

    speed: float = 0.25
    rate: float = 30.0


@dataclass(frozen=True)
class Look:
    """Appearance of an animation: width in pixels, paths of the centres (default: for few blocks), forces."""

    width: int = 800
    trails: bool | None = None
    title: str = ""
    forces: bool = False
    paint: Paint | None = None


def draw_animation(
    frames: WithContacts,
    path: Path | str,
    pace: Pace | None = None,
    look: Look | None = None,
    support: Support | None = None,
    on_picture: Callable[[int, int], None] = lambda *_: None,
) -> tuple[int, str]:
    """Write a run as GIF or MP4; the last frame is held.

    Returns the number of frames, and which blocks leave the view, as written in the pictures. `support` is what the
    blocks stand on: level ground at rest if it is not given. `on_picture` is called with the numbers of frames drawn
    and to draw. Raises InvalidInputError for an unknown format, forces that were not stored, nothing to draw or too
    many frames, OutputError when the file cannot be written and UnavailableError when what writes MP4 is missing.
    """
    path = Path(path)
    write = writer_of(path)
    chosen, seconds = timed(frames, drawable_frames(frames), pace or Pace())
    animation = Animation(frames, support or Support(), look or Look())

    def pictures() -> Iterator[Pixels]:
        for number, frame in enumerate(chosen, start=1):
            yield animation.picture(int(frame))
            on_picture(number, len(chosen))

    write(path, pictures(), seconds)
    return len(chosen), animation.beyond


def writer_of(path: Path) -> Writer:
    """Return what writes a file of this name; raises InvalidInputError for a format that is not written."""
    try:
        return WRITERS[path.suffix.lower()]
    except KeyError:
        message = f"{path}: '{path.suffix}' unsupported format; use {' or '.join(WRITERS)}"
        raise InvalidInputError(message) from None


def timed(frames: FramesLike, drawable: Indices, pace: Pace) -> tuple[Indices, Floats]:
    """Return which frame each picture shows and how long (s of animation): even in time, the last one held.

    Every picture shows the frame nearest to its time. Raises InvalidInputError for more than MOST_PICTURES.
    """
    recorded = frames.time[drawable]
    length = float(recorded[-1] - recorded[0]) / pace.speed
    count = length * pace.rate
    if count > MOST_PICTURES:
        message = f"the animation would have {count:.3g} frames, at most {MOST_PICTURES}: raise --speed or lower --fps"
        raise InvalidInputError(message)
    wanted = recorded[0] + pace.speed / pace.rate * np.arange(int(count + 1e-9) + 1)
    after = np.searchsorted(recorded, wanted).clip(max=len(recorded) - 1)
    before = (after - 1).clip(min=0)
    nearest = np.where(wanted - recorded[before] <= recorded[after] - wanted, before, after)
    nearest[-1] = len(recorded) - 1
    seconds = np.full(len(nearest), 1.0 / pace.rate)
    seconds[-1] = HELD
    return drawable[nearest], seconds


def beyond_view(names: Sequence[str], seen: Flags) -> str:
    """Return which blocks leave the view, by name where they are few; empty where all stay."""
    gone = [name for name, is_seen in zip(names, seen, strict=True) if not is_seen]
    if not gone:
        return ""
    verb = "leaves" if len(gone) == 1 else "leave"
    if len(gone) <= FEW_NAMES:
        return f"block{'' if len(gone) == 1 else 's'} {' and '.join(gone)} {verb} the view"
    return f"{len(gone)} of {len(names)} blocks {verb} the view"


class Animation:
    """Draws one frame after the other on the same page; fixed parts are drawn once."""

    def __init__(self, frames: WithContacts, support: Support, look: Look) -> None:
        """Prepare the page, as high as the run needs. Raises InvalidInputError for forces that were not stored."""
        self.frames, self.support = frames, support
        self.forces = force_scale(frames) if look.forces else None
        self.drawable = drawable_frames(frames)
        self.has_trails = len(frames.names) <= FEW_BLOCKS if look.trails is None else look.trails
        self.paint = look.paint or by_block(frames)
        self.scene = Scene(frames, support, self.paint)
        across = look.width / DOTS_PER_INCH
        tallest = HIGHEST * (across - 2.0 * MARGINS[0])
        margins = (*MARGINS[:2], MARGINS[2] + self.paint.height)
        self.seen = together(frames, self.drawable, support)
        self.beyond = beyond_view(frames.names, self.seen)
        extent = extent_of(frames, self.drawable, support, self.seen)
        self.acts, self.length = outside(frames, self.drawable, support), length_in(extent)
        self.page = page_for(with_room(extent, self.acts, self.length), across, tallest, margins)
        self._prepare(look.title)

    def _prepare(self, title: str) -> None:
        """Draw the fixed parts: title, axis, and the support unless it moves."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg

        with style.styled_figure(*_even(self.page)) as figure, style.no_word_of_missing_letters():
            figure.set_dpi(DOTS_PER_INCH)
            self.canvas = Canvas(figure.add_axes(self.page.place), self.page.extent, self.page.points_per_mm)
            self._draw_still(figure, title)
            paper: Any = FigureCanvasAgg
            self.paper = paper(figure)
            self.paper.draw()
            self.still = self.paper.copy_from_bbox(figure.bbox)

    def _draw_still(self, figure: "Figure", title: str) -> None:
        finish_panel(self.canvas, (self.page.panel_width, self.page.panel_height), labelled=True)
        if self.page.extent.tilt:
            draw_ruler(self.canvas, depth_of(0))
        shown = style.cut_to(title, self.page.panel_width * style.POINTS_PER_INCH, style.TITLE_SIZE)
        place = MARGINS[0] / self.page.width, 1.0 - 0.06 / self.page.height
        figure.text(*place, shown, va="top", fontsize=style.TITLE_SIZE)
        draw_key(figure, self.paint, MARGINS[0], KEY_FOOT)
        scales = [self.beyond] if self.beyond else []
        scales += [] if self.forces is None else [f"forces: {self.forces.example}"]
        scales += [f"loads: {self.acts.sizes}"] if self.acts.sizes else []
        if scales:
            self._tell("; ".join(scales))
        if self.support.is_still:
            draw_standing(self.canvas, self.scene, int(self.drawable[0]))

    def _tell(self, scales: str) -> None:
        """Write what leaves the view and the scale of arrows at the right, beside the time, where there is room."""
        marks = MARKS_ROOM * max(map(len, self.acts.marks), default=0)
        room = self.page.panel_width * style.POINTS_PER_INCH - TIME_ROOM - marks
        top = self.page.extent.top + 4.0 / self.page.points_per_mm
        text = style.cut_to(scales, room, style.FONT_SIZE)
        self.canvas.axes.text(self.page.extent.right, top, text, ha="right", va="bottom", color=style.FAINT_INK)

    def picture(self, frame: int) -> Pixels:
        """Return the picture of one frame."""
        axes = self.canvas.axes
        there = set(axes.get_children())
        with style.in_style(), style.no_word_of_missing_letters():
            self._draw(frame)
            moving = sorted((one for one in axes.get_children() if one not in there), key=lambda one: one.get_zorder())
            self.paper.restore_region(self.still)
            for artist in moving:
                axes.draw_artist(artist)
        for artist in moving:
            artist.remove()
        return np.array(self.paper.buffer_rgba())[..., :3]

    def _draw(self, frame: int) -> None:
        """Add to the panel what has moved since the last picture."""
        if not self.support.is_still:
            draw_standing(self.canvas, self.scene, frame)
        draw_blocks(self.canvas, self.scene, frame)
        if self.has_trails:
            self._draw_trails(frame)
        index = int(np.searchsorted(self.drawable, frame))
        draw_outside(self.canvas, self.acts, index, self.length)
        draw_marks(self.canvas, self.acts.marks[index], TIME_ROOM)
        if self.forces is not None:
            draw_forces(self.canvas, self.frames, frame, self.forces)
        top = self.page.extent.top + 4.0 / self.page.points_per_mm
        time = f"{float(self.frames.time[frame]):.3f} s"
        self.canvas.axes.text(self.page.extent.left, top, time, va="bottom")

    def _draw_trails(self, frame: int) -> None:
        """Draw the path of every free centre up to a frame."""
        from matplotlib.collections import LineCollection

        past = self.drawable[self.drawable <= frame]
        free = ~np.array(self.support.fixed or (False,) * len(self.frames.names), dtype=bool)
        ways = MILLIMETRES * np.stack([self.frames.x[past], self.frames.y[past]], axis=-1)[:, free]
        lines = LineCollection(list(ways.swapaxes(0, 1)), colors=style.INK, **TRAIL, transform=self.canvas.scene)
        self.canvas.axes.add_collection(lines)


def _even(page: Page) -> tuple[float, float]:
    """Return width and height (inches) of a page in whole pairs of pixels, as MP4 wants them; half a pixel spare."""
    pairs = (round(0.5 * side * DOTS_PER_INCH) for side in (page.width, page.height))
    width, height = ((2 * pair + 0.5) / DOTS_PER_INCH for pair in pairs)
    return width, height
