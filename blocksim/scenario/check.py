"""Everything that must hold before a scenario may be used."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import NamedTuple, get_args

from pydantic import ValidationError

from blocksim.scenario import keys
from blocksim.scenario.consistency import unfit_choices, unknown_provenance, wrong_names
from blocksim.scenario.findings import MAX_FINDINGS, Finding, findings_of
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.models.study import OWN_KEYS, Mode, Sweep
from blocksim.scenario.overrides import SYNONYMS, Data, UnfitOverrideError, with_value
from blocksim.scenario.quantities import shown
from blocksim.scenario.start import impossible_starts

MAX_TRIED = 100
MAX_VARIED = 100
MODES = get_args(Mode)
ENDS = ("from", "mean", "to")
"""Keys of a variation that is not a list, in the order in which they are reported."""
UNVARIED = ("schema", "name", "description", "experiment", "sweep", "provenance")


class Trial(NamedTuple):
    """Context in which the values of a sweep are tried: data without sweep and experiment, and the mistakes in them."""

    data: Data
    folder: Path
    before: Sequence[Finding]


def examine(data: Data, folder: Path) -> tuple[Scenario | None, list[Finding]]:
    """Validate data (tuples for lists): the scenario, or None and all mistakes.

    Mistakes of placement, such as overlapping bodies, can only be found once everything else is right.
    """
    scenario, findings = _validated(data, folder)
    findings += islice(wrong_names(data), MAX_FINDINGS)
    findings += [*_sweep(data, folder), *unknown_provenance(data)]
    if scenario is not None and not findings:
        findings += [*unfit_choices(scenario), *impossible_starts(scenario)]
    return (None if findings else scenario), findings


def _validated(data: Data, folder: Path) -> tuple[Scenario | None, list[Finding]]:
    try:
        return Scenario.model_validate(data, context={"folder": folder}), []
    except ValidationError as error:
        return None, findings_of(error, data)


def _sweep(data: Data, folder: Path) -> Iterator[Finding]:
    """Try the values of a sweep one by one; whether values are compatible shows in each case of the sweep."""
    sweep = data.get("sweep")
    if not isinstance(sweep, Mapping):
        return
    if len(sweep) > MAX_VARIED:
        yield Finding(("sweep",), f"{len(sweep)} keys are too many; at most {MAX_VARIED} can be varied", at="key")
        return
    trial = _trial(data, folder)
    mode = {"mode": sweep["mode"]} if sweep.get("mode") in MODES else {}
    for key, values in sweep.items():
        try:
            Sweep.model_validate({**mode, key: values})
        except ValidationError:
            continue
        if key not in OWN_KEYS:
            yield from islice(_varied(trial, str(key), values), 1)
    for key in map(str, sweep):
        table, dot, word = key.rpartition(".")
        synonym = f"{table}{dot}{SYNONYMS.get(word, word)}"
        if word == "kinetic_ratio" and synonym in sweep:
            message = f"{synonym}, which means the same, is varied too; keep one of the two"
            yield Finding(("sweep", key), message, at="key")


def _varied(trial: Trial, key: str, values: object) -> Iterator[Finding]:
    """Yield the mistakes in a swept key, then in its values as written, so that their dimension is checked too."""
    complaint = unfit_to_vary(key)
    if complaint:
        yield Finding(("sweep", key), complaint, at="key")
        return
    parts: Iterable[tuple[str | int, object]] = ()
    if isinstance(values, Mapping):
        parts = ((end, values[end]) for end in ENDS if end in values)
    elif isinstance(values, tuple):
        parts = enumerate(values[:MAX_TRIED])
    for part, value in parts:
        yield from _tried(trial, keys.parse_key(key), value, ("sweep", key, part))


def unfit_to_vary(key: str) -> str:
    """Return why a key cannot be swept, or nothing; whether the scenario has the key shows when it is tried."""
    try:
        first = keys.parse_key(key)[0]
    except ValueError:
        return f"{shown(key)} is not a dotted key"
    return f"{first} cannot be varied" if first in UNVARIED else ""


def mistakes_of_value(data: Data, folder: Path, key: str, value: object) -> list[Finding]:
    """List the mistakes in one value of one key by itself, in data that may have a sweep."""
    return list(_tried(_trial(data, folder), keys.parse_key(key), value, ("sweep", key)))


def _trial(data: Data, folder: Path) -> Trial:
    bare = {key: entry for key, entry in data.items() if key not in ("sweep", "experiment")}
    return Trial(bare, folder, _single_mistakes(bare, folder))


def _tried(trial: Trial, path: keys.KeyPath, value: object, place: keys.KeyPath) -> Iterator[Finding]:
    """Yield the mistakes that setting one value adds."""
    try:
        changed, _ = with_value(trial.data, path, value)
    except UnfitOverrideError as error:
        yield Finding(place[:2], str(error), at="key")
        return
    for finding in _single_mistakes(changed, trial.folder):
        if finding not in trial.before:
            unknown = finding.at == "key"
            yield Finding(place[:2] if unknown else place, finding.message, at=finding.at)


def _single_mistakes(data: Data, folder: Path) -> list[Finding]:
    """List the mistakes of values by themselves."""
    _, findings = _validated(data, folder)
    return [finding for finding in (*findings, *islice(wrong_names(data), MAX_FINDINGS)) if not finding.relation]
