"""blocksim verify: the table on a screen, for programs, and its exit code."""

import json

import pytest

from blocksim.verification import cases
from blocksim.verification.case import Case, Row, Setting
from tests.cli.conftest import Command
from tests.golden import Golden

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
