"""The option --allow-outside, which all commands have that read scenarios."""

from typing import Annotated, Any

import typer

WITH_SCENARIOS = {
    "run",
    "compare",
    "check",
    "sweep",
    "calibrate",
    "sensitivity",
    "converge",
    "plot",
    "animate",
    "export",
    "report",
}
"""Commands that read scenario files, directly or with results."""


def add_outside(name: str, command: Any) -> Any:
    """Give a command the option, if it reads scenarios; return the command."""
    if name in WITH_SCENARIOS:
        command.params.append(_option())
    return command


def _option() -> Any:
    """Let typer make the option, as it makes all others."""
    alone = typer.Typer(add_completion=False)
    alone.command()(_asked)
    return next(param for param in typer.main.get_command(alone).params if param.name == "allow_outside")


def _allow(context: typer.Context, asked: bool) -> None:
    from blocksim.scenario.path_policy import reaching

    if asked:
        context.with_resource(reaching(anywhere=True))


def _asked(
    allow_outside: Annotated[
        bool,
        typer.Option(
            "--allow-outside",
            callback=_allow,
            expose_value=False,
            help="Allow tables outside the scenario's folder and the current one.",
        ),
    ] = False,
) -> None:
    """Stand for a command that has the option."""
