"""blocksim new and schema: what a scenario is written with, templates and the schema for editors."""

import shutil
import stat
import tomllib
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
SHIPPED = "scenarios"


def templates() -> dict[str, Traversable]:
    """Return the templates by kind: the name of their file without its extension, and the folder of scenarios."""
    found = (files("blocksim.cli") / TEMPLATES).iterdir()
    known: dict[str, Traversable] = {entry.name.partition(".")[0]: entry for entry in found}
    return dict(sorted((known | {SHIPPED: shipped()}).items()))


def shipped() -> Path:
    """Return the folder of scenarios that come with blocksim: in the package, or beside it in the repository."""
    package = Path(__file__).parent
    return next((path for path in (package / SHIPPED, package.parents[1] / SHIPPED) if path.is_dir()), package)


def _lines() -> list[str]:
    """Return a line for each template, and for each scenario of the folder that the last one is."""

    def told(path: Traversable) -> str:
        text = path.read_text(encoding="utf-8")
        if path.name.endswith(".toml"):
            return str(tomllib.loads(text).get("description", ""))
        return text.partition("\n")[0].removeprefix("# ").replace(PLACE, "NAME")

    kinds = [(kind, told(path)) for kind, path in templates().items() if kind != SHIPPED]
    kinds.append((SHIPPED, "a folder with all of the following, their tables and records, and notebooks"))
    below = sorted(shipped().rglob("*.toml"), key=lambda path: (len(path.parts), path.name))
    kinds += [(path.relative_to(shipped().parent).as_posix(), told(path)) for path in below]
    width = max(len(kind) for kind, _ in kinds)
    return [f"{kind:{width}}  {text}" for kind, text in kinds]


def _print_list(asked: bool) -> None:
    if asked:
        output.answer("\n".join(_lines()))
        raise typer.Exit


def new_command(
    kind: Annotated[
        str,
        Option(f"One of {', '.join(templates())}.", metavar="KIND", complete="templates", is_argument=True),
    ],
    name: Annotated[
        str, Option("Name of the scenario, and of its file without extension.", metavar="NAME", is_argument=True)
    ],
    _listed: Annotated[
        bool, typer.Option("--list", callback=_print_list, is_eager=True, help="List all kinds, a line each, and exit.")
    ] = False,
) -> command_line.Report:
    """Write a commented scenario, sweep or table from a template.

    The file is ready to be checked and run; existing files are never overwritten. The kind scenarios is a folder: all
    scenarios that come with blocksim, with their tables.

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
    if kind == SHIPPED:
        return _copy_scenarios(path)
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


def _copy_scenarios(path: Path) -> command_line.Report:
    """Copy the folder of scenarios. Raises OutputExistsError, OutputError."""
    if path.exists():
        raise OutputExistsError(f"{path}: already exists; choose another name")
    try:
        ignored = shutil.ignore_patterns("results", "__pycache__")
        shutil.copytree(shipped(), path, ignore=ignored, copy_function=shutil.copyfile)
        for folder in (path, *filter(Path.is_dir, path.rglob("*"))):  # those of a package may be read-only
            folder.chmod(folder.stat().st_mode | stat.S_IRWXU)
    except OSError as error:  # of copytree a list of files
        raise OutputError(f"{path}: cannot be written: {error.strerror or 'not all files could be copied'}") from error
    return command_line.Report([str(path)], notes=[f"next: blocksim run {path / 'three_blocks.toml'}"])


def schema_command() -> None:
    """Print the JSON Schema of scenario files, for editors.

    An editor with a TOML language server completes and checks keys with it.

    Example: blocksim schema > scenario.schema.json
    """
    output.print_json(json_schema())
