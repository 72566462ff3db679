"""Tables of sweeps that are damaged or hostile: compared, drawn and reported without harm."""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING

import pytest
from hypothesis import given, settings, strategies as st

from tests.fuzz.conftest import LONG, QUICK, ROOT, assert_harmless
from tests.fuzz.mutations import TABLE, damaged
from tests.sizes import in_all

if TYPE_CHECKING:
    from pathlib import Path

    from tests.fuzz.child import Child

KEPT = ("x_mm", "y_mm", "rotation_deg", "left_mm", "right_mm")
ENDS = {
    "1": (16.0, 25.0, 0.0, 0.0, 32.0),
    "2": (72.0, 16.0, -90.0, 47.0, 97.0),
    "3": (131.0, 16.0, -90.0, 106.0, 156.0),
}
COMMANDS = (("compare",), ("report", "--out", "report.html"), ("plot", "--out", "sweep.png"))
OFTEN = (*COMMANDS[:2], *COMMANDS[:2], COMMANDS[2])


def _table() -> bytes:
    """Return the table of nine cases, of which one has failed."""
    ends = [f"{block}.{name}" for block in ENDS for name in KEPT]
    keys = ("friction.block_block.static", "contact.stiffness_scale")
    lines = [",".join(("case", *keys, "status", "reason", "seconds", "inside", *ends))]
    for number in range(9):
        values = (f"{value + 0.3 * number}" for block in ENDS.values() for value in block)
        setting = (f"{0.2 + 0.05 * (number // 3)}", ("0.001", "0.01", "0.1")[number % 3])
        lines.append(
            ",".join((f"{number:012x}", *setting, "finished", "at rest", "0.5", str(number % 2 == 0), *values))
        )
    lines.append(",".join(("00000000000a", "0.4", "0.1", "failed", "not finite", "0.1", *[""] * (len(ends) + 1))))
    return "\n".join([*lines, ""]).encode()


@pytest.fixture(scope="module")
def usual(child: Child, folder: Path) -> dict[tuple[str, ...], float]:
    """Write a sweep; return how long (s of processor time) each command takes with it, when all is imported."""
    (folder / "sweep").mkdir()
    shutil.copytree(ROOT / "scenarios" / "experiments", folder / "sweep" / "experiments")
    shutil.copy(ROOT / "scenarios" / "sweep_friction_stiffness.toml", folder / "sweep" / "sweep.toml")
    (folder / "sweep" / "sweep.csv").write_bytes(_table())
    _, lefts = [{command: child.call(folder, *command, "sweep") for command in COMMANDS} for _ in range(2)]
    assert {left.code for left in lefts.values()} <= {0, 1}, lefts
    return {command: left.seconds for command, left in lefts.items()}


def _try(child: Child, folder: Path, usual: dict[tuple[str, ...], float], data: st.DataObject) -> None:
    (folder / "sweep" / "sweep.csv").write_bytes(data.draw(damaged(_table(), TABLE)))
    command = data.draw(st.sampled_from(OFTEN))
    left = child.call(folder, *command, "sweep")
    assert_harmless(left, {0, 1, 65}, usual[command])
    if left.code == 65:
        assert "sweep" in left.err


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        (b",friction.block_block.static,", b",nan,", "no column friction.block_block.static"),
        (b"\n000000000000,0.2,", b"\n000000000000,nan,", "holds values that are not numbers"),
        (b"at rest,0.5,True,16.0,", b"at rest,0.5,True,1e308,", "too far to be drawn"),
        (b"at rest,0.5,True,16.0,", b"at rest,0.5,True,sixteen,", "not a number"),
        (b",1.rotation_deg,", b",turned,", "no column 1.rotation_deg"),
        (b"at rest,0.5,True,16.0,", b"at rest,0.5,True,,", "has finished, but its row lacks positions"),
    ],
)
def test_tables_that_do_not_go_with_their_plan_are_not_drawn(  # found by the damage below
    child: Child, folder: Path, usual: object, old: bytes, new: bytes, told: str
) -> None:
    assert usual
    (folder / "sweep" / "sweep.csv").write_bytes(_table().replace(old, new, 1))
    left = child.call(folder, "plot", "sweep", "--out", "sweep.png")
    assert_harmless(left, {65}, 1.0)
    assert told in left.err


@settings(max_examples=QUICK)
@given(data=st.data())
def test_damaged_tables_of_sweeps_do_no_harm(
    child: Child, folder: Path, usual: dict[tuple[str, ...], float], data: st.DataObject
) -> None:
    _try(child, folder, usual, data)


@pytest.mark.long
@settings(LONG, max_examples=in_all(200))
@given(data=st.data())
def test_two_hundred_damaged_tables_of_sweeps(
    child: Child, folder: Path, usual: dict[tuple[str, ...], float], data: st.DataObject
) -> None:
    _try(child, folder, usual, data)
