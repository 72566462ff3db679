"""Deliberate faults: one text of one source file and what it is replaced by, and the tests that have to notice.

They are data, in the TOML files beside this one. The file on the disk stays as it is: the fault is put in while the
module is imported, in a process of its own. A kernel is interpreted while it has a fault, which takes seconds, where
compiling it again would take a minute.
"""

import re
import tomllib
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
HERE = Path(__file__).parent
KERNELS = "blocksim/kernels/"
TOLERANCES = "blocksim/kernels/common/tolerances.py"
ENTRY = re.compile(r"((?:^# .+\n)+)^([A-Z_]+) = (\S.*?)  # ([a-z-]+) \| (.+)$", re.MULTILINE)


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


@dataclass(frozen=True)
class Entry:
    """A number of the table of tolerances."""

    name: str
    value: str
    comment: str
    kind: str
    relative_to: str

    @property
    def noticed(self) -> dict[str, str]:
        """The test that notices where the number is ten times as large, "x10", or a tenth, "/10"."""
        found = re.findall(r"((?:x10|/10)(?: and /10)?): (test_\w+)", self.comment)
        return {way: test for ways, test in found for way in ways.split(" and ")}


def tolerances() -> list[Entry]:
    """Return the entries of the table of tolerances, in order."""
    found = ENTRY.findall((ROOT / TOLERANCES).read_text(encoding="utf-8"))
    return [Entry(name, value, comment.replace("\n# ", " "), *rest) for comment, name, value, *rest in found]


@cache
def places_of_tests() -> dict[str, list[str]]:
    """Return the files of all tests by name."""
    places: dict[str, list[str]] = {}
    for path in sorted((ROOT / "tests").rglob("test_*.py")):
        for name in re.findall(r"^def (test_\w+)\(", path.read_text(encoding="utf-8"), re.MULTILINE):
            places.setdefault(name, []).append(path.relative_to(ROOT).as_posix())
    return places


def faults_of_tolerances() -> list[Fault]:
    """Return a fault for each tolerance and way for which the table names the test that notices."""
    faults = []
    for entry in tolerances():
        is_count = entry.value.isdecimal()
        changed = {
            "x10": f"10 * {entry.value}",
            "/10": f"max({entry.value} // 10, 1)" if is_count else f"{entry.value} / 10",
        }
        for way, test in entry.noticed.items():
            tests = tuple(f"{place}::{test}" for place in places_of_tests()[test])
            old, new = (f"\n{entry.name} = {value}  # " for value in (entry.value, changed[way]))
            faults.append(Fault(f"{entry.name} {way}", TOLERANCES, old, new, tests))
    return faults
