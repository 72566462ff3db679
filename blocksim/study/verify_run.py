"""Bitwise reproducibility of a stored run: whether it comes out again, and if not, where it parts and why it may.

Of run.json and done.json those entries are compared that follow from the scenario: not wall times, nor when, where and
in which parts the run was made.
"""

import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from blocksim.analysis.bits import Differences, differences
from blocksim.errors import InvalidInputError, StoppedEarlyError
from blocksim.scenario import Scenario, input_files, load_stored, scenario_hash
from blocksim.silence import silent
from blocksim.simulation import Watcher, checkpoint, probes, provenance, read_result, result, simulate
from blocksim.simulation import folder as files
from blocksim.simulation.frames import csv_text
from blocksim.study.stored_run import find_run

INTERRUPTED = "interrupted"
SCENARIO = "scenario"  # its hash, beside the entries of `environment`
CODE = "code"
DECIDES = ("blocksim", provenance.ROOM_PREFIX, "python", "numpy", "numba", "llvmlite", "platform", "processor", "cpu")
ALWAYS = ("name", "steps", "time_step_s", "simulated_time_s", "energy_J")
UNLESS_INTERRUPTED = ("reason", "exit_code")
OF_THE_MOTION = ("settled", "events", "movement")  # what earlier versions did not keep is not there, or null
HASHES = ("run", "scenario_hash")  # of the code, or of what it makes of a file, too


@dataclass(frozen=True)
class EntryDifference:
    """An entry that does not come out again; values as JSON has them."""

    file: str
    entry: str  # with points, as energy_J.kinetic
    stored: Any
    now: Any


def differing_entries(
    folder: Path, then: result.Summary, now: result.Summary, *, same_code: bool
) -> tuple[EntryDifference, ...]:
    """Return which entries of a run's folder are not those of its repetition; some of them only for the same code.

    The final state and the status are not among them: they are reported by themselves.
    """
    whole = then.status != INTERRUPTED
    names = [*ALWAYS, *(UNLESS_INTERRUPTED if whole else ()), *(HASHES if same_code else ())]
    stored, wanted = _read_entries(folder / files.SUMMARY), json.loads(now.to_json())
    if not whole and same_code:  # the repetition is of a scenario with another end
        wanted |= {name: getattr(then, name) for name in HASHES}
    names += [name for name in OF_THE_MOTION if same_code or stored.get(name)]
    found = [one for name in names for one in apart(files.SUMMARY, name, stored.get(name), wanted[name])]
    # the warnings are those of now, after what was reported when the run went on or began again
    before = then.warnings[: len(then.warnings) - len(now.warnings)]
    is_allowed = bool(then.resumed_from) or all(text.endswith(checkpoint.STARTS_ANEW) for text in before)
    if whole and not (is_allowed and (*before, *now.warnings) == then.warnings):
        found.append(EntryDifference(files.SUMMARY, "warnings", list(then.warnings), list(now.warnings)))
    if files.is_finished(folder):  # the mark of the end must not contradict run.json
        marked = _read_entries(folder / files.DONE)
        for name in ("run", "status"):
            found += apart(files.DONE, name, marked.get(name), getattr(then, name))
    return tuple(found)


def apart(file: str, entry: str, stored: Any, now: Any) -> Iterator[EntryDifference]:
    """Yield the differences of an entry, or of those in it."""
    if isinstance(stored, dict) and isinstance(now, dict):
        for name, value in stored.items():  # a version before may have had fewer
            yield from apart(file, f"{entry}.{name}".lstrip("."), value, now.get(name))
    elif isinstance(stored, list) and isinstance(now, list) and len(stored) == len(now):
        for number, values in enumerate(zip(stored, now, strict=True)):
            yield from apart(file, f"{entry}.{number}", *values)
    elif stored != now:
        yield EntryDifference(file, entry, stored, now)


def differing_samples(
    stored: Mapping[str, probes.ProbeSeries], again: Mapping[str, probes.ProbeSeries]
) -> Iterator[EntryDifference]:
    """Yield where the samples of each probe first are others, in the column that comes first."""
    for name, now in again.items():
        then, place = stored[name], f"probes/{name}"
        if then.step.tobytes() != now.step.tobytes():
            yield EntryDifference(files.FRAMES, f"{place}/step", len(then), len(now))
            continue
        for column, values in now.columns.items():
            before = then.columns.get(column)
            if before is None:
                yield EntryDifference(files.FRAMES, f"{place}/{column}", None, float(values[0]))
                break
            if before.tobytes() != values.tobytes():
                first = int(np.flatnonzero(before.view(np.int64) != values.view(np.int64))[0])
                where = f"{place}/{column} at step {now.step[first]}"
                yield EntryDifference(files.FRAMES, where, float(before[first]), float(values[first]))
                break


def _read_entries(path: Path) -> dict[str, Any]:
    """Return the entries of a file. Raises InputMissingError or InvalidInputError."""
    try:
        entries = json.loads(input_files.read_limited(path, result.MOST_BYTES))
    except (ValueError, RecursionError) as error:
        raise InvalidInputError(f"{path}: not the entries of a run: {error}") from error
    if not isinstance(entries, dict):
        raise InvalidInputError(f"{path}: not the entries of a run")
    return entries


@dataclass(frozen=True)
class Origin:
    """One thing that the bits may depend on, as it was when the run was made and as it is now."""

    name: str
    then: str
    now: str


@dataclass(frozen=True)
class RunVerdict:
    """What came of running a stored run again."""

    folder: Path
    changed: tuple[str, ...]  # files that are not as the run left them, or gone
    state: bool  # whether the final state has the same hash,
    table: bool  # and final.csv the same bytes,
    status: tuple[str, str]  # and how the run ended, then and now
    frames: Differences
    origins: tuple[Origin, ...]  # that are not the same as then
    entries: tuple[EntryDifference, ...] = ()  # of run.json and done.json

    @cached_property
    def agrees(self) -> bool:
        """Return True if the folder is what its scenario gives, to the last bit."""
        is_same = self.state and self.table and self.frames.is_none and self.status[0] == self.status[1]
        return is_same and not self.changed and not self.entries

    def to_dict(self) -> dict[str, object]:
        """Return it for programs."""
        return {"agrees": self.agrees, "kind": "run", **asdict(self), "folder": str(self.folder)}


def verify_run(place: Path | str, *, threads: int = 1, on_progress: Watcher = silent) -> RunVerdict:
    """Run the scenario of a run folder again, in memory, and compare everything that the folder keeps.

    A run that was interrupted is repeated as far as it got. Raises InputMissingError where no run is there,
    InvalidInputError (ScenarioError) for files that cannot be read, StoppedEarlyError where the repetition is stopped.
    """
    folder = find_run(place)
    summary = result.read_summary(folder / files.SUMMARY)
    changed = result.changed_files(folder, summary)
    try:
        stored = read_result(folder)
    except InvalidInputError as error:  # what cannot be read because it was changed is reported as such
        if not changed:
            raise
        why = f"{folder}: changed after the run, by their checksums: {', '.join(changed)}"
        raise InvalidInputError(f"{error}\n{why}") from error
    scenario, was_cut = stored.scenario, summary.status == INTERRUPTED
    if was_cut:  # a run that was interrupted is repeated as far as it got
        time = scenario.time.model_copy(update={"end": summary.simulated_time_s})
        scenario = scenario.model_copy(update={"time": time})
    again = simulate(scenario, threads=threads, on_progress=on_progress)
    if again.status == INTERRUPTED:
        raise StoppedEarlyError(f"{folder}: stopped before the new run was complete")
    origins, now = changed_origins(summary.environment), scenario_hash(stored.scenario)
    if now != summary.scenario_hash:
        origins = (Origin(SCENARIO, summary.scenario_hash, now), *origins)
    return RunVerdict(
        folder,
        changed,
        state=again.summary.final_state_sha256 == summary.final_state_sha256,
        table=csv_text(again.columns).encode() == (folder / files.FINAL).read_bytes(),
        status=(again.status if was_cut else summary.status, again.status),
        frames=differences(stored.frames, again.frames),
        origins=origins,
        entries=(
            *differing_entries(folder, summary, again.summary, same_code=not tells_of_code(origins)),
            *differing_samples(stored.probes, again.probes),
        ),
    )


def scenario_of(place: Path | str) -> Scenario:
    """Return the scenario of a stored run. Raises what `find_run` and loading it raise."""
    return load_stored(find_run(place) / files.SCENARIO)


def tells_of_code(found: tuple[Origin, ...]) -> bool:
    """Return True if the code is among what is not the same: what is named by its hash then has another name."""
    return any(one.name in {CODE, "blocksim"} or one.name.startswith(provenance.ROOM_PREFIX) for one in found)


def changed_origins(then: Mapping[str, str]) -> tuple[Origin, ...]:
    """Return which entries of an older `environment` are others now; what it lacks cannot be compared."""
    now = provenance.environment()
    whole = () if any(name.startswith(provenance.ROOM_PREFIX) for name in then) else (CODE,)  # rooms say more
    known = [name for name in now if name in then and (name in whole or name.startswith(DECIDES))]
    return tuple(Origin(name, then[name], now[name]) for name in known if then[name] != now[name])
