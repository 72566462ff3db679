"""Judgement of an ensemble, the members of a sweep, against the repeats of an experiment by all metrics.

These are outcome, inside, prediction, validation and area.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import hypot, inf, isfinite, nan, sqrt
from statistics import NormalDist
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from blocksim.analysis import compare, evidence as facts
from blocksim.analysis.experiment import MOST_NAMES, ExperimentTable
from blocksim.errors import InvalidInputError
from blocksim.notebook import Shown
from blocksim.scenario.spelling import list_names

if TYPE_CHECKING:
    import pandas as pd

U_NUM = 0.5  # mm: numerical error that step and stiffness may cause in an affordable ensemble
THRESHOLD = 0.5
QUARTER = 90.0  # deg
ROTATION = "rotation"
UNKNOWN = "?"
FAILED = "did not finish"
ALL = "all"
COVERAGE = 2.0  # factor k of the expanded uncertainty, about 95 %
ENOUGH = 2  # values that a standard deviation needs
RESAMPLES = 2000
SEED = 0
FEWEST = 4  # values of a sample that is worth resampling
Places = NDArray[np.int64]
SHARE = (
    facts.Datum("share", "share", facts.Form.SHARE, "inside / of", 1),
    facts.Datum("interval", "95 %", facts.Form.SHARE, "Clopper-Pearson limits of the probability", 1),
)


def outcome(rotations: Sequence[float]) -> str:
    """Return the class of rotations (deg); halves between two quarter turns go to the even one."""
    turns = (f"{QUARTER * round(angle / QUARTER):.0f}" if np.isfinite(angle) else UNKNOWN for angle in rotations)
    return ", ".join(turns)


def _find_outcome(evidence: facts.Evidence) -> facts.Findings:
    measured = [pair for pair in evidence.pairs if pair.measured.quantity == ROTATION]
    members = evidence.members
    blocks = [pair.measured.block for pair in measured] or [
        block for block in members.blocks if f"{block}.rotation_deg" in members.table
    ]
    if not blocks:
        return facts.Findings((), ("not computed: the sweep has no rotations",))
    rotations = np.column_stack([members.values(block, ROTATION) for block in blocks])
    every = sorted({replicate for pair in measured for replicate in pair.repeats})
    complete = [replicate for replicate in every if all(replicate in pair.repeats for pair in measured)]
    ends = zip(rotations.tolist(), members.has_ended, strict=True)
    found = Counter(outcome(row) if has_ended else FAILED for row, has_ended in ends)
    seen = Counter(outcome([pair.repeats[replicate] for pair in measured]) for replicate in complete)
    rows: list[facts.Row] = []
    for name in sorted({*found, *seen}, key=lambda name: (-found[name], -seen[name], name)):
        row: facts.Row = {
            "outcome": name,
            "members": found[name],
            "of": found.total(),
            **_share(found[name], found.total()),
        }
        row |= dict.fromkeys(("measured", "repeats", "lower_bound"), None)
        if seen[name]:
            bound = compare.lower_bound(seen[name], seen.total())
            row |= {"measured": seen[name], "repeats": seen.total(), "lower_bound": bound}
        rows.append(row)
    messages = ["blocks: " + ", ".join(blocks)]
    if incomplete := list_names(sorted(set(every) - set(complete)), MOST_NAMES):
        messages.append(f"left out, as not all rotations were measured: replicate {incomplete}")
    if seen:
        messages.append("at least: one-sided 95 % limit of the measured share")
    return facts.Findings(tuple(rows), tuple(messages))


def _share(count: int, total: int) -> facts.Row:
    return {"share": count / total, "interval": compare.interval(count, total)}


OUTCOME = facts.Metric(
    "outcome",
    "final rotations, rounded to quarter turns (deg)",
    (
        facts.Datum("outcome", "outcome", facts.Form.TEXT, "rotation of each block, rounded to 90 degrees"),
        facts.Datum("members", "samples", facts.Form.COUNT, "samples with this outcome"),
        facts.Datum("of", "of", facts.Form.COUNT, "all samples, failed ones included"),
        facts.Datum("share", "share", facts.Form.SHARE, "samples / of", 1),
        facts.Datum("interval", "95 %", facts.Form.SHARE, "Clopper-Pearson limits of the probability", 1),
        facts.Datum("measured", "measured", facts.Form.COUNT, "repeats with this outcome"),
        facts.Datum("repeats", "of", facts.Form.COUNT, "all repeats"),
        facts.Datum("lower_bound", "at least", facts.Form.SHARE, "one-sided 95 % limit: 0.05^(1/n) if all n agree", 1),
    ),
    _find_outcome,
)


def repeat_passes(n: int) -> float:
    """Return the probability that the next repeat lies within [minimum, maximum] of `n` repeats."""
    return (n - 1) / (n + 1)


def repeat_passes_all(counts: list[int]) -> facts.Interval | float | None:
    """Return the bounds of the probability that the next repeat passes all tests, with n repeats in each."""
    if not counts:
        return None
    chances = [repeat_passes(n) for n in counts]
    least = max(0.0, 1.0 - sum(1.0 - chance for chance in chances))
    return chances[0] if len(chances) == 1 else (least, min(chances))


def _find_inside(evidence: facts.Evidence) -> facts.Findings:
    total = len(evidence.members.table)
    rows: list[facts.Row] = []
    ranged = []  # repeats of those whose limits are those of the repeats, and no tolerance about them
    for pair in evidence.pairs:
        n, count = pair.measured.n, int(pair.between(pair.limits).sum())
        has_range = pair.limits == (pair.measured.minimum, pair.measured.maximum)
        ranged += [n] if has_range else []
        row: facts.Row = {**pair.head, "limits": pair.limits, "inside": count, "of": total, **_share(count, total)}
        rows.append({**row, "repeat_passes": repeat_passes(n) if has_range else None})
    count, failed = int(evidence.inside.sum()), total - int(evidence.members.has_ended.sum())
    last: facts.Row = {"block": ALL, "quantity": "", "unit": "", "limits": None, "inside": count, "of": total}
    rows.append({**last, **_share(count, total), "repeat_passes": repeat_passes_all(ranged)})
    text = f"shares are of all {total} samples" + (f"; {failed} did not finish and count as outside" if failed else "")
    return facts.Findings(tuple(rows), (text,))


def _find_predicted(evidence: facts.Evidence) -> facts.Findings:
    total = len(evidence.members.table)
    rows: list[facts.Row] = []
    for pair in (pair for pair in evidence.lengths if pair.scatters):
        half = compare.prediction_half_width(pair.measured.s, pair.measured.n)
        ends = (pair.measured.mean - half, pair.measured.mean + half)
        count = int(pair.between(ends).sum())
        rows.append({**pair.head, "prediction": ends, "inside": count, "of": total, **_share(count, total)})
    without = (pair.name for pair in evidence.lengths if not pair.scatters)
    return facts.Findings(tuple(rows), tuple(f"{name}: repeats without scatter predict nothing" for name in without))


INSIDE = facts.Metric(
    "inside",
    "samples inside the measured limits, by the rules for single runs",
    (
        *facts.BLOCK,
        facts.Datum("limits", "limits", facts.Form.NUMBER, "limits of inside, as for a single run"),
        facts.Datum("inside", "inside", facts.Form.COUNT, "samples inside; failed ones count as outside"),
        facts.Datum("of", "", facts.Form.COUNT, "all samples, failed ones included"),
        *SHARE,
        facts.Datum(
            "repeat_passes", "repeat", facts.Form.SHARE, "probability that the next repeat is inside: (n-1)/(n+1)", 0
        ),
    ),
    _find_inside,
)
PREDICTION = facts.Metric(
    "prediction",
    "samples inside the 95 % prediction interval for the next test (mm)",
    (
        *facts.BLOCK,
        facts.Datum("prediction", "next test", facts.Form.NUMBER, "mean +- t s sqrt(1 + 1/n) of the n repeats"),
        facts.Datum("inside", "inside", facts.Form.COUNT, "samples in it; failed ones count as outside"),
        facts.Datum("of", "of", facts.Form.COUNT, "all samples, failed ones included"),
        *SHARE,
    ),
    _find_predicted,
)


def _find_validation(evidence: facts.Evidence) -> facts.Findings:
    lengths, u_num = evidence.lengths, evidence.u_num
    rows: list[facts.Row] = []
    for pair in lengths:
        values, measured = pair.known, pair.measured
        simulated = float(np.mean(values)) if values.size else nan
        error = simulated - measured.mean
        u_input = float(np.std(values, ddof=1)) if values.size >= ENOUGH else nan
        u_data = compare.data_uncertainty(measured.s, measured.n)
        u_val = hypot(u_num, u_input, u_data)
        row: facts.Row = {**pair.head, "members": int(values.size), "S": simulated, "D": measured.mean, "E": error}
        row |= {"u_num": u_num, "u_input": u_input, "u_D": u_data, "u_val": u_val}
        is_known = isfinite(u_val) and isfinite(error)
        rows.append({**row, "within": abs(error) <= COVERAGE * u_val if is_known else None})
    messages = [f"u_num = {u_num:g} mm"] if rows else ["no length was measured"]
    if any(pair.known.size < ENOUGH for pair in lengths):
        messages.append("u_input needs two samples with a value")
    if any(pair.measured.n < ENOUGH for pair in lengths):
        messages.append("u_D needs two repeats")
    return facts.Findings(tuple(rows), tuple(messages))


VALIDATION = facts.Metric(
    "validation",
    "error and uncertainty after ASME V&V 20 (mm)",
    (
        *facts.BLOCK,
        facts.Datum("members", "", facts.Form.COUNT, "samples with a value, used for S and u_input"),
        facts.Datum("S", "S", facts.Form.NUMBER, "mean of the samples"),
        facts.Datum("D", "D", facts.Form.NUMBER, "mean of the repeats"),
        facts.Datum("E", "E", facts.Form.NUMBER, "S - D"),
        facts.Datum("u_num", "", facts.Form.NUMBER, "standard uncertainty of the numerical solution (--u-num)"),
        facts.Datum("u_input", "u_input", facts.Form.NUMBER, "standard deviation of the samples"),
        facts.Datum("u_D", "u_D", facts.Form.NUMBER, "of D: sqrt(s^2/n + 0.5^2), reading included"),
        facts.Datum("u_val", "u_val", facts.Form.NUMBER, "sqrt(u_num^2 + u_input^2 + u_D^2)"),
        facts.Datum("within", "|E|<=2u", facts.Form.TEXT, "|E| <= 2 u_val: no error of the model is detected"),
    ),
    _find_validation,
)


def _on_grid(one: facts.Floats, other: facts.Floats) -> tuple[facts.Floats, Places, Places]:
    """Return the distances of the values of two samples in order, and which values each sample has."""
    grid, places = np.unique(np.concatenate([one, other]), return_inverse=True)
    return np.diff(grid), places[: one.size], places[one.size :]


def _area(widths: facts.Floats, one: Places, other: Places) -> float:
    """Return the area between the distributions of two samples on a common grid."""
    shares = (np.cumsum(np.bincount(sample, minlength=widths.size + 1))[:-1] / sample.size for sample in (one, other))
    return float(np.sum(np.abs(np.subtract(*shares)) * widths))  # not by BLAS, whose threads hinder one another here


def area_between(one: facts.Floats, other: facts.Floats) -> float:
    """Return the area between the distributions of two samples, at least one value each, in their unit."""
    return _area(*_on_grid(one, other))


def area_interval(
    members: facts.Floats, repeats: facts.Floats, resamples: int = RESAMPLES, seed: int = SEED
) -> facts.Interval:
    """Return the 95 % interval of the area by bootstrap; NaN where a sample is too small for one.

    Percentiles are widened for the smaller sample as Student's t widens those of the normal distribution.
    """
    smaller = min(members.size, repeats.size)
    if smaller < FEWEST:
        return nan, nan
    random = np.random.default_rng(seed)
    widths, *both = _on_grid(members, repeats)
    samples = ([places[random.integers(0, places.size, places.size)] for places in both] for _ in range(resamples))
    areas = [_area(widths, *sample) for sample in samples]
    area = _area(widths, *both)
    widened = NormalDist().cdf(
        compare.quantile(0.5 * (1.0 + compare.CONFIDENCE), smaller - 1) * sqrt(smaller / (smaller - 1))
    )
    half = max(float(np.quantile(areas, widened)) - area, 0.0)
    return max(area - half, 0.0), area + half


def _find_area(evidence: facts.Evidence) -> facts.Findings:
    rows: list[facts.Row] = []
    messages = []
    for pair in evidence.lengths:
        members, repeats = pair.known, np.array(list(pair.repeats.values()))
        why = "" if pair.scatters else "as the repeats do not scatter"
        if not why and min(members.size, repeats.size) < FEWEST:
            why = f"which needs {FEWEST} samples and {FEWEST} repeats"
        if why:
            messages.append(f"{pair.name}: no interval, {why}")
        row: facts.Row = {**pair.head, "members": int(members.size), "repeats": int(repeats.size)}
        area = area_between(members, repeats) if members.size else None
        row |= {"area": area, "interval": None if why or area is None else area_interval(members, repeats)}
        rows.append(row)
    if len(messages) < len(rows):
        messages.append(f"bootstrap of {RESAMPLES} resamples, seed {SEED}")
    return facts.Findings(tuple(rows), tuple(messages))


AREA = facts.Metric(
    "area",
    "area between the distributions of samples and repeats (mm)",
    (
        *facts.BLOCK,
        facts.Datum("members", "samples", facts.Form.COUNT, "samples with a value"),
        facts.Datum("repeats", "repeats", facts.Form.COUNT, "repeats with a value"),
        facts.Datum(
            "area", "area", facts.Form.NUMBER, "integral of |F_samples - F_repeats| dx: 0 where they are equal"
        ),
        facts.Datum("interval", "95 %", facts.Form.NUMBER, "bootstrap interval of the area, both samples resampled"),
    ),
    _find_area,
)


METRICS: dict[str, facts.Metric] = {metric.name: metric for metric in (INSIDE, OUTCOME, VALIDATION, PREDICTION, AREA)}


@dataclass(frozen=True)
class Settings:
    """Settings: the share of members that must be inside, and u_num (mm); the tolerance of curves (curves.py)."""

    threshold: float = THRESHOLD
    u_num: float = U_NUM
    tolerance: float | None = None

    def __post_init__(self) -> None:
        """Raise InvalidInputError for an invalid share or uncertainty."""
        if not 0.0 <= self.threshold <= 1.0:
            raise InvalidInputError(f"threshold {self.threshold} is not a share from 0 to 1")
        if self.tolerance is not None and not 0.0 <= self.tolerance < inf:
            raise InvalidInputError(f"tolerance {self.tolerance} is not a share from 0 up")
        if not 0.0 <= self.u_num < inf:
            raise InvalidInputError(f"u_num {self.u_num} is not an uncertainty in mm: a number from 0 up")


@dataclass(frozen=True, eq=False, repr=False)
class Judgement(Shown):
    """Results of all metrics by name; `sweep` and `source` are what was compared."""

    sweep: str
    source: str
    members: int
    inside_all: int
    failures: tuple[facts.Failure, ...]
    settings: Settings
    findings: Mapping[str, facts.Findings]
    messages: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """Return a line: sweep, table, share inside and the verdict."""
        verdict = "inside" if self.inside else "outside"
        share = f"{self.inside_all} of {self.members} samples inside all ranges"
        return f"<Judgement of {self.sweep} against {self.source}: {share}, {verdict}>"

    @property
    def share_inside(self) -> float:
        """Share of all members, failed ones included, that are within all measured ranges."""
        return self.inside_all / self.members

    @property
    def inside(self) -> bool:
        """Whether that share reaches the threshold."""
        return self.share_inside >= self.settings.threshold

    def to_frame(self, metric: str = "inside") -> "pd.DataFrame":
        """Return the rows of one metric; its columns are explained in METRICS."""
        import pandas as pd

        names = [column.name for column in METRICS[metric].columns]
        return pd.DataFrame(self.findings[metric].rows, columns=names)

    def _repr_html_(self) -> str:
        """Return the same line above the samples inside the measured limits, and the sweep, for notebooks."""
        return compare.html_of(self, self.to_frame()) + super()._repr_html_()

    def to_dict(self) -> dict[str, object]:
        """Return plain values for JSON, with the meaning of each; a missing number is None."""
        return {
            "sweep": self.sweep,
            "experiment": self.source,
            "members": self.members,
            "finished": self.members - len(self.failures),
            "failed": [failure._asdict() for failure in self.failures],
            "inside_all": self.inside_all,
            "share_inside": self.share_inside,
            "threshold": self.settings.threshold,
            "inside": self.inside,
            "messages": list(self.messages),
            "metrics": {
                name: {
                    "meaning": METRICS[name].meaning,
                    "columns": {column.name: column.meaning for column in METRICS[name].columns},
                    "rows": [{key: compare.plain(value) for key, value in row.items()} for row in found.rows],
                    "messages": list(found.messages),
                }
                for name, found in self.findings.items()
            },
        }


def judge(
    members: facts.Members, table: ExperimentTable, settings: Settings | None = None, messages: tuple[str, ...] = ()
) -> Judgement:
    """Judge the members of a sweep by all metrics.

    Raises InvalidInputError where members lack a measured block or quantity, UnavailableError without scipy.
    """
    settings = settings or Settings()
    table.refuse_unknown(members.blocks, "the sweep")
    evidence, finished = facts.evidence_of(members, table, settings.u_num), int(members.has_ended.sum())
    incomplete = (  # measured quantities of which finished samples have no value
        f"{finished - pair.known.size} finished samples have no {pair.name}: they count as outside"
        for pair in evidence.pairs
        if pair.known.size < finished
    )
    return Judgement(
        sweep=members.source,
        source=table.source,
        members=len(members.table),
        inside_all=int(evidence.inside.sum()),
        failures=members.failures,
        settings=settings,
        findings={name: metric.find(evidence) for name, metric in METRICS.items()},
        messages=(*messages, *table.messages, *table.absence_messages(members.blocks), *incomplete),
    )
