"""Probes of a run over time: forces, material points, joints and energies, a panel for each quantity."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from blocksim.errors import InvalidInputError
from blocksim.scenario.spelling import did_you_mean_or_list
from blocksim.simulation.probe_series import ENERGY, FORCE, JOINT, POINT, ProbeSeries
from blocksim.view.history_panels import drawn_energies, unit_for
from blocksim.view.layout import OWN, Paper
from blocksim.view.run_data import Floats
from blocksim.view.time_panels import TimePanel, draw_time_panels, time_panels_png
from blocksim.view.window import MILLIMETRES

MOST_PANELS = 12
_LETTERS = 24  # of a line beside a panel
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
    return TimePanel(f"{quantity} ({unit})" if unit else quantity, lines, f"probe {probe.name}"[:_LETTERS] + several)


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
    FORCE: _force,
    POINT: _point,
    JOINT: _joint,
    ENERGY: _energy,
}
