"""blocksim new: a commented scenario, sweep or experiment table from a template."""

from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Annotated

import typer

from blocksim.cli import completion, options
from blocksim.cli.output import answer, note
from blocksim.errors import OutputError, OutputExistsError
from blocksim.scenario.spelling import did_you_mean
from blocksim.simulation.atomic import write_text

TEMPLATES = "templates"
PLACE = "@NAME@"
NEXT = {".toml": "blocksim check {path}", ".csv": 'name it in a scenario: [experiment] table = "{path}"'}
SWEEP = "sweep-"


def templates() -> dict[str, Traversable]:
    """Return the templates by kind: the name of their file without its extension."""
    found = (files("blocksim.cli") / TEMPLATES).iterdir()
    return {entry.name.partition(".")[0]: entry for entry in sorted(found, key=lambda entry: entry.name)}


def new_command(
    kind: Annotated[
        str,
        typer.Argument(
            metavar="KIND", help=f"One of {', '.join(templates())}.", autocompletion=completion.of_names(templates)
        ),
    ],
    name: Annotated[
        str, typer.Argument(metavar="NAME", help="Name of the scenario, and of its file without extension.")
    ],
    quiet: options.Quiet = False,
) -> None:
    """Write a commented scenario, sweep or table from a template.

    The file is ready to be checked and run; existing files are never overwritten.

    Example: blocksim new three-blocks my_blocks
    """
    template = _template(kind)
    ending = Path(template.name).suffix
    path = Path(name.removesuffix(ending) + ending)
    _refuse_bad_name(path.stem)
    _write(path, template.read_text(encoding="utf-8").replace(PLACE, path.stem))
    answer(str(path))
    if not quiet:
        following = "blocksim sweep {path} --dry-run" if kind.startswith(SWEEP) else NEXT[ending]
        note(f"next: {following.format(path=path)}")


def _template(kind: str) -> Traversable:
    known = templates()
    if kind in known:
        return known[kind]
    hint = did_you_mean(kind, known) or f"use one of {', '.join(known)}"
    message = f"unknown kind {kind!r}, {hint}"
    raise typer.BadParameter(message, param_hint="KIND")


def _refuse_bad_name(name: str) -> None:
    from pydantic import TypeAdapter, ValidationError

    from blocksim.scenario.models.base import Identifier

    try:
        TypeAdapter(Identifier).validate_python(name)
    except ValidationError as error:
        raise typer.BadParameter(error.errors()[0]["msg"], param_hint="NAME") from None


def _write(path: Path, text: str) -> None:
    """Write a file that must not exist yet. Raises OutputExistsError, and OutputError where the disk is full."""
    try:
        file = path.open("x", encoding="utf-8")
    except FileExistsError:
        message = f"{path}: already exists; choose another name"
        raise OutputExistsError(message) from None
    except OSError as error:
        message = f"{path}: cannot be created: {error.strerror}"
        raise OutputExistsError(message) from error
    file.close()
    try:
        write_text(path, text)
    except OutputError:
        path.unlink(missing_ok=True)  # it was made here, and is empty
        raise
