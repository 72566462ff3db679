"""What a user asks of scenarios: one run, its comparison with an experiment, many runs."""

from blocksim.study.many import SweepResult, sweep
from blocksim.study.single import compare, run

__all__ = ["SweepResult", "compare", "run", "sweep"]
