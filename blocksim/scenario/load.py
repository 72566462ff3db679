"""Loading a scenario from a file or from Python."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from blocksim.scenario.document import Document
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.path_policy import said_by_hand
from blocksim.scenario.resolved import scenario_to_toml

Source = Path | str | Mapping[str, object] | Scenario | Document


def load_stored(path: Path | str) -> Scenario:
    """Read and check a scenario in a folder of results, which may come from somebody else: no link is followed.

    Raises as `load_scenario`, and InvalidInputError for a link.
    """
    return Document.read(path, is_stored=True).build()


def load_scenario(
    source: Source,
    overrides: Mapping[str, object] | Sequence[str] = (),
    *,
    allow_outside: bool = False,
) -> Scenario:
    """Read and check a scenario: a file, nested dictionaries in the form of the file, or an existing scenario.

    `overrides` are "key=value" texts as given to --set, or dotted keys with Python values. Tables that the file names
    must lie below its folder or below the current one, unless `allow_outside` is given or an override names them.
    Raises ScenarioError with all mistakes together, and InputMissingError where the file itself cannot be read.
    """
    document = _reaching(document_of(source), allow_outside=allow_outside)
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


def replace_values(scenario: Scenario, changes: Mapping[str, object]) -> Scenario:
    """Return a scenario with some keys changed, validated as a file would be.

    `changes` are dotted keys with Python values or strings with a unit: {"ground.tilt": "10 deg"}. The given
    scenario is unchanged. Raises ScenarioError with all mistakes together.
    """
    return document_of(scenario).with_values({key: said_by_hand(key, value) for key, value in changes.items()}).build()


def document_of(source: Source) -> Document:
    """Return the document of a file, of nested dictionaries, or of a scenario.

    Tables of an existing scenario may lie anywhere. Raises what reading raises.
    """
    if isinstance(source, Document):
        return source
    if isinstance(source, Scenario):
        return replace(Document.parse(scenario_to_toml(source), source.name), allow_outside=True)
    return Document.from_mapping(source) if isinstance(source, Mapping) else Document.read(source)


def _reaching(document: Document, *, allow_outside: bool) -> Document:
    return replace(document, allow_outside=True) if allow_outside else document
