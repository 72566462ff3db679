"""A mechanism beside its last stable neighbour: displacements, the first mover, and which joints slide or rock."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from blocksim.simulation.frames import SUPPORT, Contacts, Rows
from blocksim.simulation.observables import MOVED_SHARE
from blocksim.view import style
from blocksim.view.arrows import SPEED, Outside, WithContacts, contacts_of, draw_outside, length_in, outside, with_room
from blocksim.view.paint import by_displacement, displacements, draw_key
from blocksim.view.run_data import MILLIMETRES, Extent, Floats, Support, drawable_frames, extent_of, shortest_sides
from blocksim.view.scene import Canvas, Page, Scene, corners, draw_scene, finish_panel, page_for
from blocksim.view.style import EDGE, LINE, OWN, Paper, add_axes, wrapped, write_heading, write_legend, write_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure


Pair = tuple[int, int]  # bodies a and b


class Joint(NamedTuple):
    """A joint in a frame: its points (m, scene, (k, 2)), whether it slides, and the point about which it rocks."""

    points: Floats
    slides: bool
    hinges: Floats  # (1, 2), or (0, 2) where it does not rock


class _Followed(NamedTuple):
    """Points of a joint in the frame that is drawn."""

    points: Floats  # (k, 2), on body b
    opening: Floats  # (k,), normal to the joint
    slip: Floats  # (k,), since the beginning


def joints(frames: WithContacts, frame: int, support: Support) -> list[Joint]:
    """Return the joints that slide or rock in a frame; none where no contact was recorded."""
    contacts = contacts_of(frames)
    now = _by_pair(contacts.at(frame))
    found = [
        _joint(frames, (before, frame), support, rows, now.get(pair, rows[:0]))
        for pair, (before, rows) in _at_the_start(frames, contacts, frame, support).items()
    ]
    return [one for one in found if one.slides or len(one.hinges)]


def _at_the_start(
    frames: WithContacts, contacts: Contacts, frame: int, support: Support
) -> dict[Pair, tuple[int, Rows]]:
    """Return for each joint a frame before its bodies moved, and its points then: the most that it ever had."""
    pressed = next((found for found in range(frame + 1) if len(contacts.at(found))), None)
    if pressed is None:
        return {}
    share = displacements(frames, support)[: frame + 1] / shortest_sides(frames)
    moved = np.column_stack([share > MOVED_SHARE, np.zeros(frame + 1, dtype=bool)])  # the last is the support, SUPPORT
    has_moved = np.maximum.accumulate(moved, axis=0)
    found: dict[Pair, tuple[int, Rows]] = {}
    for time in range(pressed, frame + 1):
        for pair, rows in _by_pair(contacts.at(time)).items():
            is_early = time == pressed or not has_moved[time, list(pair)].any()
            if is_early and (pair not in found or len(rows) > len(found[pair][1])):
                found[pair] = time, rows
        if has_moved[time, :-1].all():
            break
    return found


def _by_pair(rows: Rows) -> dict[Pair, Rows]:
    """Return contacts by the bodies that they are between, of those that press."""
    pairs: dict[Pair, list[int]] = defaultdict(list)
    for index, ends in enumerate(zip(rows["body_a"].tolist(), rows["body_b"].tolist(), strict=True)):
        pairs[ends].append(index)
    return {pair: rows[chosen] for pair, chosen in pairs.items() if (rows["normal_force"][chosen] > 0.0).any()}


def _joint(frames: WithContacts, times: tuple[int, int], support: Support, then: Rows, now: Rows) -> Joint:
    """Judge a joint by its points at the beginning and in the frame that is drawn."""
    pair = int(then["body_a"][0]), int(then["body_b"][0])
    least = MOVED_SHARE * min(float(shortest_sides(frames)[body]) for body in pair if body != SUPPORT)
    early = _followed(frames, times, support, then)
    # how far apart on both bodies in the first frame the points were where they touch in the second
    slip = _followed(frames, times[::-1], support, now).slip
    late = _Followed(np.stack([now["x"], now["y"]], axis=-1), -now["overlap"], slip)
    turn_a, turn_b = (_angle(frames, body, times) for body in pair)
    both = _Followed(*(np.concatenate(parts) for parts in zip(early, late, strict=True)))
    is_closed = both.opening <= least
    rocks = abs(turn_a - turn_b) > MOVED_SHARE and bool(is_closed.any())
    touching = late if len(now) else early
    hinges = touching.points[[int(np.argmin(touching.opening))]] if rocks else touching.points[:0]
    return Joint(both.points, bool((both.slip[is_closed] > least).any()), hinges)


def _followed(frames: WithContacts, times: tuple[int, int], support: Support, rows: Rows) -> _Followed:
    """Follow the points of a joint on both bodies from one frame to the other."""
    if not len(rows):
        return _Followed(np.empty((0, 2)), np.empty(0), np.empty(0))
    pair = int(rows["body_a"][0]), int(rows["body_b"][0])
    points = np.stack([rows["x"], rows["y"]], axis=-1)
    on_a, on_b = (_carried(frames, body, times, points, support) for body in pair)
    normal = np.stack([rows["normal_x"], rows["normal_y"]], axis=-1) @ _turn(frames, pair[1], times).T
    apart = on_a - on_b
    slip = np.abs(apart[:, 1] * normal[:, 0] - apart[:, 0] * normal[:, 1])
    return _Followed(on_b, (apart * normal).sum(axis=1), slip)


def _angle(frames: WithContacts, body: int, times: tuple[int, int]) -> float:
    """Return how far a body turns between two frames (rad)."""
    return 0.0 if body == SUPPORT else float(frames.angle[times[1], body] - frames.angle[times[0], body])


def _turn(frames: WithContacts, body: int, times: tuple[int, int]) -> Floats:
    """Return the matrix that turns as a body has between two frames."""
    angle = _angle(frames, body, times)
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def _carried(frames: WithContacts, body: int, times: tuple[int, int], points: Floats, support: Support) -> Floats:
    """Return where points (k, 2) of a body are at another frame."""
    if body == SUPPORT:
        before, after = support.offset(frames.time[list(times)])
        return np.asarray(points + after - before)
    before, after = (np.array([frames.x[time, body], frames.y[time, body]]) for time in times)
    return np.asarray((points - before) @ _turn(frames, body, times).T + after)


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
class Side:
    """One side of a bracket: a run, its support, the block that moved first if any, and what is said above it."""

    frames: WithContacts
    support: Support
    first: str | None
    caption: str
    is_mechanism: bool

    @cached_property
    def acts(self) -> Outside:
        """What acts on the blocks in the frame that is drawn."""
        return outside(self.frames, np.array([self.frame]), self.support)

    @cached_property
    def frame(self) -> int:
        """The last frame; of a mechanism the first in which it is seen."""
        drawable = drawable_frames(self.frames)
        if not self.is_mechanism:
            return int(drawable[-1])
        shortest = shortest_sides(self.frames)
        seen = (displacements(self.frames, self.support)[drawable] > VISIBLE * shortest).any(axis=1)
        return int(drawable[int(np.argmax(seen))] if seen.any() else drawable[-1])


def draw_mechanisms(
    brackets: Sequence[tuple[Side, Side]], path: Path | str, title: str | None = None, paper: Paper = OWN
) -> None:
    """Draw both sides of every bracket, a row each, and write PNG, SVG or PDF; the same input gives the same bytes.

    Raises InvalidInputError for an unknown picture format, too small a page and runs without contacts, OutputError.
    """
    path = Path(path)
    style.picture_suffix(path)
    width = paper.width(WIDTH, LEAST_WIDTH)
    across = 0.5 * (width - GAP)
    key = by_displacement(brackets[0][0].frames, brackets[0][0].support, 1.0).height
    notes = wrapped(_told_of_loads(brackets), width - 2.0 * SIDE)
    columns = ENTRIES if width >= ENTRIES_WIDTH else 1
    legend = LINE * (len(notes) + ENTRIES // columns)
    foot = AXIS + key + legend
    rows = len(brackets)
    tallest = paper.panel(TALLEST, rows, HEAD + foot + rows * (HEAD + ROW_GAP), LOWEST)
    pages = [page_for(_extent(pair), across, min(tallest, TALLEST), (SIDE, HEAD, ROW_GAP)) for pair in brackets]
    height = paper.height(HEAD + sum(page.height for page in pages) + foot)
    sides = [side for pair in brackets for side in pair]
    most = max(float(displacements(side.frames, side.support)[side.frame].max()) for side in sides)
    with style.styled_figure(width, height, paper.dots) as figure:
        top = height - HEAD
        for pair, page in zip(brackets, pages, strict=True):
            for column, side in enumerate(pair):
                _draw_side(figure, side, page, (column * (across + GAP) + SIDE, top), most)
            top -= page.height
        paint = by_displacement(brackets[0][0].frames, brackets[0][0].support, most)
        draw_key(figure, paint, SIDE, EDGE + legend)
        _draw_legend(figure, columns, EDGE + LINE * len(notes))
        for number, line in enumerate(reversed(notes)):
            write_text(figure, SIDE, EDGE + LINE * number, line, color=style.FAINT_INK)
        write_heading(figure, title, SIDE)
        style.save_figure(figure, path)


def _extent(pair: tuple[Side, Side]) -> Extent:
    """Return what both panels of a row show: on one scale, all blocks of either."""
    found = [extent_of(side.frames, np.array([side.frame]), side.support) for side in pair]
    one, other = (with_room(extent, side.acts, length_in(extent)) for extent, side in zip(found, pair, strict=True))
    return replace(
        one,
        left=min(one.left, other.left),
        right=max(one.right, other.right),
        bottom=min(one.bottom, other.bottom),
        top=max(one.top, other.top),
        base=min(one.base, other.base),
    )


def _told_of_loads(brackets: Sequence[tuple[Side, Side]]) -> list[str]:
    """Return what arrows mean where there are any."""
    all_acts = [side.acts for pair in brackets for side in pair]
    texts = [ARROWS_OF_LOADS] if any(acts.sizes for acts in all_acts) else []
    return [*texts, *([ARROWS_OF_SPEED] if any(acts.largest.get(SPEED, 0.0) > 0.0 for acts in all_acts) else [])]


def _draw_side(figure: "Figure", side: Side, page: Page, corner: tuple[float, float], most: float) -> None:
    """Draw a panel with its upper left corner at a place in inches; ground is tilted as it is on that side."""
    left, top = corner
    axes = add_axes(figure, left, top - HEAD - page.panel_height, page.panel_width, page.panel_height)
    extent = replace(page.extent, tilt=side.support.tilt)
    canvas = Canvas(axes, extent, page.points_per_mm)
    paint = by_displacement(side.frames, side.support, most)
    draw_scene(canvas, Scene(side.frames, side.support, paint, with_tops=False), side.frame)  # tops read as joints
    draw_outside(canvas, side.acts, 0, length_in(extent))
    if side.first in side.frames.names:
        outline = corners(side.frames, side.frame)[side.frames.names.index(side.first)]
        canvas.axes.plot(*np.concatenate([outline, outline[:2]]).T, transform=canvas.scene, **FIRST)
    for joint in joints(side.frames, side.frame, side.support):
        if joint.slides:
            canvas.axes.plot(*MILLIMETRES * joint.points.T, transform=canvas.scene, solid_capstyle="butt", **SLIDING)
        for x, y in MILLIMETRES * joint.hinges:
            canvas.axes.plot(x, y, transform=canvas.scene, **HINGE)
    finish_panel(canvas, (page.panel_width, page.panel_height), labelled=False)
    axes.xaxis.set_visible(False)
    room = page.panel_width * style.POINTS_PER_INCH
    for number, line in enumerate(side.caption.split("\n")):
        text = style.cut_to(line, room, style.FONT_SIZE)
        write_text(figure, left, top - LINE * (number + 1), text, color=style.FAINT_INK if number else style.INK)


def _draw_legend(figure: "Figure", columns: int, bottom: float) -> None:
    """Draw the marks of joints and of the first mover with their meaning, `bottom` inches from the lower edge."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles = [
        Patch(facecolor="none", edgecolor=FIRST["color"], linewidth=FIRST["linewidth"], label="first block to move"),
        Line2D([], [], label="sliding joint", **SLIDING),
        Line2D([], [], linestyle="none", label="hinge", **HINGE),
    ]
    write_legend(figure, handles, SIDE, bottom, ncols=columns, labelspacing=0.3, handlelength=1.6)
