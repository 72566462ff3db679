"""Puts one fault into this process and runs the tests that have to notice it; for a process that does nothing else."""

import json
import os
import signal
import sys
import tempfile
import time
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import numba
import pytest

from tests.faults.faults import ROOT, Fault, Finding, Verdict

HOOK = Path(__file__).parent / "hook"
PRELOADED_IS_FINE = "ignore::pytest.PytestAssertRewriteWarning"  # hypothesis was imported before the fork
OPTIONS = ("-q", "-n", "0", "-p", "no:cacheprovider", "--rootdir", str(ROOT), "-W", PRELOADED_IS_FINE)
PATIENCE = 200.0  # s of processor time: a fault may let a loop never end
PRINTED = 3000  # characters


class Failed:
    """Collects the names of the tests that fail: a plugin of pytest, as what it prints differs from CI to terminal."""

    def __init__(self) -> None:
        self.names: list[str] = []

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Keep the name of a test of which any phase failed."""
        if report.failed:
            self.names.append(report.nodeid)


def examine(fault: Fault) -> Finding:
    """Return what the named tests say about a fault."""
    if fault.is_stale:
        return Finding(fault, Verdict.STALE)
    put_in(fault)
    failed = Failed()
    code, printed = run_tests(fault.tests, failed, interpreted=fault.is_interpreted)
    seconds = time.process_time()
    if code == pytest.ExitCode.OK:
        return Finding(fault, Verdict.MISSED, "", seconds, printed)
    if code != pytest.ExitCode.TESTS_FAILED or not failed.names:
        return Finding(fault, Verdict.BROKEN, "", seconds, printed)
    return Finding(fault, Verdict.CAUGHT, failed.names[-1], seconds)


def put_in(fault: Fault) -> None:
    """Have the fault imported by this process, and by those that its tests start."""
    told = {"file": fault.file, "text": fault.text, "replacement": fault.replacement}
    os.environ["BLOCKSIM_FAULT"] = json.dumps(told)
    os.environ["PYTHONPATH"] = os.pathsep.join([str(HOOK), str(ROOT)])
    assert not any(name.startswith("blocksim") for name in sys.modules)
    sys.path.insert(0, str(HOOK))
    sys.modules.pop("sitecustomize", None)
    __import__("sitecustomize")


def run_tests(
    tests: tuple[str, ...], *plugins: object, interpreted: bool, first_only: bool = True, patience: float = PATIENCE
) -> tuple[int, str]:
    """Run tests in this process, which nothing of blocksim has been imported into; return its exit code and words.

    The first that fails is the last, unless all are asked for; `patience` is in s of processor time.
    """
    os.environ["NUMBA_DISABLE_JIT"] = str(int(interpreted))
    numba.config.DISABLE_JIT = int(interpreted)  # type: ignore[attr-defined]  # numba was imported long ago
    os.chdir(ROOT)
    signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored by what a shell starts in the background
    signal.signal(signal.SIGPROF, _give_up)
    with tempfile.TemporaryFile("w+", encoding="utf-8") as file:
        with redirect_stdout(file), redirect_stderr(file):
            signal.setitimer(signal.ITIMER_PROF, patience)
            try:
                code = int(pytest.main([*OPTIONS, *(["-x"] if first_only else []), *tests], plugins=[*plugins]))
            except TimeoutError as error:  # while no test ran
                return pytest.ExitCode.INTERNAL_ERROR, str(error)
            finally:
                signal.setitimer(signal.ITIMER_PROF, 0.0)
        file.seek(0)
        return code, file.read()[-PRINTED:]


def _give_up(*_: object) -> None:
    raise TimeoutError("no end within the processor time")
