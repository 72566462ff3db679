"""blocksim verify: the table on a screen, for programs, and its exit code."""

import json

import pytest

from blocksim.verification import cases
from blocksim.verification.case import Case, Row, Setting, absolute
from tests.cli.conftest import Command

KEYS = {
    "case",
    "title",
    "source",
    "model",
    "law",
    "scheme",
    "shortened",
    "quantity",
    "unit",
    "expected",
    "measured",
    "error",
}


def test_table_fits_80_columns_and_says_that_all_is_inside(blocksim: Command) -> None:
    answer = blocksim("verify", "v5", "V2")
    assert answer.code == 0
    lines = answer.out.splitlines()
    assert lines[0].split() == ["quantity", "expected", "measured", "error", "tolerance", "verdict"]
    assert [line[:2] for line in lines[2:]] == ["V2", "  ", "V5", "  ", "  ", "  ", "  "]
    assert all(line.endswith("inside" if line.startswith(" ") else " s") for line in lines[2:])
    assert "…" not in answer.out
    assert max(map(len, lines)) <= 80
    assert "2 of 2 cases inside" in answer.err


def test_json_has_every_number_unrounded(blocksim: Command) -> None:
    answer = blocksim("verify", "V2", "--law", "hertz-mindlin", "--json")
    (row,) = json.loads(answer.out)
    assert answer.err == ""
    assert set(row) >= KEYS | {"tolerance", "tolerance_kind", "verdict", "seconds", "remark"}
    assert (row["law"], row["tolerance_kind"], row["verdict"]) == ("hertz-mindlin", "relative", "inside")
    assert row["expected"] == pytest.approx(481.449, rel=1e-6)
    assert row["measured"] == pytest.approx(row["expected"], rel=1e-3)


def test_a_miss_gives_exit_code_1_and_its_reason(blocksim: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    def measure(_: Setting) -> list[Row]:
        return [absolute("half", "m", 1.0, 0.5, 0.1), absolute("whole", "m", 1.0, 1.0, 0.1)]

    case = Case("V2", "made up", "nowhere", measure, remarks={"surface": "it is made up"})
    monkeypatch.setattr(cases, "CASES", (case,))
    answer = blocksim("verify")
    assert answer.code == 1
    assert "−0.5" in answer.out
    assert "V2 made up: 1 of 2 outside: it is made up" in answer.err
    assert "0 of 1 cases inside" in answer.err


def test_quiet_prints_the_table_only(blocksim: Command) -> None:
    answer = blocksim("verify", "V2", "--quiet")
    assert (answer.code, answer.err) == (0, "")
    assert answer.out.startswith("quantity")


def test_quick_says_what_it_leaves_out(blocksim: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    def measure(setting: Setting) -> list[Row]:
        return [absolute("quick", "", 1.0, float(setting.quick), 0.0)]

    monkeypatch.setattr(cases, "CASES", (Case("V2", "made up", "nowhere", measure, quick="half of it"),))
    answer = blocksim("verify", "--quick")
    assert answer.code == 0
    assert "V2 shortened: half of it" in answer.err


def test_a_stop_keeps_what_was_measured(blocksim: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    def stop(_: Setting) -> list[Row]:
        raise KeyboardInterrupt

    done = Case("V1", "done", "nowhere", lambda _: [absolute("half", "m", 1.0, 1.0, 0.1)])
    monkeypatch.setattr(cases, "CASES", (done, Case("V2", "stopped", "nowhere", stop)))
    answer = blocksim("verify")
    assert answer.code == 75
    assert "half, m" in answer.out
    assert "stopped" in answer.err


def test_rigid_contacts_say_that_they_are_and_what_is_left_out(
    blocksim: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    (row, *_) = json.loads(blocksim("verify", "V5", "--scheme", "nonsmooth", "--json").out)
    assert (row["scheme"], row["verdict"]) == ("nonsmooth", "inside")
    assert row["measured"] == pytest.approx(row["expected"], rel=1e-12)
    few = tuple(case for case in cases.CASES if case.id in {"V2", "V5"})
    monkeypatch.setattr(cases, "CASES", few)
    answer = blocksim("verify", "--scheme", "nonsmooth")
    assert answer.code == 0
    assert "V2" not in answer.out
    assert "left out: V2 (rigid blocks have no stiffness" in answer.err
    assert "1 of 1 cases inside" in answer.err
