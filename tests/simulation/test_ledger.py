"""The balance of energy: every entry counts, once and with its sign."""

import pytest

from blocksim.simulation.ledger import EnergyLedger

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
