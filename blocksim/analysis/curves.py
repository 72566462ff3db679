"""Curves of one quantity of a probe over another: measured repeats, their characteristic numbers, and comparison.

A table has the columns `probe`, `replicate`, and two of that probe with their units, such as force over displacement:

    # wall 3, pushed at its head
    probe,replicate,displacement_mm,force_kN
    jack,1,0.0,0.0
    jack,1,0.5,21.3

The envelope of a curve in one direction are its points farther out than all before: of a slow push all of them, of
cycles those that are reached for the first time. From it follow the peak, the secant stiffness between 0.15 and 0.4 of
the peak, the displacement at which it has fallen to 0.8 of it, and the area below it.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean, stdev

import numpy as np
from numpy.typing import NDArray

from blocksim.analysis import outliers
from blocksim.analysis.compare import Comparison, ComparisonRow, Verdict
from blocksim.analysis.experiment import CURVES
from blocksim.errors import InvalidInputError
from blocksim.scenario import input_files, spelling, units

Floats = NDArray[np.float64]
FIRST = (CURVES, "replicate")
TIME = "time"
STIFF = (0.15, 0.4)  # of the peak, between which the secant is
FALLEN = 0.8  # of the peak
LEAST_SCATTER = 0.02  # of the mean: least standard deviation of what repeats reach
SINGLE = 0.1  # of the mean: range of a single repeat, where no tolerance is given


@dataclass(frozen=True)
class Envelope:
    """The n points of a curve that are farther out from zero than all before, in one direction."""

    x: Floats  # (n,), increasing
    y: Floats  # (n,)

    @classmethod
    def of(cls, x: Floats, y: Floats, sign: float) -> "Envelope":
        """Return it in the direction of a sign; both quantities are positive in it."""
        out, beside = sign * np.asarray(x), sign * np.asarray(y)
        before = np.maximum.accumulate(np.append(-np.inf, out[:-1])) if len(out) else out
        chosen = (out > before) & (out >= 0.0)
        return cls(out[chosen], beside[chosen])

    @property
    def peak(self) -> float:
        """The greatest value."""
        return float(self.y.max(initial=-math.inf))

    @property
    def place_of_peak(self) -> float:
        """Where it is reached first."""
        return float(self.x[int(np.argmax(self.y))])

    @property
    def stiffness(self) -> float:
        """The secant between shares STIFF of the peak; NaN where the curve begins beyond them."""
        rising = slice(0, int(np.argmax(self.y)) + 1)
        highest = np.maximum.accumulate(self.y[rising])
        levels = [share * self.peak for share in STIFF]
        if not highest[0] < levels[0]:
            return math.nan
        begin, end = (float(np.interp(level, highest, self.x[rising])) for level in levels)
        return (levels[1] - levels[0]) / (end - begin) if end > begin else math.nan

    @property
    def place_of_fall(self) -> float:
        """Where it has fallen to FALLEN of its peak; NaN where it has not."""
        beyond = np.arange(self.y.size) > int(np.argmax(self.y))
        low = np.flatnonzero(beyond & (self.y <= FALLEN * self.peak))
        return float(self.x[low[0]]) if low.size else math.nan

    def area(self, end: float) -> float:
        """Return the area below it up to a place."""
        inside = self.x < end
        x = np.append(self.x[inside], end)
        return float(np.trapezoid(np.interp(x, self.x, self.y), x))


@dataclass(frozen=True)
class Axis:
    """A quantity of a curve: its column in the table, the column of the probe, and its unit."""

    column: str
    name: str
    unit: str
    factor: float  # to SI

    @classmethod
    def read(cls, head: input_files.TableCell) -> "Axis":
        """Take the name of a column apart. Raises ValueError."""
        name, _, unit = head.text.rpartition("_")
        try:
            factor = float(units.parse_unit(unit).factor) if name else 0.0
        except ValueError:
            factor = 0.0
        if not factor:
            raise ValueError(f"'{head.text}' does not end in its unit; write for example displacement_mm or force_kN")
        return cls(head.text, name, unit, factor)


@dataclass(frozen=True, eq=False)
class CurveTable:
    """Measured curves, in the units of the table; `source` is its path as it was given."""

    x: Axis
    y: Axis
    curves: Mapping[str, Mapping[int, tuple[Floats, Floats]]]  # by probe and replicate
    source: str
    warnings: tuple[str, ...] = ()  # of points and repeats that are far from the others

    def points(self, probe: str, x: str, y: str) -> list[tuple[Floats, Floats]]:
        """Return the curves of a probe in SI, where they are of these two quantities; else none."""
        if (self.x.name, self.y.name) != (x, y):
            return []
        return [(self.x.factor * one, self.y.factor * other) for one, other in self.curves.get(probe, {}).values()]


def load_curves(path: Path | str) -> CurveTable:
    """Read a table of curves. Raises InputMissingError, InvalidInputError with every mistake by line and column."""
    table = input_files.read_table(Path(path))
    names = [head.text for head in table.heads]
    if names[:2] != [*FIRST] or len(names) != len(FIRST) + 2:
        message = "a table of curves has the columns probe, replicate, and two quantities with their units"
        input_files.raise_problems([table.header.problem(f"{message}, such as displacement_mm,force_kN")])
    axes = _axes(table)
    points: dict[str, dict[int, list[tuple[float, float]]]] = {}
    lines: dict[tuple[str, int], list[input_files.Line]] = {}
    for row in table.rows:
        number, values = row["replicate"], []
        if not (number.text.isascii() and number.text.isdigit() and int(number.text) > 0):
            table.problems.append(number.problem(f"'{number.text}' is not a repeat number; count them as 1, 2, 3, ..."))
            continue
        for name in names[2:]:
            try:
                values.append(row[name].number())
            except ValueError as error:
                table.problems.append(row[name].problem(str(error)))
        if len(values) == len(names[2:]):
            points.setdefault(row["probe"].text, {}).setdefault(int(number.text), []).append((values[0], values[1]))
            lines.setdefault((row["probe"].text, int(number.text)), []).append(number.line)
    for probe, curves in points.items():
        for replicate, found in curves.items():
            if len(found) < 2:
                message = f"probe '{probe}', replicate {replicate} has a single point; a curve needs two or more"
                table.problems.append(table.header.problem(message))
    if not table.rows and not table.problems:
        table.problems.append(table.header.problem("the table has a header and no rows"))
    if table.problems:
        input_files.raise_problems(table.problems)
    columns = {
        probe: {number: (np.array(found)[:, 0], np.array(found)[:, 1]) for number, found in curves.items()}
        for probe, curves in points.items()
    }
    return CurveTable(axes[0], axes[1], columns, str(path), tuple(_far_points(axes, columns, lines)))


def _far_points(
    axes: Sequence[Axis],
    columns: Mapping[str, Mapping[int, tuple[Floats, Floats]]],
    lines: Mapping[tuple[str, int], Sequence[input_files.Line]],
) -> Iterator[str]:
    """Yield a warning with its line for points unlike their neighbours, and repeats that reach elsewhere."""
    for probe, curves in columns.items():
        for number, axis in enumerate(axes):
            reached = [float(np.abs(one[number]).max()) for one in curves.values()]
            least, is_chosen = LEAST_SCATTER * fmean(reached), axis is axes[0]
            far = dict(outliers.far_values(reached, least, axis.unit, is_chosen=is_chosen))
            for rank, (replicate, one) in enumerate(curves.items()):
                at = lines[probe, replicate]
                found = [(at[point], why) for point, why in outliers.spikes(one[number].tolist(), axis.unit)]
                if not found and rank in far:
                    found = [(at[int(np.abs(one[number]).argmax())], f"the largest {axis.name}: {far[rank]}")]
                for line, why in found:
                    place = f"{input_files.relative_path(line.where)}:{line.number}"
                    yield f"{place}: probe {probe}, {axis.column}, replicate {replicate}: {why}"


def _axes(table: input_files.CsvTable) -> list[Axis]:
    """Return the two quantities, after recording what is wrong with their names."""
    axes = []
    for head in table.heads[2:]:
        try:
            axes.append(Axis.read(head))
        except ValueError as error:
            table.problems.append(head.problem(str(error)))
    return axes


def compare_curves(
    probes: Mapping[str, Mapping[str, Floats]], table: CurveTable, tolerance: float | None = None
) -> Comparison:
    """Compare the columns of probes (SI, `time` among them) with measured curves.

    Inside is what lies between the smallest and the largest repeat, widened on both sides by a share `tolerance` of
    their mean: by default none, and SINGLE for a single repeat. Raises InvalidInputError for probes and columns that
    the run does not have.
    """
    rows: list[ComparisonRow] = []
    messages = [f"warning: {text}" for text in table.warnings]
    for name, curves in table.curves.items():
        if name not in probes:
            known = spelling.did_you_mean_or_list(name, probes) if probes else "the run has no probes"
            raise InvalidInputError(f"{table.source}: unknown probe '{name}', {known}")
        for axis in (table.x, table.y):
            if axis.name not in probes[name]:
                known = spelling.did_you_mean_or_list(axis.name, probes[name], "it has")
                raise InvalidInputError(f"{table.source}: probe '{name}' records no {axis.name}, {known}")
        record = probes[name]
        x, y = (record[axis.name] / axis.factor for axis in (table.x, table.y))
        least = 1e-3 * max(  # of the farthest point of all curves: less is no way in a direction
            (float(np.abs(one).max()) for one, _ in [(x, y), *curves.values()] if one.size), default=0.0
        )
        for sense, sign in (("", 1.0), (" back", -1.0)):
            found = Envelope.of(x, y, sign)
            repeats = [Envelope.of(*one, sign) for one in curves.values()]
            repeats = [one for one in repeats if one.x.max(initial=0.0) > least]
            if found.x.max(initial=0.0) > least and repeats:
                rows += _rows(name, sense, found, repeats, table, tolerance)
                messages.append(_distance(f"{name}{sense}", found, repeats, table))
        if not any(row.block == name for row in rows):
            raise InvalidInputError(f"{table.source}: the probe '{name}' goes nowhere where it was measured")
    if tolerance:
        messages.append(f"ranges of repeats are widened by {100.0 * tolerance:g} % of their mean on both sides")
    return Comparison(tuple(rows), table.source, tuple(messages))


def _rows(
    name: str, sense: str, found: Envelope, measured: list[Envelope], table: CurveTable, tolerance: float | None
) -> list[ComparisonRow]:
    """Judge the numbers of a curve in one direction."""
    end, both = _common_end(found, measured), (found, *measured)
    x, y = table.x, table.y
    numbers = [
        ("peak", y.unit, [one.peak for one in both]),
        ("at peak", x.unit, [one.place_of_peak for one in both]),
        ("area", f"{y.unit} {x.unit}", [one.area(end) for one in both]),
    ]
    if x.name != TIME:
        numbers.append(("stiffness", f"{y.unit}/{x.unit}", [one.stiffness for one in both]))
    return [_row(name, f"{quantity}{sense}", unit, values, tolerance) for quantity, unit, values in numbers]


def _common_end(found: Envelope, measured: list[Envelope]) -> float:
    """Return the place up to which all curves go."""
    return min(float(one.x[-1]) for one in (found, *measured))


def _row(name: str, quantity: str, unit: str, values: list[float], tolerance: float | None) -> ComparisonRow:
    """Judge one number of a curve, the first of `values`, by those of the repeats."""
    value, *repeats = values
    known = [one for one in repeats if math.isfinite(one)]
    if not known or not math.isfinite(value):
        return ComparisonRow(name, quantity, unit, value)
    mean, n = fmean(known), len(known)
    widened = (SINGLE if n == 1 else 0.0) if tolerance is None else tolerance
    lower, upper = min(known) - widened * abs(mean), max(known) + widened * abs(mean)
    distance = max(lower - value, value - upper, 0.0)
    return ComparisonRow(
        name,
        quantity,
        unit,
        value,
        mean,
        stdev(known) if n > 1 else math.nan,
        n,
        min(known),
        max(known),
        lower,
        upper,
        error=value - mean,
        distance=distance,
        verdict=Verdict.INSIDE if distance == 0.0 else Verdict.OUTSIDE,
    )


def _distance(name: str, found: Envelope, measured: list[Envelope], table: CurveTable) -> str:
    """Return in words how far a curve is from the mean of the repeats where all go, as a share of their peak."""
    end = _common_end(found, measured)
    places = np.linspace(max(0.0, *(float(one.x[0]) for one in (found, *measured))), end, 200)
    repeats = np.stack([np.interp(places, one.x, one.y) for one in measured])
    off = np.interp(places, found.x, found.y) - repeats.mean(axis=0)
    share = math.sqrt(float(np.mean(off**2))) / fmean(one.peak for one in measured)
    return f"{name}: {share:.1%} of the peak from the mean curve (rms), up to {end:.4g} {table.x.unit}"
