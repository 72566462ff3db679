"""Pictures over time: histories of a run, its probes, and the motion of its supports."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from blocksim.errors import InvalidInputError
from blocksim.scenario.motion import Peak, acceleration_ends, displacement_and_velocity, motion_peaks
from blocksim.scenario.spelling import did_you_mean_or_list
from blocksim.scenario.units import STANDARD_GRAVITY
from blocksim.simulation import probes
from blocksim.simulation.frames import Contacts
from blocksim.simulation.probes import JOINT, POINT, ProbeSeries
from blocksim.view import style
from blocksim.view.arrows import contacts_of
from blocksim.view.final import MeasuredTable
from blocksim.view.paint import Paint, by_block
from blocksim.view.run_data import MILLIMETRES, Floats, Indices, Support, drawable_frames
from blocksim.view.style import OWN, Paper, plain_numbers, write_heading, write_text
from blocksim.view.time_panels import (
    BESIDE,
    CONTACTS,
    ENERGY,
    FORCE,
    GROUND,
    MOTIONS,
    USUAL,
    WIDTH,
    Choice,
    Entries,
    FramesInView,
    HistoryFrames,
    Motion,
    TimePanel,
    blocks_named,
    draw_contacts,
    draw_energies,
    draw_force,
    draw_ground,
    draw_time_panels,
    drawn_energies,
    farthest_blocks,
    limits_of,
    panels_named,
    stacked,
    support_force,
    time_panels_png,
    unit_for,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


LEFT, RIGHT, HEAD, FOOT = 0.80, 1.60, 0.36, 0.62  # inches; the legends stand on the right
PANEL, GAP = 1.25, 0.14  # inches
LOWEST = 0.55  # inches, of a panel on a page whose size was asked for
MOST_BLOCKS = len(style.BLOCK_COLOURS)  # that get a line of their own, unless they are chosen
MOST_POINTS = 2000  # of a line
MOST_PATHS = 50  # grey lines in an SVG or PDF; more of them are stored as an image
_LETTERS = 16  # of a name
LETTERS_AN_INCH = 14.5  # in a line below the panels
NAME_ROOM = 1.2  # inches, for a name at the right of the panels
LINE = 0.155  # inches, of each further line below the panels or beside them
LEGEND = 0.25  # inches, of the head of a legend and the gap below it
PALE = 0.7  # brightness from which a line is drawn on a darker one
DASHES: tuple[Any, ...] = ("-", (0, (4, 1.5)), (0, (1, 1)), (0, (4, 1, 1, 1)), (0, (8, 2)), (0, (2, 3)))


class HistoryLike(HistoryFrames, Protocol):
    """Frames with what was measured of the whole scene."""

    @property
    def contacts(self) -> Contacts | None:
        """Contacts of all frames, where they were recorded."""
        ...

    @property
    def energy(self) -> Entries:
        """Energies (J) by name, (n,) each."""
        ...

    @property
    def contact_count(self) -> Floats:
        """Number of contacts, (n,)."""
        ...


@dataclass(frozen=True)
class _Drawing:
    """What is drawn: n chosen frames, the blocks with lines of their own, and how those look."""

    frames: HistoryLike
    chosen: Indices
    support: Support
    shown: list[int]
    looks: dict[int, dict[str, Any]]
    others: bool  # whether all other blocks are drawn in grey
    relative: bool

    @property
    def time(self) -> Floats:
        """Times (s), (n,)."""
        return self.frames.time[self.chosen]

    def motion(self, name: str) -> Motion:
        """Return one quantity of all blocks."""
        return MOTIONS[name](FramesInView(self.frames, self.chosen, self.support, self.relative))


def draw_history(
    frames: HistoryLike,
    path: Path | str,
    title: str | None = None,
    measured: MeasuredTable | None = None,
    support: Support | None = None,
    **asked: Any,
) -> None:
    """Draw a history as `drawn_history` has it and write PNG, SVG or PDF; the same input gives the same bytes.

    Raises as that does, InvalidInputError for an unknown picture format, and OutputError when the file cannot be
    written.
    """
    path = Path(path)
    style.picture_suffix(path)
    with draw_history_page(frames, title, measured, support, **asked) as (figure, _):
        style.save_figure(figure, path)


@contextmanager
def draw_history_page(
    frames: HistoryLike,
    title: str | None = None,
    measured: MeasuredTable | None = None,
    support: Support | None = None,
    *,
    forces: bool = False,
    choice: Choice | None = None,
    paint: Paint | None = None,
    paper: Paper = OWN,
) -> "Iterator[tuple[Figure, dict[str, Axes]]]":
    """Give x, y, rotation, energies and contacts over time, or the panels of `choice`, by the name of each.

    Measured means and ranges are drawn at the end. If contacts were stored, a panel shows the force of ground and walls
    on all blocks; `forces` requires it. A moving ground has a panel of its displacement. Of more than
    six blocks the six that move farthest are coloured, the others grey, unless `choice` names blocks. Raises
    InvalidInputError for unknown panels or blocks, forces that were not stored, a page that is too small or nothing to
    draw.
    """
    choice, support = choice or Choice(), support or Support()
    drawing = _drawing(frames, support, choice, paint or by_block(frames))
    names = _panel_names(drawing, choice, forces=forces)
    legend = _legend(drawing, names, is_measured=measured is not None)
    notes = wrap(legend, int(LETTERS_AN_INCH * paper.width(WIDTH)))
    sides = LEFT, RIGHT, HEAD, FOOT + (len(notes) - 1) * LINE
    heights = _panel_height(names, len(drawing.shown)), LOWEST
    with stacked(len(names), sides, GAP, heights, paper) as (figure, axes):
        panels = dict(zip(names, axes, strict=True))
        for name in names:
            _draw_panel(panels[name], drawing, name, measured)
        _finish(panels, drawing)
        write_heading(figure, title, 0.12, 0.08)
        write_text(figure, 0.12, 0.06, "\n".join(notes), color=style.FAINT_INK, va="bottom")
        yield figure, panels


def line_looks(fills: Sequence[str], shown: Sequence[int]) -> dict[int, dict[str, Any]]:
    """Return how the line of each block is drawn: in the colour of the block, dashed where another has it too."""
    drawn: dict[str, int] = {}
    looks: dict[int, dict[str, Any]] = {}
    for block in shown:
        number = drawn.get(fills[block], 0)
        drawn[fills[block]] = number + 1
        looks[block] = {"color": fills[block], "linestyle": DASHES[number % len(DASHES)]}
    return looks


def _drawing(frames: HistoryLike, support: Support, choice: Choice, paint: Paint) -> _Drawing:
    """Choose frames and blocks. Raises InvalidInputError for unknown blocks."""
    if not paint.is_lasting:
        message = "a history is coloured by block or material; speed and rotation are separate panels"
        raise InvalidInputError(message)
    if not frames.names:
        message = "no block to draw: a history is that of blocks, and a probe shows the thrust of soil"
        raise InvalidInputError(message)
    chosen = drawable_frames(frames)
    if len(chosen) > MOST_POINTS:
        chosen = chosen[np.linspace(0, len(chosen) - 1, MOST_POINTS).round().astype(np.intp)]
    named = blocks_named(frames, choice.blocks)
    shown = named or farthest_blocks(frames, chosen, support, MOST_BLOCKS)
    looks = line_looks(paint.fills(0), shown)
    return _Drawing(frames, chosen, support, shown, looks, others=not named, relative=choice.relative)


def _panel_names(drawing: _Drawing, choice: Choice, *, forces: bool) -> tuple[str, ...]:
    """Return the panels from top to bottom; force and ground in addition to the default ones where available."""
    if choice.panels:
        names = panels_named(choice.panels)
    else:
        has_ground = drawing.support.motion is not None
        has_force = drawing.frames.contacts is not None and drawing.support.weight > 0.0
        names = (*USUAL, *((FORCE,) if has_force else ()), *((GROUND,) if has_ground else ()))
    if FORCE in names or forces:
        contacts_of(drawing.frames)  # has advice where none were stored
    return names if not forces or FORCE in names else (*names, FORCE)


def _panel_height(names: Sequence[str], blocks: int) -> float:
    """Return the height of a panel (inches); names of many blocks need room before the next text at the side."""
    legend = LEGEND + blocks * LINE
    first = next((row for row, name in enumerate(names) if name in MOTIONS), 0)
    end = next((row for row, name in enumerate(names) if row > first and name not in {*MOTIONS, CONTACTS}), len(names))
    return max(PANEL, (legend + GAP) / (end - first) - GAP)


def _draw_panel(axes: "Axes", drawing: _Drawing, name: str, measured: MeasuredTable | None) -> None:
    if name in MOTIONS:
        motion = drawing.motion(name)
        _draw_motion(axes, drawing, motion)
        _draw_measured(axes, drawing, motion, measured)
    elif name == ENERGY:
        draw_energies(axes, drawing.time, drawn_energies(drawing.frames.energy, drawing.chosen))
    elif name == CONTACTS:
        draw_contacts(axes, drawing.time, drawing.frames.contact_count[drawing.chosen])
    elif name == FORCE:
        force = support_force(drawing.frames, drawing.chosen, drawing.support)
        draw_force(axes, drawing.time, force, drawing.support.weight)
    else:
        draw_ground(axes, drawing.time, drawing.support)


def _draw_motion(axes: "Axes", drawing: _Drawing, motion: Motion) -> None:
    from matplotlib.collections import LineCollection
    from matplotlib.patheffects import Normal, Stroke

    others = (
        np.setdiff1d(np.arange(motion.values.shape[1]), drawing.shown) if drawing.others else np.zeros(0, dtype=int)
    )
    lines = [np.stack([drawing.time, motion.values[:, block]], axis=-1) for block in others]
    faint = min(0.35, max(0.12, 30.0 / max(len(lines), 1)))
    look: dict[str, Any] = {"colors": style.FAINT_INK, "linewidths": 0.4, "alpha": faint}
    axes.add_collection(LineCollection(lines, **look, rasterized=len(lines) > MOST_PATHS))
    edge = [Stroke(linewidth=2.0, foreground=style.FAINT_INK), Normal()]
    for block in drawing.shown:
        line, *_ = axes.plot(drawing.time, motion.values[:, block], linewidth=1.2, **drawing.looks[block])
        if style.brightness(drawing.looks[block]["color"]) > PALE:
            line.set_path_effects(edge)
    axes.set_ylim(*limits_of(motion.values if drawing.others else motion.values[:, drawing.shown]))
    axes.set_ylabel(motion.label)


def _draw_measured(axes: "Axes", drawing: _Drawing, motion: Motion, measured: MeasuredTable | None) -> None:
    """Draw mean and range of the repeats at the end of the lines of coloured blocks."""
    if measured is None or not motion.quantity:
        return
    statistics = measured.statistics()
    names = [drawing.frames.names[block] for block in drawing.shown]
    lines = statistics[(statistics["quantity"] == motion.quantity) & statistics["block"].isin(names)]
    x = float(drawing.frames.time[-1]) * 1.02
    line: dict[str, Any] = {"color": style.MEASURED_COLOUR, "linewidth": 1.2, "zorder": 4.0}
    known = [motion.values if drawing.others else motion.values[:, drawing.shown]]
    for item in lines.itertuples():
        mean, low, high = (float(getattr(item, key)) for key in ("mean", "minimum", "maximum"))
        axes.plot([x, x], [low, high], marker="_", markersize=4.0, **line)
        axes.plot(x, mean, marker="o", markersize=3.2, **line)
        known.append(np.array([low, high]))
    axes.set_ylim(*limits_of(np.concatenate([values.ravel() for values in known])))


def _finish(panels: dict[str, "Axes"], drawing: _Drawing) -> None:
    """Name the coloured blocks at their first panel, write plain numbers, give all panels one axis of time."""
    from matplotlib.lines import Line2D
    from matplotlib.ticker import MaxNLocator

    first = next((axes for name, axes in panels.items() if name in MOTIONS), None)
    if drawing.shown and first is not None:
        room = NAME_ROOM * style.POINTS_PER_INCH
        handles = [Line2D([], [], **drawing.looks[block]) for block in drawing.shown]
        names = [style.shortened(drawing.frames.names[block], _LETTERS) for block in drawing.shown]
        cut = [style.cut_to(name, room, style.FONT_SIZE) for name in names]
        first.legend(handles, cut, **BESIDE, title="block", alignment="left")
    start, end = float(drawing.frames.time[0]), float(drawing.frames.time[-1])
    for name, axes in panels.items():
        axes.set_xlim(start, start + 1.04 * max(end - start, 1e-9))
        axes.yaxis.set_major_locator(MaxNLocator(nbins=5, steps=[1, 2, 2.5, 5, 10], integer=name == CONTACTS))
        plain_numbers(axes.yaxis)


def _legend(drawing: _Drawing, names: Sequence[str], *, is_measured: bool) -> str:
    texts = ["Potential energy relative to its minimum."] if ENERGY in names else []
    if {"dx", "dy"} & set(names):
        texts.append("Δx, Δy: displacement from the start.")
    if drawing.relative and drawing.support.motion is not None and set(names) & set(MOTIONS):
        texts.append("Places and velocities relative to the moving ground.")
    if is_measured and {"x", "y", "rotation"} & set(names):
        texts.append("At the end: measured mean and range.")
    shown, all_blocks = len(drawing.shown), len(drawing.frames.names)
    if shown < all_blocks and drawing.others:
        texts.append(f"Coloured: {shown} of {all_blocks} blocks, those that end farthest from their start.")
    elif shown < all_blocks:
        texts.append(f"{shown} of {all_blocks} blocks.")
    return " ".join(texts) or " "


MOST_PANELS = 12
_LETTERS_PROBES = 24  # of a line beside a panel
PERCENT = 98.0  # of the samples of a force that are not those of an impact
MOST_USUAL, CUT = 3.0, 1.5  # times what they hardly exceed: forces beyond are cut, there


def draw_probes(
    probes: Mapping[str, ProbeSeries],
    path: Path,
    title: str | None = None,
    names: Sequence[str] = (),
    paper: Paper = OWN,
) -> None:
    """Draw probes, all or those of these names.

    Raises InvalidInputError for a run without probes, unknown names, too many panels, an unknown picture format or too
    small a page, and OutputError when the file cannot be written.
    """
    unknown = next((name for name in names if name not in probes), None)
    if unknown is not None:
        message = f"--probe {unknown}: no such probe in this run, {did_you_mean_or_list(unknown, probes)}"
        raise InvalidInputError(message)
    panels = [panel for name in names or probes for panel in panels_of(probes[name])]
    if not panels:
        message = "this run has no samples of probes; [[probes]] in the scenario records them"
        raise InvalidInputError(message)
    if len(panels) > MOST_PANELS:
        message = f"{len(panels)} panels are too many for one picture, at most {MOST_PANELS}; choose with --probe"
        raise InvalidInputError(message)
    draw_time_panels(panels, path, title, paper=paper)


def probe_picture(probe: ProbeSeries) -> bytes:
    """Return the picture (PNG) of one probe, for a report."""
    return time_panels_png(panels_of(probe))


def panels_of(probe: ProbeSeries) -> list[TimePanel]:
    """Return the panels of a probe; none of one without samples."""
    return _PANELS[probe.kind](probe) if len(probe) else []


def _panel(probe: ProbeSeries, quantity: str, unit: str, factor: float, columns: Mapping[str, Floats]) -> TimePanel:
    lines = {name: (probe.time, factor * values) for name, values in columns.items()}
    several = "" if len(lines) > 1 else f"\n{next(iter(lines))}"
    return TimePanel(
        f"{quantity} ({unit})" if unit else quantity, lines, f"probe {probe.name}"[:_LETTERS_PROBES] + several
    )


def _largest(columns: Mapping[str, Floats]) -> float:
    return max((float(np.nanmax(np.abs(values), initial=0.0)) for values in columns.values()), default=0.0)


def _some(probe: ProbeSeries, *names: str) -> dict[str, Floats]:
    return {name.replace("_", " "): probe[name] for name in names}


def _force(probe: ProbeSeries) -> list[TimePanel]:
    forces = _some(probe, "fx", "fy")
    largest = _largest(forces)
    usual = max(float(np.percentile(np.abs(values), PERCENT)) for values in forces.values())  # hardly exceeded
    is_cut = usual > 0.0 and largest > MOST_USUAL * usual
    factor, unit = unit_for(usual if is_cut else largest, "N")
    panel = _panel(probe, "force", unit, factor, forces)
    if is_cut:
        low, high = (
            sign * min(max(float((sign * one).max()) for one in forces.values()), CUT * usual) for sign in (-1, 1)
        )
        room = 0.08 * (high - low)
        note = f"{panel.note}\nlargest: {factor * largest:.3g} {unit}"
        panel = replace(panel, note=note, limits=(factor * (low - room), factor * (high + room)))
    panels = [panel]
    if np.isfinite(probe["mobilised"]).any():
        panels.append(_panel(probe, "share of friction", "", 1.0, {"mobilised": probe["mobilised"]}))
    return panels


def _point(probe: ProbeSeries) -> list[TimePanel]:
    moves = not np.array_equal(probe["dx"], probe["relative_dx"]) or not np.array_equal(
        probe["dy"], probe["relative_dy"]
    )
    relative = "relative_" if moves else ""
    places, velocities = (_some(probe, f"{relative}{one}x", f"{relative}{one}y") for one in "dv")
    rotation = {"rotation": np.degrees(probe["rotation"])}
    return [
        _panel(probe, "displacement", "mm", MILLIMETRES, places),
        _panel(probe, "velocity", "mm/s", MILLIMETRES, velocities),
        _panel(probe, "rotation", "°", 1.0, rotation),
    ]


def _joint(probe: ProbeSeries) -> list[TimePanel]:
    return [_panel(probe, "joint", "mm", MILLIMETRES, _some(probe, "opening_first", "opening_last", "slip"))]


def _energy(probe: ProbeSeries) -> list[TimePanel]:
    energies = drawn_energies(probe.columns, np.arange(len(probe)))
    factor, unit = unit_for(_largest(energies), "J")
    return [_panel(probe, "energy", unit, factor, energies)] if energies else []


_PANELS: dict[str, Callable[[ProbeSeries], list[TimePanel]]] = {
    probes.FORCE: _force,
    POINT: _point,
    JOINT: _joint,
    probes.ENERGY: _energy,
}


BETWEEN = 4
"""Points of velocity and displacement a piece of the motion."""
ROUND_OFF = 1e-9


def draw_support_motion(support: Support, end: float, path: Path, title: str | None = None, paper: Paper = OWN) -> None:
    """Draw the motion of the supports along its direction from 0 to `end` (s).

    Raises InvalidInputError for supports that rest, an unknown picture format or too small a page, and OutputError when
    the file cannot be written.
    """
    pieces = support.motion
    if pieces is None:
        message = "the supports of this scenario do not move: it has no table [motion]"
        raise InvalidInputError(message)
    peaks = motion_peaks(pieces, end)
    ends, acceleration = acceleration_ends(pieces)
    ends, acceleration = _until(ends, acceleration, end)
    count = len(pieces.times) - 1
    times = np.interp(np.linspace(0.0, count, BETWEEN * count + 1), np.arange(count + 1), pieces.times)
    times = np.append(times[times < end], end)
    displacement, velocity = displacement_and_velocity(pieces, times)
    in_g = peaks.acceleration.value / STANDARD_GRAVITY
    panels = [
        _panel_motion("acceleration (m/s²)", 1.0, (ends, acceleration), peaks.acceleration, "PGA", f"= {in_g:.4g} g\n"),
        _panel_motion("velocity (mm/s)", MILLIMETRES, (times, velocity), peaks.velocity, "PGV"),
        _panel_motion("displacement (mm)", MILLIMETRES, (times, displacement), peaks.displacement, "PGD"),
    ]
    final = _left(peaks.final_velocity, peaks.velocity), _left(float(displacement[-1]), peaks.displacement)
    left = f"At the end: {final[0]:.4g} mm/s, {final[1]:.4g} mm.".replace("-", "−")
    note = f"Ground, walls and fixed bodies, {support.way}. {left}"
    draw_time_panels(panels, path, title, note, paper)


def _panel_motion(
    label: str, factor: float, line: tuple[Floats, Floats], peak: Peak, name: str, more: str = ""
) -> TimePanel:
    times, values = line
    near = int(np.argmin(np.abs(times - peak.time) - 1e-9 * np.abs(values)))
    unit = label.partition("(")[2].rstrip(")")
    note = f"{name} {factor * peak.value:.4g} {unit}\n{more}at {peak.time:.4g} s"
    sign = -1.0 if values[near] < 0.0 else 1.0
    return TimePanel(label, {name: (times, factor * values)}, note, [(peak.time, sign * factor * peak.value)])


def _left(value: float, peak: Peak) -> float:
    """Return a value in mm or mm/s, zero where it is round-off beside the peak."""
    return MILLIMETRES * value if abs(value) > ROUND_OFF * peak.value else 0.0


def _until(times: Floats, values: Floats, end: float) -> tuple[Floats, Floats]:
    """Cut a line of straight pieces at `end` (s)."""
    kept = times < end
    last = int(np.count_nonzero(kept))
    share = (end - times[last - 1]) / max(times[last] - times[last - 1], 1e-300)
    value = values[last - 1] + share * (values[last] - values[last - 1])
    return np.append(times[:last], end), np.append(values[:last], value)
