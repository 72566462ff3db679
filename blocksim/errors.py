"""What can go wrong in front of a user: exit codes, located problems and the exceptions that carry them."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum


class ExitCode(IntEnum):
    """Process exit codes; after sysexits.h where a code exists there."""

    SUCCESS = 0
    OUTSIDE = 1
    USAGE = 2
    INVALID_INPUT = 65
    INPUT_MISSING = 66
    UNAVAILABLE = 69
    INTERNAL = 70
    OUTPUT_EXISTS = 73
    INPUT_OUTPUT = 74
    STOPPED_EARLY = 75
    NUMERICAL_FAILURE = 76
    SWEEP_HAS_FAILURES = 77


@dataclass(frozen=True)
class Problem:
    """One mistake in one input, with the place where a person can mend it.

    `where` names the file (or the `--set` option), `line_number` counts from 1 and is None where there is no line,
    `caret_start` counts columns from 0 in `line_text`.
    """

    where: str
    message: str
    key: str = ""
    line_number: int | None = None
    line_text: str = ""
    caret_start: int = 0
    caret_length: int = 1

    def render(self) -> str:
        """Return the message, and below it the offending line with a caret under the offending part."""
        place = self.where if self.line_number is None else f"{self.where}:{self.line_number}"
        head = f"{place}: {self.key}: {self.message}" if self.key else f"{place}: {self.message}"
        if not self.line_text:
            return head
        number = "" if self.line_number is None else str(self.line_number)
        caret = " " * self.caret_start + "^" * max(1, self.caret_length)
        return f"{head}\n{number:>5} | {self.line_text}\n{'':>5} | {caret}"


class BlocksimError(Exception):
    """Base of every error that a user can cause or has to be told about; `exit_code` is what the command returns."""

    exit_code: ExitCode = ExitCode.INTERNAL


class InvalidInputError(BlocksimError):
    """A table, result file, checkpoint or option value that cannot be used."""

    exit_code = ExitCode.INVALID_INPUT


class ScenarioError(InvalidInputError):
    """All mistakes found in one scenario, together."""

    def __init__(self, problems: Sequence[Problem]) -> None:
        """Keep the problems; the message is all of them rendered, in the order given."""
        self.problems = tuple(problems)
        super().__init__("\n".join(problem.render() for problem in self.problems))


class InputMissingError(BlocksimError):
    """A named input file does not exist or cannot be read."""

    exit_code = ExitCode.INPUT_MISSING


class UnavailableError(BlocksimError):
    """An optional package or a service is missing; the message names the extra to install."""

    exit_code = ExitCode.UNAVAILABLE


class OutputExistsError(BlocksimError):
    """The output folder holds something that must not be overwritten, or cannot be created."""

    exit_code = ExitCode.OUTPUT_EXISTS


class OutputError(BlocksimError):
    """Writing failed (disk full, read-only file system)."""

    exit_code = ExitCode.INPUT_OUTPUT


class StoppedEarlyError(BlocksimError):
    """The run was stopped before its end and can be resumed."""

    exit_code = ExitCode.STOPPED_EARLY
