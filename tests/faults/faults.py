"""Deliberate faults: one text of one source file and what it is replaced by, and the tests that have to notice.

They are data, in the TOML files beside this one. The file on the disk stays as it is: the fault is put in while the
module is imported, in a process of its own. A kernel is interpreted while it has a fault, which takes seconds, where
compiling it again would take a minute.
"""

import tomllib
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

ROOT = Path(__file__).parents[2]
HERE = Path(__file__).parent
KERNELS = "blocksim/kernels/"


class Verdict(StrEnum):
    """What became of a fault."""

    CAUGHT = "caught"
    MISSED = "MISSED"
    STALE = "STALE"  # its text is no longer in the file, or more than once
    BROKEN = "BROKEN"  # its tests could not be run


@dataclass(frozen=True)
class Fault:
    """What is changed, and by which tests of `make test` that has to be noticed."""

    name: str
    file: str
    text: str
    replacement: str
    tests: tuple[str, ...]

    @property
    def is_interpreted(self) -> bool:
        """Return True if its tests run without the compiler."""
        return self.file.startswith(KERNELS)

    @property
    def is_stale(self) -> bool:
        """Return True if it can no longer be put in."""
        path = ROOT / self.file
        return not path.is_file() or path.read_text(encoding="utf-8").count(self.text) != 1


@dataclass(frozen=True)
class Finding:
    """What the tests said about a fault, and the end of what pytest printed."""

    fault: Fault
    verdict: Verdict
    by: str = ""
    seconds: float = 0.0  # of processor time
    printed: str = ""


def faults_in(folder: Path) -> list[Fault]:
    """Return all faults of a folder, file after file."""
    tables = [tomllib.loads(path.read_text(encoding="utf-8")) for path in sorted(folder.glob("*.toml"))]
    return [Fault(**{**one, "tests": tuple(one["tests"])}) for table in tables for one in table["fault"]]
