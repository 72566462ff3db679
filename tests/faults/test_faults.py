"""The list of faults is kept up with the code, and a fault that nobody notices does not go unsaid."""

import ast
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import contextmanager

import pytest

from tests.faults import run
from tests.faults.faults import HERE, ROOT, Fault, Finding, Verdict, faults_in, faults_of_tolerances
from tests.faults.mutants import sample

FAULTS = [*faults_in(HERE), *faults_of_tolerances()]
EXAMPLE = Fault("a name", "blocksim/errors.py", "USAGE = 2", "USAGE = 3", ("tests/test_code_from_data.py",))


def test_every_fault_can_still_be_put_in() -> None:
    """Whoever changes a line that a fault is in puts the fault into the new one: tests/faults/*.toml."""
    assert [fault.name for fault in FAULTS if fault.is_stale] == []


def test_every_fault_is_a_change_that_python_can_read() -> None:
    for fault in FAULTS:
        assert fault.text != fault.replacement
        ast.parse((ROOT / fault.file).read_text(encoding="utf-8").replace(fault.text, fault.replacement))


def test_faults_have_names_of_their_own_and_tests_that_there_are() -> None:
    assert len({fault.name for fault in FAULTS}) == len(FAULTS)
    for fault in FAULTS:
        assert fault.tests, fault.name
        for test in fault.tests:
            path, _, name = test.partition("::")
            assert f"def {name.partition('[')[0]}(" in (ROOT / path).read_text(encoding="utf-8"), test


def test_mutants_are_other_sources_that_python_can_read() -> None:
    for mutant in sample(30, 1):
        fault = mutant.as_fault()
        source = (ROOT / fault.file).read_text(encoding="utf-8")
        changed = ast.parse(source.replace(fault.text, fault.replacement))
        assert not fault.is_stale
        assert ast.dump(changed) != ast.dump(ast.parse(source)), fault.name


def test_fault_is_in_the_module_and_not_on_the_disk() -> None:
    told = {"file": EXAMPLE.file, "text": EXAMPLE.text, "replacement": EXAMPLE.replacement}
    paths = os.pathsep.join([str(HERE / "hook"), str(ROOT)])
    environment = {**os.environ, "PYTHONPATH": paths, "BLOCKSIM_FAULT": json.dumps(told)}
    code = "from blocksim.errors import ExitCode; print(int(ExitCode.USAGE))"
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout == "3\n"
    assert not EXAMPLE.is_stale


class Workers:
    """Do the work here, with findings that are given."""

    def __init__(self, verdict: Verdict, code: int) -> None:
        self.verdict, self.code = verdict, code

    def submit(self, *_: object, **__: object) -> "Future[tuple[int, str]]":
        done: Future[tuple[int, str]] = Future()
        done.set_result((self.code, "printed"))
        return done

    def map(self, _: object, faults: list[Fault]) -> Iterator[Finding]:
        return (Finding(fault, self.verdict) for fault in faults)


@pytest.mark.parametrize(
    ("verdict", "code", "expected"),
    [
        (Verdict.CAUGHT, 0, 0),
        (Verdict.MISSED, 0, 1),
        (Verdict.STALE, 0, 1),
        (Verdict.BROKEN, 0, 1),
        (Verdict.CAUGHT, 1, 1),
    ],
)
def test_only_a_list_of_caught_faults_is_well(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], verdict: Verdict, code: int, expected: int
) -> None:
    @contextmanager
    def pool(_: int) -> Iterator[Workers]:
        yield Workers(verdict, code)

    monkeypatch.setattr(run, "pool", pool)
    only = ["--only", "caret is one column off"]
    assert run.main(only) == expected
    said = capsys.readouterr().out
    assert ("1 faults: " in said) is (code == 0)
    assert ("fail without any fault" in said) is (code == 1)
    assert run.main([*only, "--tests-passed"]) == (verdict is not Verdict.CAUGHT)
