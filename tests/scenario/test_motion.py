"""The motion of the supports over time, against closed forms and scipy."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.interpolate import CubicSpline

from blocksim.scenario import Scenario, load_scenario, scenario_from_mapping, scenario_hash, scenario_to_toml
from blocksim.scenario.models.motion import FromTable
from blocksim.scenario.motion import (
    Floats,
    MotionPieces,
    displacement_and_velocity,
    motion_direction,
    motion_pieces,
    spline_slopes,
)
from tests.scenario.conftest import data_of

END = 3.0


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


def test_without_a_motion_there_are_no_pieces() -> None:
    pieces = motion_pieces(scenario(None))
    assert (pieces.times.shape, pieces.coefficients.shape) == ((1,), (0, 4))
    assert motion_direction(scenario(None)) == (1.0, 0.0)
    assert [float(value[0]) for value in at(pieces, 1.0)] == [0.0, 0.0]


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


@pytest.mark.parametrize(
    ("angle", "expected"), [("0 deg", (1, 0)), ("90 deg", (0, 1)), ("-30 deg", (3**0.5 / 2, -0.5))]
)
def test_the_direction_is_a_unit_vector(angle: str, expected: tuple[float, float]) -> None:
    assert motion_direction(scenario({**HARMONIC, "direction": angle})) == pytest.approx(expected, abs=1e-15)


def test_a_triangular_pulse_of_acceleration(tmp_path: Path) -> None:
    # 0 to 2 m/s2 and back within 1 s each: velocity 1 m/s after the rise, 2 m/s after all, then it stays
    pieces = from_table(tmp_path, "acceleration_m_s2", [(0, 0), (1, 2), (2, 0)])
    assert_smooth(pieces)
    displacement, velocity = at(pieces, 0.5, 1.0, 2.0, 3.0)
    assert velocity == pytest.approx([0.25, 1.0, 2.0, 2.0])
    # t^3/3 at first; by symmetry about t = 1 half of 2 s at 2 m/s by t = 2, then 2 m/s
    assert displacement == pytest.approx([0.125 / 3, 1 / 3, 2.0, 4.0])
    assert pieces.final_velocity == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("column", "unit"),
    [("acceleration_m_s2", 1.0), ("acceleration_g", 9.80665)],
)
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


TABLE = "time_s,displacement_mm\n0,0\n1,5\n2,0\n"


@pytest.fixture
def shaken(tmp_path: Path) -> Scenario:
    (tmp_path / "m.csv").write_text(TABLE)
    return scenario({"kind": "table", "table": "m.csv", "direction": "10 deg"}, tmp_path)


def test_a_copied_table_means_the_same(tmp_path: Path, shaken: Scenario) -> None:
    copy = tmp_path / "copy"
    copy.mkdir()
    assert isinstance(shaken.motion, FromTable)
    content = shaken.motion.table.content
    assert content == TABLE.encode()
    (copy / "motion.csv").write_bytes(content)
    (copy / "scenario.toml").write_text(scenario_to_toml(shaken, motion_table="motion.csv"))
    again = load_scenario(copy / "scenario.toml")
    assert again == shaken
    assert scenario_hash(again) == scenario_hash(shaken)


@pytest.mark.parametrize("text", [TABLE.replace("5", "6"), TABLE.replace("_mm", "_m"), TABLE.replace("2,0", "3,0")])
def test_the_hash_follows_the_samples(tmp_path: Path, shaken: Scenario, text: str) -> None:
    (tmp_path / "m.csv").write_text(text)
    assert scenario_hash(scenario({"kind": "table", "table": "m.csv", "direction": "10 deg"}, tmp_path)) != (
        scenario_hash(shaken)
    )


def test_the_hash_ignores_notes_and_the_place_of_the_table(tmp_path: Path, shaken: Scenario) -> None:
    (tmp_path / "other.csv").write_text("# noted\n" + TABLE.replace("0,0", "0.0, 0e0"))
    other = scenario({"kind": "table", "table": "other.csv", "direction": "10 deg"}, tmp_path)
    assert scenario_hash(other) == scenario_hash(shaken)
