"""The surface of soil at several times on one panel, with the blocks as they are at the last of them."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from blocksim.errors import InvalidInputError
from blocksim.view import style
from blocksim.view.forces import WithContacts
from blocksim.view.layout import OWN, Paper
from blocksim.view.measured import MeasuredTable
from blocksim.view.paint import Paint, draw_key
from blocksim.view.panel import Canvas, depth_of, draw_ruler, finish_panel, page_for
from blocksim.view.run_data import (
    Support,
    drawable_frames,
    moments_at,
    moments_by_motion,
    others_of,
)
from blocksim.view.scene import Scene, draw_scene
from blocksim.view.window import MILLIMETRES, extent_of

_WIDTH, _LEAST_WIDTH, TALLEST = 7.2, 2.0, 6.0  # inches
_SIDE, _HEAD, AXIS = 0.25, 0.40, 0.42  # inches
LINES = 6  # by default
COLOURS = "viridis"
PALE = "#e8e8e8"
THICK = 1.4  # points


def draw_profile(
    frames: WithContacts,
    path: Path | str,
    title: str | None = None,
    measured: MeasuredTable | None = None,  # noqa: ARG001 - of blocks
    support: Support | None = None,
    *,
    forces: bool = False,  # noqa: ARG001 - of blocks
    times: Sequence[float] | None = None,
    paint: Paint | None = None,  # noqa: ARG001 - lines are coloured by time
    paper: Paper = OWN,
) -> None:
    """Draw the surface of soil at these times (s), by default at six that are even in motion.

    Raises InvalidInputError for an unknown picture format, a run without soil, a time that was not stored or a page
    that is too small, and OutputError when the file cannot be written.
    """
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    path = Path(path)
    style.picture_suffix(path)
    support = support or Support()
    drawable = drawable_frames(frames)
    chosen = moments_by_motion(frames, drawable, LINES) if times is None else moments_at(frames, drawable, times)
    chosen = np.unique(chosen)
    soils = [track for track in others_of(frames) if track.system.profile is not None]
    lines = [
        [line for one in soils if one.system.profile for line in one.system.profile(one, frame)]
        for frame in chosen.tolist()
    ]
    if not any(lines):
        message = "no soil in this run: --kind profile draws its surface"
        raise InvalidInputError(message)
    shades = [to_hex(colour) for colour in colormaps[COLOURS](np.linspace(0.0, 0.85, len(chosen)))]  # dark to light
    named = tuple((f"{float(frames.time[frame]):.3f} s", shade) for frame, shade in zip(chosen, shades, strict=True))
    key = Paint(lambda _: [PALE] * len(frames.names), named)
    page = page_for(
        extent_of(frames, drawable, support),
        paper.width(_WIDTH, _LEAST_WIDTH),
        TALLEST,
        (_SIDE, _HEAD, AXIS + key.height),
    )
    with style.styled_figure(page.width, paper.height(page.height), paper.dots) as figure:
        canvas = Canvas(figure.add_axes(page.place), page.extent, page.points_per_mm)
        draw_scene(canvas, Scene(frames, support, key, with_others=False), int(chosen[-1]))
        for shade, of_frame in zip(shades, lines, strict=True):
            for line in of_frame:
                canvas.axes.plot(*(MILLIMETRES * line).T, color=shade, linewidth=THICK, transform=canvas.scene)
        finish_panel(canvas, (page.panel_width, page.panel_height), labelled=True)
        if page.extent.tilt:
            draw_ruler(canvas, depth_of(0))
        draw_key(figure, key, _SIDE, 0.06)
        if title:
            shown = style.cut_to(f"{title}: surface", page.panel_width * style.POINTS_PER_INCH, style.TITLE_SIZE)
            figure.text(_SIDE / page.width, 1.0 - 0.08 / page.height, shown, va="top", fontsize=style.TITLE_SIZE)
        style.save_figure(figure, path)
