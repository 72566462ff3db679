"""The paper's figures, tables and equations with the results of the shipped scenarios.

Equations 10 and 13 over a simulated bounce and a simulated slide.

Tables 1 to 3 of the paper as Markdown: printed values with those of the scenarios.

Measurements are in scenarios/experiments; the results of the paper's own simulation are here.

All of it in one folder: README.md with the tables, and the pictures that it shows.

`python -m blocksim.verification.paper FOLDER` runs the shipped scenarios first.
"""

import sys
from collections.abc import Mapping, Sequence
from itertools import pairwise
from math import isfinite
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.analysis.compare import ComparisonRow, Verdict, compare_final
from blocksim.analysis.experiment import ExperimentTable, load_properties, load_table
from blocksim.errors import BlocksimError, OutputError
from blocksim.scenario import Scenario, load_scenario
from blocksim.simulation.atomic import write_text
from blocksim.simulation.result import Result
from blocksim.simulation.run import simulate
from blocksim.verification import closed_forms as forms
from blocksim.verification.reference import markdown
from blocksim.view.final import draw_final
from blocksim.view.run_data import support_of
from blocksim.view.strip import draw_strip
from blocksim.view.studies import Law, draw_law
from blocksim.view.style import Paper

Floats = NDArray[np.float64]
MILLI = 1e3
LEAST_APEX = 2e-5  # m; lower bounces are not distinguished from rest


class Bounce(NamedTuple):
    """Apexes (mm) and times of flight (ms) of bounce number p, simulated and by Eq. 12."""

    number: int
    apex: float
    eq12_apex: float
    flight: float
    eq12_flight: float


def bounce_law(result: Result) -> Law:
    """Return the height (mm) of the lower face over a bounce, and Eq. 10 from its start.

    The second form of Eq. 10 as printed gives the remaining rise: the height is the apex of Eq. 12 less
    that.
    """
    frames, scenario = result.frames, result.scenario
    clearance = frames.y[:, 0] - 0.5 * frames.size_y[0]
    start, restitution = float(clearance[0]), scenario.contact.restitution.block_ground
    impacts = impact_times(start, restitution, scenario.gravity)
    expected = np.array([_height(float(time), start, restitution, scenario.gravity, impacts) for time in frames.time])
    marks = [time for time in impacts if time < float(frames.time[-1])]
    return Law("height", "mm", "Eq. 10", frames.time, MILLI * clearance, MILLI * expected, marks)


def impact_times(height: float, restitution: float, gravity: float) -> list[float]:
    """Return the times (s) of the impacts of a body dropped from a height (m), as long as it rises between them."""
    times = [forms.fall_time(height, gravity)]
    while forms.apex_height(height, restitution, len(times)) > LEAST_APEX:
        times.append(times[-1] + forms.flight_time(height, restitution, len(times), gravity))
    return times


def bounces(result: Result) -> list[Bounce]:
    """Return apex and flight time of each bounce, simulated and by Eq. 12.

    In free flight height and speed of any frame give the apex and the instant of landing; the simulated flight time is
    that between two landings, the time in contact included.
    """
    frames, gravity = result.frames, result.scenario.gravity
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
            MILLI * tops[number],
            MILLI * forms.apex_height(start, restitution, number),
            MILLI * (landings[number] - landings[number - 1]),
            MILLI * forms.flight_time(start, restitution, number, gravity),
        )
        for number in range(1, len(tops))
        if forms.apex_height(start, restitution, number) > LEAST_APEX
    ]


def slide_law(result: Result) -> Law:
    """Return the speed (mm/s) of a sliding block, and Eq. 13 with the ground's friction."""
    frames, scenario = result.frames, result.scenario
    friction = scenario.friction.block_ground.kinetic
    start = float(frames.vx[0, 0])
    expected = np.array([forms.sliding_speed(float(time), start, friction, scenario.gravity) for time in frames.time])
    marks = [forms.sliding_stop_time(start, friction, scenario.gravity)]
    return Law("speed", "mm/s", "Eq. 13", frames.time, MILLI * frames.vx[:, 0], MILLI * expected, marks)


def _height(time: float, start: float, restitution: float, gravity: float, impacts: list[float]) -> float:
    """Return the height (m) of the lower face by Eqs 10 and 12, 0 after the last bounce."""
    if time < impacts[0]:
        return start - forms.fall_distance(time, gravity)
    number = sum(impact <= time for impact in impacts)
    if number == len(impacts):
        return 0.0
    since = time - impacts[number - 1]
    still = forms.remaining_rise(since, start, restitution, number, gravity)
    return forms.apex_height(start, restitution, number) - still


PAPER_X = {"1": "16", "2": "76.05", "3": "about 130"}  # mm, section 3.3 of the paper
SIGNS = {Verdict.INSIDE: "✓", Verdict.OUTSIDE: "✗", Verdict.NO_DATA: ""}
FACTORS = {"mm": 1e3, "kN/m³": 1e-3, "GPa": 1e-9, "": 1.0}
PRINTED = {  # property of the table, its name in the paper, unit
    "width": ("width", "mm"),
    "height": ("height", "mm"),
    "length": ("length", "mm"),
    "overlap": ("overlap Δx", "mm"),
    "unit_weight": ("density ρ (a unit weight)", "kN/m³"),
    "young_modulus": ("Young's modulus E", "GPa"),
    "poisson_ratio": ("Poisson's ratio ν", ""),
    "friction_block_block": ("friction between blocks μ", ""),
    "friction_block_ground": ("friction with the ground k", ""),
}


def properties_table(printed: Mapping[str, float], scenario: Scenario) -> str:
    """Return Table 1, and the sizes, with those of a scenario."""
    used = _used(scenario)
    rows = []
    for name, (label, unit) in PRINTED.items():
        factor = FACTORS[unit]
        rows.append((label, f"{printed[name] * factor:.4g}", f"{used[name] * factor:.4g}", unit))
    return _table(("property", "printed", f"`{scenario.name}`", "unit"), rows)


def edges_table(edges: ExperimentTable, runs: Sequence[Result]) -> str:
    """Return Table 2: the outer edges of the blocks in all repeats, and in runs."""
    rows = [
        _measured_row(edges, block, quantity, f"{quantity}, block {block}", [run.columns for run in runs])
        for quantity in ("left", "right")
        for block in edges.blocks
    ]
    return _table((*_repeats_heads(edges), *(f"`{run.name}`" for run in runs)), rows)


def centres_table(centres: ExperimentTable, runs: Sequence[Result]) -> str:
    """Return Table 3: the centres in all repeats, by the paper's own simulation, and in runs with verdicts."""
    judged = [_judged(run, centres) for run in runs]
    rows = []
    for block in centres.blocks:
        row = _measured_row(centres, block, "x", f"block {block}", [])
        cells = [_verdict_cell(one.get((block, "x"))) for one in judged]
        rows.append((*row, PAPER_X.get(block, ""), *cells))
    heads = (*_repeats_heads(centres), "the paper's simulation", *(f"`{run.name}`" for run in runs))
    return _table(heads, rows)


def rotations_table(centres: ExperimentTable, runs: Sequence[Result]) -> str:
    """Return the rotations of section 3.2, and those of runs with verdicts."""
    judged = [_judged(run, centres) for run in runs]
    measured = {row.block: row.mean for row in centres.summaries() if row.quantity == "rotation"}
    rows = [
        (f"block {block}", f"{mean:.0f}", *(_verdict_cell(one.get((block, "rotation"))) for one in judged))
        for block, mean in measured.items()
    ]
    return _table(("block", "measured, all repeats", *(f"`{run.name}`" for run in runs)), rows)


def bounces_table(bounces: Sequence[Bounce]) -> str:
    """Return apexes and flight times with those of Eq. 12."""
    rows = [
        (str(one.number), *(f"{value:.3f}" for value in (one.eq12_apex, one.apex, one.eq12_flight, one.flight)))
        for one in bounces
    ]
    heads = ("impact p", "h_p by Eq. 12, mm", "simulated, mm", "t_p by Eq. 12, ms", "simulated, ms")
    return _table(heads, rows)


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table; the minus sign of numbers is a proper one."""
    return markdown(heads, [[f"−{cell[1:]}" if cell.startswith("-") else cell for cell in row] for row in rows])


def _repeats_heads(table: ExperimentTable) -> tuple[str, ...]:
    return ("mm", *(str(number) for number in table.replicates), "mean")


def _measured_row(
    table: ExperimentTable, block: str, quantity: str, label: str, columns: Sequence[Mapping[str, Sequence[object]]]
) -> tuple[str, ...]:
    """Return the repeats of one quantity, their mean, and the value in final tables."""
    values = [one.value for one in table.measurements if (one.block, one.quantity) == (block, quantity)]
    mean = sum(values) / len(values)
    runs = [f"{final[f'{quantity}_mm'][list(final['block']).index(block)]:.2f}" for final in columns]
    return (label, *(f"{value:.2f}" for value in values), f"{mean:.2f}", *(_plain(text) for text in runs))


def _judged(run: Result, centres: ExperimentTable) -> dict[tuple[str, str], ComparisonRow]:
    return {(row.block, row.quantity): row for row in compare_final(run.columns, centres).rows}


def _verdict_cell(row: ComparisonRow | None) -> str:
    if row is None or not isfinite(row.simulated):
        return "–"
    return f"{_plain(f'{row.simulated:.2f}')} {SIGNS[row.verdict]}"


def _plain(text: str) -> str:
    return text[1:] if text.startswith("-") and not text.strip("-0.") else text


def _used(scenario: Scenario) -> dict[str, float]:
    """Return a scenario's sizes, material and static frictions (SI) by the names of the table of properties."""
    block, material = next(iter(scenario.blocks.values())), next(iter(scenario.materials.values()))
    overlaps = [overlap for one in scenario.structures if (overlap := getattr(one, "overlap", None)) is not None]
    return {name: float(getattr(block, name)) for name in ("width", "height", "length")} | {
        "overlap": overlaps[0] if overlaps else float("nan"),
        "unit_weight": material.density * scenario.gravity,
        "young_modulus": material.young_modulus,
        "poisson_ratio": material.poisson_ratio,
        "friction_block_block": scenario.friction.block_block.static,
        "friction_block_ground": scenario.friction.block_ground.static,
    }


PANELS = 11  # of Figure 4
PAPER = Paper(dots=110.0)
MAIN = "three_blocks"  # whose pictures are drawn
COLLAPSES = (MAIN, "three_blocks_nominal", "three_blocks_nonsmooth", "three_blocks_literal")
MEANINGS = {
    MAIN: "printed constants; restitution and kinetic friction, which are not printed, calibrated",
    "three_blocks_nominal": "printed constants, restitution 0.2 assumed, nothing tuned",
    "three_blocks_nonsmooth": "the nominal run with rigid contacts instead of springs",
    "three_blocks_literal": "the sizes read literally: 32 × 25 mm in the plane",
}
INDEX = "README.md"
TITLE = "The paper's figures, tables and equations, simulated"


def write_paper(folder: Path, scenarios: Path, settings: Mapping[str, object] | None = None) -> list[Path]:
    """Run the scenarios in a folder, with `settings` for those of the collapse, and return what was written.

    Raises what reading and running the scenarios raises, BlocksimError for a run that does not finish, OutputError.
    """
    runs = [_finished(scenarios / f"{name}.toml", settings or {}) for name in COLLAPSES]
    bounce, slide = (_finished(scenarios / f"{name}.toml", {}) for name in ("bounce", "slide"))
    experiments = scenarios / "experiments"
    centres = load_table(experiments / "three_blocks.csv")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        message = f"{folder}: cannot be created: {error.strerror}"
        raise OutputError(message) from None
    pictures = _draw_collapse(folder, runs[0], centres)
    laws = [(bounce_law(bounce), "equation10.png"), (slide_law(slide), "equation13.png")]
    titles = ("Equation 10: height over a bounce", "Equation 13: speed of a sliding block")
    for (law, name), title in zip(laws, titles, strict=True):
        draw_law(law, folder / name, title, PAPER)
        pictures.append(folder / name)
    printed = load_properties(experiments / "three_blocks_properties.csv").values
    edges = load_table(experiments / "three_blocks_edges.csv")
    wide = edges.values("3", "right") - edges.values("3", "left")
    parts = [
        f"# {TITLE}",
        (
            "T. T. T. Huyen and N. T. Cuong, *The Motion of Rigid Bodies Shaped Rectangular-Box: Experiment and "
            "Numerical Simulation* (Hanoi, 2020). Written by `make paper` from the shipped scenarios; lengths in mm, "
            "rotations in degrees, counter-clockwise positive."
        ),
        "\n".join(f"* `{name}`: {MEANINGS[name]}" for name in COLLAPSES),
        "## Table 1: properties",
        properties_table(printed, runs[0].scenario),
        (
            f"Upright is `{next(iter(runs[0].scenario.blocks.values())).upright}`, which the paper does not say; "
            "`three_blocks_literal` has the other reading."
        ),
        "## Figure 3: position and rotation after the motion",
        _picture("figure3.png", "Final state: x and rotation of each block, measured mean and range below it"),
        "## Table 2: edges after the motion",
        edges_table(edges, runs),
        (
            f"The extents of block 3 run from {min(wide):.0f} to {max(wide):.0f} mm between the repeats, so "
            "the real blocks also turned about the "
            "vertical; a simulation in the plane is compared with the centres."
        ),
        "## Table 3: centres after the motion",
        centres_table(centres, runs),
        "✓ inside the range of the six repeats, ✗ outside.",
        rotations_table(centres, runs),
        f"## Figure 4: the motion in {PANELS} frames",
        _picture("figure4.png", "Eleven frames of the collapse, equally spaced in the path travelled"),
        "The paper does not print the times of its frames; these are equally spaced in the path travelled.",
        "## Equations 10 to 12: a bounce",
        _picture("equation10.png", "Height over time, simulated and by Eq. 10, and the difference"),
        (
            "The second form of Eq. 10 as printed gives the remaining rise, largest at the impact and zero at the "
            f"apex; the height is h_p of Eq. 12 less that. Largest difference: {laws[0][0].largest:.3g} mm."
        ),
        bounces_table(bounces(bounce)),
        "## Equation 13: a slide",
        _picture("equation13.png", "Speed over time, simulated and by Eq. 13, and the difference"),
        f"V = V0 − μgt until the block stops. Largest difference: {laws[1][0].largest:.3g} mm/s.",
    ]
    index = folder / INDEX
    write_text(index, "\n\n".join(parts) + "\n")
    return [*pictures, index]


def _draw_collapse(folder: Path, run: Result, centres: ExperimentTable) -> list[Path]:
    """Draw Figures 3 and 4."""
    support = support_of(run.scenario)
    final, strip = folder / "figure3.png", folder / "figure4.png"
    look = {"measured": centres, "support": support, "paper": PAPER}
    draw_final(run.frames, final, title=f"Figure 3: {run.name}", **look)  # type: ignore[arg-type]
    draw_strip(run.frames, strip, title=f"Figure 4: {run.name}", count=PANELS, **look)  # type: ignore[arg-type]
    return [final, strip]


def _finished(path: Path, settings: Mapping[str, object]) -> Result:
    result = simulate(load_scenario(path, settings))
    if result.status != "finished":
        message = f"{path}: the run has {result.status}: {result.reason}"
        raise BlocksimError(message)
    return result


def _picture(name: str, text: str) -> str:
    return f"![{text}]({name})"


if __name__ == "__main__":
    write_paper(Path(sys.argv[1]), Path("scenarios"))
