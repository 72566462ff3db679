"""Members inside two intervals: the measured limits, and the prediction interval for the next test.

The measured limits are the test of the paper, [minimum, maximum] of the repeats. Its significance: the next repeat of
the experiment is, in rank, equally likely to fall into each of the n + 1 gaps between n repeats, so it lies between the
smallest and the largest with probability (n - 1)/(n + 1), whatever the distribution (at least that, where equal values
are possible). Of several such tests at once only bounds are known without their dependence: at most the smallest of the
probabilities, at least 1 - the sum of the complements (Bonferroni).

For normal scatter the prediction interval is mean +- t_(n-1, 0.975) s sqrt(1 + 1/n). Equal repeats give none: their
scatter is not zero, only below the reading.
"""

from blocksim.analysis.compare import prediction_half_width
from blocksim.analysis.intervals import interval
from blocksim.analysis.metrics.metric import (
    BLOCK,
    Column,
    Evidence,
    Findings,
    Form,
    Interval,
    Metric,
    Pair,
    Row,
)

ALL = "all"


def repeat_passes(n: int) -> float:
    """Return the probability that the next repeat lies within [minimum, maximum] of `n` repeats."""
    return (n - 1) / (n + 1)


def repeat_passes_all(counts: list[int]) -> Interval | float | None:
    """Return the bounds of the probability that the next repeat passes all tests, with n repeats in each."""
    if not counts:
        return None
    chances = [repeat_passes(n) for n in counts]
    least = max(0.0, 1.0 - sum(1.0 - chance for chance in chances))
    return chances[0] if len(chances) == 1 else (least, min(chances))


def _find_inside(evidence: Evidence) -> Findings:
    total = evidence.members.count
    passes = [repeat_passes(pair.measured.n) if _has_range(pair) else None for pair in evidence.pairs]
    rows: list[Row] = [
        {
            **pair.head,
            "limits": pair.limits,
            **_share(int(pair.inside.sum()), total),
            "repeat_passes": chance,
        }
        for pair, chance in zip(evidence.pairs, passes, strict=True)
    ]
    ranged = [pair.measured.n for pair in evidence.pairs if _has_range(pair)]
    everything: Row = {"block": ALL, "quantity": "", "unit": "", "limits": None}
    share = _share(int(evidence.inside.sum()), total)
    last: Row = {**everything, **share, "repeat_passes": repeat_passes_all(ranged)}
    failed = total - int(evidence.members.finished.sum())
    text = f"shares are of all {total} samples" + (f"; {failed} did not finish and count as outside" if failed else "")
    return Findings((*rows, last), (text,))


def _share(count: int, total: int) -> Row:
    return {"inside": count, "of": total, "share": count / total, "interval": interval(count, total)}


def _has_range(pair: Pair) -> bool:
    """Return True if the limits are those of the repeats, and no tolerance about them."""
    return pair.limits == (pair.measured.minimum, pair.measured.maximum)


def _find_predicted(evidence: Evidence) -> Findings:
    lengths = evidence.lengths
    rows = tuple(_predicted(pair, evidence.members.count) for pair in lengths if pair.scatters)
    without = [f"{pair.name}: repeats without scatter predict nothing" for pair in lengths if not pair.scatters]
    return Findings(rows, tuple(without))


def _predicted(pair: Pair, total: int) -> Row:
    half = prediction_half_width(pair.measured.s, pair.measured.n)
    ends = (pair.measured.mean - half, pair.measured.mean + half)
    return {**pair.head, "prediction": ends, **_share(int(pair.between(ends).sum()), total)}


SHARE = (
    Column("share", "share", Form.SHARE, "inside / of", 1),
    Column("interval", "95 %", Form.SHARE, "Clopper-Pearson limits of the probability", 1),
)
INSIDE = Metric(
    "inside",
    "samples inside the measured limits, by the rules for single runs",
    (
        *BLOCK,
        Column("limits", "limits", Form.NUMBER, "limits of inside, as for a single run"),
        Column("inside", "inside", Form.COUNT, "samples inside; failed ones count as outside"),
        Column("of", "", Form.COUNT, "all samples, failed ones included"),
        *SHARE,
        Column("repeat_passes", "repeat", Form.SHARE, "probability that the next repeat is inside: (n-1)/(n+1)", 0),
    ),
    _find_inside,
)
PREDICTION = Metric(
    "prediction",
    "samples inside the 95 % prediction interval for the next test (mm)",
    (
        *BLOCK,
        Column("prediction", "next test", Form.NUMBER, "mean +- t s sqrt(1 + 1/n) of the n repeats"),
        Column("inside", "inside", Form.COUNT, "samples in it; failed ones count as outside"),
        Column("of", "of", Form.COUNT, "all samples, failed ones included"),
        *SHARE,
    ),
    _find_predicted,
)
