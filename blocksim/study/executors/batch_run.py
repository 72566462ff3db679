"""What a worker does with a batch: in a process of this machine, or of another one."""

import platform
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from blocksim.errors import InvalidInputError
from blocksim.scenario import Scenario
from blocksim.simulation.provenance import HASH_DIGITS, code_hash
from blocksim.study.executors.ensemble import rows_of
from blocksim.study.folders import INTERRUPTED, run_case
from blocksim.study.rows import Row

Payload = Sequence[tuple[Scenario, Path | None]]  # None: nothing is kept but the row


class Outcome(NamedTuple):
    """Rows in the order of the scenarios, wall time (s), name of the machine."""

    rows: tuple[Row, ...]
    seconds: float
    host: str


def run_batch(payload: Payload, code: str) -> Outcome:
    """Run scenarios on one thread, by the same code as whoever asks. Raises InvalidInputError where it is another."""
    if code != code_hash():
        message = (
            f"the worker on {platform.node()} has another version of blocksim (code {code_hash()[:HASH_DIGITS]}, "
            f"here {code[:HASH_DIGITS]}); install the same one"
        )
        raise InvalidInputError(message)
    began = time.perf_counter()
    if any(folder is not None for _, folder in payload):
        rows = [_kept(scenario, folder) for scenario, folder in payload if folder is not None]
    else:
        rows = rows_of([scenario for scenario, _ in payload], 1)
    return Outcome(tuple(rows), time.perf_counter() - began, platform.node())


def _kept(scenario: Scenario, folder: Path) -> Row:
    row = run_case(scenario, folder)
    if row["status"] == INTERRUPTED:  # somebody has ended this process: no end of the case
        raise KeyboardInterrupt
    return row
