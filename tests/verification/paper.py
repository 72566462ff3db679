"""The paper's figures, tables and equations with the results of the shipped scenarios, in one folder.

Its README.md has Tables 1 to 3, printed values beside those of the scenarios, Equations 10 and 13 over a simulated
bounce and a simulated slide, and the pictures. Measurements are those of scenarios/experiments; the results of the
paper's own simulation are here.

`python -m tests.verification.paper FOLDER` runs the shipped scenarios first.
"""

import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import isfinite, sqrt
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from blocksim.analysis.compare import Verdict, compare_final
from blocksim.analysis.experiment import ExperimentTable, load_properties, load_table
from blocksim.errors import BlocksimError, OutputError
from blocksim.scenario import Scenario, load_scenario
from blocksim.simulation import files, results
from blocksim.simulation.run import simulate
from blocksim.study.answer import number_text
from blocksim.verification import closed_forms as forms
from blocksim.view import run_data, scene, style, time_panels
from blocksim.view.final import draw_final
from blocksim.view.strip import draw_strip

MILLI = 1e3
LEAST_APEX = 2e-5  # m; lower bounces are not distinguished from rest


LAW_SIDES, LAW_GAP = (0.75, 0.15, 0.11, 0.36), 0.16  # inches
LAW_PANEL, LAW_LEAST = (6.3, 1.7), (1.0, 0.5)  # inches, of each panel, and on a page whose size was asked for
SIMULATED: dict[str, Any] = {"color": "#0072B2", "linewidth": 3.0, "alpha": 0.55, "solid_capstyle": "butt"}
EXPECTED: dict[str, Any] = {"color": style.INK, "linewidth": 1.0, "linestyle": (0, (4, 2))}


@dataclass(frozen=True, eq=False)
class LawCurve:
    """n values of one quantity: simulated and by a formula, in the unit of `quantity`; NaN where there is no formula.

    `marks` are times (s) worth a thin line, such as impacts.
    """

    quantity: str
    unit: str
    formula: str
    time: run_data.Floats  # (n,) s
    simulated: run_data.Floats  # (n,)
    expected: run_data.Floats  # (n,)
    marks: Sequence[float] = ()

    @property
    def largest(self) -> float:
        """The largest difference, without sign."""
        return float(np.nanmax(np.abs(self.simulated - self.expected)))


def draw_law(law: LawCurve, path: Path | str, title: str, paper: style.Paper = style.OWN) -> None:
    """Draw the quantity, and its difference to the formula, and write PNG, SVG or PDF; the same input, the same bytes.

    Raises InvalidInputError for an unknown picture format or a page that is too small, and OutputError when the file
    cannot be written.
    """
    path = style.picture_path(path)
    difference, is_known = law.simulated - law.expected, np.isfinite(law.expected)
    with style.open_panels(paper, [1, 1], LAW_PANEL, LAW_LEAST, LAW_SIDES, (0.0, LAW_GAP), title=title) as opened:
        figure, ((above,), (below,)) = opened
        above.plot(law.time, law.simulated, label="simulated", **SIMULATED)
        above.plot(law.time, law.expected, label=law.formula, **EXPECTED)
        above.legend(loc="upper right", frameon=False)
        below.plot(law.time, difference, color=SIMULATED["color"], linewidth=1.0)
        known = np.concatenate([law.simulated, law.expected[is_known]])
        panels = ((above, law.quantity, known), (below, "difference", difference[is_known]))
        for axes, label, values in panels:
            for mark in law.marks:
                axes.axvline(mark, color=style.FAINT_INK, linewidth=0.5, zorder=0)
            axes.spines[["right", "top"]].set_visible(False)
            axes.set_xlim(float(law.time[0]), float(law.time[-1]))
            axes.set_ylim(*time_panels.limits_of(values))
            axes.set_ylabel(f"{label} ({law.unit})")
            style.number_axis(axes.yaxis)
        figure.align_ylabels()
        above.tick_params(labelbottom=False)
        below.set_xlabel("time (s)", labelpad=2.0)
        style.save_figure(figure, path)


def markdown(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table as Markdown; the minus sign of numbers is a proper one."""
    proper = ([f"−{cell[1:]}" if cell.startswith("-") else cell for cell in row] for row in rows)
    head, *lines = (f"| {' | '.join(cells)} |" for cells in (heads, *proper))
    return "\n".join([head, f"|{' --- |' * len(heads)}", *lines])


class Bounce(NamedTuple):
    """Apexes (mm) and times of flight (ms) of bounce number p, by Eq. 12 and simulated."""

    number: int
    eq12_apex: float
    apex: float
    eq12_flight: float
    flight: float


def remaining_rise(
    time: float, height: float, restitution: float, impacts: int, gravity: float = forms.GRAVITY
) -> float:
    """Return (v - g t)^2/(2 g) (m), Eq. 10, second form, as printed, at `time` (s) after impact number `impacts`.

    v = sqrt(2 g h0) e^p is the upward speed just after that impact. With the speed v - g t at that moment this is how
    far the body will STILL rise, not how high it is: it is largest at the impact and zero at the apex. Height and
    remaining rise add up to the apex height.
    """
    speed = sqrt(2.0 * gravity * height) * restitution**impacts
    return (speed - gravity * time) ** 2 / (2.0 * gravity)


def sliding_speed(time: float, speed: float, friction: float, gravity: float = forms.GRAVITY) -> float:
    """Return the speed (m/s) on level ground at `time` (s): V0 - mu g t (Eq. 13, N = M g), 0 once at rest."""
    return max(speed - friction * gravity * time, 0.0)


def replicates_of(table: ExperimentTable) -> list[str]:
    return [str(number) for number in sorted({one.replicate for one in table.measurements})]


def bounce_law(result: results.Result) -> LawCurve:
    """Return the height (mm) of the lower face over a bounce, and Eq. 10 from its start.

    The second form of Eq. 10 as printed gives the remaining rise: the height is the apex of Eq. 12 less that, 0 after
    the last bounce.
    """
    frames, gravity = result.frames, result.scenario.gravity.magnitude
    clearance = frames.y[:, 0] - 0.5 * frames.size_y[0]
    start, restitution = float(clearance[0]), result.scenario.contact.restitution.block_ground
    impacts = [sqrt(2.0 * start / gravity)]
    while forms.apex_height(start, restitution, len(impacts)) > LEAST_APEX:
        impacts.append(impacts[-1] + forms.flight_time(start, restitution, len(impacts), gravity))

    def height(time: float) -> float:
        number = sum(impact <= time for impact in impacts)
        if number == 0:
            return start - forms.fall_distance(time, gravity)
        if number == len(impacts):
            return 0.0
        still = remaining_rise(time - impacts[number - 1], start, restitution, number, gravity)
        return forms.apex_height(start, restitution, number) - still

    expected = np.array([height(float(time)) for time in frames.time])
    marks = [time for time in impacts if time < float(frames.time[-1])]
    return LawCurve("height", "mm", "Eq. 10", frames.time, MILLI * clearance, MILLI * expected, marks)


def bounces(result: results.Result) -> list[Bounce]:
    """Return apex and flight time of each bounce, by Eq. 12 and simulated.

    In free flight height and speed of any frame give the apex and the instant of landing; the simulated flight time is
    that between two landings, the time in contact included.
    """
    frames, gravity = result.frames, result.scenario.gravity.magnitude
    clearance, speed = frames.y[:, 0] - 0.5 * frames.size_y[0], frames.vy[:, 0]
    restitution, start = result.scenario.contact.restitution.block_ground, float(clearance[0])
    turns = np.flatnonzero((speed[:-1] < 0.0) & (speed[1:] > 0.0)) + 1
    tops, landings = [], []
    for first, last in pairwise([0, *turns]):
        flight = slice(first, last)
        rise = speed[flight] ** 2 / (2.0 * gravity)
        free = clearance[flight] > 0.0
        top = (clearance[flight] + rise)[free]
        landing = (frames.time[flight] + speed[flight] / gravity)[free] + np.sqrt(2.0 * top / gravity)
        tops.append(float(np.median(top)))
        landings.append(float(np.median(landing)))
    return [
        Bounce(
            number,
            MILLI * forms.apex_height(start, restitution, number),
            MILLI * tops[number],
            MILLI * forms.flight_time(start, restitution, number, gravity),
            MILLI * (landings[number] - landings[number - 1]),
        )
        for number in range(1, len(tops))
        if forms.apex_height(start, restitution, number) > LEAST_APEX
    ]


def slide_law(result: results.Result) -> LawCurve:
    """Return the speed (mm/s) of a sliding block, and Eq. 13 with the ground's friction."""
    frames, gravity = result.frames, result.scenario.gravity.magnitude
    friction, start = result.scenario.friction.block_ground.kinetic, float(frames.vx[0, 0])
    expected = np.array([sliding_speed(float(time), start, friction, gravity) for time in frames.time])
    marks = [forms.sliding_stop_time(start, friction, gravity)]
    return LawCurve("speed", "mm/s", "Eq. 13", frames.time, MILLI * frames.vx[:, 0], MILLI * expected, marks)


PAPER_X = {"1": "16", "2": "76.05", "3": "about 130"}  # mm, section 3.3 of the paper
SIGNS = {Verdict.INSIDE: "✓", Verdict.OUTSIDE: "✗", Verdict.NO_DATA: ""}
PRINTED = {  # property of the table, its name in the paper, unit, how many of it are one of SI
    "width": ("width", "mm", 1e3),
    "height": ("height", "mm", 1e3),
    "length": ("length", "mm", 1e3),
    "overlap": ("overlap Δx", "mm", 1e3),
    "unit_weight": ("density ρ (a unit weight)", "kN/m³", 1e-3),
    "young_modulus": ("Young's modulus E", "GPa", 1e-9),
    "poisson_ratio": ("Poisson's ratio ν", "", 1.0),
    "friction_block_block": ("friction between blocks μ", "", 1.0),
    "friction_block_ground": ("friction with the ground k", "", 1.0),
}


def properties_table(printed: Mapping[str, float], scenario: Scenario) -> str:
    """Return Table 1, and the sizes, with those of a scenario; frictions are the static ones."""
    block, material = next(iter(scenario.blocks.values())), next(iter(scenario.materials.values()))
    overlaps = [overlap for one in scenario.structures if (overlap := getattr(one, "overlap", None)) is not None]
    used = {name: float(getattr(block, name)) for name in ("width", "height", "length")} | {
        "overlap": overlaps[0] if overlaps else float("nan"),
        "unit_weight": material.density * scenario.gravity.magnitude,
        "young_modulus": material.young_modulus,
        "poisson_ratio": material.poisson_ratio,
        "friction_block_block": scenario.friction.block_block.static,
        "friction_block_ground": scenario.friction.block_ground.static,
    }
    rows = [
        (label, f"{printed[name] * factor:.4g}", f"{used[name] * factor:.4g}", unit)
        for name, (label, unit, factor) in PRINTED.items()
    ]
    return markdown(("property", "printed", f"`{scenario.name}`", "unit"), rows)


def edges_table(edges: ExperimentTable, runs: Sequence[results.Result]) -> str:
    """Return Table 2: the outer edges of the blocks in all repeats, and in runs."""
    rows = []
    for quantity in ("left", "right"):
        for block in edges.blocks:
            places = [run.columns[f"{quantity}_mm"][list(run.columns["block"]).index(block)] for run in runs]
            texts = (*_repeats(edges, block, quantity), *(number_text(place, 2) for place in places))
            rows.append((f"{quantity}, block {block}", *texts))
    return markdown(("mm", *replicates_of(edges), "mean", *(f"`{run.name}`" for run in runs)), rows)


def centres_table(centres: ExperimentTable, runs: Sequence[results.Result]) -> str:
    """Return Table 3 and the rotations of section 3.2, with those of runs and verdicts.

    Table 3 has the centres in all repeats and by the paper's own simulation.
    """
    judged = [{(row.block, row.quantity): row for row in compare_final(run.columns, centres).rows} for run in runs]

    def verdicts(block: str, quantity: str) -> Iterator[str]:
        for rows in judged:
            row = rows.get((block, quantity))
            if row is None or not isfinite(row.simulated):
                yield "–"
            else:
                yield f"{number_text(row.simulated, 2)} {SIGNS[row.verdict]}"

    places = [
        (f"block {block}", *_repeats(centres, block, "x"), PAPER_X.get(block, ""), *verdicts(block, "x"))
        for block in centres.blocks
    ]
    rotations = [
        (f"block {row.block}", f"{row.mean:.0f}", *verdicts(row.block, "rotation"))
        for row in centres.summaries()
        if row.quantity == "rotation"
    ]
    names = [f"`{run.name}`" for run in runs]
    heads = ("mm", *replicates_of(centres), "mean", "the paper's simulation", *names)
    said = "✓ inside the range of the six repeats, ✗ outside."
    turned = markdown(("block", "measured, all repeats", *names), rotations)
    return f"{markdown(heads, places)}\n\n{said}\n\n{turned}"


def _repeats(table: ExperimentTable, block: str, quantity: str) -> list[str]:
    """Return the repeats of one quantity, and their mean."""
    values = [one.value for one in table.measurements if (one.block, one.quantity) == (block, quantity)]
    return [f"{value:.2f}" for value in (*values, sum(values) / len(values))]


PANELS = 11  # of Figure 4
PAPER = style.Paper(dots=110.0)
COLLAPSES = {  # pictures are those of the first
    "three_blocks": "printed constants; restitution and kinetic friction, which are not printed, calibrated",
    "three_blocks_nominal": "printed constants, restitution 0.2 assumed, nothing tuned",
    "three_blocks_nonsmooth": "the nominal run with rigid contacts instead of springs",
    "three_blocks_literal": "the sizes read literally: 32 × 25 mm in the plane",
}


def write_paper(folder: Path, scenarios: Path, settings: Mapping[str, object] | None = None) -> list[Path]:
    """Run the scenarios in a folder, with `settings` for those of the collapse, and return what was written.

    Raises what reading and running the scenarios raises, BlocksimError for a run that does not finish, OutputError.
    """
    runs = [_finished(scenarios / f"{name}.toml", settings or {}) for name in COLLAPSES]
    bounce, slide = (_finished(scenarios / f"{name}.toml", {}) for name in ("bounce", "slide"))
    experiments, first = scenarios / "experiments", runs[0]
    centres = load_table(experiments / "three_blocks.csv")
    edges = load_table(experiments / "three_blocks_edges.csv")
    wide = edges.values("3", "right") - edges.values("3", "left")
    height, speed = bounce_law(bounce), slide_law(slide)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: cannot be created: {error.strerror}") from None
    names = ("figure3.png", "figure4.png", "equation10.png", "equation13.png", "README.md")
    final, strip, equation10, equation13, index = written = [folder / name for name in names]
    support = run_data.support_of(first.model)
    options = scene.PictureOptions(f"Figure 3: {first.name}", centres.summaries(), support, count=PANELS, paper=PAPER)
    draw_final(first.frames, final, options)
    draw_strip(first.frames, strip, replace(options, title=f"Figure 4: {first.name}"))
    draw_law(height, equation10, "Equation 10: height over a bounce", PAPER)
    draw_law(speed, equation13, "Equation 13: speed of a sliding block", PAPER)
    parts = [
        "# The paper's figures, tables and equations, simulated",
        (
            "T. T. T. Huyen and N. T. Cuong, *The Motion of Rigid Bodies Shaped Rectangular-Box: Experiment and "
            "Numerical Simulation* (Hanoi, 2020). Written by `make paper` from the shipped scenarios; lengths in mm, "
            "rotations in degrees, counter-clockwise positive."
        ),
        "\n".join(f"* `{name}`: {meaning}" for name, meaning in COLLAPSES.items()),
        "## Table 1: properties",
        properties_table(load_properties(experiments / "three_blocks_properties.csv").values, first.scenario),
        (
            f"Upright is `{next(iter(first.scenario.blocks.values())).upright}`, which the paper does not say; "
            "`three_blocks_literal` has the other reading."
        ),
        "## Figure 3: position and rotation after the motion",
        "![Final state: x and rotation of each block, measured mean and range below it](figure3.png)",
        "## Table 2: edges after the motion",
        edges_table(edges, runs),
        (
            f"The extents of block 3 run from {min(wide):.0f} to {max(wide):.0f} mm between the repeats, so "
            "the real blocks also turned about the vertical; a simulation in the plane is compared with the centres."
        ),
        "## Table 3: centres after the motion",
        centres_table(centres, runs),
        f"## Figure 4: the motion in {PANELS} frames",
        "![Eleven frames of the collapse, equally spaced in the path travelled](figure4.png)",
        "The paper does not print the times of its frames; these are equally spaced in the path travelled.",
        "## Equations 10 to 12: a bounce",
        "![Height over time, simulated and by Eq. 10, and the difference](equation10.png)",
        (
            "The second form of Eq. 10 as printed gives the remaining rise, largest at the impact and zero at the "
            f"apex; the height is h_p of Eq. 12 less that. Largest difference: {height.largest:.3g} mm."
        ),
        markdown(
            ("impact p", "h_p by Eq. 12, mm", "simulated, mm", "t_p by Eq. 12, ms", "simulated, ms"),
            [(str(number), *(f"{value:.3f}" for value in values)) for number, *values in bounces(bounce)],
        ),
        "## Equation 13: a slide",
        "![Speed over time, simulated and by Eq. 13, and the difference](equation13.png)",
        f"V = V0 − μgt until the block stops. Largest difference: {speed.largest:.3g} mm/s.",
    ]
    files.write_text(index, "\n\n".join(parts) + "\n")
    return written


def _finished(path: Path, settings: Mapping[str, object]) -> results.Result:
    result = simulate(load_scenario(path, settings))
    if result.status != "finished":
        raise BlocksimError(f"{path}: the run has {result.status}: {result.reason}")
    return result


if __name__ == "__main__":
    write_paper(Path(sys.argv[1]), Path("scenarios"))
