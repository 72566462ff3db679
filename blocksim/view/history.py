"""A run over time: motions of blocks, energies, contacts, support force and ground, a panel each."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from blocksim.errors import InvalidInputError
from blocksim.scenario.spelling import nearest
from blocksim.simulation.trajectory import Frames, force_on_supports
from blocksim.view import arrows, paints, run_data, scene, style, time_panels
from blocksim.world.systems.blocks import BLOCKS
from blocksim.world.systems.system import Channel

MOST_BLOCKS = len(style.BLOCK_COLOURS)  # that get a line of their own, unless they are chosen
MOST_POINTS = 2000  # of a line
MOST_PATHS = 50  # grey lines in an SVG or PDF; more of them are stored as an image
LEGEND = 0.25  # inches, of the head of a legend and the gap below it
LATER = 1.04  # length of the axis of time over that of the run, so that measured ranges stand at its end
DASHES: tuple[Any, ...] = ("-", (0, (4, 1.5)), (0, (1, 1)), (0, (4, 1, 1, 1)), (0, (8, 2)), (0, (2, 3)))
ENERGY, CONTACTS, FORCE, GROUND = "energy", "contacts", "force", "ground"
GROUPS = {"displacement": ("dx", "dy"), "velocity": ("vx", "vy")}
USUAL = ("x", "y", "rotation", ENERGY, CONTACTS)
SCENE = (ENERGY, CONTACTS, FORCE, GROUND)
MOST_SLIPS = 2
MOST_CHOSEN = 12  # blocks; more names have no room beside the panels
MOST_WEIGHTS = 3.0  # of all blocks: forces of supports beyond that are cut, those of impacts are far beyond
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
INK: dict[str, Any] = {"color": style.INK, "linewidth": 0.8}


@dataclass(frozen=True)
class Motion:
    """One quantity of all blocks: n values of b blocks, and the column of the measured table that goes with it."""

    label: str
    values: run_data.Floats
    quantity: str = ""


@dataclass(frozen=True)
class FramesInView:
    """Chosen frames as seen from where the ground was at the start, or from the moving ground."""

    frames: Frames
    chosen: run_data.Indices
    support: run_data.Support
    relative: bool = False

    @property
    def time(self) -> run_data.Floats:
        """Times (s), (n,)."""
        return self.frames.time[self.chosen]

    @property
    def from_ground(self) -> str:
        """Suffix of the labels of positions and velocities."""
        return " − ground" if self.relative and self.support.motion is not None else ""

    def place(self, axis: int) -> run_data.Floats:
        """Return centres (mm) along x (0) or y (1)."""
        places = (self.frames.x, self.frames.y)[axis][self.chosen]
        carried = self.support.offset(self.time) * bool(self.from_ground)
        return np.asarray(run_data.MILLIMETRES * (places - carried[:, axis, None]))

    def velocity(self, axis: int) -> run_data.Floats:
        """Return velocities (mm/s) along x (0) or y (1)."""
        velocities = (self.frames.vx, self.frames.vy)[axis][self.chosen]
        carried = np.multiply.outer(self.support.displacement(self.time, 1), self.support.direction)
        return np.asarray(run_data.MILLIMETRES * (velocities - carried[:, axis, None] * bool(self.from_ground)))


MOTIONS: dict[str, Callable[[FramesInView], Motion]] = {
    "x": lambda seen: Motion(f"x{seen.from_ground} (mm)", seen.place(0), "" if seen.from_ground else "x"),
    "y": lambda seen: Motion(f"y{seen.from_ground} (mm)", seen.place(1), "" if seen.from_ground else "y"),
    "dx": lambda seen: Motion(f"Δx{seen.from_ground} (mm)", seen.place(0) - run_data.MILLIMETRES * seen.frames.x[0]),
    "dy": lambda seen: Motion(f"Δy{seen.from_ground} (mm)", seen.place(1) - run_data.MILLIMETRES * seen.frames.y[0]),
    "rotation": lambda seen: Motion("rotation (°)", np.degrees(seen.frames.rotation[seen.chosen]), "rotation"),
    "vx": lambda seen: Motion(f"vx{seen.from_ground} (mm/s)", seen.velocity(0)),
    "vy": lambda seen: Motion(f"vy{seen.from_ground} (mm/s)", seen.velocity(1)),
    "speed": lambda seen: Motion(
        f"{'relative ' if seen.from_ground else ''}speed (mm/s)", np.hypot(seen.velocity(0), seen.velocity(1))
    ),
    "spin": lambda seen: Motion("spin (°/s)", np.degrees(seen.frames.spin[seen.chosen])),
}


def _shown(output: Channel) -> Callable[[FramesInView], Motion]:
    """Return the panel of what blocks show beside their motion."""

    def motion(seen: FramesInView) -> Motion:
        values = output.of(seen.frames.tracks[0].some(seen.chosen))
        factor, unit = time_panels.unit_for(float(np.abs(values).max(initial=0.0)), output.unit)
        return Motion(f"{output.meaning} ({unit})", factor * values)

    return motion


MOTIONS |= {one.name: _shown(one) for one in BLOCKS.outputs if one.name not in MOTIONS}
PANELS = (*MOTIONS, *SCENE, *GROUPS)


def draw_history(frames: Frames, path: Path | str, options: scene.PictureOptions = scene.PLAIN) -> None:
    """Draw a history as `draw_history_page` gives it and write PNG, SVG or PDF; the same input gives the same bytes.

    Raises as that does, InvalidInputError for an unknown picture format, and OutputError when the file cannot be
    written.
    """
    path = style.picture_path(path)
    with draw_history_page(frames, options) as (figure, _):
        style.save_figure(figure, path)


@contextmanager
def draw_history_page(
    frames: Frames, options: scene.PictureOptions
) -> "Iterator[tuple[style.Figure, dict[str, style.Axes]]]":
    """Give x, y, rotation, energies and contacts over time, or the panels that were asked for, by the name of each.

    Measured means and ranges are drawn at the end. If contacts were stored, a panel shows the force of ground and walls
    on all blocks; `forces` requires it. A moving ground has a panel of its displacement. Of more than
    six blocks the six that move farthest are coloured, the others grey, unless blocks were named. Raises
    InvalidInputError for unknown panels or blocks, forces that were not stored, a page that is too small or nothing to
    draw.
    """
    measured, paint = options.measured, options.paint or paints.by_block(frames)
    if paint.scale is not None and not any(paint.elements):  # a block does not keep its colour throughout the run
        raise InvalidInputError("a history is coloured by block or material; speed and rotation are separate panels")
    if not frames.names:
        raise InvalidInputError("no block to draw: a history is that of blocks, and a probe shows the thrust of soil")
    chosen = run_data.drawable_frames(frames)
    if len(chosen) > MOST_POINTS:
        chosen = chosen[np.linspace(0, len(chosen) - 1, MOST_POINTS).round().astype(np.intp)]
    seen = FramesInView(frames, chosen, options.support, options.relative)
    blocks = _blocks_named(frames, options.blocks)
    shown = blocks or _farthest_blocks(seen)
    looks = {frames.names[block]: look for block, look in line_looks(paint.fills(0), shown).items()}
    names = _panel_names(seen, options)
    notes = _notes(seen, names, len(shown), is_measured=measured is not None, is_chosen=bool(blocks))
    motions = {name: MOTIONS[name](seen) for name in names if name in MOTIONS}
    panels = []
    for name in names:
        if name not in motions:
            panels.append(SCENE_PANELS[name](seen))
            continue
        values = motions[name].values
        lines = {frames.names[block]: (seen.time, values[:, block]) for block in shown}
        limits = time_panels.limits_of(values[:, shown] if blocks else values)
        legend = "block" if shown and name == next(iter(motions)) else None
        panels.append(time_panels.TimePanel(motions[name].label, lines, limits=limits, looks=looks, legend=legend))
    own, start = _panel_height(names, len(shown)), float(seen.time[0])
    span = start, start + LATER * (float(seen.time[-1]) - start)
    with time_panels.open_time_panels(panels, options.title, notes, options.paper, own, span) as (figure, rows):
        axes_of = dict(zip(names, rows, strict=True))
        for name, motion in motions.items():
            if not blocks:
                rest = [np.stack([seen.time, one], axis=-1) for one in np.delete(motion.values, shown, axis=1).T]
                look: dict[str, Any] = {"colors": style.FAINT_INK, "linewidths": 0.4}
                look["alpha"] = min(0.35, max(0.12, 30.0 / max(len(rest), 1)))
                style.add_lines(axes_of[name], rest, **look, rasterized=len(rest) > MOST_PATHS)
            if measured is not None and motion.quantity:
                drawn = replace(motion, values=motion.values[:, shown]) if blocks else motion
                _draw_measured(axes_of[name], seen, drawn, measured, [frames.names[block] for block in shown])
        if CONTACTS in axes_of:
            axes_of[CONTACTS].locator_params("y", integer=True)
        yield figure, axes_of


def line_looks(fills: Sequence[str], shown: Sequence[int]) -> dict[int, dict[str, Any]]:
    """Return how the line of each block is drawn: in the colour of the block, dashed where another has it too."""
    drawn: dict[str, int] = {}
    looks: dict[int, dict[str, Any]] = {}
    for block in shown:
        number = drawn.get(fills[block], 0)
        drawn[fills[block]] = number + 1
        looks[block] = {"color": fills[block], "linestyle": DASHES[number % len(DASHES)], "linewidth": 1.2}
    return looks


def _blocks_named(frames: Frames, names: Sequence[str]) -> list[int]:
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


def _farthest_blocks(seen: FramesInView) -> list[int]:
    """Return the blocks to colour, in their order: free ones; of many, those that end farthest from their start."""
    frames, last = seen.frames, seen.chosen[-1]
    away = np.hypot(frames.x[last] - frames.x[0], frames.y[last] - frames.y[0])
    fixed = run_data.is_fixed(frames, seen.support)
    ordered = [int(block) for block in np.argsort(-away, kind="stable") if not fixed[block]]
    return sorted(ordered[:MOST_BLOCKS])


def _panel_names(seen: FramesInView, options: scene.PictureOptions) -> tuple[str, ...]:
    """Return the panels from top to bottom; force and ground in addition to the default ones where available.

    Raises InvalidInputError for an unknown one, and for forces that were not stored.
    """
    for name in options.panels:
        if name not in PANELS:
            meant = nearest(name, PANELS, MOST_SLIPS)
            hint = f"did you mean '{meant}'?" if meant else f"choose {', '.join(PANELS)}"
            raise InvalidInputError(f"--panels {name}: unknown panel, {hint}")
    names = [one for name in options.panels for one in GROUPS.get(name, (name,))] or [*USUAL]
    if not options.panels and seen.frames.contacts is not None and seen.support.weight > 0.0:
        names.append(FORCE)
    if not options.panels and seen.support.motion is not None:
        names.append(GROUND)
    if FORCE in names or options.forces:
        arrows.contacts_of(seen.frames)  # has advice where none were stored
    return tuple(dict.fromkeys([*names, *([FORCE] if options.forces else [])]))


def _panel_height(names: Sequence[str], blocks: int) -> float:
    """Return the height of a panel (inches); names of many blocks need room before the next text at the side."""
    legend = LEGEND + blocks * style.LINE
    first = next((row for row, name in enumerate(names) if name in MOTIONS), 0)
    end = next((row for row, name in enumerate(names) if row > first and name not in {*MOTIONS, CONTACTS}), len(names))
    return max(time_panels.PANEL, (legend + time_panels.GAP) / (end - first) - time_panels.GAP)


def _draw_measured(
    axes: "style.Axes", seen: FramesInView, motion: Motion, measured: run_data.Repeats, names: Sequence[str]
) -> None:
    """Draw mean and range of the repeats at the end of the lines of blocks."""
    rows = [one for one in measured if one.quantity == motion.quantity and one.block in names]
    x = float(seen.frames.time[-1]) * 1.02
    line: dict[str, Any] = {"color": style.MEASURED_COLOUR, "linewidth": 1.2, "zorder": 4.0}
    known = [motion.values.ravel()]
    for one in rows:
        axes.plot([x, x], [one.minimum, one.maximum], marker="_", markersize=4.0, **line)
        axes.plot(x, one.mean, marker="o", markersize=3.2, **line)
        known.append(np.array([one.minimum, one.maximum]))
    axes.set_ylim(*time_panels.limits_of(np.concatenate(known)))


def _energies(seen: FramesInView) -> time_panels.TimePanel:
    """Return energies (J) by name, each in its own colour and dashes."""
    energies = time_panels.energy_groups(seen.frames.energy, seen.chosen)
    factor, unit = time_panels.unit_for(float(np.abs([*energies.values()]).max(initial=0.0)), "J")
    looks = {name: ENERGY_LOOKS.get(name, OTHER_ENERGY) for name in energies}
    return time_panels.TimePanel(
        f"energy ({unit})",
        {name: (seen.time, factor * values) for name, values in energies.items()},
        looks={
            name: {"color": colour, "linestyle": dashes, "linewidth": 1.1} for name, (colour, dashes) in looks.items()
        },
        legend="" if energies else None,
    )


def _contacts(seen: FramesInView) -> time_panels.TimePanel:
    line = {"": (seen.time, seen.frames.contact_count[seen.chosen])}
    return time_panels.TimePanel("contacts", line, limits=(0.0, None), looks={"": {**INK, "drawstyle": "steps-post"}})


def _support_force(seen: FramesInView) -> time_panels.TimePanel:
    """Return the upward force (N) of the supports on all free blocks, with the weight; where it is cut, its largest.

    Raises InvalidInputError where contacts were not stored.
    """
    support = seen.support
    up = float(np.sin(support.tilt)), float(np.cos(support.tilt))
    force = force_on_supports(arrows.contacts_of(seen.frames), up, support.fixed)[seen.chosen]
    largest, reference = float(force.max(initial=0.0)), support.weight or float(np.median(force)) or 1.0
    factor, unit = time_panels.unit_for(reference, "N")
    note = f"upwards, from ground,\nwalls and fixed bodies\ndashed: weight {factor * support.weight:.3g} {unit}"
    if largest > MOST_WEIGHTS * reference:
        note += f"\nlargest: {factor * largest:.3g} {unit}"
    return time_panels.TimePanel(
        f"support force ({unit})",
        {"": (seen.time, factor * force)},
        note,
        limits=(0.0, factor * min(max(1.1 * largest, 1.5 * reference), MOST_WEIGHTS * reference)),
        looks={"": INK},
        level=factor * support.weight,
    )


def _ground(seen: FramesInView) -> time_panels.TimePanel:
    """Return the displacement of ground, walls and fixed bodies."""
    moved = run_data.MILLIMETRES * seen.support.displacement(seen.time)
    note = f"displacement of\nthe ground {seen.support.way}" if seen.support.motion is not None else "at rest"
    return time_panels.TimePanel(
        "ground (mm)", {"": (seen.time, moved)}, note, limits=time_panels.limits_of(moved), looks={"": INK}
    )


SCENE_PANELS: dict[str, Callable[[FramesInView], time_panels.TimePanel]] = {
    ENERGY: _energies,
    CONTACTS: _contacts,
    FORCE: _support_force,
    GROUND: _ground,
}


def _notes(seen: FramesInView, names: Sequence[str], shown: int, *, is_measured: bool, is_chosen: bool) -> str:
    texts = ["Potential energy relative to its minimum."] if ENERGY in names else []
    if {"dx", "dy"} & set(names):
        texts.append("Δx, Δy: displacement from the start.")
    if seen.from_ground and set(names) & set(MOTIONS):
        texts.append("Places and velocities relative to the moving ground.")
    if is_measured and {"x", "y", "rotation"} & set(names):
        texts.append("At the end: measured mean and range.")
    blocks = len(seen.frames.names)
    if shown < blocks:
        which = f"{shown} of {blocks} blocks"
        texts.append(f"{which}." if is_chosen else f"Coloured: {which}, those that end farthest from their start.")
    return " ".join(texts)
