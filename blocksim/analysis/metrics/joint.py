"""One check of all measured positions together: whether the means of members and repeats agree.

Hotelling's T2 for two samples whose covariances differ, since the scatter of members comes from their inputs and that
of repeats from the laboratory. With means a (n repeats) and b (N members) of p positions, A and B the covariances of
these means (sample covariance by n and by N) and V = A + B: T2 = (a - b)' V^-1 (a - b). Without a difference,
T2 (nu - p + 1)/(nu p) follows F(p, nu - p + 1) nearly, with

    nu = (p + p^2) / ( (tr(M^2) + tr(M)^2)/(n - 1) + (tr(K^2) + tr(K)^2)/(N - 1) ),  M = A V^-1, K = B V^-1

(Krishnamoorthy and Yu, Statistics & Probability Letters 66, 2004, modifying Nel and van der Merwe). Where the ensemble
is large, or has one member, or does not scatter, B = 0, nu = n - 1, and this is exactly the one-sample test of the
repeats against the ensemble's mean. For p = 1 it is Welch's test. It does not include the uncertainty of the reading.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from blocksim.analysis.intervals import CONFIDENCE
from blocksim.analysis.metrics.metric import (
    Column,
    Evidence,
    Findings,
    Floats,
    Form,
    Metric,
    Pair,
    Row,
    complete_repeats,
)
from blocksim.extras import loaded

SMALLEST_EIGENVALUE = 1e-9  # of the correlation matrix: below it, one position follows from the others


class Hotelling(NamedTuple):
    """T2, and the F distribution of its test: `F` has `dof_1`, `dof_2` degrees of freedom."""

    T2: float
    F: float
    dof_1: float
    dof_2: float
    critical: float  # at the level 5 %
    p_value: float


def hotelling(repeats: Floats, members: Floats) -> Hotelling | None:
    """Compare the means of repeats (n, p) and members (N, p), n > p; None where degrees of freedom do not suffice."""
    n, p = repeats.shape
    difference = repeats.mean(axis=0) - members.mean(axis=0)
    of_repeats, of_members = _covariance_of_mean(repeats), _covariance_of_mean(members)
    both = of_repeats + of_members
    squared = float(difference @ np.linalg.solve(both, difference))
    inverse = _spread(both, of_repeats) / (n - 1)
    if len(members) > 1:
        inverse += _spread(both, of_members) / (len(members) - 1)
    degrees = (p + p * p) / inverse
    rest = degrees - p + 1
    if rest <= 0.0:
        return None
    scale = degrees * p / rest
    special = loaded("scipy.special", "judging a sweep")
    critical = scale * float(special.fdtri(p, rest, CONFIDENCE))
    return Hotelling(squared, squared / scale, float(p), rest, critical, float(special.fdtrc(p, rest, squared / scale)))


def _covariance_of_mean(sample: Floats) -> Floats:
    """Return the sample covariance of p columns by the number of rows; zero for a single row."""
    n, p = sample.shape
    if n == 1:
        return np.zeros((p, p))
    covariance: Floats = np.cov(sample, rowvar=False).reshape(p, p) / n
    return covariance


def _spread(both: Floats, part: Floats) -> float:
    """Return tr(M^2) + tr(M)^2 for M = part both^-1, which has the traces of both^-1 part."""
    share = np.linalg.solve(both, part)
    return float(np.trace(share @ share) + np.trace(share) ** 2)


def _find(evidence: Evidence) -> Findings:
    lengths = evidence.lengths
    chosen = [pair for pair in lengths if pair.scatters]
    messages = [f"{pair.name}: repeats without scatter are left out" for pair in lengths if not pair.scatters]
    if not chosen:
        return Findings((), (*messages, "not computed: no measured position scatters"))
    repeats, incomplete = complete_repeats(chosen)
    members = np.column_stack([pair.values for pair in chosen])
    members = members[np.isfinite(members).all(axis=1)]
    if incomplete:
        messages.append(f"left out, as not all positions were measured: replicate {incomplete}")
    complaint = _complaint(repeats, members)
    found = None if complaint else hotelling(repeats, members)
    if found is None:
        return Findings((), (*messages, f"not computed: {complaint or 'too few samples for their scatter'}"))
    return Findings((_row(chosen, repeats, members, found),), tuple(messages))


def _complaint(repeats: Floats, members: Floats) -> str:
    """Return why no test is possible, or nothing."""
    n, p = repeats.shape
    if n <= p:
        return f"{n} complete repeats for {p} positions, at least {p + 1} are needed"
    if not len(members):
        return "no sample has all positions"
    if not np.ptp(repeats, axis=0).all():
        return "a position does not scatter in the complete repeats"
    correlation = np.atleast_2d(np.corrcoef(repeats, rowvar=False))
    if np.linalg.eigvalsh(correlation)[0] < SMALLEST_EIGENVALUE:
        return "a position follows from the others (their covariance is singular)"
    return ""


def _row(pairs: Sequence[Pair], repeats: Floats, members: Floats, found: Hotelling) -> Row:
    return {
        "positions": ", ".join(f"{pair.measured.block} {pair.measured.quantity}" for pair in pairs),
        "repeats": len(repeats),
        "members": len(members),
        **found._asdict(),
        "within": found.critical >= found.T2,
    }


JOINT = Metric(
    "joint",
    "do the means of all positions agree? Hotelling's T2, two samples",
    (
        Column("positions", "positions", Form.TEXT, "blocks and quantities taken together"),
        Column("repeats", "n", Form.COUNT, "repeats in which all of them were measured"),
        Column("members", "N", Form.COUNT, "samples that have all of them"),
        Column("T2", "T2", Form.NUMBER, "squared distance of the means in units of their scatter"),
        Column("critical", "5 %", Form.NUMBER, "T2 that is exceeded by chance in 5 % of experiments"),
        Column("F", "", Form.NUMBER, "T2 scaled to follow the F distribution"),
        Column("dof_1", "", Form.NUMBER, "its degrees of freedom: number of positions"),
        Column("dof_2", "dof", Form.NUMBER, "its degrees of freedom: n - p for large ensembles", 1),
        Column("p_value", "p", Form.NUMBER, "probability of such a T2 if the true means agree", 3),
        Column("within", "agree", Form.TEXT, "T2 <= critical T2"),
    ),
    _find,
)
