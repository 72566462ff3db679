"""How a run can end, in words and exit codes."""

from dataclasses import dataclass
from typing import Literal

from blocksim.errors import ExitCode
from blocksim.kernels import arrays

RESIDUAL_LIMIT = 0.05  # of the energy in play; a run beyond this has no meaning
RESIDUAL_PROMISE = 1e-3  # of the energy in play; beyond this a warning is due


@dataclass(frozen=True)
class Outcome:
    """What a run came to; `reason` says why it ended."""

    status: Literal["finished", "failed", "interrupted"]
    reason: str
    exit_code: ExitCode

    @property
    def is_finished(self) -> bool:
        """Return True if the run came to its proper end."""
        return self.status == "finished"


END_OF_TIME = Outcome("finished", "end of simulated time", ExitCode.SUCCESS)
REST = Outcome("finished", "at rest", ExitCode.SUCCESS)
RESIDUAL = Outcome(
    "failed", f"energy residual above {RESIDUAL_LIMIT:.0%} of the energy in play", ExitCode.NUMERICAL_FAILURE
)

BY_CODE = {
    arrays.REACHED: END_OF_TIME,
    arrays.AT_REST: REST,
    arrays.NOT_FINITE: Outcome("failed", "a position or velocity is no longer finite", ExitCode.NUMERICAL_FAILURE),
    arrays.TOO_FAST: Outcome(
        "failed", "a block moves too far in one step for its contacts to be found", ExitCode.NUMERICAL_FAILURE
    ),
    arrays.OVERLAP_LIMIT: Outcome("failed", "an overlap exceeds contact.max_overlap", ExitCode.NUMERICAL_FAILURE),
}


def interrupted(why: str) -> Outcome:
    """Return what a run comes to that is stopped, and can continue."""
    return Outcome("interrupted", why, ExitCode.STOPPED_EARLY)
