"""Options that several commands share."""

import re
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from blocksim.cli import completion

if TYPE_CHECKING:
    from blocksim.view.layout import Paper

SIZE = re.compile(r"([0-9]+(?:\.[0-9]*)?)\s*[x×]\s*([0-9]+(?:\.[0-9]*)?)\s*(mm|cm|in|px)?")
INCHES = {"mm": 1.0 / 25.4, "cm": 1.0 / 2.54, "in": 1.0}
LEAST_SIDE, MOST_SIDE = 20.0 / 25.4 - 1e-9, 2000.0 / 25.4 + 1e-9  # inches
SPARE_PIXEL = 0.25  # so that no round-off removes a whole one
MOST_PIXELS = 1e8
MOST_SHOWN = 40  # letters of a value in a message


def seconds_of(text: object) -> float:
    """Return a time in s, written with its unit. Raises BadParameter, a mistake of usage."""
    from pydantic_core import PydanticCustomError

    from blocksim.scenario.quantities import TIME, Quantity

    try:
        return Quantity(TIME, above=0.0).read(text)
    except PydanticCustomError as error:
        raise typer.BadParameter(error.message()) from None


@dataclass(frozen=True)
class PageSize:
    """Picture size as the user gave it: width and height in a unit."""

    width: float
    height: float
    unit: str

    def inches(self, dots: float) -> tuple[float, float]:
        """Return width and height in inches; pixels are those of a PNG with so many dots per inch."""
        if self.unit == "px":
            return (self.width + SPARE_PIXEL) / dots, (self.height + SPARE_PIXEL) / dots
        return self.width * INCHES[self.unit], self.height * INCHES[self.unit]


def page_size(text: object) -> PageSize:
    """Return a size of pictures, WxH with mm, cm, in or px. Raises BadParameter, a mistake of usage."""
    found = SIZE.fullmatch(str(text).strip())
    if found is None:
        raise typer.BadParameter(
            f"{str(text)[:MOST_SHOWN]!r} is not a picture size; write it as in 180x120mm or 1600x900px"
        )
    size = PageSize(float(found[1]), float(found[2]), found[3] or "mm")
    if not all(LEAST_SIDE <= side <= MOST_SIDE for side in size.inches(150.0)):
        raise typer.BadParameter("each side of a picture must be 20 to 2000 mm (about 120 to 12 000 px)")
    return size


def paper_of(size: PageSize | None, dots: float | None) -> "Paper":
    """Return the page for --size and --dpi. Raises BadParameter for more than MOST_PIXELS."""
    from blocksim.view.layout import Paper
    from blocksim.view.style import DOTS_PER_INCH

    resolution = dots or float(DOTS_PER_INCH)
    inches = None if size is None else size.inches(resolution)
    if inches is not None and inches[0] * inches[1] * resolution**2 > MOST_PIXELS:
        raise typer.BadParameter(f"--size and --dpi make more than {MOST_PIXELS / 1e6:.0f} million pixels")
    return Paper(inches, dots)


def colour_name(text: object) -> str:
    """Return a way to colour blocks. Raises BadParameter for an unknown one."""
    from blocksim.view.paint import COLOURS

    if text not in COLOURS:
        raise typer.BadParameter(f"{str(text)[:MOST_SHOWN]!r} is unknown; choose {', '.join(COLOURS)}")
    return str(text)


def names_of(option: str, text: str | None) -> tuple[str, ...] | None:
    """Return names separated by commas, None where none were given. Raises BadParameter for an empty list."""
    if text is None:
        return None
    names = tuple(name.strip() for name in text.split(",") if name.strip())
    if not names:
        raise typer.BadParameter("give one name or several, separated by commas", param_hint=option)
    return names


ScenarioPath = Annotated[Path, typer.Argument(metavar="SCENARIO", help="Scenario file (TOML).")]
StoredRunPath = Annotated[
    Path, typer.Argument(metavar="RUN", help="Run folder, results/NAME (its newest finished run) or scenario file.")
]
Forces = Annotated[bool, typer.Option("--forces", help="Draw contact forces, if the run has stored them.")]
Size = Annotated[
    PageSize | None,
    typer.Option(
        "--size", parser=page_size, metavar="WxH", help="Size of the picture: 180x120mm, 7x5in or 1600x900px."
    ),
]
Dots = Annotated[
    float | None,
    typer.Option("--dpi", min=20.0, max=1200.0, metavar="N", help="Dots per inch of a PNG (default: 150)."),
]
Colour = Annotated[
    str,
    typer.Option(
        "--colour",
        "--color",
        parser=colour_name,
        metavar="BY",
        autocompletion=completion.colours,
        help="Colour blocks by block, material, speed or turn; soil by displacement (default), speed, plastic or "
        "pressure.",
    ),
]


class Executor(StrEnum):
    """What runs the cases of a study."""

    ENSEMBLE = "ensemble"
    PROCESSES = "processes"
    DASK = "dask"


ExecutorName = Annotated[
    Executor | None,
    typer.Option(help="ensemble: in this process (default); processes: a case that crashes stops no other."),
]
Jobs = Annotated[int | None, typer.Option(min=1, metavar="N", help="Threads or processes (default: one per core).")]
Scheduler = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="Scheduler of a Dask cluster, such as tcp://host:8786.")
]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Set a scenario key, e.g. contact.stiffness_scale=0.01. Repeatable.",
        autocompletion=completion.scenario_keys,
    ),
]
OutFolder = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="Folder for the results (default: results/NAME/HASH).")
]
SweepFolder = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="Folder for the results (default: results/NAME/sweep-HASH).")
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Run again and replace the existing results.")]
Replace = Annotated[bool, typer.Option("--overwrite", help="Replace a file that blocksim did not write.")]
Resume = Annotated[bool, typer.Option("--resume", help="Resume a run that was stopped or killed.")]
CheckpointEvery = Annotated[
    float,
    typer.Option(
        "--checkpoint-every",
        parser=seconds_of,
        metavar="TIME",
        help="Wall time between checkpoints (default: 60 s).",
        show_default=False,
    ),
]
CheckpointSteps = Annotated[
    int | None, typer.Option("--checkpoint-steps", min=1, metavar="N", help="Steps between checkpoints.")
]
CheckpointTime = Annotated[
    float | None,
    typer.Option("--checkpoint-time", parser=seconds_of, metavar="TIME", help="Simulated time between checkpoints."),
]
WallTime = Annotated[
    float | None,
    typer.Option(
        "--wall-time",
        parser=seconds_of,
        metavar="TIME",
        help='Stop after this wall time, e.g. "90 min", as Ctrl-C does.',
    ),
]
Threads = Annotated[
    int,
    typer.Option(
        "--threads", min=1, metavar="N", help="Threads, for scenes of 200 blocks and more. Results are bit-identical."
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print the answer as JSON, for programs.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print only the answer.")]
ExperimentPath = Annotated[
    Path | None,
    typer.Option("--experiment", metavar="TABLE", help="Experiment table (CSV) instead of the scenario's own."),
]
