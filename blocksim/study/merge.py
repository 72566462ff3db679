"""One table from the shards of a sweep."""

import re
from collections.abc import Iterator
from pathlib import Path

from blocksim.errors import InputMissingError, InvalidInputError
from blocksim.study.done import Done
from blocksim.study.many import cases_in, ranges_of
from blocksim.study.shard import Shard
from blocksim.study.sweep_folder import read_plan
from blocksim.study.table import TABLE, SweepResult, SweepTable

SHARDED = re.compile(r"manifest-\d+-of-(\d+)\.jsonl")
MOST_TOLD = 20


def merge(folder: Path | str, *, allow_missing: bool = False) -> SweepResult:
    """Write sweep.csv from everything that has been run in a folder, by shards or not.

    Raises InputMissingError where no sweep is there, and InvalidInputError, with a list of shards, where cases are
    missing, unless that is allowed.
    """
    folder = Path(folder)
    document = read_plan(folder)
    base = document.build()
    cases = cases_in(document)
    done = Done(folder, len(cases))
    if not done.paths:
        message = f"{folder}: no case of this sweep has been run yet"
        raise InputMissingError(message)
    for number, settings in enumerate(cases.design):
        done.holds(number, settings)
    if done.count() < len(cases) and not allow_missing:
        raise InvalidInputError("\n".join(_what_is_missing(folder, done, len(cases))))
    SweepTable(folder / TABLE, cases, done, ranges_of(base)).write()
    return SweepResult(folder, planned=len(cases))


def _what_is_missing(folder: Path, done: Done, count: int) -> Iterator[str]:
    """Tell it by shards, those of the job array with the most jobs where there were several."""
    yield f"{folder}: {count - done.count()} of {count} cases are missing; --allow-missing makes a table without them"
    of = max((int(match[1]) for path in done.paths if (match := SHARDED.fullmatch(path.name))), default=1)
    shards = [(shard, len(shard.numbers(count))) for shard in (Shard(index, of) for index in range(of))]
    missing = [(shard, size - done.count(shard), size) for shard, size in shards if done.count(shard) < size]
    if of > 1:
        yield from (f"  --shard {shard}: {left} of {size} missing" for shard, left, size in missing[:MOST_TOLD])
        if len(missing) > MOST_TOLD:
            yield f"  and {len(missing) - MOST_TOLD} more shards"
