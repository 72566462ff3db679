"""A run whose energy does not add up ends at a step that nothing but its scene decides."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from blocksim.simulation import run_ensemble, simulate, simulate_into
from blocksim.simulation.looks import BODY_STEPS, FIRST, next_look
from blocksim.simulation.precautions import Precautions

if TYPE_CHECKING:
    from pathlib import Path

    from tests.simulation.conftest import Shipped

WILD: dict[str, Any] = {"time__force_step": True, "time__step": 4e-4, "contact__max_overlap": 1.0, "time__end": 20.0}


@pytest.mark.parametrize("bodies", [1, 3, 50, 10_000])
def test_looks_are_rarer_where_steps_are_cheap_but_the_first_is_early(bodies: int) -> None:
    looks = [0]
    while looks[-1] < 10 * BODY_STEPS:
        looks.append(next_look(looks[-1], bodies))
    assert looks[1] == FIRST
    assert looks[-1] - looks[-2] <= max(FIRST, 4 * BODY_STEPS // bodies)
    assert looks[-1] - looks[-2] >= BODY_STEPS // bodies


def test_looks_do_not_depend_on_where_a_run_is_interrupted() -> None:
    for done in range(0, 300_000, 777):
        assert next_look(next_look(done, 3) - 1, 3) == next_look(done, 3)


def test_where_a_run_fails_depends_on_nothing_that_watches_it(soft: Shipped, tmp_path: Path) -> None:
    often = Precautions(checkpoint_steps=13)
    one = simulate(soft(**WILD))
    other = simulate_into(soft(**{**WILD, "output__every": 0.0137}), tmp_path / "run", precautions=often)
    assert one.summary.exit_code == 76
    assert one.reason.startswith("energy residual above 5% of the energy in play (the fastest is block ")
    assert one.summary.steps == FIRST
    assert (other.reason, other.summary.final_state_sha256) == (one.reason, one.summary.final_state_sha256)


def test_member_of_an_ensemble_fails_at_the_same_step(soft: Shipped) -> None:
    wild = soft(**WILD)
    members = run_ensemble([wild, soft(), wild])
    alone = simulate(wild)
    assert [end.outcome.status for end in members] == ["failed", "finished", "failed"]
    assert members[0].outcome.reason == alone.reason
    assert members[0].columns == alone.columns
    assert members[1].columns == simulate(soft()).columns
