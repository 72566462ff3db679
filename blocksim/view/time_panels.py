"""Panels over one axis of time: named lines beside their names and notes; probes, and the motion of supports.

Capacity curves: force over displacement of actuators, with the bound of statics, before measured curves.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from blocksim.errors import InvalidInputError
from blocksim.scenario import motion, spelling, units
from blocksim.simulation import instruments
from blocksim.view import style
from blocksim.view.run_data import MILLIMETRES, Floats, Indices, Support

WIDTH = 7.2  # inches
SIDES = 0.78, 1.70, 0.12, 0.36  # inches, around the panels; texts stand on the right
LABEL = 0.16  # inches, from the edge of the page to the right of the name of an axis
PANEL, GAP = 1.25, 0.15  # inches
LOWEST, NARROWEST = 0.55, 1.0  # inches, of a panel on a page whose size was asked for
NAME_ROOM = 1.2  # inches, for the name of a line
LETTERS = 24  # of a name
MOST_POINTS = 4000  # of a line; each that stands for many shows their range
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
DASHES: tuple[Any, ...] = ("-", (0, (5, 1.5)), (0, (1.5, 1.5)))
PALE = 0.7  # brightness from which a line is drawn on a darker one
LEAST_SPAN = 0.05  # mm, degrees, mm/s, degrees/s: an axis never shows less, so that round-off looks flat
LEAST_SHARE = 4e-4  # of the largest value: nor less than that, so that numbers along it differ in five digits
BESIDE: dict[str, Any] = {"loc": "upper left", "frameon": False, "borderaxespad": 0.0, "handlelength": 2.0}
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
Entries = dict[str, Floats]


@dataclass(frozen=True)
class TimePanel:
    """A quantity over time: lines by name, each times (s) and values in the unit of the label."""

    label: str
    lines: Mapping[str, tuple[Floats, Floats]]
    note: str = ""  # beside the panel, above the names of the lines
    marks: Sequence[tuple[float, float]] = ()  # points (s, value) that are marked
    limits: tuple[float, float | None] | None = None  # of the values, where the panel does not show all of them
    looks: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)  # of lines that have one of their own
    level: float | None = None  # a value worth a dashed line
    legend: str | None = None  # above the names of the lines; None for no names


@contextmanager
def open_time_panels(
    panels: Sequence[TimePanel],
    title: str | None,
    notes: str = "",
    paper: style.Paper = style.OWN,
    own: float | None = None,
    span: tuple[float, float] | None = None,
) -> Iterator[tuple["style.Figure", list["style.Axes"]]]:
    """Give panels that are drawn one below the other over an axis of time, by default as long as their lines.

    Each is `own` inches high, by default as high as its texts need. Raises InvalidInputError for too small a page.
    """
    times = [float(time[end]) for panel in panels for time, _ in panel.lines.values() if len(time) for end in (0, -1)]
    start, end = span or (min(times), max(times))
    texts = (panel.note.count("\n") + 2 + len(panel.lines) * (panel.legend is not None) for panel in panels)
    size = WIDTH - sum(SIDES[:2]), own or max(PANEL, style.LINE * max(texts))
    counts, least = [1] * len(panels), (NARROWEST, LOWEST)
    with style.open_panels(paper, counts, size, least, SIDES, (0.0, GAP), title=title, notes=notes) as (figure, rows):
        for panel, (axes,) in zip(panels, rows, strict=True):
            axes.spines[["right", "top"]].set_visible(False)
            axes.tick_params(axis="x", labelbottom=axes is rows[-1][0])
            axes.yaxis.set_label_coords((LABEL - SIDES[0]) / style.size_of(axes)[0], 0.5)
            axes.set_xlim(start, max(end, start + 1e-9))
            _draw_panel(axes, panel)
        rows[-1][0].set_xlabel("time (s)", labelpad=2.0)
        yield figure, [axes for (axes,) in rows]


def _draw_panel(axes: "style.Axes", panel: TimePanel) -> None:
    """Draw the lines of a panel, and write what belongs to them at its right."""
    from matplotlib.patheffects import Normal, Stroke

    handles = []
    for number, (name, (time, values)) in enumerate(panel.lines.items()):
        dashes = DASHES[number // len(COLOURS) % len(DASHES)]
        look: dict[str, Any] = {"color": COLOURS[number % len(COLOURS)], "linestyle": dashes, "linewidth": 1.0}
        look |= panel.looks.get(name, {})
        handles += axes.plot(*thin_line(time, values), **look, label=name)
        if style.brightness(look["color"]) > PALE:
            handles[-1].set_path_effects([Stroke(linewidth=2.0, foreground=style.FAINT_INK), Normal()])
    for moment, value in panel.marks:
        axes.plot(moment, value, marker="o", markersize=3.5, color=style.MEASURED_COLOUR, clip_on=False)
    if panel.level is not None:
        axes.axhline(panel.level, color=style.FAINT_INK, linewidth=style.LINE_WIDTH, linestyle=(0, (4, 3)))
    axes.margins(y=0.08)
    if panel.limits is not None:
        axes.set_ylim(*panel.limits)
    axes.set_ylabel(panel.label)
    style.number_axis(axes.yaxis)
    style.number_axis(axes.xaxis, 8)
    axes.text(1.04, 1.0, panel.note, transform=axes.transAxes, va="top")
    if panel.legend is not None:
        below = style.LINE * (panel.note.count("\n") + 1 if panel.note else 0) / style.size_of(axes)[1]
        room, names = NAME_ROOM * style.POINTS_PER_INCH, [style.shorten(name, LETTERS) for name in panel.lines]
        names = [style.cut_to(name, room, style.FONT_SIZE) for name in names]
        place: dict[str, Any] = {**BESIDE, "bbox_to_anchor": (1.04, 1.0 - below)}
        axes.legend(handles, names, **place, title=panel.legend, alignment="left")


def thin_line(time: Floats, values: Floats) -> tuple[Floats, Floats]:
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


def limits_of(values: Floats) -> tuple[float, float]:
    """Return the ends of an axis around values, with a margin, never so near to each other that round-off is seen."""
    return style.limits_around(values, 0.05, max(LEAST_SPAN, LEAST_SHARE * float(np.abs(values).max())))


def energy_groups(energy: Entries, chosen: Indices) -> Entries:
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


def unit_for(most: float, unit: str) -> tuple[float, str]:
    """Return factor and unit in which values up to this one (J, N) are best read."""
    for factor, prefix in ((1e-3, "k"), (1.0, ""), (1e3, "m")):
        if most * factor >= 1.0:
            return factor, f"{prefix}{unit}"
    return 1e6, f"µ{unit}"


MOST_PANELS = 12
PERCENT = 98.0  # of the samples of a force that are not those of an impact
MOST_USUAL, CUT = 3.0, 1.5  # times what they hardly exceed: forces beyond are cut, there


def draw_probes(
    series: Mapping[str, instruments.ProbeSeries],
    path: Path,
    title: str | None = None,
    names: Sequence[str] = (),
    paper: style.Paper = style.OWN,
) -> None:
    """Draw probes, all or those of these names.

    Raises InvalidInputError for a run without probes, unknown names, too many panels, an unknown picture format or too
    small a page, and OutputError when the file cannot be written.
    """
    unknown = next((name for name in names if name not in series), None)
    if unknown is not None:
        hint = spelling.did_you_mean_or_list(unknown, series)
        raise InvalidInputError(f"--probe {unknown}: no such probe in this run, {hint}")
    panels = [panel for name in names or series for panel in panels_of(series[name])]
    if not panels:
        raise InvalidInputError("this run has no samples of probes; [[probes]] in the scenario records them")
    if len(panels) > MOST_PANELS:
        message = f"{len(panels)} panels are too many for one picture, at most {MOST_PANELS}; choose with --probe"
        raise InvalidInputError(message)
    path = style.picture_path(path)
    with open_time_panels(panels, title, paper=paper) as (figure, _):
        style.save_figure(figure, path)


def probe_picture(probe: instruments.ProbeSeries) -> bytes:
    """Return the picture (PNG) of one probe, for a report; nothing of one without samples."""
    panels = panels_of(probe)
    if not panels:
        return b""
    with open_time_panels(panels, None) as (figure, _):
        return style.figure_bytes(figure, ".png")


def panels_of(probe: instruments.ProbeSeries) -> list[TimePanel]:
    """Return the panels of a probe; none of one without samples."""

    def panel(quantity: str, unit: str, factor: float, columns: Mapping[str, Floats]) -> TimePanel:
        lines = {name.replace("_", " "): (probe.time, factor * values) for name, values in columns.items()}
        note = f"probe {probe.name}"[:LETTERS] + ("" if len(lines) > 1 else f"\n{next(iter(lines))}")
        label = f"{quantity} ({unit})" if unit else quantity
        return TimePanel(label, lines, note, level=0.0, legend="" if len(lines) > 1 else None)

    if not len(probe):
        return []
    if probe.kind == instruments.JOINT:
        ends = {f"opening at {one} end": probe[f"opening_{one}"] for one in ("first", "last")}  # not in time
        return [panel("joint", "mm", MILLIMETRES, {**ends, "slip": probe["slip"]})]
    if probe.kind == instruments.ENERGY:
        energies = energy_groups(probe.columns, np.arange(len(probe)))
        factor, unit = unit_for(float(np.nanmax(np.abs([*energies.values()]), initial=0.0)), "J")
        return [panel("energy", unit, factor, energies)] if energies else []
    if probe.kind == instruments.ACTUATOR:
        places = {name: probe[name] for name in ("displacement", "head")}
        found = [panel("displacement", "mm", MILLIMETRES, places)]
        for column, base in (("force", "N"), ("work", "J")):
            factor, unit = unit_for(float(np.nanmax(np.abs(probe[column]), initial=0.0)), base)
            found.append(panel(column, unit, factor, {column: probe[column]}))
        return found
    if probe.kind == instruments.POINT:
        moves = any(not np.array_equal(probe[one], probe[f"relative_{one}"]) for one in ("dx", "dy"))
        names = [[f"{'relative_' * moves}{one}{axis}" for axis in "xy"] for one in "dv"]
        places, velocities = ({name: probe[name] for name in pair} for pair in names)
        return [
            panel("displacement", "mm", MILLIMETRES, places),
            panel("velocity", "mm/s", MILLIMETRES, velocities),
            panel("rotation", "°", 1.0, {"rotation": np.degrees(probe["rotation"])}),
        ]
    forces = {name: probe[name] for name in ("fx", "fy")}
    largest = float(np.nanmax(np.abs([*forces.values()]), initial=0.0))
    usual = max(float(np.percentile(np.abs(values), PERCENT)) for values in forces.values())  # hardly exceeded
    is_cut = usual > 0.0 and largest > MOST_USUAL * usual
    factor, unit = unit_for(usual if is_cut else largest, "N")
    force = panel("force", unit, factor, forces)
    if is_cut:
        low, high = (
            sign * min(max(float((sign * one).max()) for one in forces.values()), CUT * usual) for sign in (-1, 1)
        )
        room = 0.08 * (high - low)
        note = f"{force.note}\nlargest: {factor * largest:.3g} {unit}"
        force = replace(force, note=note, limits=(factor * (low - room), factor * (high + room)))
    mobilised = probe["mobilised"]
    is_known = np.isfinite(mobilised).any()
    return [force, *([panel("share of friction", "", 1.0, {"mobilised": mobilised})] if is_known else [])]


BETWEEN = 4
"""Points of velocity and displacement a piece of the motion."""
ROUND_OFF = 1e-9


def draw_support_motion(
    support: Support, end: float, path: Path, title: str | None = None, paper: style.Paper = style.OWN
) -> None:
    """Draw the motion of the supports along its direction from 0 to `end` (s).

    Raises InvalidInputError for supports that rest, an unknown picture format or too small a page, and OutputError when
    the file cannot be written.
    """
    pieces = support.motion
    if pieces is None:
        raise InvalidInputError("the supports of this scenario do not move: it has no table [motion]")
    peaks = motion.motion_peaks(pieces, end)
    ends, acceleration = motion.acceleration_ends(pieces)
    last = int(np.count_nonzero(ends < end))  # the line of straight pieces is cut at the end
    share = (end - ends[last - 1]) / max(ends[last] - ends[last - 1], 1e-300)
    value = acceleration[last - 1] + share * (acceleration[last] - acceleration[last - 1])
    ends, acceleration = np.append(ends[:last], end), np.append(acceleration[:last], value)
    count = len(pieces.times) - 1
    times = np.interp(np.linspace(0.0, count, BETWEEN * count + 1), np.arange(count + 1), pieces.times)
    times = np.append(times[times < end], end)
    displacement, velocity = motion.displacement_and_velocity(pieces, times)

    def panel(
        name: str, quantity: str, unit: str, factor: float, line: tuple[Floats, Floats], peak: motion.Peak
    ) -> TimePanel:
        at, values = line
        near = int(np.argmin(np.abs(at - peak.time) - 1e-9 * np.abs(values)))
        in_g = f"= {peak.value / units.STANDARD_GRAVITY:.4g} g\n" if name == "PGA" else ""
        note = f"{name} {factor * peak.value:.4g} {unit}\n{in_g}at {peak.time:.4g} s"
        mark = peak.time, (-factor if values[near] < 0.0 else factor) * peak.value
        return TimePanel(f"{quantity} ({unit})", {name: (at, factor * values)}, note, [mark], level=0.0)

    panels = [
        panel("PGA", "acceleration", "m/s²", 1.0, (ends, acceleration), peaks.acceleration),
        panel("PGV", "velocity", "mm/s", MILLIMETRES, (times, velocity), peaks.velocity),
        panel("PGD", "displacement", "mm", MILLIMETRES, (times, displacement), peaks.displacement),
    ]
    final = ((peaks.final_velocity, peaks.velocity), (float(displacement[-1]), peaks.displacement))
    speed, place = (MILLIMETRES * one if abs(one) > ROUND_OFF * peak.value else 0.0 for one, peak in final)
    left = f"At the end: {speed:.4g} mm/s, {place:.4g} mm.".replace("-", "−")
    path = style.picture_path(path)
    notes = f"Ground, walls and fixed bodies, {support.way}. {left}"
    with open_time_panels(panels, title, notes, paper) as (figure, _):
        style.save_figure(figure, path)


KILO = 1e-3
CURVES, LEAST_CURVES = (5.2, 3.3), (1.8, 1.0)  # inches, of the panel, and on a page whose size was asked for
CURVE_SIDES = 0.70, 0.15, 0.11, 0.44  # inches
MEASURED: dict[str, Any] = {"color": "#9E9E9E", "linewidth": 2.2, "alpha": 0.8}
BOUND: dict[str, Any] = {"linewidth": 1.0, "linestyle": (0, (5, 2))}


@dataclass(frozen=True, eq=False)
class CapacityCurve:
    """The n samples of one actuator, what statics allows in each direction in which it went, and what was measured."""

    name: str
    displacement: Floats  # (n,) m
    force: Floats  # (n,) N
    bounds: Sequence[float]  # N, negative of pulls; NaN where statics has none
    measured: Sequence[tuple[Floats, Floats]]  # m, N of each repeat


def draw_curves(curves: Sequence[CapacityCurve], path: Path | str, title: str, paper: style.Paper) -> None:
    """Draw them into one panel and write PNG, SVG or PDF; the same input gives the same bytes.

    Raises InvalidInputError for an unknown picture format or too small a page, OutputError.
    """
    path = style.picture_path(path)
    with style.open_panels(paper, [1], CURVES, LEAST_CURVES, CURVE_SIDES, title=title) as (figure, ((axes,),)):
        axes.spines[["right", "top"]].set_visible(False)
        label = "measured"
        for curve in curves:
            for x, y in curve.measured:
                axes.plot(MILLIMETRES * x, KILO * y, label=label, **MEASURED)
                label = "_"
        for number, curve in enumerate(curves):
            colour = COLOURS[number % len(COLOURS)]
            axes.plot(
                MILLIMETRES * curve.displacement, KILO * curve.force, color=colour, linewidth=1.4, label=curve.name
            )
            for bound in (one for one in curve.bounds if np.isfinite(one)):
                name = f"no equilibrium beyond {KILO * abs(bound):.4g} kN (statics)"
                axes.axhline(KILO * bound, color=colour, label=name, **BOUND)
        axes.axhline(0.0, color=style.INK, linewidth=0.6, zorder=0)
        axes.set_xlabel("displacement (mm)")
        axes.set_ylabel("force (kN)")
        axes.margins(x=0.02, y=0.08)
        axes.legend(loc="best", frameon=False)
        style.save_figure(figure, path)
