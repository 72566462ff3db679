"""Recorded accelerations of the supports: PEER AT2, and text or CSV with a column of time and one of acceleration.

AT2, of the PEER and NGA data bases: four lines of head with the unit in the third and `NPTS= 4000, DT= .0050 SEC` in
the fourth (older files: `4000 0.0050 NPTS, DT`), then the samples, several a line. The format follows from this line,
not from the file's name.

Two columns, separated by blanks, commas or semicolons: times in s at a constant step, accelerations. Lines that begin
with `#` or `%` are notes. A first line with names may say the unit: g, m/s2, cm/s2 (gal).

"""

import re
import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal, get_args

from pydantic import Field

from blocksim.scenario import units as q
from blocksim.scenario.models import base, motion

Unit = Literal["g", "m/s^2", "cm/s^2"]
UNITS: dict[Unit, float] = {"g": q.STANDARD_GRAVITY, "m/s^2": 1.0, "cm/s^2": 0.01}
"""Units of acceleration in SI."""
_PER_S2 = r"(?:[/_ ]?\s?s(?:ec)?\s?(?:2|\^2|²|\*\*2|[/_]s(?:ec)?\b))"
_UNIT_WORDS: tuple[tuple[Unit, re.Pattern[str]], ...] = (
    ("cm/s^2", re.compile(rf"(?<![a-z])(?:cm{_PER_S2}|gals?(?![a-z]))", re.IGNORECASE)),
    ("m/s^2", re.compile(rf"(?<![a-z])m{_PER_S2}", re.IGNORECASE)),
    ("g", re.compile(r"(?<![a-z])g(?![a-z0-9])", re.IGNORECASE)),
)
_AT2 = re.compile(r"NPTS\s*=\s*(\d+)\s*,?\s*DT\s*=\s*([0-9.]+(?:[ED][+-]?\d+)?)", re.IGNORECASE)
_OLD_AT2 = re.compile(r"^\s*(\d+)\s+([0-9.]+(?:[ED][+-]?\d+)?)\s+NPTS\s*,?\s*DT", re.IGNORECASE)
_OTHER = re.compile(r"\b(velocity|displacement)\b", re.IGNORECASE)
_IN_UNITS = re.compile(r"\bUNITS?\b(?:\s+OF|\s*[:=])?\s*(.*)$", re.IGNORECASE)
HEAD_LINES = 8
"""Lines among which the one with NPTS and DT is looked for."""
GAP = 1.5
"""Steps between two samples above which some are missing."""
UNEVEN = 0.25
"""Steps by which a time may be off from a constant step: files round them."""
Line = tuple[int, str]
"""Number (from 1) and text of a line of the file."""


@dataclass(frozen=True)
class RecordTable(motion.MotionTable):
    """Samples of acceleration at a constant step, in m/s² where the file says its unit, otherwise as in the file."""

    unit: Unit | None = field(kw_only=True)  # as the file says


def read_record(path: Path) -> RecordTable:
    """Read an accelerogram; raises MotionTableError with the line of the first mistake."""
    content = motion.content_of(path)
    text = content.decode("utf-8-sig", errors="replace").replace("\r\n", "\n").replace("\r", "\n")
    lines = [*enumerate(text.split("\n"), start=1)]
    sizes = (_AT2.search(line) or _OLD_AT2.search(line) for _, line in lines[:HEAD_LINES])
    head = next(((number, size) for number, size in enumerate(sizes, start=1) if size), None)
    unit, times, values = _two_columns(lines) if head is None else _at2(lines, *head)
    factor = 1.0 if unit is None else UNITS[unit]
    return RecordTable(path, "acceleration", tuple(times), tuple(factor * one for one in values), content, unit=unit)


def _at2(lines: Sequence[Line], head: int, found: re.Match[str]) -> tuple[Unit | None, Iterable[float], list[float]]:
    """Return unit, times and values of an AT2 file, in whose line `head` number and step stand."""
    before = lines[: head - 1]
    other = next((line for line in before if _OTHER.search(line[1])), None)
    if other is not None:
        raise motion.MotionTableError(f"line {other[0]}: {q.toml(other[1].strip())}: an acceleration is needed")
    count, step = int(found[1]), _number(head, found[2])
    if step <= 0.0:
        raise motion.MotionTableError(f"line {head}: step {found[2]} s: it must be above 0")
    values = [_number(number, word) for number, line in lines[head:] for word in line.split()]
    if len(values) != count:
        last = max((number for number, line in lines if line.strip()), default=head)
        message = f"line {last}: the file ends after {len(values)} samples; line {head} has NPTS = {count}"
        raise motion.MotionTableError(message)
    _check_count(count)
    said = (_IN_UNITS.search(line) for _, line in before)
    unit = next((_unit_in(one[1]) for one in said if one is not None and one[1]), None)
    return unit, (number * step for number in range(count)), values


def _two_columns(lines: Sequence[Line]) -> tuple[Unit | None, Iterable[float], list[float]]:
    """Return unit, times and values of a file with two columns."""
    kept = [line for line in lines if line[1].strip() and line[1].lstrip()[0] not in "#%"]
    unit, is_named = _named_unit(kept[0]) if kept else (None, False)
    rows = []
    for number, text in kept[is_named:]:
        cells = re.findall(r"[^,;\s]+", text)
        if len(cells) != 2:  # as in 0,01;0,12 or 0,01,0,12, whose numbers have a comma where a point belongs
            by_others = re.findall(r"[^;\s]+", text)
            is_pair = len(by_others) == 2 and 0 < text.count(",") <= 2
            has_commas = is_pair or (len(by_others) == 1 and text.count(",") == 1 + 2)
            hint = "; decimals are written with a point" if has_commas else ""
            why = f"a time and an acceleration are needed{hint}"
            raise motion.MotionTableError(f"line {number}: {q.toml(text.strip())}: {why}")
        rows.append((number, _number(number, cells[0]), _number(number, cells[1])))
    _check_count(len(rows))
    times = [time for _, time, _ in rows]
    step = (times[-1] - times[0]) / (len(times) - 1)
    _check_steps([number for number, *_ in rows], times, step)
    return unit, (times[0] + place * step for place in range(len(times))), [value for *_, value in rows]


def _named_unit(line: Line) -> tuple[Unit | None, bool]:
    """Return the unit that the first line says, and whether it names columns at all."""
    try:
        float(re.findall(r"[^,;\s]+", line[1])[0])
    except (ValueError, IndexError):
        pass
    else:
        return None, False
    text = line[1].strip()
    if not re.match(r"\W*t", text, re.IGNORECASE):
        message = f"line {line[0]}: {q.toml(text)}: neither numbers nor columns of time and acceleration"
        raise motion.MotionTableError(message)
    if re.match(r"[^,;]*(?<![a-z])ms(?![a-z/])", text, re.IGNORECASE):
        raise motion.MotionTableError(f"line {line[0]}: {q.toml(text)}: times in s are needed")
    first = re.split(r"[,;]", text, maxsplit=1) if re.search(r"[,;]", text) else text.split(maxsplit=1)
    return _unit_in(first[-1]), True


def _unit_in(text: str) -> Unit | None:
    return next((unit for unit, word in _UNIT_WORDS if word.search(text)), None)


def _check_count(count: int) -> None:
    if not motion.LEAST_ROWS <= count <= motion.MAX_ROWS:
        raise motion.MotionTableError(f"{count} samples; {motion.LEAST_ROWS} to {motion.MAX_ROWS} are allowed")


def _check_steps(lines: Sequence[int], times: Sequence[float], mean: float) -> None:
    """Raise MotionTableError at the first time that does not increase, after a gap, or off a constant step (s)."""
    steps = [after - before for before, after in pairwise(times)]
    usual = statistics.median(steps)
    back = next((number for number, step in enumerate(steps, start=1) if step <= 0.0), 0)
    gap = next((number for number, step in enumerate(steps, start=1) if step > GAP * usual), 0)
    uneven = (number for number, time in enumerate(times) if abs(time - times[0] - number * mean) > UNEVEN * mean)
    place, why = 0, ""
    if times[0] < 0.0:
        why = "times must increase from 0 or later"
    elif back:  # before gaps: where times are repeated, the usual step means nothing
        place, before = back, f"line {lines[back - 1]}"
        why = f"times must increase, {before} has {times[back - 1]:g} s"
        why = why if steps[back - 1] < 0.0 else f"the time of {before} is repeated"
    elif max(steps) > GAP * usual:
        place, why = gap, f"a gap of {steps[gap - 1]:g} s, the step is {usual:g} s"
    elif (place := next(uneven, 0)) > 0:
        why = f'not at a constant step of {usual:g} s; a motion of kind "table" takes any steps'
    if why:
        raise motion.MotionTableError(f"line {lines[place]}: time {times[place]:g} s: {why}")


def _number(line: int, text: str) -> float:
    """Return a number of the file, also with the D of Fortran in its exponent."""
    return motion.finite_number(line, text, re.sub(r"(?<=[0-9.])[dD](?=[+-]?\d)", "E", text))


Baseline = Literal["rest", "parabolic", "none"]


class Record(base.Table):
    """A recorded accelerogram, corrected, scaled, joined by straight lines and integrated from rest.

    The order is: unit, baseline, then `scale`, or the factor that makes the largest acceleration `pga`. After the last
    sample the velocity is constant.
    """

    kind: Literal["record"] = Field(description="kind of motion")
    table: Annotated[RecordTable, motion.TableFile(read_record, "record.AT2")] = Field(
        description="accelerogram, relative to the scenario file: PEER AT2, or text or CSV of time and value"
    )
    unit: Annotated[Unit, base.OneOf(get_args(Unit))] | None = Field(
        default=None, description="unit of the accelerations, g, m/s^2 or cm/s^2, where the file does not say it"
    )
    scale: q.Number = Field(default=1.0, description="factor on the accelerations; give this or pga")
    pga: motion.Acceleration | None = Field(
        default=None, description="largest acceleration that the record is scaled to"
    )
    baseline: Annotated[Baseline, base.OneOf(get_args(Baseline))] = Field(
        default="rest",
        description="correction of the accelerations: rest subtracts the straight line with which the supports end at "
        "rest where they began, parabolic the parabola that makes the velocities least in the mean square, none",
    )
    direction: q.Angle = Field(default=0.0, description="direction of the motion, counter-clockwise from +x")
    start: q.NonNegativeTime = Field(
        default=0.0, description="time at which the record's time is zero; the supports rest before"
    )

    @property
    def factor(self) -> float:
        """Factor from the table's values to m/s²."""
        return UNITS[self.unit] if self.table.unit is None and self.unit is not None else 1.0

    def _check(self) -> None:
        name, said = self.table.path.name, self.table.unit
        if said is None and self.unit is None:
            raise q.invalid(f'{name} does not say its unit; write unit = "g", "m/s^2" or "cm/s^2"', "table")
        if said is not None and self.unit not in (None, said):
            raise q.invalid(f"{q.toml(self.unit)}: {name} says {said}", "unit")
        if self.pga is not None and self.scale != 1.0:
            raise q.invalid("scale and pga are both given; one of them decides the accelerations", "pga")
        if self.pga is not None and not any(self.table.values):
            raise q.invalid(f"{self.table.path.name} is zero throughout; it cannot be scaled", "pga")


AnyMotion = Annotated[motion.Harmonic | motion.FromTable | motion.Pulse | Record, Field(discriminator="kind")]
"""Any prescribed motion, distinguished by its `kind`."""
MOTIONS: dict[str, type[base.Table]] = base.by_kind(AnyMotion)
"""Class by kind, as written in a scenario."""
TABLED = (motion.FromTable, Record)
"""Those that read a file, named by the key `table`."""
