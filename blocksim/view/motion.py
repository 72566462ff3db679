"""The motion of the supports over time: acceleration, velocity and displacement with their peaks."""

from pathlib import Path

import numpy as np

from blocksim.errors import InvalidInputError
from blocksim.scenario.motion import displacement_and_velocity
from blocksim.scenario.motion_peaks import Peak, acceleration_ends, motion_peaks
from blocksim.scenario.units import STANDARD_GRAVITY
from blocksim.view.layout import OWN, Paper
from blocksim.view.run_data import Floats, Support
from blocksim.view.time_panels import TimePanel, draw_time_panels
from blocksim.view.window import MILLIMETRES

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
        _panel("acceleration (m/s²)", 1.0, (ends, acceleration), peaks.acceleration, "PGA", f"= {in_g:.4g} g\n"),
        _panel("velocity (mm/s)", MILLIMETRES, (times, velocity), peaks.velocity, "PGV"),
        _panel("displacement (mm)", MILLIMETRES, (times, displacement), peaks.displacement, "PGD"),
    ]
    final = _left(peaks.final_velocity, peaks.velocity), _left(float(displacement[-1]), peaks.displacement)
    left = f"At the end: {final[0]:.4g} mm/s, {final[1]:.4g} mm.".replace("-", "−")
    note = f"Ground, walls and fixed bodies, {support.way}. {left}"
    draw_time_panels(panels, path, title, note, paper)


def _panel(label: str, factor: float, line: tuple[Floats, Floats], peak: Peak, name: str, more: str = "") -> TimePanel:
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
