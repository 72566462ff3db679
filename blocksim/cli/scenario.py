"""Reading a scenario for a command, so that mistakes found later also point into the file."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from blocksim.cli.output import note
from blocksim.errors import ScenarioError
from blocksim.scenario import Document, Scenario
from blocksim.scenario.findings import Finding
from blocksim.scenario.plausible import implausible_values
from blocksim.world.step import SkinTooSmallError, StepError


@contextmanager
def read_scenario(path: Path, settings: Sequence[str]) -> Iterator[Scenario]:
    """Give the validated scenario; a step or skin that turns out not to fit is shown where it was written."""
    document = Document.read(path).with_settings(settings)
    try:
        yield document.build()
    except StepError as error:
        raise ScenarioError([document.problem(Finding(("time", "step"), str(error)))]) from None
    except SkinTooSmallError as error:
        raise ScenarioError([document.problem(Finding(("contact", "skin"), str(error)))]) from None


def warn_of_values(scenario: Scenario) -> None:
    """Warn of values that are allowed but implausible."""
    for text in implausible_values(scenario):
        note(f"warning: {text}")
