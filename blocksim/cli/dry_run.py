"""blocksim sweep --dry-run: what a sweep will cost."""

import os
from dataclasses import asdict

from blocksim.cli.output import answer, duration, note, print_json
from blocksim.scenario import Document
from blocksim.study.plan import Estimate, estimate
from blocksim.world.free_memory import readable


def show_estimate(document: Document, jobs: int | None, *, keep_cases: bool, as_json: bool) -> None:
    """Print count, cost and size of the sweep of a document. Raises what `estimate` raises."""
    found = estimate(document, keep_cases=keep_cases)
    cores = jobs or os.cpu_count() or 1
    if as_json:
        print_json({**asdict(found), "jobs": cores})
        return
    answer("\n".join(_lines(found, cores)))
    for remark in found.remarks:
        note(remark)


def _lines(found: Estimate, cores: int) -> list[str]:
    lines = [
        f"cases      {found.cases}",
        f"solving    at most about {duration(found.seconds / cores)} on {cores} {'core' if cores == 1 else 'cores'}",
        f"results    at most about {readable(found.bytes)}",
        f"memory     about {readable(found.memory)} for a process that runs one case",
        f"from the steps of {found.looked_at} cases at the measured speed{_until_rest(found)}",
    ]
    if found.impossible:
        lines.append(f"{found.impossible} of these {found.looked_at} cannot be simulated; the first: {found.reason}")
    return lines


def _until_rest(found: Estimate) -> str:
    """Return what makes the estimate an upper limit."""
    return "; less if they stop at rest" if found.stop_at_rest else ""
