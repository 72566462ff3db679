"""Options that several commands share."""

from pathlib import Path
from typing import Annotated

import typer

from blocksim.cli import completion


def seconds_of(text: object) -> float:
    """Return a time in s, written with its unit. Raises BadParameter, a mistake of usage."""
    from pydantic_core import PydanticCustomError

    from blocksim.scenario.quantities import TIME, Quantity

    try:
        return Quantity(TIME, above=0.0).read(text)
    except PydanticCustomError as error:
        raise typer.BadParameter(error.message()) from None


ScenarioPath = Annotated[Path, typer.Argument(metavar="SCENARIO", help="Scenario file (TOML).")]
StoredRunPath = Annotated[
    Path, typer.Argument(metavar="RUN", help="Run folder, results/NAME (its newest finished run) or scenario file.")
]
Forces = Annotated[bool, typer.Option("--forces", help="Draw contact forces, where the run has stored them.")]
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
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Run again and replace what is there.")]
Replace = Annotated[bool, typer.Option("--overwrite", help="Replace a file that blocksim did not write.")]
Resume = Annotated[bool, typer.Option("--resume", help="Go on with a run that was stopped or killed.")]
CheckpointEvery = Annotated[
    float,
    typer.Option(
        "--checkpoint-every",
        parser=seconds_of,
        metavar="TIME",
        help="Wall time between checkpoints.",
        show_default="60 s",
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
        "--threads", min=1, metavar="N", help="Threads, for scenes of 200 blocks and more. The result stays the same."
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print the answer as JSON, for programs.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but the answer.")]
ExperimentPath = Annotated[
    Path | None,
    typer.Option("--experiment", metavar="TABLE", help="Experiment table (CSV) instead of the scenario's own."),
]
