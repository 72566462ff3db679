"""The balance of energy: every entry counts, once and with its sign."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from blocksim.simulation import run_ensemble, simulate, simulate_into
from blocksim.simulation.balance import BODY_STEPS, FIRST_CHECK, EnergyLedger, next_energy_check
from blocksim.simulation.checkpoint import CheckpointPolicy

if TYPE_CHECKING:
    from pathlib import Path

    from tests.simulation.conftest import Shipped

ENTRIES = set(EnergyLedger.model_fields) - {"start", "in_play"}


@pytest.mark.parametrize("name", sorted(ENTRIES))
def test_every_entry_is_in_the_residual(name: str) -> None:
    none = dict.fromkeys(ENTRIES, 0.0)
    assert EnergyLedger(**none, start=0.0, in_play=2.0).residual == 0.0
    some = EnergyLedger(**{**none, name: -3.0}, start=0.0, in_play=2.0)
    assert (some.residual, some.relative_residual) == (-3.0, 1.5)


def test_energy_at_the_start_is_what_it_is_compared_with() -> None:
    none = dict.fromkeys(ENTRIES, 0.0)
    assert EnergyLedger(**{**none, "kinetic": 5.0}, start=7.0, in_play=1.0).residual == -2.0


WILD: dict[str, Any] = {"time__force_step": True, "time__step": 6e-4, "contact__max_overlap": 1.0, "time__end": 20.0}


@pytest.mark.parametrize("bodies", [1, 3, 50, 10_000])
def test_looks_are_rarer_where_steps_are_cheap_but_the_first_is_early(bodies: int) -> None:
    looks = [0]
    while looks[-1] < 10 * BODY_STEPS:
        looks.append(next_energy_check(looks[-1], bodies))
    assert looks[1] == FIRST_CHECK
    assert looks[-1] - looks[-2] <= max(FIRST_CHECK, 4 * BODY_STEPS // bodies)
    assert looks[-1] - looks[-2] >= BODY_STEPS // bodies


def test_looks_do_not_depend_on_where_a_run_is_interrupted() -> None:
    for done in range(0, 300_000, 777):
        assert next_energy_check(next_energy_check(done, 3) - 1, 3) == next_energy_check(done, 3)


def test_where_a_run_fails_depends_on_nothing_that_watches_it(soft: Shipped, tmp_path: Path) -> None:
    often = CheckpointPolicy(checkpoint_steps=13)
    one = simulate(soft(**WILD))
    other = simulate_into(soft(**{**WILD, "output__every": 0.0137}), tmp_path / "run", precautions=often)
    assert one.summary.exit_code == 76
    assert one.reason.startswith("energy residual above 5% of the energy in play (the fastest is block ")
    assert one.summary.steps == FIRST_CHECK
    assert (other.reason, other.summary.final_state_sha256) == (one.reason, one.summary.final_state_sha256)


def test_member_of_an_ensemble_fails_at_the_same_step(soft: Shipped) -> None:
    wild = soft(**WILD)
    members = run_ensemble([wild, soft(), wild])
    alone = simulate(wild)
    assert [end.outcome.status for end in members] == ["failed", "finished", "failed"]
    assert members[0].outcome.reason == alone.reason
    assert members[0].columns == alone.columns
    assert members[1].columns == simulate(soft()).columns
