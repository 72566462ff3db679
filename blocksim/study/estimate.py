"""What a sweep will cost, before anything runs."""

from dataclasses import dataclass
from statistics import fmean

import numpy as np

from blocksim.errors import InvalidInputError
from blocksim.scenario import Document
from blocksim.study.plan import cases_of
from blocksim.study.sampling.modes import remarks
from blocksim.study.single import check_experiment
from blocksim.world.describe import Description, describe

LOOKED_AT = 32
"""Cases that are built to estimate all of them."""
SMALL_FILES = 12_000
"""Bytes of the files beside run.h5 in the folder of a case."""
ROW, ROW_OF_BLOCK = 570, 230
"""Bytes of a case in manifest and table, and more for each block; three blocks and three keys take 1.25 kB."""


@dataclass(frozen=True)
class Estimate:
    """Cases of a sweep and what they cost, from the steps of some of them and the measured speed of a step."""

    cases: int
    looked_at: int
    impossible: int  # of those looked at
    reason: str  # why the first impossible one is
    seconds: float  # of solving all cases on one core, at most: as if none came to rest before its end
    bytes: int  # of all that the sweep writes, at most
    memory: int  # bytes of one process that runs a case, of the largest case looked at
    stop_at_rest: int  # cases of those looked at that end before, where they come to rest
    remarks: tuple[str, ...]


def estimate(document: Document, *, keep_cases: bool = False) -> Estimate:
    """Return what the sweep of a document comes to, with all frames of every case or without; nothing is written.

    Raises what building the document, its plan or a scene raises, InvalidInputError where nothing is varied.
    """
    base = document.build()
    if base.sweep is None:
        message = "nothing to vary: give --vary KEY=VALUES, or a [sweep] table in the scenario"
        raise InvalidInputError(message)
    check_experiment(base)
    cases = cases_of(document, base.sweep)
    chosen = [cases[number] for number in _spread_out(len(cases))]
    described = [describe(case.scenario) for case in chosen if case.scenario is not None]
    problems = [case.problem for case in chosen if case.scenario is None]
    share = len(described) / len(chosen)
    return Estimate(
        cases=len(cases),
        looked_at=len(chosen),
        impossible=len(problems),
        reason=problems[0] if problems else "",
        seconds=share * len(cases) * fmean([one.seconds for one in described] or [0.0]),
        bytes=round(share * len(cases) * fmean([_bytes(one, keep_cases=keep_cases) for one in described] or [0.0])),
        memory=max((one.memory for one in described), default=0),
        stop_at_rest=sum(case.scenario.time.stop_at_rest for case in chosen if case.scenario is not None),
        remarks=tuple(remarks(base.sweep)),
    )


def _bytes(one: Description, *, keep_cases: bool) -> int:
    row = ROW + ROW_OF_BLOCK * len(one.bodies)
    return row + one.bytes + SMALL_FILES if keep_cases else row


def _spread_out(count: int) -> list[int]:
    """Return numbers of cases, all of them or a random choice: evenly spaced ones may meet one value of a key only."""
    if count <= LOOKED_AT:
        return list(range(count))
    chosen = np.random.default_rng(0).choice(count, LOOKED_AT, replace=False)
    return sorted(chosen.tolist())
