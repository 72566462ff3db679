"""Joints across structures over their height: what they carry, where the resultant lies, factors of safety."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from blocksim.errors import InvalidInputError
from blocksim.simulation.safety import FACTORS, Safety, SafetyRow
from blocksim.view import style
from blocksim.view.time_panels import unit_for

PANEL, LEAST, SIDES, GAPS = (1.9, 2.2), (0.9, 1.0), (0.72, 0.14, 0.24, 0.40), (0.3, 0.72)  # inches
MOST_ROWS = 3
LONG = 2e3  # mm: from there on lengths are in m
WIDEST = 10.0  # factors beyond are not drawn
ARROW = 0.5  # of the longest joint: the largest thrust
SHEAR, PRESS = style.MEASURED_COLOUR, style.BLOCK_COLOURS[4]
MARK: dict[str, Any] = {"marker": "o", "markersize": 3.5, "linewidth": 1.0}
ACTIVE: dict[str, Any] = {**MARK, "markerfacecolor": "white", "linestyle": (0, (3, 2))}
NOTES = (
    "N, T on what is below; T, e positive to the right. Grey: kern, a sixth of the length to both sides of the middle. "
    "Black: ends of the joint. Arrows: resultants of soil on the structure. Factors beyond 10 are not drawn."
)
ALARM = (
    " Mobilised factors near one are no alarm for a wall at rest, which stands under any thrust from the active one "
    "to that which overturns it."
)


def draw_joints(states: Mapping[str, Safety], path: Path, title: str, paper: style.Paper = style.OWN) -> None:
    """Draw the joints of structures at the end, or as settled where they fell, a row of panels each.

    Raises InvalidInputError for a run without joints, an unknown picture format or too small a page, OutputError.
    """
    path = style.picture_path(path)
    shown = {row.structure: state for state, one in states.items() for row in one.joints}  # the end comes last
    if not shown:
        reasons = [f" ({name}: {text})" for one in states.values() for name, text in one.reasons.items()]
        raise InvalidInputError(f"this run has no joints across structures{''.join(reasons[-1:])}")
    rows = {name: [one for one in states[shown[name]].joints if one.structure == name] for name in [*shown][:MOST_ROWS]}
    has_active = any(one.active_sliding is not None for own in rows.values() for one in own)
    looks = {"N, overturning": {"color": PRESS, **MARK}, "T, sliding": {"color": SHEAR, **MARK}}
    looks |= {
        "e": {"color": style.INK, **MARK},
        **({"active": {"color": style.FAINT_INK, **ACTIVE}} if has_active else {}),
    }
    notes = NOTES + ALARM * has_active + f" {len(shown) - MOST_ROWS} more structures." * (len(shown) > MOST_ROWS)
    handles = [style.legend_entry(name, **look) for name, look in looks.items()]
    around: dict[str, Any] = {"title": title, "notes": notes, "handles": handles, "columns": len(handles)}
    with style.open_panels(paper, [3] * len(rows), PANEL, LEAST, SIDES, GAPS, **around) as (figure, panels):
        for (name, own), axes in zip(rows.items(), panels, strict=True):
            _draw(axes, own, states[shown[name]])
            head = f"{name}, {'at the end' if shown[name] == 'end' else shown[name]}"
            axes[0].set_title(style.cut_to(head, 72.0 * PANEL[0], style.FONT_SIZE), loc="left")
        style.save_figure(figure, path)


def _draw(axes: "Sequence[style.Axes]", rows: Sequence[SafetyRow], state: Safety) -> None:
    """Draw one structure: forces, eccentricity with the thrust of soil, factors."""
    table = np.array([[*row.model_dump(exclude={"structure"}).values()] for row in rows], dtype=np.float64)
    columns = dict(zip([*SafetyRow.model_fields][1:], table.T, strict=True))
    thrusts = [one for one in state.thrusts if one.on == rows[0].structure and one.side in ("left", "right")]
    reach = max(*np.abs(columns["y_mm"]), *columns["length_mm"], *(abs(one.y_mm) for one in thrusts))
    scale, unit = (1e-3, "m") if reach >= LONG else (1.0, "mm")
    height, press, shear = scale * columns["y_mm"], columns["compression_N"], columns["shear_N"]
    factor, newton = unit_for(float(np.abs([press, shear]).max()), "N")
    half, kern = 0.5 * scale * columns["length_mm"], scale * columns["kern_mm"]
    bars = np.stack([np.stack([-kern, kern], -1), np.stack([height, height], -1)], axis=-1)
    style.add_lines(axes[1], bars, colors=style.GROUND_COLOUR, linewidths=3.0)
    axes[1].fill_betweenx(height, -kern, kern, color=style.GROUND_COLOUR, linewidth=0.0)
    for end in (-half, half):
        axes[1].plot(end, height, color=style.INK, linewidth=0.8, marker="|", markersize=4.0)
    axes[1].plot(scale * columns["eccentricity_mm"], height, color=style.INK, **MARK)
    sizes = [math.hypot(one.fx_N, one.fy_N) for one in thrusts]
    widest = farthest = float(half.max())
    for thrust, size in zip(thrusts, sizes, strict=True):
        x, y, length = math.copysign(widest, -thrust.fx_N), scale * thrust.y_mm, 2.0 * ARROW * widest / max(sizes)
        tail = (x - length * thrust.fx_N, y - length * thrust.fy_N)
        farthest = max(farthest, abs(tail[0]))
        axes[1].annotate("", (x, y), tail, arrowprops={"arrowstyle": "-|>", "color": PRESS, "shrinkA": 0, "shrinkB": 0})
        text, away = f" {factor * size:.3g} {newton} ", "left" if x > 0.0 else "right"
        axes[1].text(x, max(y, tail[1]), text, ha=away, va="bottom", color=PRESS)
    for colour, values in ((PRESS, press), (SHEAR, shear)):
        axes[0].plot(factor * values, height, color=colour, **MARK)
    for name, colour, look in zip(FACTORS, (SHEAR, PRESS) * 2, (MARK, MARK, ACTIVE, ACTIVE), strict=True):
        if (drawn := columns[name] <= WIDEST).any():
            axes[2].plot(columns[name][drawn], height[drawn], color=colour, **look)
    axes[1].set_xlim(-1.2 * farthest, 1.2 * farthest)
    axes[2].set_xlim(0.0)
    for panel, place in ((axes[0], 0.0), (axes[2], 1.0)):
        panel.axvline(place, color=style.FAINT_INK, linewidth=style.LINE_WIDTH, linestyle=(0, (4, 3)))
    limits = style.limits_around(np.array([*height, *(scale * one.y_mm for one in thrusts)]), 0.12, widest)
    for panel, name in zip(axes, (f"force ({newton})", f"e ({unit})", "factor of safety"), strict=True):
        panel.spines[["right", "top"]].set_visible(False)
        panel.set_ylim(*limits)
        panel.tick_params(axis="y", labelleft=panel is axes[0])
        style.number_axis(panel.xaxis, 4)
        style.number_axis(panel.yaxis)
        panel.set_xlabel(name, labelpad=2.0)
    axes[0].set_ylabel(f"height ({unit})")
