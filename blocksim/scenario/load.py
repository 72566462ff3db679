"""The two ways to a scenario: from a file, and from Python."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from blocksim.scenario.document import Document
from blocksim.scenario.models.scenario import Scenario


def load_scenario(path: Path | str, overrides: Mapping[str, object] | Sequence[str] = ()) -> Scenario:
    """Read and check a scenario file.

    `overrides` are "key=value" texts as given to --set, or dotted keys with Python values. Raises
    ScenarioError with all mistakes together, and InputMissingError where the file itself cannot be read.
    """
    document = Document.read(path)
    if isinstance(overrides, Mapping):
        return document.with_values(overrides).build()
    return document.with_settings(overrides).build()


def scenario_from_mapping(data: Mapping[str, object], base_folder: Path = Path()) -> Scenario:
    """Check a scenario given as nested dicts and lists in the form of the file; raises ScenarioError."""
    return Document.from_mapping(data, base_folder).build()
