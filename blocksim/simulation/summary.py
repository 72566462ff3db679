"""run.json: how a run ended, what it cost, and what it takes to know, years later, where its numbers came from."""

from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ValidationError

from blocksim.errors import InvalidInputError
from blocksim.scenario.bounded_read import MEGABYTE, read_limited
from blocksim.simulation import folder as files
from blocksim.simulation.atomic import sha256_of
from blocksim.simulation.happened import Happened
from blocksim.simulation.ledger import EnergyLedger
from blocksim.simulation.movement import Movement
from blocksim.simulation.settled import Settled

MOST_BYTES = MEGABYTE
"""Of run.json; a run writes two thousand."""


class Summary(BaseModel, frozen=True):
    """The entries of run.json; seconds are of wall time, unless they say that they are simulated."""

    name: str
    status: Literal["finished", "failed", "interrupted"]
    reason: str
    exit_code: int
    run: str
    scenario_hash: str
    final_state_sha256: str
    steps: int
    time_step_s: float
    simulated_time_s: float
    ended_at: str
    compile_seconds: float
    solver_seconds: float
    total_seconds: float
    threads: int = 1
    resumed_from: tuple[int, ...] = ()  # steps at which parts of the run after the first one began
    last_checkpoint: int | None = None  # step of the last good one, where the run did not finish
    energy_J: EnergyLedger  # noqa: N815 - the unit of energy is a capital letter
    settled: Settled | None = None  # how it came to rest before time zero, where it did
    events: tuple[Happened, ...] = ()  # in the order in which they have happened
    movement: Movement | None = None  # None in runs of earlier versions and without blocks
    warnings: tuple[str, ...]
    environment: dict[str, str]
    sha256: dict[str, str] = {}

    def to_json(self) -> str:
        """Return the text of run.json; numbers that are not finite become null."""
        return self.model_dump_json(indent=2) + "\n"


def read_summary(path: Path) -> Summary:
    """Return what a run.json holds. Raises InputMissingError or InvalidInputError."""
    try:
        return Summary.model_validate_json(read_limited(path, MOST_BYTES))
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"]))
        message = f"{path}: not the summary of a run: {place + ': ' if place else ''}{first['msg']}"
        raise InvalidInputError(message) from None


def changed_files(folder: Path, summary: Summary) -> tuple[str, ...]:
    """Return the files of a run that do not have the checksums that run.json has for them."""
    return tuple(
        name
        for name, digest in summary.sha256.items()
        if not (folder / Path(name).name).is_file() or sha256_of(folder / Path(name).name) != digest
    )


def changed_results(folder: Path, summary: Summary) -> tuple[str, ...]:
    """Return which of frames and final table are not as the run has written them; the other files may be renewed."""
    return tuple(name for name in changed_files(folder, summary) if name in {files.FRAMES, files.FINAL})
