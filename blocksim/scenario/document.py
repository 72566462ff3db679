"""Loading: a scenario file as read, the values set over it, and the scenario in it or all mistakes with their place."""

import difflib
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Self, cast

from blocksim.errors import InputMissingError, Problem, ScenarioError
from blocksim.scenario.bounded_read import NoSuchFileError, is_folder, read_head
from blocksim.scenario.check import examine
from blocksim.scenario.findings import Finding
from blocksim.scenario.keys import MAX_PARTS
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.overrides import (
    Data,
    Override,
    TooDeepError,
    UnfitOverrideError,
    frozen,
    parse_override,
    with_value,
)
from blocksim.scenario.path_policy import is_anywhere, reaching, said_by_hand
from blocksim.scenario.quantities import shown
from blocksim.scenario.resolved import scenario_to_toml
from blocksim.scenario.source import ScenarioText, clipped, override_problem

MAX_BYTES = 1_000_000
MAX_PROBLEMS = 50
Pair = tuple[str | Sequence[str], object]
TOO_DEEP = "tables or lists are nested too deeply for a scenario"
_PART = r"(?:[A-Za-z0-9_-]++|\"[^\"\n]*+\"|'[^'\n]*+')"
ENDLESS_KEY = re.compile(rf"(?<![A-Za-z0-9_-]){_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{MAX_PARTS}}}")
"""A dotted key (or a text like one) that would keep tomllib busy for minutes; it takes the square of the parts."""


@dataclass(frozen=True)
class Document:
    """Raw data of one scenario with its text, so that mistakes can be shown in their line.

    Relative paths inside are resolved against `folder`; with `allow_outside` they may lead anywhere. In a
    folder of results (`is_stored`) no link is followed: it may come from somebody else and lead to a private file.
    """

    data: Data
    source: ScenarioText
    folder: Path = Path()
    overrides: tuple[Override, ...] = ()
    allow_outside: bool = field(default_factory=is_anywhere)
    is_stored: bool = False

    @classmethod
    def read(cls, path: Path | str, *, is_stored: bool = False) -> Self:
        """Read a TOML file, `is_stored` in a folder of results.

        Raises InputMissingError where it cannot be read, ScenarioError where it is not TOML, InvalidInputError where it
        is not a regular file.
        """
        path = Path(path)
        content = _content(path, is_stored=is_stored)
        try:
            text = content.decode("utf-8-sig")
        except UnicodeDecodeError:
            raise _unusable(str(path), "not a text file in UTF-8") from None
        if "\0" in text:
            raise _unusable(str(path), "not a text file")
        return replace(cls.parse(text, str(path), path.parent), is_stored=is_stored)

    @classmethod
    def parse(cls, text: str, where: str = "scenario", folder: Path = Path()) -> Self:
        """Take the text of a TOML file, named `where` in messages.

        Raises ScenarioError where it is not TOML.
        """
        source = ScenarioText(where, text.replace("\r\n", "\n"))
        endless = ENDLESS_KEY.search(source.text)
        if endless is not None:
            raise ScenarioError([source.shown(TOO_DEEP, "", source.span_at(endless.start()))])
        try:
            data = cast("Data", frozen(tomllib.loads(source.text)))
        except tomllib.TOMLDecodeError as error:
            raise ScenarioError([source.syntax_problem(error)]) from None
        except (RecursionError, TooDeepError):
            raise _unusable(where, TOO_DEEP) from None
        except ValueError as error:  # whole numbers with thousands of digits
            raise _unusable(where, f"not valid TOML: {error}") from None
        if not data:
            raise _unusable(where, "the file is empty; a scenario starts with schema = 1 and a name")
        return cls(data, source, folder)

    @classmethod
    def from_mapping(cls, data: Mapping[str, object], folder: Path = Path()) -> Self:
        """Take data from Python in the form of a file; raises ScenarioError where it is nested too deeply."""
        try:
            return cls(cast("Data", frozen(data)), ScenarioText("scenario"), folder)
        except TooDeepError:
            raise _unusable("scenario", TOO_DEEP) from None

    def with_values(self, values: Mapping[str, object]) -> Self:
        """Set values by dotted key; raises ScenarioError where a key leads nowhere."""
        return self._with([(f"value {key}", f"{key} = {shown(value)}", (key, value)) for key, value in values.items()])

    def with_settings(self, settings: Sequence[str]) -> Self:
        """Set values as --set takes them ("contact.stiffness_scale=0.1"); raises ScenarioError."""
        return self._with([(f"--set {clipped(text, 0)[0]}", text, None) for text in settings])

    def without_sweep(self) -> Self:
        """Leave out the table [sweep]: what a study varies itself."""
        return replace(self, data={key: entry for key, entry in self.data.items() if key != "sweep"})

    def _with(self, settings: Sequence[tuple[str, str, Pair | None]]) -> Self:
        """Set one value after the other, of which each has a name, a text, and key and value if these are known.

        Raises ScenarioError with all that cannot be set.
        """
        data, overrides, problems = self.data, list(self.overrides), []
        for label, text, pair in settings:
            try:
                key, value = parse_override(text) if pair is None else pair
                data, path = with_value(data, key, said_by_hand(key, value) if pair is None else value)
                overrides.append(Override(label, text, path))
            except (UnfitOverrideError, TooDeepError) as error:
                problems.append(override_problem(Override(label, text, ()), (), str(error), "key"))
        if problems:
            raise ScenarioError(problems)
        return replace(self, data=data, overrides=tuple(overrides))

    def build(self) -> Scenario:
        """Validate; raises ScenarioError with every mistake, those in the file first and by line."""
        with reaching(anywhere=self.allow_outside, links=not self.is_stored):
            scenario, findings = examine(self.data, self.folder)
        if scenario is None:
            raise ScenarioError(self._problems(findings))
        return scenario

    def _problems(self, findings: Sequence[Finding]) -> list[Problem]:
        problems = list(dict.fromkeys(self.problem(finding) for finding in findings))
        problems.sort(key=lambda p: (p.line_number is None, p.line_number or 0, p.caret_start))
        more = [Problem(self.source.where, "more mistakes follow")] if len(problems) > MAX_PROBLEMS else []
        return [*problems[:MAX_PROBLEMS], *more]

    def problem(self, finding: Finding) -> Problem:
        """Show a finding where it can be corrected: in a value set from outside, or else in the text."""
        override = next((one for one in reversed(self.overrides) if self._is_cause(one, finding)), None)
        if override is None:  # something may be missing in a table that is not in the text but was created from outside
            table = finding.path[:-1]
            created = reversed(self.overrides) if table and table not in self.source.places else ()
            override = next((one for one in created if one.path[: len(table)] == table), None)
        if override is not None:
            return override_problem(override, finding.path, finding.message, finding.at)
        return self.source.problem(finding.path, finding.message, finding.at)

    def _is_cause(self, override: Override, finding: Finding) -> bool:
        path, found = override.path, finding.path
        inside = found[: len(path)] == path
        on_the_way = path[: len(found)] == found and found not in self.source.places
        beside = finding.relation and path[:-1] == found[:-1]
        return inside or (bool(found) and on_the_way) or beside


Source = Path | str | Mapping[str, object] | Scenario | Document
"""What a scenario can be loaded from."""


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
    document = document_of(source)
    document = replace(document, allow_outside=allow_outside or document.allow_outside)
    if isinstance(overrides, Mapping):
        return document.with_values({key: said_by_hand(key, value) for key, value in overrides.items()}).build()
    return document.with_settings(overrides).build()


def scenario_from_mapping(
    data: Mapping[str, object], base_folder: Path = Path(), *, allow_outside: bool = False
) -> Scenario:
    """Check a scenario given as nested dicts and lists in the form of the file; raises ScenarioError.

    Tables as in `load_scenario`.
    """
    document = Document.from_mapping(data, base_folder)
    return replace(document, allow_outside=allow_outside or document.allow_outside).build()


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


def _unusable(where: str, message: str) -> ScenarioError:
    return ScenarioError([Problem(where, message)])


def _content(path: Path, *, is_stored: bool) -> bytes:
    """Read a file, but never much more than a scenario may have."""
    if is_folder(path):
        raise InputMissingError(f"{path}: this is a folder; a scenario file is needed{_similar_file(path / path.name)}")
    try:
        content = read_head(path, MAX_BYTES + 1, links=not is_stored)
    except NoSuchFileError as error:
        raise InputMissingError(f"{error}{_similar_file(path)}") from None
    if len(content) > MAX_BYTES:
        raise _unusable(str(path), f"larger than {MAX_BYTES // 1_000_000} MB; this is not a scenario")
    return content


def _similar_file(path: Path) -> str:
    """Suggest the scenario in the same folder with the most similar name."""
    try:
        names = sorted(entry.name for entry in path.parent.glob("*.toml"))
    except OSError:
        names = []
    by_stem = {Path(name).stem: name for name in names}  # the ending that all share makes any two names similar
    similar = difflib.get_close_matches(path.stem, by_stem, n=1)
    return f", did you mean '{path.parent / by_stem[similar[0]]}'?" if similar else ""
