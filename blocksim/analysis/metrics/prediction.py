"""Prediction interval for the next test, and the members inside it.

For normal scatter the interval is mean +- t_(n-1, 0.975) s sqrt(1 + 1/n). Equal repeats give none: their
scatter is not zero, only below the reading.
"""

from blocksim.analysis.compare import prediction_half_width
from blocksim.analysis.metrics.metric import BLOCK, Column, Evidence, Findings, Form, Metric, Pair, Row, shown_name
from blocksim.analysis.proportion import interval


def _find(evidence: Evidence) -> Findings:
    lengths = [pair for pair in evidence.pairs if pair.is_length]
    rows = tuple(_row(pair, evidence.members.count) for pair in lengths if pair.scatters)
    without = [f"{shown_name(pair)}: repeats without scatter predict nothing" for pair in lengths if not pair.scatters]
    return Findings(rows, tuple(without))


def _row(pair: Pair, total: int) -> Row:
    half = prediction_half_width(pair.measured.s, pair.measured.n)
    ends = (pair.measured.mean - half, pair.measured.mean + half)
    count = int(pair.between(ends).sum())
    shares: Row = {"inside": count, "of": total, "share": count / total, "interval": interval(count, total)}
    return {**pair.head, "prediction": ends, **shares}


PREDICTION = Metric(
    "prediction",
    "members inside the 95 % prediction interval for the next test (mm)",
    (
        *BLOCK,
        Column("prediction", "next test", Form.NUMBER, "mean +- t s sqrt(1 + 1/n) of the n repeats"),
        Column("inside", "inside", Form.COUNT, "members in it; failed ones count as outside"),
        Column("of", "of", Form.COUNT, "all members, failed ones included"),
        Column("share", "share", Form.SHARE, "inside / of", 1),
        Column("interval", "95 %", Form.SHARE, "Clopper-Pearson limits of the probability", 1),
    ),
    _find,
)
