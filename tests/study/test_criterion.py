"""What counts as standing."""

import pytest

from blocksim.study.criterion import DEFAULT, Stability, read_criterion

ROW = {"status": "finished", "reason": "at rest", "outcome": "slid", "displacement_mm": 4.9, "turn_deg": 30.0}


@pytest.mark.parametrize(
    ("text", "stands"),
    [
        (DEFAULT, False),
        ("outcome != fell", True),
        ("outcome = slid | stands", True),
        ("outcome == slid", True),
        ("moved < 5 mm", True),
        ("moved < 0.0049 m", False),
        ("moved <= 0.491 cm", True),
        ("turned < 0.5 rad", False),
        ("turned<31deg", True),
        ("moved > 4 mm", True),
        ("moved < 5 mm, turned < 10 deg", False),
    ],
)
def test_conditions_are_judged_in_the_units_that_were_typed(text: str, stands: bool) -> None:
    assert (read_criterion(text).verdict(ROW) is Stability.STANDS) is stands


def test_a_run_that_failed_neither_stands_nor_falls() -> None:
    assert read_criterion(DEFAULT).verdict({"status": "invalid"}) is Stability.FAILED


@pytest.mark.parametrize(("text", "verdict"), [("moved < 5 mm", "undecided"), ("moved < 4 mm", "falls")])
def test_what_meets_the_conditions_but_moves_on_at_its_end_is_undecided(text: str, verdict: str) -> None:
    assert read_criterion(text).verdict({**ROW, "moves_on": True}) == verdict
