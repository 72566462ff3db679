"""Panels over one axis of time: named lines, motions of blocks, energies, contacts and forces."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from blocksim.errors import InvalidInputError
from blocksim.scenario.spelling import nearest
from blocksim.simulation.frames import force_on_supports
from blocksim.view import style
from blocksim.view.arrows import WithContacts, contacts_of
from blocksim.view.paint import MovingFrames
from blocksim.view.run_data import MILLIMETRES, Floats, FramesLike, Indices, Support
from blocksim.view.style import OWN, Paper, add_axes, number_axis, write_heading, write_text
from blocksim.world.systems.blocks import BLOCKS
from blocksim.world.systems.system import Output, Track

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


WIDTH = 7.2  # inches
LEFT, RIGHT, HEAD, FOOT = 0.78, 1.75, 0.40, 0.42  # inches; texts stand on the right
LABEL = 0.16  # inches, from the edge of the page to the right of the name of an axis
PANEL, GAP = 1.3, 0.16  # inches
LOWEST, NARROWEST = 0.6, 1.0  # inches, of a panel on a page whose size was asked for
_BESIDE = 0.1  # inches, from a panel to its text
LINE = 0.155  # inches, of a line of text
MOST_POINTS = 4000  # of a line; each that stands for many shows their range
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
DASHES: tuple[Any, ...] = ("-", (0, (5, 1.5)), (0, (1.5, 1.5)))


@dataclass(frozen=True)
class TimePanel:
    """A quantity over time: lines by name, each times (s) and values in the unit of the label."""

    label: str
    lines: Mapping[str, tuple[Floats, Floats]]
    note: str = ""  # beside the panel, below the names of the lines
    marks: Sequence[tuple[float, float]] = field(default=())  # points (s, value) that are marked
    limits: tuple[float, float] | None = None  # of the values, where the panel does not show all of them


def draw_time_panels(
    panels: Sequence[TimePanel], path: Path, title: str | None, note: str = "", paper: Paper = OWN
) -> None:
    """Draw panels one below the other; names of lines are written where a panel has more than one.

    Raises InvalidInputError for an unknown picture format or too small a page, OutputError when the file cannot be
    written.
    """
    style.picture_suffix(path)
    with _drawn(panels, title, note, paper) as figure:
        style.save_figure(figure, path)


def time_panels_png(panels: Sequence[TimePanel], paper: Paper = OWN) -> bytes:
    """Return such a picture without a title as PNG."""
    with _drawn(panels, None, "", paper) as figure:
        return style.figure_bytes(figure, ".png")


@contextmanager
def _drawn(panels: Sequence[TimePanel], title: str | None, note: str, paper: Paper) -> Iterator["Figure"]:
    head, foot = HEAD if title else GAP, FOOT + (LINE if note else 0.0)
    own = max(PANEL, *(LINE * (_rows(panel) + 1) for panel in panels))
    with stacked(len(panels), (LEFT, RIGHT, head, foot), GAP, (own, LOWEST), paper) as (figure, drawn):
        span = _span(panels)
        across, up = (float(size) for size in figure.get_size_inches())
        for axes, panel in zip(drawn, panels, strict=True):
            _draw(axes, panel, span)
            _write_beside(figure, panel, across - RIGHT + _BESIDE, axes.get_position().y1 * up)
        write_heading(figure, title, 0.12, 0.08)
        write_text(figure, 0.12, 0.05, note, color=style.FAINT_INK, va="bottom")
        yield figure


@contextmanager
def stacked(
    count: int,
    sides: tuple[float, float, float, float],
    gap: float,
    heights: tuple[float, float],
    paper: Paper,
) -> Iterator[tuple["Figure", list["Axes"]]]:
    """Give so many panels over one axis of time, one below the other, with room at left, right, top and bottom.

    `heights` are those of a panel: its own, and the least on a page whose size was asked for. All in inches. Raises
    InvalidInputError for too small a page.
    """
    left, right, head, foot = sides
    width = paper.width(WIDTH, left + right + NARROWEST)
    others = head + foot + (count - 1) * gap
    height = paper.panel(heights[0], count, others, heights[1])
    total = paper.height(others + count * height)
    with style.styled_figure(width, total, paper.dots) as figure:
        panels = []
        for row in range(count):
            bottom = foot + (count - 1 - row) * (height + gap)
            axes = add_axes(figure, left, bottom, width - left - right, height)
            axes.spines[["right", "top"]].set_visible(False)
            axes.tick_params(axis="x", labelbottom=row == count - 1)
            axes.yaxis.set_label_coords((LABEL - left) / (width - left - right), 0.5)
            panels.append(axes)
        panels[-1].set_xlabel("time (s)", labelpad=2.0)
        yield figure, panels


def _rows(panel: TimePanel) -> int:
    return (len(panel.lines) if len(panel.lines) > 1 else 0) + (panel.note.count("\n") + 1 if panel.note else 0)


def _span(panels: Sequence[TimePanel]) -> tuple[float, float]:
    times = [time for panel in panels for time, _ in panel.lines.values() if len(time)]
    first, last = min(float(time[0]) for time in times), max(float(time[-1]) for time in times)
    return first, first + max(last - first, 1e-9)


def _look(number: int) -> dict[str, Any]:
    colour, dashes = COLOURS[number % len(COLOURS)], DASHES[number // len(COLOURS) % len(DASHES)]
    return {"color": colour, "linestyle": dashes, "linewidth": 1.0}


def _draw(axes: "Axes", panel: TimePanel, span: tuple[float, float]) -> None:
    axes.axhline(0.0, color=style.FAINT_INK, linewidth=0.4)
    for number, (time, values) in enumerate(panel.lines.values()):
        axes.plot(*thinned(time, values), **_look(number))
    for moment, value in panel.marks:
        axes.plot(moment, value, marker="o", markersize=3.5, color=style.MEASURED_COLOUR, clip_on=False)
    axes.set_xlim(span)
    axes.margins(y=0.08)
    if panel.limits is not None:
        axes.set_ylim(*panel.limits)
    axes.set_ylabel(panel.label)
    number_axis(axes.yaxis)
    number_axis(axes.xaxis, 8)


def _write_beside(figure: "Figure", panel: TimePanel, left: float, top: float) -> None:
    room = (RIGHT - 2.0 * _BESIDE) * style.POINTS_PER_INCH
    names = [*panel.lines] if len(panel.lines) > 1 else []
    for number, name in enumerate(names):
        cut = style.cut_to(name, room, style.FONT_SIZE)
        write_text(figure, left, top - number * LINE, cut, va="top", color=_look(number)["color"])
    write_text(figure, left, top - len(names) * LINE, panel.note, va="top")


def thinned(time: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return at most MOST_POINTS points of a line: of each stretch the first, least, greatest and last one."""
    if len(time) <= MOST_POINTS:
        return time, values
    edges = np.linspace(0, len(time), MOST_POINTS // 4 + 1).round().astype(np.intp)
    kept: set[int] = set()
    for first, after in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        part = values[first:after]
        kept |= {first, after - 1, first + int(np.argmin(part)), first + int(np.argmax(part))}
    places = np.array(sorted(kept), dtype=np.intp)
    return time[places], values[places]


ENERGY, CONTACTS, FORCE, GROUND = "energy", "contacts", "force", "ground"
GROUPS = {"displacement": ("dx", "dy"), "velocity": ("vx", "vy")}
USUAL = ("x", "y", "rotation", ENERGY, CONTACTS)
SCENE = (ENERGY, CONTACTS, FORCE, GROUND)
MOST_SLIPS = 2
MOST_CHOSEN = 12  # blocks; more names have no room beside the panels
LEAST_SPAN = 0.05  # mm, degrees, mm/s, degrees/s: an axis never shows less, so that round-off looks flat
LEAST_SHARE = 4e-4  # of the largest value: nor less than that, so that numbers along it differ in five digits

MOST_WEIGHTS = 3.0  # of all blocks: forces of supports beyond that are cut, those of impacts are far beyond
SMALL_SHARE = 1e-3  # of the largest energy; what stays below is not drawn
ENERGIES = {  # how entries of the ledger are drawn together
    "kinetic": ("kinetic",),
    "potential": ("potential",),
    "stored in contacts": ("stored_normal", "stored_shear"),
    "lost to friction": ("friction",),
    "lost in impacts": ("dashpot", "broken", "impacts", "correction"),
    "given to support": ("to_support",),
    "given to loads": ("to_loads",),
}
ENERGY_LOOKS: dict[str, tuple[str, Any]] = {  # the same in every picture; dashes distinguish them in grey
    "kinetic": ("#0072B2", "-"),
    "potential": ("#E69F00", "-"),
    "stored in contacts": ("#CC79A7", (0, (1, 1))),
    "lost to friction": ("#009E73", (0, (5, 1.5))),
    "lost in impacts": ("#222222", (0, (3, 1, 1, 1))),
    "given to support": ("#56B4E9", (0, (2, 1))),
    "given to loads": ("#D55E00", (0, (4, 1, 1, 1))),
}
OTHER_ENERGY: tuple[str, Any] = ("#999999", "-")
BESIDE: dict[str, Any] = {
    "loc": "upper left",
    "bbox_to_anchor": (1.04, 1.0),
    "frameon": False,
    "borderaxespad": 0.0,
    "handlelength": 2.0,
}
Entries = dict[str, Floats]


class HistoryFrames(MovingFrames, Protocol):
    """Frames with velocities and spins."""

    @property
    def spin(self) -> Floats:
        """Angular velocities (rad/s), (n, b)."""
        ...

    @property
    def tracks(self) -> tuple[Track, ...]:
        """Every system over time, blocks first."""
        ...


@dataclass(frozen=True)
class Choice:
    """Panels by name (none: the default ones) and blocks by name (none: those that move farthest).

    With `relative`, positions and velocities are relative to the moving ground.
    """

    panels: tuple[str, ...] = ()
    blocks: tuple[str, ...] = ()
    relative: bool = False


@dataclass(frozen=True)
class Motion:
    """One quantity of all blocks: n values of b blocks, and the column of the measured table that goes with it."""

    label: str
    values: Floats
    quantity: str = ""


@dataclass(frozen=True)
class FramesInView:
    """Chosen frames as seen from where the ground was at the start, or from the moving ground."""

    frames: HistoryFrames
    chosen: Indices
    support: Support
    relative: bool = False

    @property
    def from_ground(self) -> str:
        """Suffix of the labels of positions and velocities."""
        return " − ground" if self.relative and self.support.motion is not None else ""

    def place(self, axis: int) -> Floats:
        """Return centres (mm) along x (0) or y (1)."""
        places = (self.frames.x, self.frames.y)[axis][self.chosen]
        carried = self.support.offset(self.frames.time[self.chosen]) * bool(self.from_ground)
        return np.asarray(MILLIMETRES * (places - carried[:, axis, None]))

    def displacement(self, axis: int) -> Floats:
        """Return displacements (mm) from the first frame of the run."""
        return np.asarray(self.place(axis) - MILLIMETRES * (self.frames.x, self.frames.y)[axis][0])

    def velocity(self, axis: int) -> Floats:
        """Return velocities (mm/s) along x (0) or y (1)."""
        velocities = (self.frames.vx, self.frames.vy)[axis][self.chosen]
        carried = np.multiply.outer(self.support.velocity(self.frames.time[self.chosen]), self.support.direction)
        return np.asarray(MILLIMETRES * (velocities - carried[:, axis, None] * bool(self.from_ground)))


MOTIONS: dict[str, Callable[[FramesInView], Motion]] = {
    "x": lambda seen: Motion(f"x{seen.from_ground} (mm)", seen.place(0), "" if seen.from_ground else "x"),
    "y": lambda seen: Motion(f"y{seen.from_ground} (mm)", seen.place(1), "" if seen.from_ground else "y"),
    "dx": lambda seen: Motion(f"Δx{seen.from_ground} (mm)", seen.displacement(0)),
    "dy": lambda seen: Motion(f"Δy{seen.from_ground} (mm)", seen.displacement(1)),
    "rotation": lambda seen: Motion("rotation (°)", np.degrees(seen.frames.rotation[seen.chosen]), "rotation"),
    "vx": lambda seen: Motion(f"vx{seen.from_ground} (mm/s)", seen.velocity(0)),
    "vy": lambda seen: Motion(f"vy{seen.from_ground} (mm/s)", seen.velocity(1)),
    "speed": lambda seen: Motion(
        f"{'relative ' if seen.from_ground else ''}speed (mm/s)", np.hypot(seen.velocity(0), seen.velocity(1))
    ),
    "spin": lambda seen: Motion("spin (°/s)", np.degrees(seen.frames.spin[seen.chosen])),
}


def _shown(output: Output) -> Callable[[FramesInView], Motion]:
    """Return the panel of what blocks show beside their motion."""

    def motion(seen: FramesInView) -> Motion:
        values = output.of(seen.frames.tracks[0].some(seen.chosen))
        factor, unit = unit_for(float(np.abs(values).max(initial=0.0)), output.unit)
        return Motion(f"{output.meaning} ({unit})", factor * values)

    return motion


MOTIONS |= {one.name: _shown(one) for one in BLOCKS.outputs if one.name not in MOTIONS}
PANELS = (*MOTIONS, *SCENE, *GROUPS)


def panels_named(names: Sequence[str]) -> tuple[str, ...]:
    """Return panels in the given order, groups as their members. Raises InvalidInputError for an unknown name."""
    for name in names:
        if name not in PANELS:
            meant = nearest(name, PANELS, MOST_SLIPS)
            hint = f"did you mean '{meant}'?" if meant else f"choose {', '.join(PANELS)}"
            message = f"--panels {name}: unknown panel, {hint}"
            raise InvalidInputError(message)
    return tuple(dict.fromkeys(one for name in names for one in GROUPS.get(name, (name,))))


def blocks_named(frames: FramesLike, names: Sequence[str]) -> list[int]:
    """Return the numbers (from 0) of blocks with these names. Raises InvalidInputError for unknown ones or too many."""
    known = {name: number for number, name in enumerate(frames.names)}
    for name in names:
        if name not in known:
            first = ", ".join(frames.names[:MOST_CHOSEN]) + (", …" if len(frames.names) > MOST_CHOSEN else "")
            message = f"--block {name}: no such block in this run, its {len(known)} blocks are {first}"
            raise InvalidInputError(message)
    if len(names) > MOST_CHOSEN:
        message = f"--block: {len(names)} blocks are too many for one picture, at most {MOST_CHOSEN}"
        raise InvalidInputError(message)
    return list(dict.fromkeys(known[name] for name in names))


def farthest_blocks(frames: FramesLike, chosen: Indices, support: Support, most: int) -> list[int]:
    """Return the blocks to colour, in their order: free ones; of many, those that end farthest from their start."""
    away = np.hypot(frames.x[chosen[-1]] - frames.x[0], frames.y[chosen[-1]] - frames.y[0])
    free = ~np.array(support.fixed or (False,) * len(away), dtype=bool)
    ordered = [int(block) for block in np.argsort(-away, kind="stable") if free[block]]
    return sorted(ordered[:most])


def limits_of(values: Floats) -> tuple[float, float]:
    """Return the ends of an axis around values, with a margin, never so near to each other that round-off is seen."""
    low, high = float(values.min()), float(values.max())
    least = max(LEAST_SPAN, LEAST_SHARE * max(abs(low), abs(high)))
    margin = max(0.05 * (high - low), 0.5 * (least - (high - low)))
    return low - margin, high + margin


def drawn_energies(energy: Entries, chosen: Indices) -> Entries:
    """Return the energies (J) to draw by name: all that matter, potential relative to its minimum."""
    known = {entry for entries in ENERGIES.values() for entry in entries}
    groups = {**ENERGIES, **{name.replace("_", " "): (name,) for name in energy if name not in known}}
    sums = {
        label: np.sum([energy[entry][chosen] for entry in entries if entry in energy], axis=0)
        for label, entries in groups.items()
        if any(entry in energy for entry in entries)
    }
    if "potential" in sums:
        sums["potential"] = sums["potential"] - sums["potential"].min()
    most = max((float(np.abs(values).max()) for values in sums.values()), default=0.0)
    return {label: values for label, values in sums.items() if float(np.abs(values).max()) > SMALL_SHARE * most}


def support_force(frames: WithContacts, chosen: Indices, support: Support) -> Floats:
    """Return the upward force (N) of the supports on all free blocks, (n,).

    Raises InvalidInputError where contacts were not stored.
    """
    up = float(np.sin(support.tilt)), float(np.cos(support.tilt))
    return force_on_supports(contacts_of(frames), up, support.fixed)[chosen]


def unit_for(most: float, unit: str) -> tuple[float, str]:
    """Return factor and unit in which values up to this one (J, N) are best read."""
    for factor, prefix in ((1e-3, "k"), (1.0, ""), (1e3, "m")):
        if most * factor >= 1.0:
            return factor, f"{prefix}{unit}"
    return 1e6, f"µ{unit}"


def draw_energies(axes: "Axes", time: Floats, energies: Entries) -> None:
    """Draw energies (J) by name, each in its own colour and dashes."""
    factor, unit = unit_for(max((float(np.abs(values).max()) for values in energies.values()), default=0.0), "J")
    for label, values in energies.items():
        colour, dashes = ENERGY_LOOKS.get(label, OTHER_ENERGY)
        axes.plot(time, factor * values, color=colour, linestyle=dashes, linewidth=1.1, label=label)
    axes.set_ylabel(f"energy ({unit})")
    if energies:
        axes.legend(**BESIDE)


def draw_contacts(axes: "Axes", time: Floats, count: Floats) -> None:
    """Draw the number of contacts."""
    axes.plot(time, count, color=style.INK, linewidth=0.8, drawstyle="steps-post")
    axes.set_ylabel("contacts")
    axes.set_ylim(bottom=0.0)


def draw_force(axes: "Axes", time: Floats, force: Floats, weight: float) -> None:
    """Draw the support force with the weight (N); where it is cut, its largest value is printed."""
    largest, reference = float(force.max(initial=0.0)), weight or float(np.median(force)) or 1.0
    factor, unit = unit_for(reference, "N")
    axes.plot(time, factor * force, color=style.INK, linewidth=0.8)
    axes.axhline(factor * weight, color=style.FAINT_INK, linewidth=style.LINE_WIDTH, linestyle=(0, (4, 3)))
    axes.set_ylabel(f"support force ({unit})")
    axes.set_ylim(0.0, factor * min(max(1.1 * largest, 1.5 * reference), MOST_WEIGHTS * reference))
    text = f"upwards, from ground,\nwalls and fixed bodies\ndashed: weight {factor * weight:.3g} {unit}"
    more = f"\nlargest: {factor * largest:.3g} {unit}" if largest > MOST_WEIGHTS * reference else ""
    axes.text(1.04, 1.0, text + more, transform=axes.transAxes, va="top")


def draw_ground(axes: "Axes", time: Floats, support: Support) -> None:
    """Draw the displacement of ground, walls and fixed bodies."""
    moved = MILLIMETRES * support.displacement(time)
    axes.plot(time, moved, color=style.INK, linewidth=1.0)
    axes.set_ylim(*limits_of(moved))
    axes.set_ylabel("ground (mm)")
    text = f"displacement of\nthe ground {support.way}" if support.motion is not None else "at rest"
    axes.text(1.04, 1.0, text, transform=axes.transAxes, va="top")
