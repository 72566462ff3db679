"""Which test executes which line of blocksim, measured: what mutants and the matrix choose their tests by.

    python -m tests.faults.reach [--jobs N] [--part 1/4] [--only WORDS] [--again]

Every test file runs once under coverage.py, in a process of its own: those of the kernels as plain Python, the others
with the kernels compiled. What it reached is kept in results/reach, one file each, outside git; files measured before
are left out, so that a call goes on where the last one ended. Lines that run in other processes are not seen.
"""

import argparse
import json
import os
import sys
import tempfile
from collections import Counter, defaultdict
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import TypeVar

import coverage
import pytest

from tests.faults.examine import run_tests
from tests.faults.faults import ROOT
from tests.faults.run import pool, say

FOLDER = ROOT / "results" / "reach"
INTERPRETED = "tests/kernels/"
LEFT_OUT = ("tests/faults/", "tests/plan/", "tests/browser/", "tests/fuzz/")
T = TypeVar("T")
Reach = dict[str, dict[str, list[int]]]  # lines by file by test; those of an import under the name of the test file


class Contexts:
    """Tells coverage.py which test runs: a plugin of pytest."""

    def __init__(self, measurement: coverage.Coverage) -> None:
        self.measurement = measurement
        self.failed: set[str] = set()

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_setup(self, item: pytest.Item) -> None:
        """Begin the lines of a test."""
        self.measurement.switch_context(item.nodeid)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Keep which tests do not pass: they would notice anything."""
        if not report.passed:
            self.failed.add(report.nodeid)


def measure(test_file: str) -> str:
    """Run one test file and keep what its tests that pass reach; return a line to say."""
    measurement = coverage.Coverage(data_file=None, config_file=False, source=[str(ROOT / "blocksim")])
    contexts = Contexts(measurement)
    measurement.start()
    code, printed = run_tests(
        (test_file,), contexts, interpreted=test_file.startswith(INTERPRETED), first_only=False, patience=900
    )
    measurement.stop()
    if code not in {pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED, pytest.ExitCode.NO_TESTS_COLLECTED}:
        return f"{test_file}: exit code {code}\n{printed}"
    reach: defaultdict[str, dict[str, list[int]]] = defaultdict(dict)
    data = measurement.get_data()
    for path in data.measured_files():
        lines = defaultdict(list)
        for line, tests in data.contexts_by_lineno(path).items():
            for test in set(tests) - contexts.failed:
                lines[test or test_file].append(line)
        for test, reached in lines.items():
            reach[test][Path(path).relative_to(ROOT).as_posix()] = sorted(reached)
    place = kept_at(test_file)
    place.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile("w", dir=place.parent, delete=False, encoding="utf-8") as file:
        json.dump(reach, file, separators=(",", ":"))
    Path(file.name).replace(place)
    return f"{test_file}: {len(reach)} tests" + f", {len(contexts.failed)} do not pass or are skipped"


def kept_at(test_file: str) -> Path:
    """Return where the reach of a test file is kept."""
    return FOLDER / (test_file.replace("/", "+") + ".json")


@cache
def reach() -> Reach:
    """Return what all tests reach, as far as it is measured."""
    kept: Reach = {}
    for path in sorted(FOLDER.glob("*.json")):
        if (ROOT / path.stem.replace("+", "/")).is_file():
            kept |= json.loads(path.read_text(encoding="utf-8"))
    return kept


@cache
def size(test: str) -> int:
    """Return how many lines a test reaches."""
    return sum(map(len, reach()[test].values()))


def nearest(file: str, line: int) -> list[str]:
    """Return the tests that reach a line, those of its room first, and of them those that reach least.

    A function that has reached it with one parameter comes again after all others have. A line that runs at import is
    reached by the tests that reach another line of its file.
    """
    tests = [one for one in reach() if "::" in one and file in reach()[one]]
    room = f"tests/{file.split('/')[1]}/"
    found = [one for one in tests if line in reach()[one][file]] or tests
    rounds: Counter[str] = Counter()
    ranked = []
    for test in sorted(found, key=lambda one: (size(one), one)):
        function = test.partition("[")[0]
        ranked.append((room not in test, rounds[function], size(test), test))
        rounds[function] += 1
    return [test for *_, test in sorted(ranked)]


def part_of(every: Sequence[T], part: str) -> Sequence[T]:
    """Return one part of a list: "2/4" is the second of four."""
    index, count = map(int, part.split("/"))
    return every[index - 1 :: count]


def main(arguments: Sequence[str]) -> int:
    """Measure the test files that are not measured yet."""
    parser = argparse.ArgumentParser(description="Measure which test executes which line of blocksim.")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--part", default="1/1")
    parser.add_argument("--only", default="", help="words in the path of a test file")
    parser.add_argument("--again", action="store_true", help="those that are measured too")
    asked = parser.parse_args(arguments)
    every = [path.relative_to(ROOT).as_posix() for path in sorted((ROOT / "tests").rglob("test_*.py"))]
    chosen = [one for one in every if asked.only in one and not one.startswith(LEFT_OUT)]
    files = [one for one in part_of(chosen, asked.part) if asked.again or not kept_at(one).exists()]
    with pool(asked.jobs) as workers:
        for line in workers.map(measure, files):
            say(line)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
