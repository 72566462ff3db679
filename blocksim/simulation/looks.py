"""At which steps a run looks whether its energy still adds up, so that one that blows up ends soon.

They follow from the scene alone: where outputs, checkpoints and signals interrupt a run must not decide where it fails.
"""

from blocksim.simulation import outcome as ends
from blocksim.simulation.ledger import EnergyLedger

FIRST = 1000  # steps
RARER = 4  # times as many steps between two looks as before ...
BODY_STEPS = 200_000  # ... until they cost less than a hundredth of the steps between them


def next_look(done: int, bodies: int) -> int:
    """Return the first such step after `done`, in a scene of so many bodies."""
    period = FIRST
    while period <= done and period * bodies < BODY_STEPS:
        period *= RARER
    return (done // period + 1) * period


def adds_up(ledger: EnergyLedger) -> bool:
    """Return True if a run may continue; not so where the residual is no number."""
    return ledger.relative_residual <= ends.RESIDUAL_LIMIT
