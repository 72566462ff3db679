"""blocksim verify: the table on a screen, for programs, and its exit code."""

import pytest

from blocksim.verification import cases
from blocksim.verification.case import Case, Row, Setting
from tests.cli.conftest import Command
from tests.golden import Golden


def missed(_: Setting) -> list[Row]:
    return [Row("half", "m", 1.0, 0.5, 0.1), Row("whole", "m", 1.0, 1.0, 0.1)]


def shortened(setting: Setting) -> list[Row]:
    return [Row("quick", "", 1.0, float(setting.quick), 0.0)]


def stopped(_: Setting) -> list[Row]:
    raise KeyboardInterrupt


MADE_UP = {
    "miss": (Case("V2", "made up", "nowhere", missed, remarks={"surface": "it is made up"}),),
    "quick": (Case("V2", "made up", "nowhere", shortened, quick="half of it"),),
    "stop": (Case("V1", "done", "nowhere", missed), Case("V2", "stopped", "nowhere", stopped)),
}


@pytest.mark.parametrize("name", MADE_UP)
def test_misses_shortened_cases_and_a_stop_are_told(
    blocksim: Command, golden: Golden, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.setattr(cases, "CASES", MADE_UP[name])
    answer = blocksim("verify", *(["--quick"] if name == "quick" else []))
    golden(f"exit code {answer.code}\n{answer.out}{answer.err}", rules=["times"])


def test_rigid_contacts_say_what_is_left_out(blocksim: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    few = tuple(case for case in cases.CASES if case.id in {"V2", "V5"})
    monkeypatch.setattr(cases, "CASES", few)
    answer = blocksim("verify", "--scheme", "nonsmooth")
    assert answer.code == 0
    assert "V2" not in answer.out
    assert "left out: V2 (rigid blocks have no stiffness" in answer.err
    assert "1 of 1 cases inside" in answer.err
