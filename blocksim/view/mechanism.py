"""A mechanism beside its last stable neighbour: displacements, the first mover, and which joints slide or rock."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from blocksim.simulation.observables import MOVED_SHARE
from blocksim.simulation.trajectory import SUPPORT, Frames, Rows
from blocksim.view import arrows, paints, run_data, scene, style

Pair = tuple[int, int]  # bodies a and b


class JointMotion(NamedTuple):
    """A joint in a frame: its points (m, scene, (k, 2)), whether it slides, and the point about which it rocks."""

    points: run_data.Floats
    slides: bool
    hinges: run_data.Floats  # (1, 2), or (0, 2) where it does not rock


class _Followed(NamedTuple):
    """Points of a joint in the frame that is drawn."""

    points: run_data.Floats  # (k, 2), on body b
    opening: run_data.Floats  # (k,), normal to the joint
    slip: run_data.Floats  # (k,), since the beginning


def joints(frames: Frames, frame: int, support: run_data.Support) -> list[JointMotion]:
    """Return the joints that slide or rock in a frame; none where no contact was recorded."""
    now = contacts_by_pair(arrows.contacts_of(frames).at(frame))
    found = [
        _joint(frames, (before, frame), support, rows, now.get(pair, rows[:0]))
        for pair, (before, rows) in _at_the_start(frames, frame, support).items()
    ]
    return [one for one in found if one.slides or len(one.hinges)]


def _at_the_start(frames: Frames, frame: int, support: run_data.Support) -> dict[Pair, tuple[int, Rows]]:
    """Return for each joint a frame before its bodies moved, and its points then: the most that it ever had."""
    contacts = arrows.contacts_of(frames)
    pressed = next((found for found in range(frame + 1) if len(contacts.at(found))), None)
    if pressed is None:
        return {}
    share = paints.displacements(frames, support)[: frame + 1] / frames.least_widths
    moved = np.column_stack([share > MOVED_SHARE, np.zeros(frame + 1, dtype=bool)])  # the last is the support, SUPPORT
    has_moved = np.maximum.accumulate(moved, axis=0)
    found: dict[Pair, tuple[int, Rows]] = {}
    for time in range(pressed, frame + 1):
        for pair, rows in contacts_by_pair(contacts.at(time)).items():
            is_early = time == pressed or not has_moved[time, list(pair)].any()
            if is_early and (pair not in found or len(rows) > len(found[pair][1])):
                found[pair] = time, rows
        if has_moved[time, :-1].all():
            break
    return found


def contacts_by_pair(rows: Rows) -> dict[Pair, Rows]:
    """Return contacts by the bodies that they are between, of those that press."""
    pairs: dict[Pair, list[int]] = defaultdict(list)
    for index, ends in enumerate(zip(rows["body_a"].tolist(), rows["body_b"].tolist(), strict=True)):
        pairs[ends].append(index)
    return {pair: rows[chosen] for pair, chosen in pairs.items() if (rows["normal_force"][chosen] > 0.0).any()}


def _joint(frames: Frames, times: tuple[int, int], support: run_data.Support, then: Rows, now: Rows) -> JointMotion:
    """Judge a joint by its points at the beginning and in the frame that is drawn."""
    pair = int(then["body_a"][0]), int(then["body_b"][0])
    least = MOVED_SHARE * min(float(frames.least_widths[body]) for body in pair if body != SUPPORT)
    early = _followed(frames, times, support, then)
    # how far apart on both bodies in the first frame the points were where they touch in the second
    slip = _followed(frames, times[::-1], support, now).slip
    late = _Followed(np.stack([now["x"], now["y"]], axis=-1), -now["overlap"], slip)
    turn_a, turn_b = (_turned(frames, body, times) for body in pair)
    both = _Followed(*(np.concatenate(parts) for parts in zip(early, late, strict=True)))
    is_closed = both.opening <= least
    rocks = abs(turn_a - turn_b) > MOVED_SHARE and bool(is_closed.any())
    touching = late if len(now) else early
    hinges = touching.points[[int(np.argmin(touching.opening))]] if rocks else touching.points[:0]
    return JointMotion(both.points, bool((both.slip[is_closed] > least).any()), hinges)


def _followed(frames: Frames, times: tuple[int, int], support: run_data.Support, rows: Rows) -> _Followed:
    """Follow the points of a joint on both bodies from one frame to the other."""
    if not len(rows):
        return _Followed(np.empty((0, 2)), np.empty(0), np.empty(0))
    pair = int(rows["body_a"][0]), int(rows["body_b"][0])
    points = np.stack([rows["x"], rows["y"]], axis=-1)
    on_a, on_b = (_carried(frames, body, times, points, support) for body in pair)
    normal = run_data.rotate_points(
        np.stack([rows["normal_x"], rows["normal_y"]], axis=-1), _turned(frames, pair[1], times)
    )
    apart = on_a - on_b
    slip = np.abs(apart[:, 1] * normal[:, 0] - apart[:, 0] * normal[:, 1])
    return _Followed(on_b, (apart * normal).sum(axis=1), slip)


def _turned(frames: Frames, body: int, times: tuple[int, int]) -> float:
    """Return how far a body turns between two frames (rad)."""
    return 0.0 if body == SUPPORT else float(frames.angle[times[1], body] - frames.angle[times[0], body])


def _carried(
    frames: Frames, body: int, times: tuple[int, int], points: run_data.Floats, support: run_data.Support
) -> run_data.Floats:
    """Return where points (k, 2) of a body are at another frame."""
    if body == SUPPORT:
        before, after = support.offset(frames.time[list(times)])
        return np.asarray(points + after - before)
    before, after = (np.array([frames.x[time, body], frames.y[time, body]]) for time in times)
    return np.asarray(run_data.rotate_points(points - before, _turned(frames, body, times)) + after)


WIDTH, TALLEST, LEAST_WIDTH, LOWEST = 7.2, 3.6, 3.0, 0.5  # inches
SIDE, GAP, HEAD, ROW_GAP, AXIS = 0.12, 0.16, 0.36, 0.12, 0.30  # inches
VISIBLE = 0.3  # of a block's shortest side: displacement from which on a mechanism is seen
SLIDES, ROCKS = "#E7298A", "#FFFFFF"  # no colour of displacements, loads or edges
FIRST: dict[str, Any] = {"color": "#000000", "linewidth": 1.8, "zorder": 3.2, "solid_joinstyle": "miter"}
ARROWS_OF_LOADS = "Red arrows: loads, on a scale of its own on each side."
ARROWS_OF_SPEED = "Black arrows: velocity of driven bodies."
SLIDING: dict[str, Any] = {"color": SLIDES, "linewidth": 2.6, "marker": "D", "markersize": 2.2, "zorder": 3.3}
HINGE: dict[str, Any] = {"color": ROCKS, "marker": "o", "markersize": 4.0, "zorder": 3.4}
HINGE |= {"markeredgecolor": style.INK, "markeredgewidth": 0.8}
ENTRIES, ENTRIES_WIDTH = 3, 3.8  # of the legend; inches that they need side by side


@dataclass(frozen=True, eq=False)
class BracketRun:
    """One side of a bracket: a run, its support, the block that moved first if any, and what is said above it."""

    frames: Frames
    support: run_data.Support
    first: str | None
    caption: str
    is_mechanism: bool

    @cached_property
    def acts(self) -> arrows.Actions:
        """What acts on the blocks in the frame that is drawn."""
        return arrows.actions_on(self.frames, np.array([self.frame]), self.support)

    @cached_property
    def frame(self) -> int:
        """The last frame; of a mechanism the first in which it is seen."""
        drawable = run_data.drawable_frames(self.frames)
        if not self.is_mechanism:
            return int(drawable[-1])
        shortest = self.frames.least_widths
        seen = (paints.displacements(self.frames, self.support)[drawable] > VISIBLE * shortest).any(axis=1)
        return int(drawable[int(np.argmax(seen))] if seen.any() else drawable[-1])


def draw_mechanisms(
    brackets: Sequence[tuple[BracketRun, BracketRun]],
    path: Path | str,
    title: str | None = None,
    paper: style.Paper = style.OWN,
) -> None:
    """Draw both sides of every bracket, a row each, and write PNG, SVG or PDF; the same input gives the same bytes.

    Raises InvalidInputError for an unknown picture format, too small a page and runs without contacts, OutputError.
    """
    path = style.picture_path(path)
    width = paper.width(WIDTH, LEAST_WIDTH)
    across = 0.5 * (width - GAP)
    sides = [side for pair in brackets for side in pair]
    most = max(float(paints.displacements(side.frames, side.support)[side.frame].max()) for side in sides)
    paint = paints.by_displacement(sides[0].frames, sides[0].support, most)
    texts = [ARROWS_OF_LOADS] if any(side.acts.sizes for side in sides) else []
    texts += [ARROWS_OF_SPEED] if any(arrows.SPEED in side.acts.largest for side in sides) else []
    notes = style.break_lines(" ".join(texts), width - 2.0 * SIDE) if texts else []
    columns = ENTRIES if width >= ENTRIES_WIDTH else 1
    legend = style.LINE * (len(notes) + ENTRIES // columns)
    foot, rows = AXIS + paint.height + legend, len(brackets)
    tallest = min(paper.panel(TALLEST, rows, HEAD + foot + rows * (HEAD + ROW_GAP), LOWEST), TALLEST)
    pages = [scene.page_for(_extent(pair), across, tallest, (SIDE, HEAD, ROW_GAP)) for pair in brackets]
    height = paper.height(HEAD + sum(page.height for page in pages) + foot)
    look = {"edgecolor": FIRST["color"], "linewidth": FIRST["linewidth"]}
    handles = [
        style.legend_entry("first block to move", facecolor="none", **look),
        style.legend_entry("sliding joint", **SLIDING),
        style.legend_entry("hinge", linestyle="none", **HINGE),
    ]
    with style.open_figure(width, height, paper.dots) as figure:
        top = height - HEAD
        for pair, page in zip(brackets, pages, strict=True):
            for column, side in enumerate(pair):
                _draw_side(figure, side, page, (column * (across + GAP) + SIDE, top), most)
            top -= page.height
        paints.draw_key(figure, paint, SIDE, style.EDGE + legend)
        style.write_legend(figure, handles, SIDE, style.EDGE + style.LINE * len(notes), ncols=columns, handlelength=1.6)
        style.write_text(figure, SIDE, style.EDGE, "\n".join(notes), color=style.FAINT_INK, va="bottom")
        style.write_heading(figure, title, SIDE)
        style.save_figure(figure, path)


def _extent(pair: tuple[BracketRun, BracketRun]) -> run_data.Extent:
    """Return what both panels of a row show: on one scale, all blocks of either."""
    found = [run_data.extent_of(side.frames, np.array([side.frame]), side.support) for side in pair]
    one, other = (arrows.with_room(extent, side.acts)[0] for extent, side in zip(found, pair, strict=True))
    least = {name: min(getattr(one, name), getattr(other, name)) for name in ("left", "bottom", "base")}
    return replace(one, right=max(one.right, other.right), top=max(one.top, other.top), **least)


def _draw_side(
    figure: "style.Figure", side: BracketRun, page: scene.Page, corner: tuple[float, float], most: float
) -> None:
    """Draw a panel with its upper left corner at a place in inches; ground is tilted as it is on that side."""
    left, top = corner
    page = replace(page, extent=replace(page.extent, tilt=side.support.tilt))
    canvas = page.canvas(figure, left, top - HEAD - page.panel_height)
    paint = paints.by_displacement(side.frames, side.support, most)
    shown = scene.Scene(side.frames, side.support, paint, with_tops=False)  # tops read as joints
    scene.draw_scene(canvas, shown, side.frame)
    longest = arrows.LENGTH * max(page.extent.width, page.extent.height)
    arrows.draw_actions(canvas, side.acts, 0, longest)
    if side.first in side.frames.names:
        outline = scene.corners(side.frames, side.frame)[side.frames.names.index(side.first)]
        canvas.axes.plot(*np.concatenate([outline, outline[:2]]).T, transform=canvas.scene, **FIRST)
    for joint in joints(side.frames, side.frame, side.support):
        if joint.slides:
            canvas.axes.plot(
                *run_data.MILLIMETRES * joint.points.T, transform=canvas.scene, solid_capstyle="butt", **SLIDING
            )
        for x, y in run_data.MILLIMETRES * joint.hinges:
            canvas.axes.plot(x, y, transform=canvas.scene, **HINGE)
    scene.finish_panel(canvas, labelled=False, is_numbered=False)
    room = page.panel_width * style.POINTS_PER_INCH
    for number, line in enumerate(side.caption.split("\n")):
        text = style.cut_to(line, room, style.FONT_SIZE)
        colour = style.FAINT_INK if number else style.INK
        style.write_text(figure, left, top - style.LINE * (number + 1), text, color=colour)
