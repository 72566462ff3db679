"""Forces in the joints of a structure with the line of thrust, and the mechanism that statics finds beyond them."""

import math
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from blocksim.scenario import Model, placement
from blocksim.simulation.trajectory import SUPPORT, Frames, forces_on_a
from blocksim.statics.joint_forces import BlockMotion, JointForce
from blocksim.view import arrows, mechanism, paints, run_data, scene, style

WIDTH, TALLEST, LEAST_WIDTH = 7.2, 3.6, 3.0  # inches
SIDE, GAP, HEAD = 0.12, 0.16, 0.36  # inches
MOVED = 0.4  # of the usual side of a block: the largest way in the picture of a mechanism
LOADED = 1e-3  # of the greatest force: joints with less are not drawn
BAR = 0.45  # of the mean side of the blocks: half the length of a bar of the greatest force
THICK, THIN = 3.2, 0.7  # points: bars of the greatest force, and of none
AT_AN_EDGE = 1e-3  # of a joint: a force that near to its end makes a hinge
PAIR = 2
FORCE: dict[str, Any] = {"colors": style.MEASURED_COLOUR, "capstyle": "round", "zorder": 3.2}
LINE: dict[str, Any] = {"colors": style.INK, "linewidths": 1.0, "linestyles": [(0, (3, 2))], "zorder": 3.1}
PALE = "#F4F4F4"
NOTES = (
    "Bars: forces in joints, in their direction; length and width go with the root of the force. Dashed: line of "
    "thrust through blocks with two loaded joints."
)
SEVERAL = "One of several equilibria, and one of several mechanisms, where there is more than one."


class _Panels(NamedTuple):
    """What is drawn: frames with what stands above each, forces in the joints of the first one, and notes."""

    frames: Frames
    support: run_data.Support
    shown: Sequence[tuple[int, str]]
    joints: Sequence[JointForce]
    notes: str


def draw_thrust(
    model: Model,
    joints: Sequence[JointForce],
    motions: Sequence[BlockMotion],
    heads: tuple[str, str],
    path: Path,
    title: str | None = None,
    paper: style.Paper = style.OWN,
) -> None:
    """Draw joints with their forces, and the mechanism beside them, and write PNG, SVG or PDF.

    `heads` stand above both panels. The same input gives the same bytes. Raises InvalidInputError for an unknown
    picture format or too small a page, OutputError.
    """
    frames, support = _frames(model, motions), run_data.support_of(model)
    _draw(_Panels(frames, support, [*enumerate(heads)], joints, f"{NOTES} {SEVERAL}"), path, title, paper)


def draw_run_thrust(frames: Frames, path: Path, options: scene.PictureOptions = scene.PLAIN) -> None:
    """Draw the forces in the joints of a run in its last frame, or the one nearest to the last time asked for.

    Raises InvalidInputError for runs without contacts, and as `draw_thrust`.
    """
    drawable = run_data.drawable_frames(frames)
    chosen = drawable if options.times is None else run_data.moments_at(frames, drawable, options.times)
    frame = int(chosen[-1])
    head = f"forces in joints at {float(frames.time[frame]):.3f} s"
    panels = _Panels(frames, options.support, [(frame, head)], run_joints(frames, frame), NOTES)
    _draw(panels, path, options.title, options.paper)


def run_joints(frames: Frames, frame: int) -> list[JointForce]:
    """Return what joints carry in a frame of a run. Raises InvalidInputError where no contacts were stored."""
    joints = []
    for (a, b), rows in mechanism.contacts_by_pair(arrows.contacts_of(frames).at(frame)).items():
        normal = np.array([rows["normal_x"], rows["normal_y"]]).mean(axis=1)
        normal /= np.hypot(*normal)  # from body b to body a
        force, pressed = forces_on_a(rows).sum(axis=0), rows["normal_force"]
        points = np.stack([rows["x"], rows["y"]], axis=-1)
        along = points @ np.array([-normal[1], normal[0]])
        x, y = pressed @ points / pressed.sum()
        reach = float(np.array([x, y]) @ np.array([-normal[1], normal[0]]))
        ends = points[[int(np.argmin(along)), int(np.argmax(along))]]
        joints.append(
            JointForce(
                one=None if b == SUPPORT else frames.names[b],
                other=None if a == SUPPORT else frames.names[a],
                x_m=x,
                y_m=y,
                compression=float(force @ normal),
                shear=float(force @ np.array([-normal[1], normal[0]])),
                margin_m=min(reach - float(along.min()), float(along.max()) - reach),
                slides=False,
                ends_m=ends.tolist(),
                normal=normal.tolist(),
            )
        )
    return joints


def _draw(panels: _Panels, path: Path, title: str | None, paper: style.Paper) -> None:
    path = style.picture_path(path)
    frames, support, shown, joints, _ = panels
    first, chosen = shown[0][0], np.array([frame for frame, _ in shown])
    acts = arrows.actions_on(frames, chosen[:1], support)
    width = paper.width(WIDTH, LEAST_WIDTH)
    across = (width - GAP * (len(shown) - 1)) / len(shown)
    notes = style.break_lines(panels.notes, width - 2.0 * SIDE)
    foot = style.LINE * (len(notes) + 1) + style.EDGE
    tallest = min(paper.panel(TALLEST, 1, HEAD + HEAD + foot, mechanism.LOWEST), TALLEST)
    extent = arrows.with_room(run_data.extent_of(frames, chosen, support), acts)[0]
    page = scene.page_for(extent, across, tallest, (SIDE, HEAD, 0.0))
    height = paper.height(HEAD + page.height + foot)
    handles = [
        style.legend_entry("force in a joint", color=style.MEASURED_COLOUR, linewidth=2.0),
        style.legend_entry("hinge", linestyle="none", **mechanism.HINGE),
    ]
    if any(one.slides for one in joints):
        handles.append(style.legend_entry("all friction in use", **mechanism.SLIDING))
    paint = paints.Paint(lambda _: [PALE] * len(frames.names))
    with style.open_figure(width, height, paper.dots) as figure:
        for number, (frame, head) in enumerate(shown):
            left = number * (across + GAP)
            canvas = page.canvas(figure, left + SIDE, height - 2.0 * HEAD - page.panel_height)
            scene.draw_scene(canvas, scene.Scene(frames, support, paint, with_tops=False), frame)
            if number == 0:
                _draw_joints(canvas, frames, joints)
                arrows.draw_actions(canvas, acts, 0, arrows.LENGTH * max(page.extent.width, page.extent.height))
            else:
                start = scene.corners(frames, first)
                closed = np.concatenate([start, start[:, :1]], axis=1)
                style.add_lines(canvas.axes, closed, **scene.START_LINE, zorder=scene.START, transform=canvas.scene)
            scene.finish_panel(canvas, labelled=False, is_numbered=False)
            canvas.axes.spines["bottom"].set_visible(False)
            text = style.cut_to(head, page.panel_width * style.POINTS_PER_INCH, style.FONT_SIZE)
            style.write_text(figure, left + SIDE, height - HEAD - style.LINE, text)
        style.write_legend(figure, handles, SIDE, style.EDGE + style.LINE * len(notes), ncols=3, handlelength=1.6)
        style.write_text(figure, SIDE, style.EDGE, "\n".join(notes), color=style.FAINT_INK, va="bottom")
        style.write_heading(figure, title, SIDE)
        style.save_figure(figure, path)


def _frames(model: Model, motions: Sequence[BlockMotion]) -> Frames:
    """Return the blocks as they are placed, and as they are when they have moved a little in the mechanism."""
    placed = model.bodies
    ways = {one.block: (one.x_m, one.y_m, one.turn_rad) for one in motions}
    moved = np.array([ways.get(body.name, (0.0, 0.0, 0.0)) for body in placed])
    usual = float(np.median([body.least_width for body in placed]))
    start = np.array([(body.x, body.y, body.angle) for body in placed])
    x, y, angle = np.stack([start, start + MOVED * usual * moved]).transpose(2, 0, 1)
    rest = np.zeros_like(x)
    size_x, size_y = np.array([(body.size_x, body.size_y) for body in placed]).T
    names = tuple(body.name for body in placed)
    return Frames(np.arange(2), np.zeros(2), x, y, angle, rest, rest, rest, {}, np.zeros(2), np.zeros(2), names,
        size_x, size_y, start[:, 2], outlines=placement.outlines_of(placed))  # fmt: skip


def _draw_joints(canvas: scene.Canvas, frames: Frames, joints: Sequence[JointForce]) -> None:
    """Draw the forces of joints, the line of thrust, hinges and sliding joints."""
    forces = np.array([one.force for one in joints]).reshape(-1, 2)
    sizes = np.hypot(*forces.T)
    greatest = float(sizes.max(initial=0.0))
    side = 0.5 * float(frames.size_x.mean() + frames.size_y.mean())
    loaded, bars, widths = [], [], []
    places: dict[str, list[tuple[float, float]]] = defaultdict(list)
    for one, force, size in zip(joints, forces, sizes.tolist(), strict=True):
        if not size > LOADED * greatest:
            continue
        loaded.append(one)
        share = float(np.sqrt(size / greatest))
        half = BAR * side * share * force / size
        place = np.array([one.x_m, one.y_m])
        bars.append(run_data.MILLIMETRES * np.stack([place - half, place + half]))
        widths.append(THIN + (THICK - THIN) * share)
        for name in (one.one, one.other):
            if name is not None:
                places[name].append((one.x_m, one.y_m))
    lines = [run_data.MILLIMETRES * np.array(pair) for pair in places.values() if len(pair) == PAIR]
    style.add_lines(canvas.axes, lines, **LINE, transform=canvas.scene)
    style.add_lines(canvas.axes, bars, linewidths=widths, **FORCE, transform=canvas.scene)
    for one in loaded:
        ends = run_data.MILLIMETRES * np.array(one.ends_m)
        if one.slides:
            canvas.axes.plot(*ends.T, transform=canvas.scene, solid_capstyle="butt", **mechanism.SLIDING)
        elif len(ends) == PAIR and one.margin_m < AT_AN_EDGE * math.dist(*one.ends_m):
            canvas.axes.plot(run_data.MILLIMETRES * one.x_m, run_data.MILLIMETRES * one.y_m, transform=canvas.scene,
                **mechanism.HINGE)  # fmt: skip
