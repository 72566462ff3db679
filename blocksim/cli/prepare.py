"""What comes before a run: reading the scenario, so that later mistakes also point into the file, and compiling."""

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

from blocksim.cli import command_line, output
from blocksim.errors import ScenarioError
from blocksim.options import Option
from blocksim.scenario import Document, Model, mistakes
from blocksim.study import plan
from blocksim.world.free_memory import readable
from blocksim.world.step import SkinTooSmallError, StepError


@dataclass(frozen=True)
class ScenarioInput:
    """A scenario file on the command line, with what is set in it."""

    scenario: Annotated[Path, Option("Scenario file (TOML).", metavar="SCENARIO", is_argument=True)]
    settings: command_line.Settings = None

    def document(self) -> Document:
        """Return the document. Raises what reading it raises."""
        return Document.read(self.scenario).with_settings(self.settings or [])

    @contextmanager
    def built(self) -> Iterator[Model]:
        """Give what a valid scenario describes; a step or skin that does not fit is shown where it was written."""
        document = self.document()
        try:
            yield Model(document)
        except StepError as error:
            raise ScenarioError([document.problem(mistakes.Mistake(("time", "step"), str(error)))]) from None
        except SkinTooSmallError as error:
            raise ScenarioError([document.problem(mistakes.Mistake(("contact", "skin"), str(error)))]) from None


def warn_of_values(models: Iterable[Model], screen: command_line.Screen) -> list[str]:
    """Warn of values that are allowed but implausible, of each once, and return the warnings."""
    shown = [] if screen.silent else list(dict.fromkeys(text for one in models for text in one.implausible_values))
    for text in shown:
        screen.note(f"warning: {text}")
    return shown


DryRun = Annotated[bool, Option("Print number of cases, cost and size without running anything.")]


def estimate_report(
    found: plan.Estimate, jobs: int | None, screen: command_line.Screen, more: Iterable[str] = ()
) -> command_line.Report:
    """Return what a study comes to without running it, with what its numbers hold for."""
    cores = jobs or os.cpu_count() or 1
    on = f"{cores} core{'' if cores == 1 else 's'}"
    until_rest = "; less if they stop at rest" if found.stop_at_rest else ""
    lines = [
        f"cases      {found.cases}",
        f"solving    at most about {output.duration(found.seconds / cores)} on {on}",
        f"results    at most about {readable(found.bytes)}",
        f"memory     about {readable(found.memory)} for a process that runs one case",
        f"from the steps of {found.looked_at} cases at the measured speed{until_rest}",
    ]
    if found.impossible:
        which = f"{found.impossible} of these {found.looked_at}"
        lines.append(f"{which} cannot be simulated; the first: {found.reason}")
    return command_line.Report(
        [*lines, *more], {**asdict(found), "jobs": cores}, always=() if screen.as_json else found.remarks
    )


def announce_compilation(kernels: str, *, quiet: bool) -> None:
    """Compile a set of kernels unless that is done, and report it: it is not part of a run."""
    from blocksim.kernels.common import jit
    from blocksim.simulation.schemes import compile_kernels, is_compiled

    if quiet or is_compiled(kernels):
        compile_kernels(kernels)
        return
    output.note("Compiling the solver, once after installation (less than a minute) ...")
    output.note(f"Compiled in {compile_kernels(kernels):.0f} s.")
    if not is_compiled(kernels):
        folder = jit.cache_folder() or jit.cache_root()
        output.note(f"{folder}: the compiled solver cannot be stored there; free some space, or set BLOCKSIM_CACHE_DIR")
