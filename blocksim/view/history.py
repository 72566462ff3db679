"""Histories of a run: x, y and rotation of the blocks, energies and the number of contacts over time."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from blocksim.simulation.contacts import Contacts, borne
from blocksim.view import style
from blocksim.view.forces import contacts_of
from blocksim.view.moments import Floats, FramesLike, Indices, drawable_frames
from blocksim.view.strip import MeasuredTable
from blocksim.view.support import Support
from blocksim.view.window import MILLIMETRES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH = 7.2  # inches
LEFT, RIGHT, HEAD, FOOT = 0.72, 1.60, 0.36, 0.62  # inches; the legends stand on the right
PANEL, GAP = 1.25, 0.14  # inches
MOST_BLOCKS = len(style.BLOCK_COLOURS)  # that get a line of their own
MOST_POINTS = 2000  # of a line
MOST_PATHS = 50  # grey lines in an SVG or PDF; more of them are stored as an image
LETTERS, NOTE_LETTERS = 16, 105  # of a name, of a line below the panels
NAME_ROOM = 1.2  # inches, for a name beside the panels
LINE = 0.155  # inches, of each further line below the panels
MOST_WEIGHTS = 3.0  # of all blocks: forces of supports beyond that are cut, those of impacts are far beyond
SMALL_SHARE = 1e-3  # of the largest energy; what stays below is not drawn
ENERGIES = {  # how entries of the ledger are drawn together
    "kinetic": ("kinetic",),
    "potential": ("potential",),
    "stored in contacts": ("stored_normal", "stored_shear"),
    "lost to friction": ("friction",),
    "lost in impacts": ("dashpot", "broken", "impacts", "correction"),
    "given to support": ("to_support",),
}
ENERGY_COLOURS = ("#0072B2", "#E69F00", "#CC79A7", "#D55E00", "#009E73", "#777777")  # as in style, without the pale
BESIDE: dict[str, Any] = {
    "loc": "upper left",
    "bbox_to_anchor": (1.04, 1.0),
    "frameon": False,
    "borderaxespad": 0.0,
    "handlelength": 1.2,
}
Entries = dict[str, Floats]


class HistoryLike(FramesLike, Protocol):
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
class Motion:
    """One quantity of all blocks: n values of b blocks, and the column of the measured table that goes with it."""

    label: str
    values: Floats
    quantity: str


def draw_history(
    frames: HistoryLike,
    path: Path | str,
    title: str | None = None,
    measured: MeasuredTable | None = None,
    support: Support | None = None,
    *,
    forces: bool = False,
) -> None:
    """Draw x, y, rotation, energies and contacts over time; measured means and ranges stand at the end.

    Where contacts were stored, a last panel has the force with which ground and walls hold all blocks, over their
    weight; `forces` asks for it. Of more than six blocks the six that come farthest are coloured, the others grey. The
    same input gives the same bytes. Raises InvalidInputError for an unknown picture format, forces that were not stored
    or nothing to draw, and OutputError when the file cannot be written.
    """
    path = Path(path)
    style.picture_suffix(path)
    support = support or Support()
    chosen = _thinned(drawable_frames(frames))
    held = weights_held(frames, chosen, support, forces=forces)
    shown = farthest_blocks(frames, chosen, support)
    energies = drawn_energies(frames.energy, chosen)
    notes = wrap(_legend(frames, shown, is_measured=measured is not None), NOTE_LETTERS)
    foot = FOOT + (len(notes) - 1) * LINE
    count = 5 if held is None else 6
    height = HEAD + count * PANEL + (count - 1) * GAP + foot
    with style.styled_figure(WIDTH, height) as figure:
        panels = _panels(figure, foot, count)
        for axes, motion in zip(panels, _motions(frames, chosen), strict=False):
            _draw_motion(axes, frames.time[chosen], motion, shown)
            _draw_measured(axes, frames, motion, shown, measured)
        _draw_energies(panels[3], frames.time[chosen], energies)
        _draw_contacts(panels[4], frames.time[chosen], frames.contact_count[chosen])
        if held is not None:
            _draw_held(panels[5], frames.time[chosen], held)
        _draw_legends(panels, frames, shown)
        _draw_texts(figure, height, title, "\n".join(notes))
        style.save_figure(figure, path)


def farthest_blocks(frames: FramesLike, chosen: Indices, support: Support) -> list[int]:
    """Return the blocks to colour, in their order: free ones, of many those that end farthest from their start."""
    away = np.hypot(frames.x[chosen[-1]] - frames.x[0], frames.y[chosen[-1]] - frames.y[0])
    free = ~np.array(support.fixed or (False,) * len(away))
    ordered = [int(block) for block in np.argsort(-away, kind="stable") if free[block]]
    return sorted(ordered[:MOST_BLOCKS])


def drawn_energies(energy: Entries, chosen: Indices) -> Entries:
    """Return the energies (J) to draw, by what they are called: all that matter, potential from its least."""
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


def weights_held(frames: HistoryLike, chosen: Indices, support: Support, *, forces: bool) -> Floats | None:
    """Return the force upwards on all free blocks by what they stand on, over their weight; None where not stored.

    Raises InvalidInputError where `forces` asks for what was not stored.
    """
    if not forces and (frames.contacts is None or support.weight <= 0.0):
        return None
    up = float(np.sin(support.tilt)), float(np.cos(support.tilt))
    return borne(contacts_of(frames), up, support.fixed)[chosen] / (support.weight or 1.0)


def energy_unit(most: float) -> tuple[float, str]:
    """Return factor and unit in which energies up to this one (J) are best read."""
    for factor, unit in ((1e-3, "kJ"), (1.0, "J"), (1e3, "mJ")):
        if most * factor >= 1.0:
            return factor, unit
    return 1e6, "µJ"


def _thinned(drawable: Indices) -> Indices:
    if len(drawable) <= MOST_POINTS:
        return drawable
    return drawable[np.linspace(0, len(drawable) - 1, MOST_POINTS).round().astype(np.intp)]


def _motions(frames: FramesLike, chosen: Indices) -> list[Motion]:
    return [
        Motion("x (mm)", MILLIMETRES * frames.x[chosen], "x"),
        Motion("y (mm)", MILLIMETRES * frames.y[chosen], "y"),
        Motion("rotation (°)", np.degrees(frames.angle[chosen] - frames.angle[0]), "rotation"),
    ]


def _panels(figure: "Figure", foot: float, count: int) -> list["Axes"]:
    """Add so many panels, one below the other, with one axis of time."""
    height = float(figure.get_figheight())
    width, panels = (WIDTH - LEFT - RIGHT) / WIDTH, []
    for row in range(count):
        bottom = foot + (count - 1 - row) * (PANEL + GAP)
        axes = figure.add_axes((LEFT / WIDTH, bottom / height, width, PANEL / height))
        axes.spines[["right", "top"]].set_visible(False)
        axes.tick_params(axis="x", labelbottom=row == count - 1)
        axes.yaxis.set_label_coords(-0.5 / (WIDTH - LEFT - RIGHT), 0.5)
        panels.append(axes)
    panels[-1].set_xlabel("time (s)", labelpad=2.0)
    return panels


def _draw_motion(axes: "Axes", time: Floats, motion: Motion, shown: Sequence[int]) -> None:
    from matplotlib.collections import LineCollection  # noqa: PLC0415 - see style

    others = np.setdiff1d(np.arange(motion.values.shape[1]), shown)
    lines = [np.stack([time, motion.values[:, block]], axis=-1) for block in others]
    faint = min(0.35, max(0.12, 30.0 / max(len(lines), 1)))
    look: dict[str, Any] = {"colors": style.FAINT_INK, "linewidths": 0.4, "alpha": faint}
    axes.add_collection(LineCollection(lines, **look, rasterized=len(lines) > MOST_PATHS))
    for block in shown:
        axes.plot(time, motion.values[:, block], color=_colour(shown, block), linewidth=1.2)
    axes.autoscale_view()
    low, high = axes.get_ylim()
    if high - low < 1.0:  # of round-off nobody wants to see a picture
        axes.set_ylim(0.5 * (low + high) - 0.5, 0.5 * (low + high) + 0.5)
    axes.set_ylabel(motion.label)


def _draw_measured(
    axes: "Axes", frames: FramesLike, motion: Motion, shown: Sequence[int], measured: MeasuredTable | None
) -> None:
    """Draw mean and range of the repeats at the end of the lines of coloured blocks."""
    if measured is None:
        return
    statistics = measured.statistics()
    names = {frames.names[block]: block for block in shown}
    lines = statistics[(statistics["quantity"] == motion.quantity) & statistics["block"].isin(list(names))]
    end = float(frames.time[-1])
    line: dict[str, Any] = {"color": style.MEASURED_COLOUR, "linewidth": 1.2, "zorder": 4.0}
    for item in lines.itertuples():
        mean, low, high = (float(getattr(item, key)) for key in ("mean", "minimum", "maximum"))
        x = end * 1.02
        axes.plot([x, x], [low, high], marker="_", markersize=4.0, **line)
        axes.plot(x, mean, marker="o", markersize=3.2, **line)


def _draw_energies(axes: "Axes", time: Floats, energies: Entries) -> None:
    from matplotlib.ticker import FuncFormatter  # noqa: PLC0415 - see style

    factor, unit = energy_unit(max((float(np.abs(values).max()) for values in energies.values()), default=0.0))
    for (label, values), colour in zip(energies.items(), ENERGY_COLOURS * len(energies), strict=False):
        axes.plot(time, factor * values, color=colour, linewidth=1.0, label=label)
    axes.set_ylabel(f"energy ({unit})")
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}".replace("-", "−")))
    if energies:
        axes.legend(**BESIDE)


def _draw_contacts(axes: "Axes", time: Floats, count: Floats) -> None:
    from matplotlib.ticker import MaxNLocator  # noqa: PLC0415 - see style

    axes.plot(time, count, color=style.INK, linewidth=0.8, drawstyle="steps-post")
    axes.set_ylabel("contacts")
    axes.set_ylim(bottom=0.0)
    axes.yaxis.set_major_locator(MaxNLocator(nbins=5, integer=True))


def _draw_held(axes: "Axes", time: Floats, held: Floats) -> None:
    """Draw the force of the supports over the weight; where it is cut, its largest value is told beside."""
    axes.axhline(1.0, color=style.FAINT_INK, linewidth=style.LINE_WIDTH, linestyle=(0, (4, 3)))
    axes.plot(time, held, color=style.INK, linewidth=0.8)
    axes.set_ylabel("held / weight")
    largest = float(held.max(initial=0.0))
    axes.set_ylim(0.0, min(max(1.1 * largest, 1.5), MOST_WEIGHTS))
    told = "force up from what\nblocks stand on\ndashed: their weight"
    more = f"\nlargest: {largest:.3g}" if largest > MOST_WEIGHTS else ""
    axes.text(1.04, 1.0, told + more, transform=axes.transAxes, va="top")


def _draw_legends(panels: Sequence["Axes"], frames: FramesLike, shown: Sequence[int]) -> None:
    """Name the coloured blocks beside the first panel and give all panels one axis of time."""
    from matplotlib.lines import Line2D  # noqa: PLC0415 - see style

    if shown:
        room = NAME_ROOM * style.POINTS_PER_INCH
        handles = [Line2D([], [], color=_colour(shown, block)) for block in shown]
        names = [style.cut_to(style.shortened(frames.names[block], LETTERS), room, style.FONT_SIZE) for block in shown]
        panels[0].legend(handles, names, **BESIDE, title="block", alignment="left")
    start, end = float(frames.time[0]), float(frames.time[-1])
    for axes in panels:
        axes.set_xlim(start, start + 1.04 * max(end - start, 1e-9))


def _colour(shown: Sequence[int], block: int) -> str:
    """Return the colour of a block, its own as in other pictures where no two would look alike."""
    return style.block_colour(block if max(shown) < MOST_BLOCKS else shown.index(block))


def _draw_texts(figure: "Figure", height: float, title: str | None, legend: str) -> None:
    if title:
        place = 0.12 / WIDTH, 1.0 - 0.08 / height
        room = (WIDTH - 0.24) * style.POINTS_PER_INCH
        figure.text(*place, style.cut_to(title, room, style.TITLE_SIZE), va="top", fontsize=style.TITLE_SIZE)
    figure.text(0.12 / WIDTH, 0.06 / height, legend, color=style.FAINT_INK, va="bottom")


def _legend(frames: FramesLike, shown: Sequence[int], *, is_measured: bool) -> str:
    texts = ["Potential energy from its least."]
    if is_measured:
        texts.append("At the end: measured mean and range.")
    if len(shown) < len(frames.names):
        texts.append(f"Coloured: {len(shown)} of {len(frames.names)} blocks, those that end farthest from their start.")
    return " ".join(texts)
