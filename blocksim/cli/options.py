"""Options that several commands share."""

from pathlib import Path
from typing import Annotated

import typer

ScenarioPath = Annotated[Path, typer.Argument(metavar="SCENARIO", help="Scenario file (TOML).")]
StoredRunPath = Annotated[
    Path, typer.Argument(metavar="RUN", help="Run folder, results/NAME (its newest finished run) or scenario file.")
]
Forces = Annotated[bool, typer.Option("--forces", help="Draw contact forces, where the run has stored them.")]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY=VALUE", help="Set a scenario key, e.g. contact.stiffness_scale=0.01. Repeatable."
    ),
]
OutFolder = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="Folder for the results (default: results/NAME/HASH).")
]
SweepFolder = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="Folder for the results (default: results/NAME/sweep-HASH).")
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Run again and replace what is there.")]
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
