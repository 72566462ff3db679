"""The probability of each outcome: the rotations of all blocks, rounded to quarter turns.

A class is written as its angles in degrees, "0, -90, -90". It covers the blocks whose rotation was measured, or
all blocks if none was. Members that failed are in the total, as a class of their own.
"""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from blocksim.analysis.intervals import interval, lower_bound
from blocksim.analysis.metrics.metric import Column, Evidence, Findings, Form, Metric, Row, complete_repeats

QUARTER = 90.0  # deg
ROTATION = "rotation"
UNKNOWN = "?"
FAILED = "did not finish"


def outcome(rotations: Sequence[float]) -> str:
    """Return the class of rotations (deg); halves between two quarter turns go to the even one."""
    turns = (f"{QUARTER * round(angle / QUARTER):.0f}" if np.isfinite(angle) else UNKNOWN for angle in rotations)
    return ", ".join(turns)


def _find(evidence: Evidence) -> Findings:
    measured = [pair for pair in evidence.pairs if pair.measured.quantity == ROTATION]
    members = evidence.members
    blocks = [pair.measured.block for pair in measured] or [
        block for block in members.blocks if members.has(block, ROTATION)
    ]
    if not blocks:
        return Findings((), ("not computed: the sweep has no rotations",))
    rotations = np.column_stack([members.values(block, ROTATION) for block in blocks])
    repeats, incomplete = complete_repeats(measured)
    ends = zip(rotations.tolist(), members.finished, strict=True)
    found = Counter(outcome(row) if has_ended else FAILED for row, has_ended in ends)
    seen = Counter(map(outcome, repeats.tolist()))
    order = sorted({*found, *seen}, key=lambda name: (-found[name], -seen[name], name))
    messages = ["blocks: " + ", ".join(blocks)]
    if incomplete:
        messages.append(f"left out, as not all rotations were measured: replicate {incomplete}")
    if seen:
        messages.append("at least: one-sided 95 % limit of the measured share")
    return Findings(tuple(_row(name, found, seen) for name in order), tuple(messages))


def _row(name: str, found: Counter[str], seen: Counter[str]) -> Row:
    count, total, repeats = found[name], found.total(), seen.total()
    measured: Row = {"measured": seen[name], "repeats": repeats, "lower_bound": lower_bound(seen[name], repeats)}
    return {
        "outcome": name,
        "members": count,
        "of": total,
        "share": count / total,
        "interval": interval(count, total),
        **(measured if seen[name] else dict.fromkeys(measured, None)),
    }


OUTCOME = Metric(
    "outcome",
    "final rotations, rounded to quarter turns (deg)",
    (
        Column("outcome", "outcome", Form.TEXT, "rotation of each block, rounded to 90 degrees"),
        Column("members", "samples", Form.COUNT, "samples with this outcome"),
        Column("of", "of", Form.COUNT, "all samples, failed ones included"),
        Column("share", "share", Form.SHARE, "samples / of", 1),
        Column("interval", "95 %", Form.SHARE, "Clopper-Pearson limits of the probability", 1),
        Column("measured", "measured", Form.COUNT, "repeats with this outcome"),
        Column("repeats", "of", Form.COUNT, "all repeats"),
        Column("lower_bound", "at least", Form.SHARE, "one-sided 95 % limit: 0.05^(1/n) if all n agree", 1),
    ),
    _find,
)
