"""The two ways to a scenario: from a file, and from Python."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from blocksim.scenario.document import Document
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.reach import said_by_hand


def load_scenario(
    path: Path | str, overrides: Mapping[str, object] | Sequence[str] = (), *, allow_outside: bool = False
) -> Scenario:
    """Read and check a scenario file.

    `overrides` are "key=value" texts as given to --set, or dotted keys with Python values. Tables that the file names
    have to lie below its folder or below the current one, unless `allow_outside` is given or an override names them.
    Raises ScenarioError with all mistakes together, and InputMissingError where the file itself cannot be read.
    """
    document = _reaching(Document.read(path), allow_outside=allow_outside)
    if isinstance(overrides, Mapping):
        return document.with_values({key: said_by_hand(key, value) for key, value in overrides.items()}).build()
    return document.with_settings(overrides).build()


def scenario_from_mapping(
    data: Mapping[str, object], base_folder: Path = Path(), *, allow_outside: bool = False
) -> Scenario:
    """Check a scenario given as nested dicts and lists in the form of the file; raises ScenarioError.

    Tables as in `load_scenario`.
    """
    return _reaching(Document.from_mapping(data, base_folder), allow_outside=allow_outside).build()


def _reaching(document: Document, *, allow_outside: bool) -> Document:
    return replace(document, allow_outside=True) if allow_outside else document
