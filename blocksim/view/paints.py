"""Colours of blocks: each in its own colour, or by material, speed or rotation.

A block has the same colour in every picture: strip, final state, history, animation and report.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from blocksim.errors import InvalidInputError
from blocksim.scenario import Model
from blocksim.simulation.trajectory import Frames
from blocksim.view import run_data, style

SPEED_COLOURS = "YlGnBu"  # light at rest; darker in steps that are seen in grey as well
ELEMENT_COLOURS = "viridis"  # of the elements of systems beside the blocks: seen on white at rest too
TURN_COLOURS = "PuOr"  # distinguishable with every common colour blindness
LEAST_TURN = 1.0  # degrees
RARE = 0.995  # share of all speeds that the scale covers
PEAK = 1.5  # largest over that speed, from which the scale leaves the rest beyond its end
BAR_HEIGHT, ENTRIES_HEIGHT = 0.50, 0.24  # inches, of what explains the colours
BAR = 0.10  # inches
METRE = 1e4  # mm, from which on displacements are in metres
LETTERS = 24  # of a material's name

Fills = Callable[[int], Sequence[str]]


@dataclass(frozen=True)
class Scale:
    """A bar of colours: what it shows, the map, its ends, and beyond which of them values lie."""

    label: str
    colours: str
    low: float
    high: float
    extend: str = "neither"


@dataclass(frozen=True)
class Paint:
    """The fills (#rrggbb) of all blocks in a frame, and what explains them: named colours, a scale, or nothing.

    `elements` are those of the elements of each system beside the blocks, None for a system in one colour; where there
    are any, the scale is theirs.
    """

    fills: Fills
    entries: tuple[tuple[str, str], ...] = ()
    scale: Scale | None = None
    elements: tuple[Fills | None, ...] = ()

    @property
    def height(self) -> float:
        """Height (inches) of what explains the colours."""
        if self.scale is not None:
            return BAR_HEIGHT
        return ENTRIES_HEIGHT if self.entries else 0.0


def by_block(frames: Frames) -> Paint:
    """Return the default: blocks take turns in six colours."""
    fills = [style.block_colour(index) for index in range(len(frames.names))]
    return Paint(lambda _: fills)


def by_material(_: object, model: Model) -> Paint:
    """Return a colour for each material, in the order of the blocks; fixed bodies keep the ground's."""
    bodies = model.bodies
    materials = list(dict.fromkeys(body.material for body in bodies))
    colours = {name: style.block_colour(index) for index, name in enumerate(materials)}
    fills = [colours[body.material] for body in bodies]
    return Paint(lambda _: fills, tuple((style.shorten(name, LETTERS), colours[name]) for name in materials))


def by_speed(frames: Frames) -> Paint:
    """Return a scale from rest to the largest speed; to that of all but the rarest where a few are far beyond."""
    speeds = np.hypot(frames.vx, frames.vy)
    known = speeds[run_data.drawable_frames(frames)]
    factor, unit = (1.0, "m/s") if (float(known.max()) or 1.0) >= 1.0 else (1e3, "mm/s")
    moving = known[known > 0.0] if known.any() else np.ones(1)
    return _scaled(factor * speeds, scale_from_zero(f"speed ({unit})", factor * moving, SPEED_COLOURS))


def scale_from_zero(label: str, values: run_data.Floats, colours: str = ELEMENT_COLOURS) -> Scale:
    """Return a scale from 0 to the largest value; where a few are far beyond all others, these lie beyond its end."""
    usual, largest = (float(np.quantile(values, share)) for share in (RARE, 1.0))
    is_cut = largest > PEAK * usual > 0.0
    high = (usual if is_cut else largest) or 1.0
    return Scale(label, colours, 0.0, high, "max" if is_cut else "neither")


def shade_elements(paint: Paint, frames: Frames, name: str) -> Paint:
    """Return a paint of blocks that also colours the elements of other systems, by a shade of this name."""
    found = [next((one for one in track.system.shades if one.name == name), None) for track in frames.others]
    values = [None if shade is None else shade.of(track) for shade, track in zip(found, frames.others, strict=True)]
    known = np.concatenate([one[run_data.drawable_frames(frames)].ravel() for one in values if one is not None])
    scale = scale_from_zero(next(shade.label for shade in found if shade is not None), known)
    fills = tuple(None if one is None else _scaled(one, scale).fills for one in values)
    return replace(paint, entries=(), scale=scale, elements=fills)


def by_turn(frames: Frames) -> Paint:
    """Return a scale of the angle turned since the blocks were placed, the same to both sides."""
    turns = np.degrees(frames.rotation)
    farthest = float(np.abs(turns[run_data.drawable_frames(frames)]).max())
    most = min(max(farthest, LEAST_TURN), 180.0)  # degrees; blocks that have turned farther share the colour
    extend = "both" if farthest > most * 1.001 else "neither"
    return _scaled(turns, Scale("rotation (°)", TURN_COLOURS, -most, most, extend))


def displacements(frames: Frames, support: run_data.Support) -> run_data.Floats:
    """Return how far the centres of all blocks are from where they began (m), relative to the support, (n, b)."""
    carried = support.offset(frames.time)
    dx = frames.x - frames.x[0] - (carried[:, :1] - carried[0, 0])
    dy = frames.y - frames.y[0] - (carried[:, 1:] - carried[0, 1])
    return np.asarray(np.hypot(dx, dy))


def by_displacement(frames: Frames, support: run_data.Support, most: float) -> Paint:
    """Return a scale of the displacement since the start, from none to `most` (m)."""
    high = 1e3 * most or 1.0
    factor, unit = (1.0, "mm") if high < METRE else (1e-3, "m")
    scale = Scale(f"displacement ({unit})", SPEED_COLOURS, 0.0, factor * high)
    return _scaled(factor * 1e3 * displacements(frames, support), scale)


# Each takes the frames and the model; another way to colour is one function and one line here.
PAINTS: dict[str, Callable[[Any, Model], Paint]] = {
    "block": lambda frames, _: by_block(frames),
    "material": by_material,
    "speed": lambda frames, _: by_speed(frames),
    "turn": lambda frames, _: by_turn(frames),
}


SHADES = ("displacement", "speed", "plastic", "pressure")
"""Of the elements of systems beside the blocks; those that blocks do not know leave them in their own colours."""
COLOURS = tuple(dict.fromkeys((*PAINTS, *SHADES)))


def paint_of(name: str, frames: Frames, model: Model) -> Paint:
    """Return the colours of a run by their meaning. Raises InvalidInputError for a meaning that this run does not have.

    Elements of other systems have their first shade, unless the meaning is one of theirs: then blocks keep their own
    colours, and the scale is that of the elements.
    """
    shades = [shade.name for track in frames.others for shade in track.system.shades]
    known = tuple(dict.fromkeys((*PAINTS, *shades)))
    if name not in known:
        raise InvalidInputError(f"unknown colour {name!r} in this run; choose {', '.join(known)}")
    if name in shades:
        return shade_elements(by_block(frames), frames, name)
    paint = PAINTS[name](frames, model)
    return shade_elements(paint, frames, shades[0]) if shades and paint.scale is None else paint


def _scaled(values: run_data.Floats, scale: Scale) -> Paint:
    """Return fills from a map of colours; `values` are (n, b)."""

    def fills(frame: int) -> list[str]:
        from matplotlib import colormaps, colors

        shares = (np.nan_to_num(values[frame]) - scale.low) / (scale.high - scale.low)
        return [colors.to_hex(colour) for colour in colormaps[scale.colours](shares.clip(0.0, 1.0))]

    return Paint(fills, scale=scale)


def draw_key(figure: "style.Figure", paint: Paint, left: float, bottom: float) -> None:
    """Draw what explains the colours, its lower left corner at a place given in inches."""
    from matplotlib import cm, colors, ticker

    across = float(figure.get_figwidth())
    if paint.scale is not None:
        scale, width, left = paint.scale, min(0.4 * across, 3.0), left + 0.06 * across
        colours = cm.ScalarMappable(colors.Normalize(scale.low, scale.high), scale.colours)
        place = style.add_axes(figure, left, bottom + 0.34, width, BAR)
        bar = figure.colorbar(colours, cax=place, orientation="horizontal", extend=scale.extend)
        bar.outline.set_linewidth(style.LINE_WIDTH)
        bar.locator = ticker.MaxNLocator(nbins=5, steps=[1, 2, 3, 4.5, 5, 9, 10])
        bar.formatter = ticker.FuncFormatter(lambda value, _: f"{value:g}".replace("-", "−"))
        bar.update_ticks()
        style.write_text(figure, left + width + 0.15, bottom + 0.39, scale.label, va="center")
    elif paint.entries:
        edge = {"edgecolor": style.INK, "linewidth": 0.5}
        handles = [style.legend_entry(name, facecolor=fill, **edge) for name, fill in paint.entries]
        style.write_legend(figure, handles, left, bottom, ncols=max(1, min(len(handles), int(across / 1.6))))
