"""What a user asks of scenarios: one run, its comparison with an experiment, many runs."""

from blocksim.study.single import compare, run
from blocksim.study.sweep import sweep

__all__ = ["compare", "run", "sweep"]
