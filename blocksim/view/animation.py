"""A run as an animation: choice of frames, one picture after the other, GIF and MP4 files."""

import shutil
import subprocess
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from io import BytesIO
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from blocksim.errors import InvalidInputError, OutputError, UnavailableError
from blocksim.simulation.atomic import atomic_path, write_bytes
from blocksim.simulation.folder import NAME
from blocksim.view import style
from blocksim.view.arrows import (
    WithContacts,
    draw_forces,
    draw_marks,
    draw_outside,
    force_scale,
    length_in,
    outside,
    with_room,
)
from blocksim.view.paint import Paint, by_block, draw_key
from blocksim.view.run_data import (
    MILLIMETRES,
    Floats,
    FramesLike,
    Indices,
    Support,
    drawable_frames,
    extent_of,
    together,
)
from blocksim.view.scene import (
    Canvas,
    Page,
    Scene,
    depth_of,
    draw_blocks,
    draw_ruler,
    draw_standing,
    finish_panel,
    page_for,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from PIL.Image import Image


TICK = 0.01  # s, of a GIF's clock
SHORTEST = 2  # ticks; browsers slow down what is shorter
COLOURS = 128
FILLS, SHARES = 16, np.array([[0.2], [0.4], [0.6], [0.8]])  # so many colours get so many shades
UNKNOWN = 255
MOST_BYTES = 1 << 30  # of all pictures together, which Pillow keeps in memory

_Pixels = NDArray[np.uint8]
Encode = Callable[[Path, Iterator[_Pixels], float, int], bool]

PROGRAM = "ffmpeg"
QUALITY = 8.0  # of 10; thin lines stay sharp
CODECS = {  # of the system's ffmpeg, the best first
    "libx264": ["-c:v", "libx264", "-crf", "18"],
    "libopenh264": ["-c:v", "libopenh264", "-b:v", "4M"],
    "mpeg4": ["-c:v", "mpeg4", "-q:v", "3"],
}
OPTIONS = ["-movflags", "+faststart", "-metadata", f"comment={NAME.decode()}"]  # a browser may begin before it has all


def write_gif(path: Path, pictures: Iterator[_Pixels], seconds: NDArray[np.float64]) -> None:
    """Write pictures (height, width, 3) that are shown for the given seconds each; the GIF repeats for ever.

    Raises InvalidInputError for more than 50 pictures a second or more pictures than fit into memory, OutputError.
    """
    durations = ticks(seconds)
    if durations.min() < SHORTEST:
        message = f"{path}: a GIF shows at most {1.0 / (SHORTEST * TICK):.0f} frames per second; lower --fps"
        raise InvalidInputError(message)
    first = next(pictures)
    if len(seconds) * first[..., 0].size > MOST_BYTES:
        message = f"{path}: {len(seconds)} frames are too many for a GIF; write .mp4, raise --speed or lower --width"
        raise InvalidInputError(message)
    palette = Palette(first)
    buffer = BytesIO()
    palette.reduced(first).save(
        buffer,
        format="GIF",
        save_all=True,
        append_images=map(palette.reduced, pictures),
        duration=[int(10 * duration) for duration in durations],
        loop=0,
        comment=NAME,
    )
    write_bytes(path, buffer.getvalue())


def ticks(seconds: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return how many hundredths of a second each picture stays, so that they add up to the length of the animation."""
    ends = np.round(np.cumsum(seconds) / TICK).astype(np.int64)
    return np.diff(ends, prepend=0)


class Palette:
    """The colours of an animation: the most frequent ones of its first picture, unchanged, and shades of these.

    All others become the nearest.
    """

    def __init__(self, picture: _Pixels) -> None:
        """Choose the colours."""
        colours, counts = np.unique(_packed(picture), return_counts=True)
        frequent = colours[np.argsort(-counts, kind="stable")[:COLOURS]]
        self.colours = np.concatenate([_unpacked(frequent), _mixed(_unpacked(frequent))])
        self.numbers = np.full(1 << 24, UNKNOWN, dtype=np.uint8)  # of every colour, found when first met
        self.numbers[frequent] = np.arange(len(frequent))

    def reduced(self, picture: _Pixels) -> "Image":
        """Return a picture in these colours."""
        from PIL import Image

        packed = _packed(picture)
        unknown = np.unique(packed[self.numbers[packed] == UNKNOWN])
        apart = np.abs(_unpacked(unknown)[:, None] - self.colours).sum(axis=-1)
        self.numbers[unknown] = apart.argmin(axis=1)
        image = Image.fromarray(self.numbers[packed])
        image.putpalette(self.colours.astype(np.uint8).tobytes())
        return image


def _mixed(colours: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return shades between the first colours and the darkest: the edges of lines that come later."""
    darkest = colours[colours.sum(axis=1).argmin()]
    shades = darkest + (colours[:FILLS, None] - darkest) * SHARES
    mixed: NDArray[np.int32] = np.round(shades).astype(np.int32).reshape(-1, 3)
    return mixed


def _packed(picture: _Pixels) -> NDArray[np.int32]:
    """Return the colours of pixels as one number each."""
    red, green, blue = np.moveaxis(picture.astype(np.int32), -1, 0)
    packed: NDArray[np.int32] = red << 16 | green << 8 | blue
    return packed


def _unpacked(colours: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return red, green and blue, (k, 3)."""
    return np.stack([colours >> 16, colours >> 8 & 255, colours & 255], axis=-1)


def write_mp4(path: Path, pictures: Iterator[NDArray[np.uint8]], seconds: NDArray[np.float64]) -> None:
    """Write pictures (height, width, 3), both sides even, at the pace of the first one; held ones are repeated.

    Raises UnavailableError with neither the package nor ffmpeg, OutputError.
    """
    encode = _encoder()
    rate = 1.0 / float(seconds[0])
    repeats = np.round(seconds * rate).astype(int)
    shown = zip(repeats, pictures, strict=True)
    repeated = (np.ascontiguousarray(picture) for repeat, picture in shown for _ in range(repeat))
    with atomic_path(path) as temporary:
        try:
            is_whole = encode(temporary, repeated, rate, int(repeats.sum()))
        except (OSError, RuntimeError):
            is_whole = False
        if not is_whole:  # nothing else reports a disk that was full at the end
            message = f"{path}: cannot be written: ffmpeg stopped before the end"
            raise OutputError(message)


def _encoder() -> Encode:
    """Return what encodes pictures into a file; raises UnavailableError."""
    try:
        package = import_module("imageio_ffmpeg")
        package.get_ffmpeg_exe()
    except (ImportError, RuntimeError) as error:
        program = shutil.which(PROGRAM)
        if program is None:
            message = (
                f"MP4 needs ffmpeg, or the package imageio-ffmpeg ({error}); install the extra: "
                "pip install 'blocksim[video]'"
            )
            raise UnavailableError(message) from None
        return partial(_by_program, program)
    return partial(_by_package, package)


def _by_package(package: Any, path: Path, pictures: Iterator[_Pixels], rate: float, count: int) -> bool:
    """Encode pictures and return whether all of them are in the file."""
    first = next(pictures)
    size = first.shape[1], first.shape[0]
    settings = {"fps": rate, "quality": QUALITY, "macro_block_size": 2, "output_params": OPTIONS}
    stream = package.write_frames(str(path), size, **settings, ffmpeg_log_level="error")
    stream.send(None)
    try:
        for picture in chain([first], pictures):
            stream.send(picture)
    finally:
        stream.close()
    written, _ = package.count_frames_and_secs(str(path))
    return bool(written == count)


def _by_program(program: str, path: Path, pictures: Iterator[_Pixels], rate: float, count: int) -> bool:
    """Encode pictures by the ffmpeg of the system and return whether it has taken all of them and written its end."""
    first = next(pictures)
    size = f"{first.shape[1]}x{first.shape[0]}"
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", size, "-r", repr(rate), "-i", "-"]
    form = ["-an", *_codec(program), "-pix_fmt", "yuv420p", *OPTIONS, "-f", "mp4", str(path.absolute())]
    command = [program, "-y", "-loglevel", "error", *raw, *form]
    sent = 0
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as pipe:  # noqa: S603 - what `which` has found
        if pipe.stdin is None:
            return False
        for picture in chain([first], pictures):
            pipe.stdin.write(picture.tobytes())
            sent += 1
        pipe.stdin.close()
        return pipe.wait() == 0 and sent == count and path.stat().st_size > 0


def _codec(program: str) -> list[str]:
    """Return the options of the best encoder that this ffmpeg has; builds without H.264 have MPEG-4."""
    encoders = subprocess.run([program, "-hide_banner", "-encoders"], capture_output=True, text=True, check=False)  # noqa: S603 - as above
    known = {line.split()[1] for line in encoders.stdout.splitlines() if len(line.split()) > 1}
    return next((options for name, options in CODECS.items() if name in known), CODECS["mpeg4"])


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

        with style.styled_figure(*_even(self.page)) as figure, style.silence_missing_glyphs():
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
        with style.in_style(), style.silence_missing_glyphs():
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
