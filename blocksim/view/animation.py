"""A run as an animation: choice of frames, one picture after the other, GIF and MP4 files."""

import shutil
import subprocess
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib import import_module
from io import BytesIO
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from blocksim.errors import InvalidInputError, OutputError, UnavailableError
from blocksim.simulation.files import NAME, atomic_path, write_bytes
from blocksim.simulation.trajectory import Frames
from blocksim.view import arrows, paints, run_data, scene, style

if TYPE_CHECKING:
    from PIL.Image import Image


Pixels = NDArray[np.uint8]  # (height, width, 3), red, green, blue
Writer = Callable[[Path, Iterator[Pixels], run_data.Floats], None]

TICK = 0.01  # s, of a GIF's clock
SHORTEST = 2  # ticks; browsers slow down what is shorter
COLOURS = 128
FILLS, SHARES = 16, np.array([[0.2], [0.4], [0.6], [0.8]])  # so many colours get so many shades
CODE = np.array([1 << 16, 1 << 8, 1], dtype=np.int32)  # of red, green and blue: a colour as one number
UNKNOWN = 255
MOST_BYTES = 1 << 30  # of all pictures together, which Pillow keeps in memory

PROGRAM = "ffmpeg"
CODECS = {  # of ffmpeg, the best first; builds without H.264 have MPEG-4
    "libx264": ["-c:v", "libx264", "-crf", "18"],
    "libopenh264": ["-c:v", "libopenh264", "-b:v", "4M"],
    "mpeg4": ["-c:v", "mpeg4", "-q:v", "3"],
}
OPTIONS = ["-movflags", "+faststart", "-metadata", f"comment={NAME.decode()}"]  # a browser may begin before it has all


def write_gif(path: Path, pictures: Iterator[Pixels], seconds: run_data.Floats) -> None:
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
    reduce = palette_of(first)
    buffer = BytesIO()
    reduce(first).save(
        buffer,
        format="GIF",
        save_all=True,
        append_images=map(reduce, pictures),
        duration=[int(10 * duration) for duration in durations],
        loop=0,
        comment=NAME,
    )
    write_bytes(path, buffer.getvalue())


def ticks(seconds: run_data.Floats) -> NDArray[np.int64]:
    """Return how many hundredths of a second each picture stays, so that they add up to the length of the animation."""
    ends = np.round(np.cumsum(seconds) / TICK).astype(np.int64)
    return np.diff(ends, prepend=0)


def palette_of(picture: Pixels) -> "Callable[[Pixels], Image]":
    """Return what reduces pictures to the most frequent colours of one, unchanged, and shades of these.

    The shades lie between the first colours and the darkest: the edges of lines that come later. All others become the
    nearest.
    """
    from PIL import Image

    codes, counts = np.unique(picture.astype(np.int32) @ CODE, return_counts=True)
    codes = codes[np.argsort(-counts, kind="stable")[:COLOURS]]
    frequent = codes[:, None] // CODE % 256
    darkest = frequent[frequent.sum(axis=1).argmin()]
    shades = np.round(darkest + (frequent[:FILLS, None] - darkest) * SHARES).reshape(-1, 3)
    palette = np.concatenate([frequent, shades]).astype(np.int32)
    numbers = np.full(1 << 24, UNKNOWN, dtype=np.uint8)  # of every colour, found when first met
    numbers[codes] = np.arange(len(codes))

    def reduce(pixels: Pixels) -> Image.Image:
        found = pixels.astype(np.int32) @ CODE
        unknown = np.unique(found[numbers[found] == UNKNOWN])
        apart = np.abs((unknown[:, None] // CODE % 256)[:, None] - palette).sum(axis=-1)
        numbers[unknown] = apart.argmin(axis=1)
        image = Image.fromarray(numbers[found])
        image.putpalette(palette.astype(np.uint8).tobytes())
        return image

    return reduce


def write_mp4(path: Path, pictures: Iterator[Pixels], seconds: run_data.Floats) -> None:
    """Write pictures (height, width, 3), both sides even, at the pace of the first one; held ones are repeated.

    Raises UnavailableError with neither the package nor ffmpeg, OutputError.
    """
    try:
        program = str(import_module("imageio_ffmpeg").get_ffmpeg_exe())
    except (ImportError, RuntimeError) as error:
        program = shutil.which(PROGRAM) or ""
        if not program:
            needed = "MP4 needs ffmpeg, or the package imageio-ffmpeg"
            message = f"{needed} ({error}); install the extra: pip install 'blocksim[video]'"
            raise UnavailableError(message) from None
    rate = 1.0 / float(seconds[0])
    first = next(pictures)
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{first.shape[1]}x{first.shape[0]}", "-r", repr(rate)]
    with atomic_path(path) as temporary:
        form = ["-an", *_codec(program), "-pix_fmt", "yuv420p", *OPTIONS, "-f", "mp4", str(temporary.absolute())]
        command = [program, "-y", "-xerror", "-loglevel", "error", *raw, "-i", "-", *form]
        quiet: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        try:
            with subprocess.Popen(command, stdin=subprocess.PIPE, **quiet) as pipe:  # noqa: S603 - what was found
                assert pipe.stdin is not None  # noqa: S101 - it is a pipe
                for repeat, picture in zip(np.round(seconds * rate).astype(int), chain([first], pictures), strict=True):
                    for _ in range(repeat):
                        pipe.stdin.write(picture.tobytes())
                pipe.stdin.close()
                is_whole = pipe.wait() == 0 and temporary.stat().st_size > 0
        except OSError:
            is_whole = False
        if not is_whole:
            raise OutputError(f"{path}: cannot be written: ffmpeg stopped before the end")


def _codec(program: str) -> list[str]:
    """Return the options of the best encoder that this ffmpeg has."""
    encoders = subprocess.run([program, "-hide_banner", "-encoders"], capture_output=True, text=True, check=False)  # noqa: S603 - as above
    known = {line.split()[1] for line in encoders.stdout.splitlines() if len(line.split()) > 1}
    return next((options for name, options in CODECS.items() if name in known), CODECS["mpeg4"])


WRITERS: dict[str, Writer] = {".gif": write_gif, ".mp4": write_mp4}  # by suffix; one function and one line a format
DOTS_PER_INCH = 100.0  # letters of 11 pixels
MARGINS = 0.15, 0.50, 0.42  # inches: at the sides, above and below the panel
HIGHEST = 1.25  # height of the panel over its width
HELD = 1.5  # s that the last picture stays
MOST_PICTURES = 10_000
TIME_ROOM, MARKS_ROOM = 60.0, 70.0  # points: for the time, and for a mark of what acts on all bodies
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
    paint: paints.Paint | None = None


def draw_animation(
    frames: Frames,
    path: Path | str,
    pace: Pace | None = None,
    look: Look | None = None,
    support: run_data.Support | None = None,
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
    chosen, seconds = frame_times(frames, run_data.drawable_frames(frames), pace or Pace())
    animation = Animation(frames, support or run_data.LEVEL, look or Look())

    def pictures() -> Iterator[Pixels]:
        for number, frame in enumerate(chosen, start=1):
            yield animation.picture(int(frame))
            on_picture(number, len(chosen))

    write(path, pictures(), seconds)
    return len(chosen), animation.beyond


def writer_of(path: Path) -> Writer:
    """Return what writes a file of this name; raises InvalidInputError for a format that is not written."""
    write = WRITERS.get(path.suffix.lower())
    if write is None:
        raise InvalidInputError(f"{path}: '{path.suffix}' unsupported format; use {' or '.join(WRITERS)}")
    return write


def frame_times(frames: Frames, drawable: run_data.Indices, pace: Pace) -> tuple[run_data.Indices, run_data.Floats]:
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


def beyond_view(names: Sequence[str], seen: run_data.Flags) -> str:
    """Return which blocks leave the view, by name where they are few; empty where all stay."""
    gone = [name for name, is_seen in zip(names, seen, strict=True) if not is_seen]
    if not gone:
        return ""
    verb = "leaves" if len(gone) == 1 else "leave"
    if len(gone) <= 2:  # of blocks that leave the view
        return f"block{'' if len(gone) == 1 else 's'} {' and '.join(gone)} {verb} the view"
    return f"{len(gone)} of {len(names)} blocks {verb} the view"


class Animation:
    """Draws one frame after the other on the same page; fixed parts are drawn once."""

    def __init__(self, frames: Frames, support: run_data.Support, look: Look) -> None:
        """Draw what is fixed: title, axis, and the support unless it moves, on a page as high as the run needs.

        Raises InvalidInputError for forces that were not stored.
        """
        self.frames, self.support = frames, support
        self.forces = arrows.force_scale(frames) if look.forces else None
        self.drawable = run_data.drawable_frames(frames)
        self.has_trails = len(frames.names) <= FEW_BLOCKS if look.trails is None else look.trails
        paint = look.paint or paints.by_block(frames)
        self.scene = scene.Scene(frames, support, paint)
        across = look.width / DOTS_PER_INCH
        side, head, foot = MARGINS
        self.seen = run_data.blocks_in_view(frames, self.drawable, support)
        self.beyond = beyond_view(frames.names, self.seen)
        extent = run_data.extent_of(frames, self.drawable, support, self.seen)
        self.acts = arrows.actions_on(frames, self.drawable, support)
        extent, self.length = arrows.with_room(extent, self.acts)
        margins = side, head, foot + paint.height
        self.page = page = scene.page_for(extent, across, HIGHEST * (across - 2.0 * side), margins)
        # whole pairs of pixels, as MP4 wants them; half a pixel spare
        pairs = (round(0.5 * one * DOTS_PER_INCH) for one in (page.width, page.height))
        width, height = ((2 * pair + 0.5) / DOTS_PER_INCH for pair in pairs)
        with style.open_figure(width, height) as figure, style.silence_missing_glyphs():
            figure.set_dpi(DOTS_PER_INCH)
            self.canvas = page.canvas(figure)
            scene.finish_panel(self.canvas, labelled=True)
            style.write_heading(figure, look.title, side)
            paints.draw_key(figure, paint, side, 0.04)  # inches, below what explains the colours
            scales = [self.beyond, "" if self.forces is None else f"forces: {self.forces.example}"]
            scales.append(f"loads: {self.acts.sizes}" if self.acts.sizes else "")
            # at the right, beside the time, where there is room
            marks = MARKS_ROOM * max(map(len, self.acts.marks), default=0)
            room = page.panel_width * style.POINTS_PER_INCH - TIME_ROOM - marks
            text = style.cut_to("; ".join(filter(None, scales)), room, style.FONT_SIZE)
            place = page.extent.right, page.extent.top + 4.0 / page.points_per_mm
            self.canvas.axes.text(*place, text, ha="right", va="bottom", color=style.FAINT_INK)
            self.is_still = support.motion is None and not np.isfinite(support.gone).any()
            if self.is_still:
                scene.draw_surroundings(self.canvas, self.scene, int(self.drawable[0]))
            self.paper = cast("Any", figure.canvas)
            self.paper.draw()
            self.still = self.paper.copy_from_bbox(figure.bbox)

    def picture(self, frame: int) -> Pixels:
        """Return the picture of one frame: the fixed parts, and what has moved."""
        canvas, frames, axes = self.canvas, self.frames, self.canvas.axes
        there, index = set(axes.get_children()), int(np.searchsorted(self.drawable, frame))
        with style.in_style(), style.silence_missing_glyphs():
            if not self.is_still:
                scene.draw_surroundings(canvas, self.scene, frame)
            scene.draw_blocks(canvas, self.scene, frame)
            if self.has_trails:  # the paths of all free centres
                past, free = self.drawable[: index + 1], ~run_data.is_fixed(frames, self.support)
                ways = run_data.MILLIMETRES * np.stack([frames.x[past], frames.y[past]], axis=-1)[:, free]
                style.add_lines(axes, ways.swapaxes(0, 1), colors=style.INK, **TRAIL, transform=canvas.scene)
            arrows.draw_actions(canvas, self.acts, index, self.length)
            arrows.draw_marks(canvas, self.acts.marks[index], TIME_ROOM)
            if self.forces is not None:
                arrows.draw_forces(canvas, frames, frame, self.forces)
            top = canvas.extent.top + 4.0 / canvas.points_per_mm
            axes.text(canvas.extent.left, top, f"{float(frames.time[frame]):.3f} s", va="bottom")
            moving = sorted((one for one in axes.get_children() if one not in there), key=lambda one: one.get_zorder())
            self.paper.restore_region(self.still)
            for artist in moving:
                axes.draw_artist(artist)
        for artist in moving:
            artist.remove()
        return np.array(self.paper.buffer_rgba())[..., :3]
