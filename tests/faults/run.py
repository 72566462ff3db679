"""make faults: put every fault in, one at a time, and tell which of them the tests notice.

    python -m tests.faults.run [--jobs N] [--only WORDS] [--tests-passed]

Exit code 1 where a fault is missed or can no longer be put in, or where its tests fail without it.
"""

import argparse
import multiprocessing
import os
import sys
from collections import Counter
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor

from tests.faults.examine import examine, run_tests
from tests.faults.faults import HERE, Fault, Finding, Verdict, faults_in, faults_of_tolerances

# What tests import, other than blocksim: processes are forked from one that has it already, so that a fault costs a
# second and not four.
PRELOADED = ["numba", "h5py", "pandas", "pydantic", "typer", "hypothesis", "pytest", "tests.faults.examine"]


def pool(jobs: int) -> ProcessPoolExecutor:
    """Return processes of which each does one thing: a fault cannot be taken out again."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(PRELOADED)
    return ProcessPoolExecutor(jobs, mp_context=context, max_tasks_per_child=1)


def fail_without_fault(workers: ProcessPoolExecutor, faults: Sequence[Fault]) -> list[str]:
    """Return what pytest printed where the tests fail by themselves: then they would notice anything."""
    waiting = []
    for interpreted in (False, True):
        tests = dict.fromkeys(one for fault in faults if fault.is_interpreted is interpreted for one in fault.tests)
        if tests:
            waiting.append(workers.submit(run_tests, tuple(tests), interpreted=interpreted))
    return [printed for code, printed in (one.result() for one in waiting) if code]


def told(finding: Finding) -> str:
    """Return a line of the table."""
    place = finding.fault.file.removeprefix("blocksim/")
    line = f"{finding.verdict:7} {finding.seconds:5.1f} s  {place:34.34} {finding.fault.name}"
    return f"{line}\n{'':17}by {finding.by.removeprefix('tests/')}" if finding.by else line


def summary(findings: Iterable[Finding]) -> str:
    """Return what pytest printed where it could not run, and how many faults came to what."""
    findings = list(findings)
    broken = [f"{one.fault.name}:\n{one.printed}" for one in findings if one.verdict is Verdict.BROKEN]
    counts = Counter(one.verdict for one in findings)
    return "\n\n".join([*broken, f"{len(findings)} faults: " + ", ".join(f"{counts[one]} {one}" for one in Verdict)])


def say(text: str) -> None:
    """Print a line at once."""
    print(text, flush=True)  # noqa: T201 - this is the answer


def main(arguments: Sequence[str]) -> int:
    """Examine all faults, or those whose name or file has some words; return the exit code."""
    parser = argparse.ArgumentParser(description="Put faults in and see whether the tests notice.")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--only", default="", help="words in the name, the file or a test of a fault")
    parser.add_argument("--tests-passed", action="store_true", help="make test and make test-nojit have just passed")
    asked = parser.parse_args(arguments)
    every = [*faults_in(HERE), *faults_of_tolerances()]
    faults = [fault for fault in every if asked.only in " ".join([fault.file, fault.name, *fault.tests])]
    with pool(asked.jobs) as workers:
        examined = [] if asked.tests_passed else [fault for fault in faults if not fault.is_stale]
        failing = fail_without_fault(workers, examined)
        if failing:
            say("\n".join([*failing, "these tests fail without any fault; mend them first"]))
            return 1
        findings = []
        for finding in workers.map(examine, faults):
            say(told(finding))
            findings.append(finding)
    say(summary(findings))
    return 0 if all(finding.verdict is Verdict.CAUGHT for finding in findings) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
