"""All of it in one folder: README.md with the tables, and the pictures that it shows.

`python -m blocksim.verification.paper.write FOLDER` runs the shipped scenarios first.
"""

import sys
from collections.abc import Mapping
from pathlib import Path

from blocksim.analysis.experiment import ExperimentTable, load_table
from blocksim.analysis.properties import load_properties
from blocksim.errors import BlocksimError, OutputError
from blocksim.scenario import load_scenario
from blocksim.simulation.atomic import write_text
from blocksim.simulation.result import Result
from blocksim.simulation.running import simulate
from blocksim.verification.paper import tables
from blocksim.verification.paper.laws import bounce_law, bounces, slide_law
from blocksim.view.final import draw_final
from blocksim.view.law import draw_law
from blocksim.view.layout import Paper
from blocksim.view.run_data import support_of
from blocksim.view.strip import draw_strip

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
        tables.properties_table(printed, runs[0].scenario),
        (
            f"Upright is `{next(iter(runs[0].scenario.blocks.values())).upright}`, which the paper does not say; "
            "`three_blocks_literal` has the other reading."
        ),
        "## Figure 3: position and rotation after the motion",
        _picture("figure3.png", "Final state: x and rotation of each block, measured mean and range below it"),
        "## Table 2: edges after the motion",
        tables.edges_table(edges, runs),
        (
            f"The extents of block 3 run from {min(wide):.0f} to {max(wide):.0f} mm between the repeats, so "
            "the real blocks also turned about the "
            "vertical; a simulation in the plane is compared with the centres."
        ),
        "## Table 3: centres after the motion",
        tables.centres_table(centres, runs),
        "✓ inside the range of the six repeats, ✗ outside.",
        tables.rotations_table(centres, runs),
        f"## Figure 4: the motion in {PANELS} frames",
        _picture("figure4.png", "Eleven frames of the collapse, equally spaced in the path travelled"),
        "The paper does not print the times of its frames; these are equally spaced in the path travelled.",
        "## Equations 10 to 12: a bounce",
        _picture("equation10.png", "Height over time, simulated and by Eq. 10, and the difference"),
        (
            "The second form of Eq. 10 as printed gives the remaining rise, largest at the impact and zero at the "
            f"apex; the height is h_p of Eq. 12 less that. Largest difference: {laws[0][0].largest:.3g} mm."
        ),
        tables.bounces_table(bounces(bounce)),
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
