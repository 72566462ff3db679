"""Prescribed motion of the supports, and of single bodies; tables of samples over time.

The ground, walls and fixed bodies move together along one direction: with a vibration, a pulse of acceleration (sine,
half-sine, rectangular, cosine), or the samples of a table. A body of its own motion moves as the supports could, or
once from start to end along a line or about a point. It has friction and restitution at its faces as any other; forces
do not move it, and [motion] does not either. Two bodies neither of which is free do not touch.

A table of motion is CSV with the columns `time_s` and one of displacement or acceleration:

    # shaking table, run 7
    time_s,acceleration_g
    0.00,0
    0.01,0.12

Lines that begin with `#` are notes. Times increase and are not negative; the motion begins with the first of them.

Recorded accelerations are those of PEER AT2, or of text or CSV with a column of time and one of acceleration.

AT2, of the PEER and NGA data bases: four lines of head with the unit in the third and `NPTS= 4000, DT= .0050 SEC` in
the fourth (older files: `4000 0.0050 NPTS, DT`), then the samples, several a line. The format follows from this line,
not from the file's name.

Two columns, separated by blanks, commas or semicolons: times in s at a constant step, accelerations. Lines that begin
with `#` or `%` are notes. A first line with names may say the unit: g, m/s2, cm/s2 (gal).
"""

import hashlib
import math
import re
import statistics
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal, get_args

from pydantic import Field, GetCoreSchemaHandler
from pydantic_core import CoreSchema, core_schema

from blocksim.errors import BlocksimError
from blocksim.scenario import input_files, units as q
from blocksim.scenario.models.base import PATH_SCHEMA, OneOf, Table, by_kind, require_one, setting, table_path

PIECES_PER_CYCLE = 200
"""The cubic pieces are then off by less than (2 pi/200)^4/384 = 3e-9 of the amplitude."""
TIME = "time_s"
COLUMNS: dict[str, tuple[Literal["displacement", "acceleration"], float]] = {
    "displacement_m": ("displacement", 1.0),
    "displacement_mm": ("displacement", 1e-3),
    "acceleration_m_s2": ("acceleration", 1.0),
    "acceleration_g": ("acceleration", q.STANDARD_GRAVITY),
}
"""Possible names of the second column: the quantity, and its unit in SI."""
MAX_BYTES = 20_000_000
MAX_ROWS = 500_000
LEAST_ROWS = 2


BACK = "for the opposite way turn the direction by 180 deg"


class Harmonic(Table):
    """u(t) = amplitude r(t) sin(2 pi frequency (t - start) + phase) from `start` on, for `duration`.

    r rises smoothly from 0 to 1 within `ramp` and falls as smoothly at the end of a duration.
    """

    kind: Literal["harmonic"] = setting("kind of motion")
    amplitude: Annotated[float, q.Quantity(q.LENGTH, above=0.0, negative=BACK)] = setting("largest displacement")
    frequency: q.PositiveFrequency = setting("cycles per second")
    phase: q.Angle = setting("phase at the start", 0.0)
    direction: q.Angle = setting("direction of the motion, counter-clockwise from +x", 0.0)
    start: q.NonNegativeTime = setting("start of the motion; the supports rest before", 0.0)
    duration: q.PositiveTime | None = setting("duration of the motion (default: to the end)", None)
    ramp: q.PositiveTime | None = setting(
        "time of the smooth rise, and of the fall after a duration (default: one cycle)", None
    )

    @property
    def resolved_ramp(self) -> float:
        """Time (s) of the rise, as given or by default."""
        return 1.0 / self.frequency if self.ramp is None else self.ramp

    def sections(self, end: float) -> Iterator[tuple[float, float, int]]:
        """Yield start and end (s) of rise, steady part and fall, up to `end`, and the number of pieces of each."""
        ramp, cycle = self.resolved_ramp, 1.0 / self.frequency
        stop = math.inf if self.duration is None else self.start + self.duration
        breaks = [(self.start, min(cycle, ramp)), (self.start + ramp, cycle), (stop - ramp, min(cycle, ramp))]
        lasts = [begin for begin, _ in breaks[1:]] + [stop]
        for (begin, length), last in zip(breaks, lasts, strict=True):
            until = min(last, end)
            if until > begin:
                yield begin, until, math.ceil((until - begin) / length * PIECES_PER_CYCLE)

    def _check(self) -> None:
        if self.duration is not None and self.duration < 2.0 * self.resolved_ramp:
            raise q.invalid(f"{self.duration:g} s is too short for two ramps of {self.resolved_ramp:g} s", "duration")


class MotionTableError(ValueError):
    """Invalid table; the text has the place and the reason."""


@dataclass(frozen=True)
class MotionTable:
    """Samples of one quantity over time, SI (s; m or m/s²); two tables are equal if their samples are."""

    path: Path = field(compare=False)
    quantity: Literal["displacement", "acceleration"]
    times: tuple[float, ...] = field(repr=False)
    values: tuple[float, ...] = field(repr=False)
    content: bytes = field(repr=False, compare=False)

    @property
    def digest(self) -> str:
        """SHA-256 (hex) of the samples."""
        return hashlib.sha256(repr((self.quantity, self.times, self.values)).encode()).hexdigest()


def content_of(path: Path, most: int = MAX_BYTES) -> bytes:
    """Return what a file of samples holds; raises MotionTableError where it cannot be read, or has too many bytes."""
    try:
        return input_files.read_limited(path, most, links=True)
    except BlocksimError as error:
        raise MotionTableError(str(error).removeprefix(f"{path}: ")) from None


def read_motion_table(path: Path) -> MotionTable:
    """Read a table of motion; raises MotionTableError with the line of the first mistake."""
    content = content_of(path)
    name, times, values = read_series(content, COLUMNS, f"{TIME} and one of {', '.join(COLUMNS)}", MAX_ROWS)
    quantity, unit = COLUMNS[name]
    return MotionTable(path, quantity, times, tuple(unit * value for value in values), content)


def read_series(
    content: bytes, columns: Collection[str], needed: str, most: int
) -> tuple[str, tuple[float, ...], tuple[float, ...]]:
    """Read a table of times (s) and the values of one of some columns: its name, times and values, 2 to `most`.

    Raises MotionTableError with the line of the first mistake; `needed` names the columns.
    """
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise MotionTableError("not a text file in UTF-8") from None
    kept = (one for one in input_files.numbered_lines(text) if one[1].strip() and not one[1].lstrip().startswith("#"))
    rows = list(kept)
    separator = input_files.separator_of(rows[0][1]) if rows else ","
    lines = [
        (number, [input_files.QUOTED.sub(r"\1", cell.strip()) for cell in row.split(separator)]) for number, row in rows
    ]
    line, names = lines[0] if lines else (1, [])
    others = [name for name in names if name != TIME]
    if len(names) != 2 or len(others) != 1 or others[0] not in columns:
        found = q.toml(",".join(names))
        raise MotionTableError(f"line {line}: the columns are {found}; {needed} are needed")
    times: list[float] = []
    values: list[float] = []
    for line, cells in lines[1:]:
        if len(cells) != 2:
            is_unclear = separator == "," and (len(cells) > 2 or any(";" in cell for cell in cells))
            hint = "; decimals with a comma need semicolons between columns" if is_unclear else ""
            raise MotionTableError(f"line {line}: {q.toml(','.join(cells))}: a time and a value are needed{hint}")
        empty = next((name for name, cell in zip(names, cells, strict=True) if not cell), "")
        if empty:
            raise MotionTableError(f"line {line}: the {empty} is missing")
        plain = [finite_number(line, cell, input_files.plain_number(cell, separator)) for cell in cells]
        numbers = dict(zip(names, plain, strict=True))
        time, before = numbers[TIME], times[-1] if times else -math.inf
        if time < 0.0 or time <= before:
            why = "times must not be negative" if time < 0.0 else f"times must increase, the one before is {before:g} s"
            why = "the time of the line before is repeated" if time == before else why
            raise MotionTableError(f"line {line}: time {time:g} s: {why}")
        times.append(time)
        values.append(numbers[others[0]])
    if not LEAST_ROWS <= len(times) <= most:
        raise MotionTableError(f"{len(times)} lines with samples; {LEAST_ROWS} to {most} are allowed")
    return others[0], tuple(times), tuple(values)


def finite_number(line: int, text: str, digits: str) -> float:
    """Return the number that is written with these digits, `text` in the line; raises MotionTableError."""
    try:
        number = float(digits)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise MotionTableError(f"line {line}: {q.toml(text)} is not a finite number")
    return number


@dataclass(frozen=True)
class TableFile:
    """Annotation of a table: the path of its file, relative to the scenario's folder, which is the validation context.

    What `read` finds wrong becomes a pydantic error with the name of the file, and so does what is no path.
    """

    read: Callable[[Path], MotionTable]
    example: str

    def __get_pydantic_core_schema__(self, source: type, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Pass a table as it is, or read it; write its path."""

        def load(value: object, info: core_schema.ValidationInfo) -> object:
            if isinstance(value, source):
                return value
            path = table_path(value, (info.context or {}).get("folder", ""), self.example)
            try:
                return self.read(path)
            except MotionTableError as error:
                raise q.invalid(f"{path.name}: {error}") from None

        write = core_schema.plain_serializer_function_ser_schema(lambda table: table.path.as_posix())
        return core_schema.with_info_plain_validator_function(load, serialization=write)


class FromTable(Table):
    """Samples of a CSV table; see `blocksim.scenario.models.motion`.

    Displacements count from the first and are joined by a cubic spline that begins and ends at rest.
    Accelerations are joined by straight lines and integrated from rest; after the last one the velocity is constant.
    """

    kind: Literal["table"] = setting("kind of motion")
    table: Annotated[MotionTable, TableFile(read_motion_table, "shaking.csv"), PATH_SCHEMA] = setting(
        "CSV table, relative to the scenario file: time_s and displacement_m, _mm or acceleration_g, _m_s2"
    )
    scale: q.Number = setting("factor on the table's values", 1.0)
    direction: q.Angle = setting("direction of the motion, counter-clockwise from +x", 0.0)
    start: q.NonNegativeTime = setting("time at which the table's time is zero; the supports rest before", 0.0)


Shape = Literal["sine", "half-sine", "rectangular", "cosine"]
SINGLE = ("half-sine", "rectangular")  # shapes of half a cycle, which do not repeat
ABRUPT = ("rectangular", "cosine")  # shapes that begin at their largest acceleration
Acceleration = Annotated[float, q.Quantity(q.ACCELERATION, above=0.0, negative=BACK)]


class Pulse(Table):
    """Acceleration a(t) of the supports, which rest at t = `start` and before; a = 0 after the pulse.

    With the amplitude A, w = 2 pi frequency, t from the start: sine A sin wt and cosine A cos wt over `cycles`,
    half-sine A sin wt over half a cycle, rectangular A over half a cycle. The velocity that a half-sine (2 A/w), a
    rectangle (A duration) or an incomplete cycle leaves stays; a full sine leaves no velocity but the displacement
    2 pi A cycles/w^2, a full cosine neither.

    A cosine or rectangle at time zero finds blocks that have settled into it, as with `start.settle`, as far as
    friction carries its inertial force: see simulation/rest_state.py. One that begins later finds springs that carry
    none of it; run.json warns where that makes a slip too large.
    """

    kind: Literal["pulse"] = setting("kind of motion")
    shape: Annotated[Shape, OneOf(get_args(Shape))] = setting("course of the acceleration")
    amplitude: Acceleration = setting("largest acceleration; 0.5 g is written as such")
    frequency: q.PositiveFrequency | None = setting(
        "cycles per second; give this or duration (a half-sine, a rectangle: half a cycle)", None
    )
    duration: q.PositiveTime | None = setting("duration of the whole pulse", None)
    cycles: Annotated[float, q.Quantity(q.NUMBER, above=0.0, at_most=1000.0)] = setting(
        "number of cycles of a sine or cosine, at most 1000", 1.0
    )
    direction: q.Angle = setting("direction of positive acceleration, counter-clockwise from +x", 0.0)
    start: q.NonNegativeTime = setting("start of the pulse; the supports rest before", 0.0)

    @property
    def is_abrupt(self) -> bool:
        """Return True for a pulse that begins at its largest acceleration."""
        return self.shape in ABRUPT

    @property
    def resolved_cycles(self) -> float:
        """Number of cycles, one half of a half-sine or a rectangle."""
        return 0.5 if self.shape in SINGLE else self.cycles

    @property
    def resolved_duration(self) -> float:
        """Duration (s) of the whole pulse."""
        if self.duration is not None:
            return self.duration
        assert self.frequency is not None  # noqa: S101 - one of the two is there
        return self.resolved_cycles / self.frequency

    def _check(self) -> None:
        if (self.frequency is None) == (self.duration is None):
            found = "neither is" if self.frequency is None else "both are"
            raise q.invalid(f"frequency or duration is needed; {found} given", "duration")
        if self.shape in SINGLE and self.cycles != 1.0:
            message = f'shape {q.toml(self.shape)} is a single half cycle; cycles belongs to "sine" and "cosine"'
            raise q.invalid(message, "cycles")


Course = Annotated[Literal["constant", "smooth"], OneOf(("constant", "smooth"))]
MOST_BODY_TABLES = 16
"""Different tables of motion of bodies, which are copied into the folder of a run."""


class Ramp(Table):
    """Once over a distance: at constant speed, or smoothly, u = distance (10 s^3 - 15 s^4 + 6 s^5)."""

    kind: Literal["ramp"] = setting("kind of motion")
    distance: Annotated[float, q.Quantity(q.LENGTH, above=0.0, negative=BACK)] = setting("way from start to end")
    direction: q.Angle = setting("direction of the motion, counter-clockwise from +x", 0.0)
    duration: q.PositiveTime | None = setting("time from start to end; give this or speed", None)
    speed: Annotated[float, q.Quantity(q.SPEED, above=0.0, negative=BACK)] | None = setting(
        "greatest speed; give this or duration", None
    )
    course: Course = setting("constant (at once at full speed) or smooth (starts and ends without a jerk)", "constant")
    start: q.NonNegativeTime = setting("start of the motion; the body rests before", 0.0)

    @property
    def resolved_duration(self) -> float:
        """Time (s) from start to end."""
        return _duration(self, self.distance, self.speed)

    def _check(self) -> None:
        require_one("give duration or speed", duration=self.duration, speed=self.speed)


class Rotation(Table):
    """Once by an angle about a point, at constant spin or smoothly as a ramp."""

    kind: Literal["rotation"] = setting("kind of motion")
    angle: q.Angle = setting("turn from start to end, counter-clockwise positive")
    about: tuple[q.Length, q.Length] | None = setting(
        "[x, y] of the point that it turns about (default: the centre of the body)", None
    )
    duration: q.PositiveTime | None = setting("time from start to end; give this or spin", None)
    spin: q.PositiveSpin | None = setting("greatest angular velocity; give this or duration", None)
    course: Course = setting("constant (at once at full spin) or smooth (starts and ends without a jerk)", "constant")
    start: q.NonNegativeTime = setting("start of the motion; the body rests before", 0.0)

    @property
    def resolved_duration(self) -> float:
        """Time (s) from start to end."""
        return _duration(self, self.angle, self.spin)

    def _check(self) -> None:
        require_one("give duration or spin", duration=self.duration, spin=self.spin)
        if self.angle == 0.0:
            raise q.invalid("a turn by 0 is none", "angle")


def _duration(moved: Ramp | Rotation, way: float, greatest: float | None) -> float:
    """Return the time (s) of a way (m or rad), as given or from its greatest rate."""
    steepest = 15.0 / 8.0 if moved.course == "smooth" else 1.0  # greatest rate over its mean
    return abs(way) / (greatest or math.nan) * steepest if moved.duration is None else moved.duration


AnyDrive = Annotated[Harmonic | FromTable | Ramp | Rotation, Field(discriminator="kind")]
"""Any prescribed motion of a body, distinguished by its `kind`."""
OWN_DRIVES: dict[str, type[Table]] = {"ramp": Ramp, "rotation": Rotation}
DRIVES: dict[str, type[Table]] = {"harmonic": Harmonic, "table": FromTable, **OWN_DRIVES}
"""Class by kind, as written in a scenario."""


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
HEAD_LINES = 8  # lines among which the one with NPTS and DT is looked for
GAP = 1.5  # steps between two samples above which some are missing
UNEVEN = 0.25  # steps by which a time may be off from a constant step: files round them
Line = tuple[int, str]  # number (from 1) and text of a line of the file


@dataclass(frozen=True)
class RecordTable(MotionTable):
    """Samples of acceleration at a constant step, in m/s² where the file says its unit, otherwise as in the file."""

    unit: Unit | None = field(kw_only=True)  # as the file says


def read_record(path: Path) -> RecordTable:
    """Read an accelerogram; raises MotionTableError with the line of the first mistake."""
    content = content_of(path)
    lines = [*input_files.numbered_lines(content.decode("utf-8-sig", errors="replace"))]
    sizes = (_AT2.search(line) or _OLD_AT2.search(line) for _, line in lines[:HEAD_LINES])
    head = next(((number, size) for number, size in enumerate(sizes, start=1) if size), None)
    said, times, values = _two_columns(lines) if head is None else _at2(lines, *head)
    unit = next((unit for unit, word in _UNIT_WORDS if word.search(said)), None)
    factor = 1.0 if unit is None else UNITS[unit]
    return RecordTable(path, "acceleration", tuple(times), tuple(factor * one for one in values), content, unit=unit)


def _at2(lines: Sequence[Line], head: int, found: re.Match[str]) -> tuple[str, Iterable[float], list[float]]:
    """Return where the unit stands, times and values of an AT2 file, in whose line `head` number and step stand."""
    before = lines[: head - 1]
    other = next((line for line in before if _OTHER.search(line[1])), None)
    if other is not None:
        raise MotionTableError(f"line {other[0]}: {q.toml(other[1].strip())}: an acceleration is needed")
    count, step = int(found[1]), _number(head, found[2])
    if step <= 0.0:
        raise MotionTableError(f"line {head}: step {found[2]} s: it must be above 0")
    values = [_number(number, word) for number, line in lines[head:] for word in line.split()]
    if len(values) != count:
        last = max((number for number, line in lines if line.strip()), default=head)
        message = f"line {last}: the file ends after {len(values)} samples; line {head} has NPTS = {count}"
        raise MotionTableError(message)
    _check_count(count)
    units = (_IN_UNITS.search(line) for _, line in before)
    said = next((one[1] for one in units if one is not None and one[1]), "")
    return said, (number * step for number in range(count)), values


def _two_columns(lines: Sequence[Line]) -> tuple[str, Iterable[float], list[float]]:
    """Return where the unit stands, times and values of a file with two columns."""
    kept = [line for line in lines if line[1].strip() and line[1].lstrip()[0] not in "#%"]
    said, is_named = _second_name(kept[0]) if kept else ("", False)
    rows = []
    for number, text in kept[is_named:]:
        cells = [input_files.plain_number(cell.strip(), ";") for cell in text.strip(" \t;").split(";")]
        if len(cells) != 2:  # not separated by semicolons, with which numbers may have decimal commas
            cells = re.findall(r"[^,;\s]+", text)
        if len(cells) != 2:  # as in 0,01 0,12 or 0,01,0,12
            by_others = re.findall(r"[^;\s]+", text)
            is_pair = len(by_others) == 2 and 0 < text.count(",") <= 2
            has_commas = is_pair or (len(by_others) == 1 and text.count(",") == 1 + 2)
            hint = "; decimals with a comma need semicolons between columns" if has_commas else ""
            why = f"a time and an acceleration are needed{hint}"
            raise MotionTableError(f"line {number}: {q.toml(text.strip())}: {why}")
        rows.append((number, _number(number, cells[0]), _number(number, cells[1])))
    _check_count(len(rows))
    times = [time for _, time, _ in rows]
    step = (times[-1] - times[0]) / (len(times) - 1)
    _check_steps([number for number, *_ in rows], times, step)
    return said, (times[0] + place * step for place in range(len(times))), [value for *_, value in rows]


def _second_name(line: Line) -> tuple[str, bool]:
    """Return the name of the second column, which may say the unit, and whether the line names columns at all."""
    try:
        float(re.findall(r"[^,;\s]+", line[1])[0])
    except (ValueError, IndexError):
        pass
    else:
        return "", False
    text = line[1].strip()
    if not re.match(r"\W*t", text, re.IGNORECASE):
        raise MotionTableError(f"line {line[0]}: {q.toml(text)}: neither numbers nor columns of time and acceleration")
    if re.match(r"[^,;]*(?<![a-z])ms(?![a-z/])", text, re.IGNORECASE):
        raise MotionTableError(f"line {line[0]}: {q.toml(text)}: times in s are needed")
    first = re.split(r"[,;]", text, maxsplit=1) if re.search(r"[,;]", text) else text.split(maxsplit=1)
    return first[-1], True


def _check_count(count: int) -> None:
    """Raise MotionTableError for fewer samples than a motion has, or too many."""
    if not LEAST_ROWS <= count <= MAX_ROWS:
        raise MotionTableError(f"{count} samples; {LEAST_ROWS} to {MAX_ROWS} are allowed")


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
        raise MotionTableError(f"line {lines[place]}: time {times[place]:g} s: {why}")


def _number(line: int, text: str) -> float:
    """Return a number of the file, also with the D of Fortran in its exponent."""
    return finite_number(line, text, re.sub(r"(?<=[0-9.])[dD](?=[+-]?\d)", "E", text))


Baseline = Literal["rest", "parabolic", "none"]


class Record(Table):
    """A recorded accelerogram, corrected, scaled, joined by straight lines and integrated from rest.

    The order is: unit, baseline, then `scale`, or the factor that makes the largest acceleration `pga`. After the last
    sample the velocity is constant.
    """

    kind: Literal["record"] = setting("kind of motion")
    table: Annotated[RecordTable, TableFile(read_record, "record.AT2"), PATH_SCHEMA] = setting(
        "accelerogram, relative to the scenario file: PEER AT2, or text or CSV of time and value"
    )
    unit: Annotated[Unit, OneOf(get_args(Unit))] | None = setting(
        "unit of the accelerations, g, m/s^2 or cm/s^2, where the file does not say it", None
    )
    scale: q.Number = setting("factor on the accelerations; give this or pga", 1.0)
    pga: Acceleration | None = setting("largest acceleration that the record is scaled to", None)
    baseline: Annotated[Baseline, OneOf(get_args(Baseline))] = setting(
        "correction of the accelerations: rest subtracts the straight line with which the supports end at "
        "rest where they began, parabolic the parabola that makes the velocities least in the mean square, none",
        "rest",
    )
    direction: q.Angle = setting("direction of the motion, counter-clockwise from +x", 0.0)
    start: q.NonNegativeTime = setting("time at which the record's time is zero; the supports rest before", 0.0)

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


AnyMotion = Annotated[Harmonic | FromTable | Pulse | Record, Field(discriminator="kind")]
"""Any prescribed motion, distinguished by its `kind`."""
MOTIONS: dict[str, type[Table]] = by_kind(AnyMotion)  # class by kind, as written in a scenario
TABLED = (FromTable, Record)  # those that read a file, named by the key `table`
