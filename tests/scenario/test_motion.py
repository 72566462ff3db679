"""The motion of the supports over time, from harmonics, tables, pulses and records, against closed forms and scipy."""

import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicSpline

from blocksim.scenario import Model, Scenario, load_scenario, scenario_from_mapping, scenario_to_toml
from blocksim.scenario.models.motion import FromTable, MotionTableError, Record, read_motion_table, read_record
from blocksim.scenario.motion import (
    Floats,
    MotionPieces,
    correct_baseline,
    displacement_and_velocity,
    motion_direction,
    motion_peaks,
    motion_pieces,
    spline_slopes,
)
from tests.golden import Golden
from tests.scenario.conftest import data_of

END = 3.0
G = 9.80665


def scenario(motion: dict[str, Any] | None, folder: Path = Path(), **tables: object) -> Scenario:
    data = data_of(time={"end": END}, **tables)
    return scenario_from_mapping(data if motion is None else {**data, "motion": motion}, folder)


def from_table(folder: Path, column: str, rows: list[tuple[float, float]], **keys: object) -> MotionPieces:
    lines = [f"time_s,{column}", *(f"{time!r},{value!r}" for time, value in rows)]
    (folder / "m.csv").write_text("\n".join(lines))
    return motion_pieces(scenario({"kind": "table", "table": "m.csv", **keys}, folder))


def assert_smooth(pieces: MotionPieces) -> None:
    """Check that every piece ends where the next begins, with its velocity, and that the first begins at rest."""
    scale = max(1e-3, float(np.abs(pieces.coefficients[:, :2]).max()))
    s = np.diff(pieces.times)
    assert s.min() > 0
    assert pieces.times[0] == 0.0
    assert pieces.times[-1] >= 1.01 * END
    c0, c1, c2, c3 = pieces.coefficients.T
    assert (c0[0], c1[0]) == (0.0, 0.0)
    np.testing.assert_allclose((c0 + s * (c1 + s * (c2 + s * c3)))[:-1], c0[1:], rtol=0, atol=1e-12 * scale)
    np.testing.assert_allclose((c1 + s * (2 * c2 + s * 3 * c3))[:-1], c1[1:], rtol=0, atol=1e-9 * scale)


def at(pieces: MotionPieces, *times: float) -> tuple[Floats, Floats]:
    return displacement_and_velocity(pieces, np.array(times))


HARMONIC = {"kind": "harmonic", "amplitude": "10 mm", "frequency": "2 Hz"}


@pytest.mark.parametrize(("phase", "start"), [(0.0, 0.0), (1.0, 0.7)])
def test_a_harmonic_motion_is_a_sine_after_its_ramp(phase: float, start: float) -> None:
    pieces = motion_pieces(scenario({**HARMONIC, "phase": f"{phase!r} rad", "start": start}))
    assert_smooth(pieces)
    times = np.linspace(start + 0.5, END, 1003)
    displacement, velocity = displacement_and_velocity(pieces, times)
    angle = 4 * math.pi * (times - start) + phase
    np.testing.assert_allclose(displacement, 0.01 * np.sin(angle), rtol=0, atol=3e-9 * 0.01)
    np.testing.assert_allclose(velocity, 0.01 * 4 * math.pi * np.cos(angle), rtol=0, atol=1e-6 * 0.13)


def test_before_its_start_and_after_its_duration_a_harmonic_motion_rests() -> None:
    keys = {"start": 0.5, "duration": "1.5 s", "ramp": "0.4 s", "phase": "40 deg"}
    pieces = motion_pieces(scenario({**HARMONIC, **keys}))
    assert_smooth(pieces)
    displacement, velocity = at(pieces, 0.0, 0.3, 0.5, 2.0, 2.5, END)
    assert np.abs(displacement).max() < 1e-12
    assert np.abs(velocity).max() < 1e-10
    assert list(pieces.coefficients[-1][1:]) == [0.0, 0.0, 0.0]
    middle, _ = at(pieces, 1.25)  # between the ramps
    assert middle[0] == pytest.approx(0.01 * math.sin(4 * math.pi * 0.75 + math.radians(40)), rel=1e-6)


def test_the_ramp_is_the_quintic_step() -> None:
    pieces = motion_pieces(scenario({**HARMONIC, "frequency": 0.01, "phase": "90 deg", "ramp": "1 s"}))
    shares = np.array([0.1, 0.25, 0.5, 0.9])
    expected = 0.01 * (10 * shares**3 - 15 * shares**4 + 6 * shares**5) * np.cos(2 * math.pi * 0.01 * shares)
    np.testing.assert_allclose(at(pieces, *shares)[0], expected, rtol=0, atol=1e-10)


@pytest.mark.parametrize("keys", [{"duration": "1 s"}, {"duration": "0.7 s", "ramp": "0.35 s"}, {"start": 5}])
def test_limits_of_ramp_duration_and_start(keys: dict[str, object]) -> None:
    assert_smooth(motion_pieces(scenario({**HARMONIC, **keys})))


def test_the_direction_is_a_unit_vector_and_without_a_motion_there_are_no_pieces() -> None:
    for angle, expected in (("0 deg", (1, 0)), ("90 deg", (0, 1)), ("-30 deg", (3**0.5 / 2, -0.5))):
        assert motion_direction(scenario({**HARMONIC, "direction": angle})) == pytest.approx(expected, abs=1e-15)
    pieces = motion_pieces(scenario(None))
    assert (pieces.times.shape, pieces.coefficients.shape) == ((1,), (0, 4))
    assert motion_direction(scenario(None)) == (1.0, 0.0)
    assert [float(value[0]) for value in at(pieces, 1.0)] == [0.0, 0.0]


def test_a_triangular_pulse_of_acceleration(tmp_path: Path) -> None:
    # 0 to 2 m/s2 and back within 1 s each: velocity 1 m/s after the rise, 2 m/s after all, then it stays
    pieces = from_table(tmp_path, "acceleration_m_s2", [(0, 0), (1, 2), (2, 0)])
    assert_smooth(pieces)
    displacement, velocity = at(pieces, 0.5, 1.0, 2.0, 3.0)
    assert velocity == pytest.approx([0.25, 1.0, 2.0, 2.0])
    # t^3/3 at first; by symmetry about t = 1 half of 2 s at 2 m/s by t = 2, then 2 m/s
    assert displacement == pytest.approx([0.125 / 3, 1 / 3, 2.0, 4.0])
    assert pieces.final_velocity == pytest.approx(2.0)


@pytest.mark.parametrize(("column", "unit"), [("acceleration_m_s2", 1.0), ("acceleration_g", G)])
def test_start_scale_and_unit_of_accelerations(tmp_path: Path, column: str, unit: float) -> None:
    pieces = from_table(tmp_path, column, [(0.25, 1), (1.25, 1)], start=0.5, scale=-0.5)
    assert_smooth(pieces)
    _, velocity = at(pieces, 0.75, 1.25, 1.75, 2.5)
    assert velocity == pytest.approx([0.0, -0.25 * unit, -0.5 * unit, -0.5 * unit], abs=1e-12)


@pytest.mark.parametrize(("column", "unit"), [("displacement_m", 1.0), ("displacement_mm", 1e-3)])
def test_displacements_count_from_the_first_and_rest_at_both_ends(tmp_path: Path, column: str, unit: float) -> None:
    pieces = from_table(tmp_path, column, [(0.5, 7), (1.0, 9), (1.25, 8), (2, 8)], scale=2)
    assert_smooth(pieces)
    displacement, velocity = at(pieces, 0.0, 0.5, 1.0, 1.25, 2.0, END)
    assert displacement == pytest.approx(2 * unit * np.array([0, 0, 2, 1, 1, 1]), abs=1e-12 * unit)
    assert velocity[[0, 1, 4, 5]] == pytest.approx(0.0, abs=1e-12)
    assert list(pieces.coefficients[-1][1:]) == [0.0, 0.0, 0.0]
    assert pieces.final_velocity == 0.0


@given(st.lists(st.tuples(st.floats(0.01, 1), st.floats(-5, 5)), min_size=2, max_size=12))
def test_slopes_are_those_of_the_clamped_spline(steps: list[tuple[float, float]]) -> None:
    x, y = np.cumsum([step for step, _ in steps]), np.array([value for _, value in steps])
    expected = CubicSpline(x, y, bc_type="clamped")(x, 1)
    np.testing.assert_allclose(spline_slopes(x, y), expected, rtol=1e-9, atol=1e-9 * (1 + np.abs(expected).max()))


A, F = 4.0, 2.0
W = 2 * math.pi * F


def pulse(shape: str, **keys: object) -> MotionPieces:
    where = keys if "duration" in keys else {"frequency": F, **keys}
    pieces = motion_pieces(scenario({"kind": "pulse", "shape": shape, "amplitude": A, **where}))
    assert_smooth(pieces)
    return pieces


@pytest.mark.parametrize(
    ("shape", "keys", "length", "speed", "moved"),
    [
        ("sine", {}, 1 / F, 0.0, A / W / F),
        ("sine", {"cycles": 3}, 3 / F, 0.0, 3 * A / W / F),
        ("cosine", {"cycles": 2}, 2 / F, 0.0, 0.0),
        ("cosine", {"cycles": 0.25}, 0.25 / F, A / W, A / W**2),
        ("half-sine", {}, 0.5 / F, 2 * A / W, A / W * 0.5 / F),
        ("half-sine", {"duration": 0.25}, 0.25, 2 * A / W, A / W * 0.25),
        ("rectangular", {"duration": 0.1}, 0.1, 0.1 * A, 0.005 * A),
    ],
)
def test_what_a_pulse_leaves(shape: str, keys: dict[str, object], length: float, speed: float, moved: float) -> None:
    displacement, velocity = at(pulse(shape, start=0.3, **keys), 0.3, 0.3 + length, 1.3 + length)
    np.testing.assert_allclose(velocity, [0, speed, speed], rtol=1e-12, atol=1e-12 * A / W)
    np.testing.assert_allclose(displacement, [0, moved, moved + speed], rtol=1e-12, atol=1e-12 * A / W**2)


def test_the_bound_of_the_cubic_pieces_holds_between_their_joints() -> None:
    t = np.linspace(0, 1 / F, 3001)
    sine, cosine = at(pulse("sine"), *t)[0], at(pulse("cosine"), *t)[0]
    bound = (2 * math.pi / 1000) ** 4 / 384 * A / W**2 * 1.01
    assert np.abs(sine - A / W * (t - np.sin(W * t) / W)).max() < bound
    assert np.abs(cosine - A / W**2 * (1 - np.cos(W * t))).max() < bound
    push = {"kind": "pulse", "shape": "rectangular", "amplitude": "0.5 g", "duration": "100 ms"}
    assert motion_pieces(scenario(push)).final_velocity == pytest.approx(0.05 * G, rel=1e-14)


def recorded(folder: Path, rows: np.ndarray, **keys: object) -> MotionPieces:
    lines = ["time_s,acceleration_m_s2", *(f"{time!r},{value!r}" for time, value in rows.tolist())]
    (folder / "r.csv").write_text("\n".join(lines))
    return motion_pieces(scenario({"kind": "record", "table": "r.csv", **keys}, folder))


@pytest.fixture
def rows() -> np.ndarray:
    t = 0.01 * np.arange(201)
    noise = np.random.default_rng(5).standard_normal(t.size)
    return np.stack([t, noise + 0.3 - 0.2 * t], axis=1)


def test_a_record_is_integrated_exactly_between_its_samples(tmp_path: Path, rows: np.ndarray) -> None:
    pieces = recorded(tmp_path, rows, baseline="none", scale=0.5)
    assert_smooth(pieces)
    fine = np.linspace(0, 2, 40001)  # the samples are among them, so that the trapezoids lose nothing of velocity
    velocity = cumulative_trapezoid(0.5 * np.interp(fine, *rows.T), fine, initial=0)
    np.testing.assert_allclose(at(pieces, *fine)[1], velocity, rtol=0, atol=1e-12)
    np.testing.assert_allclose(at(pieces, *fine)[0], cumulative_trapezoid(velocity, fine, initial=0), atol=1e-8)
    assert pieces.final_velocity == pytest.approx(velocity[-1])


def test_with_the_baseline_rest_the_supports_end_at_rest_where_they_began(tmp_path: Path, rows: np.ndarray) -> None:
    pieces = recorded(tmp_path, rows, start=0.25)
    assert_smooth(pieces)
    displacement, velocity = at(pieces, 2.25, 3.0)
    assert np.abs(displacement).max() < 1e-13
    assert np.abs(velocity).max() < 1e-13
    removed = rows[:, 1] - correct_baseline(rows[:, 0], rows[:, 1], "rest")
    assert np.abs(np.diff(removed, 2)).max() < 1e-12  # a straight line
    scaled = recorded(tmp_path, rows, pga="0.4 g")  # to the largest acceleration after the correction
    assert np.abs(2 * scaled.coefficients[:, 2]).max() == pytest.approx(0.4 * G, rel=1e-12)


def test_the_parabolic_baseline_makes_the_velocities_least(rows: np.ndarray) -> None:
    t, before = rows.T
    after = correct_baseline(t, before, "parabolic")
    removed = before - after
    assert np.abs(np.diff(removed, 3)).max() < 1e-12  # a parabola

    def energy(acceleration: np.ndarray) -> float:
        return float((cumulative_trapezoid(acceleration, t, initial=0) ** 2).sum())

    least = energy(after)
    assert least < 0.5 * energy(before)
    for term in (np.ones_like(t), t, t * t):
        assert min(energy(after + 1e-2 * term), energy(after - 1e-2 * term)) > least


def test_peaks_of_a_cosine_pulse_until_any_end() -> None:
    amplitude, speed = 3.0, 4 * math.pi
    motion = {"kind": "pulse", "shape": "cosine", "amplitude": amplitude, "frequency": "2 Hz", "start": 0.25}
    pieces = motion_pieces(scenario(motion))
    whole = motion_peaks(pieces, END)
    assert whole.acceleration.value == pytest.approx(amplitude, rel=1e-5)
    assert whole.velocity == pytest.approx((amplitude / speed, 0.375), rel=1e-5)
    assert whole.displacement == pytest.approx((2 * amplitude / speed**2, 0.5), rel=1e-5)
    assert whole.final_velocity == pytest.approx(0.0, abs=1e-12)
    early = motion_peaks(pieces, 0.3125)  # an eighth of the cycle
    assert early.velocity == pytest.approx((amplitude / speed * math.sin(math.pi / 4), 0.3125), rel=1e-5)
    assert early.final_velocity == early.velocity.value
    # u = s^3 - 1.5 s^2 on 0..2: u' = 3 s (s - 1) is least, -0.75, at 0.5; u is least, -0.5, at 1 and 2 at the end
    coarse = MotionPieces(np.array([0.0, 2.0]), np.array([[0.0, 0.0, -1.5, 1.0]]), 6.0)
    assert motion_peaks(coarse, 1.4).displacement == pytest.approx((0.5, 1.0))
    assert motion_peaks(coarse, 1.0).velocity == pytest.approx((0.75, 0.5))
    assert motion_peaks(coarse, 2.0).acceleration == pytest.approx((9.0, 2.0))


AT2 = """\
PEER NGA STRONG MOTION DATABASE RECORD
Somewhere, 1/17/1994, Station, 090
ACCELERATION TIME SERIES IN UNITS OF {unit}
{size}
  .1000000E-01 -.2000000E-01  .3000000D-01
 -.4000000E-01
"""
NEW, OLD = "NPTS=   4, DT=   .0050 SEC,", "    4   0.0050    NPTS, DT"


def written(folder: Path, text: str, name: str = "r.txt") -> Path:
    path = folder / name
    path.write_bytes(text.encode())
    return path


@pytest.mark.parametrize(
    ("size", "unit", "factor"),
    [(NEW, "G", G), (OLD, "CM/S/S", 0.01), ("NPTS= 4,DT= 5.0E-3 SEC", "M/SEC/SEC", 1.0), (NEW, "cm/sec2", 0.01)],
)
def test_at2_of_any_age_and_unit(tmp_path: Path, size: str, unit: str, factor: float) -> None:
    found = read_record(written(tmp_path, AT2.format(unit=unit, size=size)))
    assert found.times == pytest.approx((0.0, 0.005, 0.01, 0.015), abs=1e-15)
    assert found.values == pytest.approx([factor * one for one in (0.01, -0.02, 0.03, -0.04)], rel=1e-14)


HEADS = """time_s,acceleration_g|Time (s), Acceleration (cm/s2)|t [s];a [m/s^2]|time\tgal|time_s,acceleration_m_s2
% no names|time,acceleration"""


def test_two_columns_say_their_unit_in_the_first_line(tmp_path: Path, golden: Golden) -> None:
    told = []
    for head in HEADS.replace("\n", "|").split("|"):
        found = read_record(written(tmp_path, f"# noted\n{head}\n0.0 1\n0.5, 2\n1;-3\n"))
        told.append(f"{head!r}: {found.unit}")
        assert found.times == (0.0, 0.5, 1.0)
    golden("\n".join(told))


def test_rounded_times_are_a_constant_step(tmp_path: Path) -> None:
    lines = [f"{place / 512:.4f} {place % 7}" for place in range(500)]
    found = read_record(written(tmp_path, "\n".join(lines)))
    steps = [after - before for before, after in pairwise(found.times)]
    assert max(steps) - min(steps) < 1e-12


TABLE = "time_s,displacement_mm\n0,0\n1,5\n2,0\n"
RECORD = AT2.format(unit="G", size=NEW)
NOTED = "# noted\n" + TABLE.replace("0,0", "0.0, 0e0")
OTHERS = TABLE.replace("5", "6"), TABLE.replace("_mm", "_m"), TABLE.replace("2,0", "3,0")


@pytest.mark.parametrize(
    ("name", "keys", "texts", "others"),
    [
        ("m.csv", {"kind": "table", "direction": "10 deg"}, (TABLE, NOTED), OTHERS),
        ("quake.AT2", {"kind": "record", "pga": "0.2 g"}, (RECORD,), (RECORD.replace(".0050", ".0060"),)),
    ],
)
def test_a_copied_motion_means_the_same_whatever_its_name_and_the_hash_follows_its_samples(
    tmp_path: Path, name: str, keys: dict[str, object], texts: tuple[str, ...], others: tuple[str, ...]
) -> None:
    written(tmp_path, texts[0], name)
    first = scenario({**keys, "table": name}, tmp_path)
    assert isinstance(first.motion, FromTable | Record)
    (tmp_path / "motion.csv").write_bytes(first.motion.table.content)
    copy = written(tmp_path, scenario_to_toml(first, motion_table="motion.csv"), "s.toml")
    assert load_scenario(copy) == first
    for text in (*texts, *others):
        written(tmp_path, text, "motion.csv")
        assert (Model(load_scenario(copy)).hash == Model(first).hash) == (text in texts)


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_lines_end_only_where_editors_end_them(tmp_path: Path, end: str) -> None:
    lines = ["# run 7\u2028shaking\x0ctable", "", "time_s, displacement_mm", "0,0", " # pause", "0.5,2"]
    path = tmp_path / "m.csv"
    path.write_bytes(end.join(lines).encode("utf-8-sig"))
    table = read_motion_table(path)
    assert (table.times, table.values) == ((0.0, 0.5), (0.0, 0.002))
    path.write_bytes(end.join([*lines, "0.4,1"]).encode())
    with pytest.raises(MotionTableError, match=r"^line 7: time 0\.4 s: times must increase"):
        read_motion_table(path)
