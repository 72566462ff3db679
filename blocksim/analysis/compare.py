"""Comparison of the final positions of one run with the repeats of an experiment, and the intervals it takes.

The rules, in the order in which they are tried:

* rotation: inside when within 5 degrees of the mean of the repeats;
* repeats that are all equal (also a single one): inside when within the reading uncertainty of 0.5 mm,
  because a range of no width only says that the scatter is below what can be read, and a simulated block that
  stays where it is still settles into its contacts by a fraction of a millimetre;
* everything else: inside when within [minimum, maximum] of the repeats, ends included. This is the rule of
  the paper, and such ranges are not widened.

The verdict comes with the numbers of a validation after ASME V&V 20: the error E = S - D, the
standard uncertainty of the measured mean u_D = sqrt(s^2/n + reading^2), and the half-width of the 95 %
prediction interval for the next test, t_(n-1, 0.975) s sqrt(1 + 1/n). Quantiles of Student's t need no scipy: every run
that is compared asks for them.

Limits of a probability from k of n, after Clopper and Pearson (Biometrika 26, 1934), hold at least the stated
confidence whatever the probability is. Each is the probability at which k, or more (fewer), of n has just the remaining
chance; a quantile of a beta distribution solves that equation.
"""

from collections import Counter
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from html import escape
from math import cos, inf, isfinite, nan, pi, sin, sqrt, tan
from typing import TYPE_CHECKING, Any

from blocksim.analysis.experiment import QUANTITIES, ExperimentTable, Statistics, quote_names
from blocksim.analysis.outliers import READINGS
from blocksim.errors import InvalidInputError
from blocksim.extras import load_module
from blocksim.notebook import Shown

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import pandas as pd


CONFIDENCE = 0.95
BISECTIONS = 100  # each halves the bracket; 100 exhaust double precision


def quantile(probability: float, degrees: int) -> float:
    """Return t with P(T <= t) = `probability`, for `degrees` >= 1 and 0 < `probability` < 1.

    P(|T| <= sqrt(degrees) tan(theta)) is the finite series of Abramowitz & Stegun, 26.7.3 and 26.7.4: odd powers of
    cos(theta) for odd degrees of freedom, even powers for even ones. It is inverted by bisection in theta, which is
    bounded. Raises ValueError outside these limits.
    """
    if degrees < 1 or not 0.0 < probability < 1.0:
        raise ValueError("needs at least one degree of freedom and a probability between 0 and 1")
    is_odd = degrees % 2 == 1
    low, high = 0.0, pi / 2
    for _ in range(BISECTIONS):
        theta = 0.5 * (low + high)
        total = term = cos(theta) if is_odd else 1.0
        for index in range(3 if is_odd else 2, degrees - 1, 2):
            term *= cos(theta) ** 2 * (index - 1) / index
            total += term
        part = sin(theta) * total
        if is_odd:
            part = 2.0 * theta / pi if degrees == 1 else 2.0 / pi * (theta + part)
        low, high = (theta, high) if part < abs(2.0 * probability - 1.0) else (low, theta)
    size = sqrt(degrees) * tan(low)
    return size if probability >= 0.5 else -size


def interval(count: int, total: int, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Return the two-sided limits of the probability, given `count` of `total`; (0, 1) where `total` is 0."""
    tail = 0.5 * (1.0 - confidence)
    return lower_bound(count, total, tail), 1.0 - lower_bound(total - count, total, tail)


def lower_bound(count: int, total: int, tail: float = 1.0 - CONFIDENCE) -> float:
    """Return the one-sided lower limit p, P(at least `count` of `total`; p) = `tail`: tail^(1/n) where all n agree."""
    if count == 0:
        return 0.0
    return float(load_module("scipy.special", "judging a sweep").betaincinv(count, total - count + 1, tail))


ROTATION_TOLERANCE = 5.0  # deg, either side of the measured mean
READING = READINGS["mm"]


class Verdict(StrEnum):
    """Whether a simulated value agrees with the repeats."""

    INSIDE = "inside"
    OUTSIDE = "outside"
    NO_DATA = "no data"


@dataclass(frozen=True)
class ComparisonRow:
    """One quantity of one block, in `unit` (mm or deg); NaN where a number is missing.

    `minimum` and `maximum` are measured, `lower` and `upper` are the limits judged by (see the module's
    rules), `error` is simulated - mean, `distance` the distance of the simulated value beyond the nearer limit
    (0 inside). `u_data` and `prediction` (half-width for the next test) are given for lengths.
    """

    block: str
    quantity: str
    unit: str
    simulated: float
    mean: float = nan
    s: float = nan
    n: int = 0
    minimum: float = nan
    maximum: float = nan
    lower: float = nan
    upper: float = nan
    error: float = nan
    distance: float = nan
    u_data: float = nan
    prediction: float = nan
    verdict: Verdict = Verdict.NO_DATA


@dataclass(frozen=True)
class Comparison(Shown):
    """All compared quantities of one run; `source` is the measured table, `messages` list what is missing.

    `run` is what was compared, where it can be drawn: a result or its folder.
    """

    rows: tuple[ComparisonRow, ...]
    source: str
    messages: tuple[str, ...] = ()
    run: Any = field(default=None, compare=False)

    def __repr__(self) -> str:
        """Return a line: the table and how many quantities are inside; the numbers are in `to_frame`."""
        judged = [row.verdict for row in self.rows if row.verdict is not Verdict.NO_DATA]
        return f"<Comparison with {self.source}: {judged.count(Verdict.INSIDE)} of {len(judged)} quantities inside>"

    @property
    def inside(self) -> bool:
        """Whether every quantity with data is inside; there is always at least one."""
        return all(row.verdict is not Verdict.OUTSIDE for row in self.rows)

    def to_frame(self) -> "pd.DataFrame":
        """Return one row a quantity, columns as in ComparisonRow."""
        import pandas as pd

        frame = pd.DataFrame([asdict(row) for row in self.rows])
        frame["verdict"] = [row.verdict.value for row in self.rows]
        return frame

    def _repr_html_(self) -> str:
        """Return the same line above the table and the picture of the end, for notebooks."""
        return html_of(self, self.to_frame()) + super()._repr_html_()

    def to_dict(self) -> dict[str, object]:
        """Return plain values for JSON; a missing number is None."""
        rows = [{key: plain(value) for key, value in asdict(row).items()} for row in self.rows]
        return {"inside": self.inside, "experiment": self.source, "rows": rows, "messages": list(self.messages)}


def html_of(shown: object, table: "pd.DataFrame") -> str:
    """Return the line of a comparison above its table (no text of it is taken for HTML)."""
    return f"<p>{escape(repr(shown)[1:-1])}</p>{table.to_html(index=False, float_format='{:.4g}'.format)}"


def compare_final(final: "pd.DataFrame | Mapping[str, Sequence[Any]]", table: ExperimentTable) -> Comparison:
    """Compare a run's final table or its columns (`block`, `x_mm`, `rotation_deg`, ...) with the measured repeats.

    Raises InvalidInputError when the final table lacks a measured block or quantity, or names a block twice.
    A block that was not measured has rows with the verdict "no data"; a message names all of them.
    """
    columns = {one.quantity: QUANTITIES[one.quantity].final_column for one in table.measurements}
    missing = [column for column in ["block", *columns.values()] if column not in final]
    if missing:
        message = f"the final table has no column {', '.join(missing)}, which {table.source} is compared with"
        raise InvalidInputError(message)
    names = [str(name) for name in final["block"]]
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise InvalidInputError(f"the final table has more than one row for block {quote_names(twice)}")
    table.refuse_unknown(names, "the run")
    measured = {(row.block, row.quantity): row for row in table.summaries()}
    values = {quantity: [float(value) for value in final[column]] for quantity, column in columns.items()}
    rows = [
        _row(name, quantity, values[quantity][i], measured.get((name, quantity)))
        for i, name in enumerate(names)
        for quantity in columns
    ]
    return Comparison(tuple(rows), table.source, (*table.messages, *table.absence_messages(names)))


def limits(quantity: str, mean: float, minimum: float, maximum: float) -> tuple[float, float]:
    """Return the limits of inside (mm or deg)."""
    if quantity == "rotation":
        return mean - ROTATION_TOLERANCE, mean + ROTATION_TOLERANCE
    if minimum == maximum:
        return minimum - READING, maximum + READING
    return minimum, maximum


def data_uncertainty(s: float, n: int) -> float:
    """Return the standard uncertainty u_D of the mean of `n` lengths (mm); NaN for a single one."""
    return sqrt(s**2 / n + READING**2)


def prediction_half_width(s: float, n: int) -> float:
    """Return half width of the 95 % prediction interval for the next test (unit of `s`); NaN for n = 1."""
    if n < 2:
        return nan
    return quantile(0.5 * (1.0 + CONFIDENCE), n - 1) * s * sqrt(1.0 + 1.0 / n)


def _row(block: str, quantity: str, value: float, measured: Statistics | None) -> ComparisonRow:
    """Judge one quantity of one block; `measured` is its row of the statistics, None where there is none."""
    unit = QUANTITIES[quantity].unit
    if measured is None:
        return ComparisonRow(block, quantity, unit, value)
    mean, s, n = measured.mean, measured.s, measured.n
    lower, upper = limits(quantity, mean, measured.minimum, measured.maximum)
    distance = max(lower - value, value - upper, 0.0) if isfinite(value) else inf
    return ComparisonRow(
        block,
        quantity,
        unit,
        value,
        *measured[3:],
        lower,
        upper,
        error=value - mean,
        distance=distance,
        u_data=data_uncertainty(s, n) if unit == "mm" else nan,
        prediction=prediction_half_width(s, n) if unit == "mm" else nan,
        verdict=Verdict.INSIDE if distance == 0.0 else Verdict.OUTSIDE,
    )


def plain(value: object) -> object:
    """Return what JSON can carry."""
    if isinstance(value, tuple):
        return [plain(end) for end in value]
    if isinstance(value, Verdict):
        return value.value
    return None if isinstance(value, float) and not isfinite(value) else value
