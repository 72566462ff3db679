"""blocksim new and schema: what a scenario is written with, templates and the schema for editors."""

from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Annotated

import typer

from blocksim.cli import command_line, output
from blocksim.errors import OutputError, OutputExistsError
from blocksim.options import Option
from blocksim.scenario import json_schema, spelling
from blocksim.simulation.files import write_text

TEMPLATES = "templates"
PLACE = "@NAME@"
NEXT = {".toml": "blocksim check {path}", ".csv": 'name it in a scenario: [experiment] table = "{path}"'}
SWEEP = "sweep-"


def templates() -> dict[str, Traversable]:
    """Return the templates by kind: the name of their file without its extension."""
    found = (files("blocksim.cli") / TEMPLATES).iterdir()
    return dict(sorted((entry.name.partition(".")[0], entry) for entry in found))


def new_command(
    kind: Annotated[
        str,
        Option(f"One of {', '.join(templates())}.", metavar="KIND", complete="templates", is_argument=True),
    ],
    name: Annotated[
        str, Option("Name of the scenario, and of its file without extension.", metavar="NAME", is_argument=True)
    ],
) -> command_line.Report:
    """Write a commented scenario, sweep or table from a template.

    The file is ready to be checked and run; existing files are never overwritten.

    Example: blocksim new three-blocks my_blocks
    """
    from pydantic import TypeAdapter, ValidationError

    from blocksim.scenario.models.base import Identifier

    known = templates()
    if kind not in known:
        hint = spelling.did_you_mean(kind, known) or f"use one of {', '.join(known)}"
        raise typer.BadParameter(f"unknown kind {kind!r}, {hint}", param_hint="KIND")
    template = known[kind]
    ending = Path(template.name).suffix
    path = Path(name.removesuffix(ending) + ending)
    try:
        TypeAdapter(Identifier).validate_python(path.stem)
    except ValidationError as error:
        raise typer.BadParameter(error.errors()[0]["msg"], param_hint="NAME") from None
    try:
        path.open("x", encoding="utf-8").close()
    except FileExistsError:
        raise OutputExistsError(f"{path}: already exists; choose another name") from None
    except OSError as error:
        raise OutputExistsError(f"{path}: cannot be created: {error.strerror}") from error
    try:
        write_text(path, template.read_text(encoding="utf-8").replace(PLACE, path.stem))
    except OutputError:  # the disk is full
        path.unlink(missing_ok=True)  # it was made here, and is empty
        raise
    following = "blocksim sweep {path} --dry-run" if kind.startswith(SWEEP) else NEXT[ending]
    return command_line.Report([str(path)], notes=[f"next: {following.format(path=path)}"])


def schema_command() -> None:
    """Print the JSON Schema of scenario files, for editors.

    An editor with a TOML language server completes and checks keys with it.

    Example: blocksim schema > scenario.schema.json
    """
    output.print_json(json_schema())
