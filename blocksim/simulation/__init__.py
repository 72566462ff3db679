"""The time loop and what it leaves behind: frames, final table, summary, and the folder that keeps them."""

from blocksim.simulation.ending import MemberEnd, MemberFailure
from blocksim.simulation.ensemble import run_ensemble, run_in_batches
from blocksim.simulation.frames import Frames
from blocksim.simulation.loop import Progress, Watcher
from blocksim.simulation.result import Result, read_result
from blocksim.simulation.simulate import renew_copies, simulate, simulate_into
from blocksim.simulation.summary import Summary

__all__ = [
    "Frames",
    "MemberEnd",
    "MemberFailure",
    "Progress",
    "Result",
    "Summary",
    "Watcher",
    "read_result",
    "renew_copies",
    "run_ensemble",
    "run_in_batches",
    "simulate",
    "simulate_into",
]
