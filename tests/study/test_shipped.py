"""The scenarios that ship, end to end: what their comments and the README say about them."""

import runpy

import numpy as np
import pytest

from blocksim.analysis import Verdict
from blocksim.analysis.compare import Comparison
from blocksim.scenario import Document, load_scenario
from blocksim.scenario.models.motion import read_record
from blocksim.scenario.units import STANDARD_GRAVITY
from blocksim.simulation import Result
from blocksim.study.compare import compare_run
from blocksim.study.run import run
from tests.study.conftest import SCENARIOS
from tests.study.plans import cases

STUDIES = {"sweep_friction_stiffness": 10_000, "sweep_readings": 4875, "ensemble_three_blocks": 1024}


def run_shipped(name: str, **overrides: object) -> Result:
    return run(load_scenario(SCENARIOS / f"{name}.toml", overrides))


def test_calibrated_scenario_is_inside_everywhere() -> None:
    comparison = compare_run(run_shipped("three_blocks"))
    assert len(comparison.rows) == 6
    assert comparison.inside, comparison.to_frame()


def test_nominal_scenario_gets_block_1_and_all_rotations_and_the_literal_reading_is_far_outside() -> None:
    found = {(row.block, row.quantity): row.verdict for row in compare_run(run_shipped("three_blocks_nominal")).rows}
    assert found[("1", "x")] == Verdict.INSIDE
    assert [found[(block, "rotation")] for block in "123"] == [Verdict.INSIDE] * 3
    literal = {(row.block, row.quantity): row.distance for row in compare_run(run_shipped("three_blocks_literal")).rows}
    assert min(literal[("2", "x")], literal[("3", "x")]) > 10.0


@pytest.mark.parametrize(("name", "count"), STUDIES.items())
def test_shipped_studies_have_cases_that_can_be_run(name: str, count: int) -> None:
    found = cases(Document.read(SCENARIOS / f"{name}.toml"))
    assert len(found) == count
    assert not [case.problem for case in map(found.__getitem__, range(0, count, count // 50)) if case.scenario is None]


def reading(upright: str, overlap: str, restitution: float) -> Comparison:
    values = {"blocks.brick.upright": upright, "structures.0.overlap": overlap, "contact.restitution": restitution}
    return compare_run(run_shipped("sweep_readings", **values))


@pytest.mark.parametrize("restitution", [0.3, 0.4, 0.5])
def test_only_one_reading_of_the_printed_sizes_explains_the_data(restitution: float) -> None:
    assert not reading("height", "10 mm", restitution).inside
    assert not reading("width", "10 mm", restitution).inside
    assert reading("length", "10 mm", restitution).inside


def test_blocks_stand_where_the_overlap_is_read_as_the_offset() -> None:
    final = run_shipped("sweep_readings", **{"structures.0.overlap": "22 mm"}).final
    np.testing.assert_allclose(final["rotation_deg"], 0.0, atol=0.01)
    np.testing.assert_allclose(final["x_mm"], [16.0, 26.0, 36.0], atol=0.01)


def test_tower_stands() -> None:
    result = run_shipped("tower", **{"contact.stiffness_scale": 0.01})
    assert result.status == "finished"
    np.testing.assert_allclose(result.final["x_mm"], result.final["x_mm"].iloc[0], atol=0.01)
    np.testing.assert_allclose(result.final["rotation_deg"], 0.0, atol=0.01)
    np.testing.assert_allclose(result.final["y_mm"], 12.5 + 25.0 * np.arange(10), atol=0.05)


@pytest.mark.parametrize(("pga", "stands"), [("0.35 g", True), ("0.7 g", False)])
def test_column_rocks_under_its_record_and_falls_under_twice_of_it(pga: str, stands: bool) -> None:
    result = run_shipped("record_column", **{"motion.pga": pga, "time.end": 12.0})
    turned = result.frames.rotation[:, 0]
    assert (np.degrees(np.abs(turned).max()) < 10.0) == stands
    assert np.degrees(np.abs(turned).max()) > 2.0
    crown = result.probes["crown"]
    assert crown["rotation"].tolist() == result.frames.rotation[:, 4].tolist()


def test_the_synthetic_record_is_what_its_script_makes() -> None:
    script = runpy.run_path(str(SCENARIOS / "records" / "synthetic.py"))
    found = read_record(SCENARIOS / "records" / "synthetic.AT2")
    assert (len(found.times), found.times[1], found.unit) == (script["COUNT"], script["STEP"], "g")
    np.testing.assert_allclose(found.values, STANDARD_GRAVITY * script["record"](), rtol=0, atol=1e-7)


def test_dominoes_fall_one_after_the_other_at_a_constant_speed() -> None:
    result = run_shipped("dominoes")
    assert result.reason == "at rest"
    assert (result.final["rotation_deg"] < -60.0).all()
    frames = result.frames
    starts = np.array([frames.time[np.argmax(turned < -0.02)] for turned in frames.rotation.T])
    assert (np.diff(starts) > 0.0).all()
    for first, last in ((10, 17), (17, 23)):
        assert (last - first) * 0.023 / (starts[last] - starts[first]) == pytest.approx(0.86, abs=0.03)


def test_pushed_wall_leans_more_the_higher_a_course_is() -> None:
    """The first moments; a whole run takes longer than a test may."""
    result = run_shipped("wall", **{"time.end": 0.05})
    assert result.status == "finished"
    moved = result.frames.x[-1] - result.frames.x[0]
    left = moved.reshape(25, 40)[:, :20].mean(axis=1)  # the other end breaks off
    assert (np.diff(left) > 0.0).all()
    assert abs(left[0]) < 1e-4
    assert 0.02 < left[-1] < 0.05  # 1 m/s, less friction


def drums_under(amplitude: float, **values: object) -> Result:
    """Run the column of drums under another amplitude (m/s2)."""
    return run_shipped("drum_column", **{"motion.amplitude": amplitude, **values})


def test_drums_begin_to_rock_at_the_foot_as_one_block() -> None:
    """Half the width of the foot over the height of the centre: h/3 (w0 + 2 w1)/(w0 + w1)."""
    height = 10.33 / 3.0 * (1.63 + 2.0 * 1.31) / (1.63 + 1.31)
    onset = 0.5 * 1.63 / height * 9.81
    assert onset / 9.81 == pytest.approx(0.1637, abs=5e-5)  # as the file says
    for share, opens in ((0.99, False), (1.01, True)):
        frames = drums_under(share * onset, **{"time.end": 0.5, "output.every": 5e-3}).frames
        least = frames.contact_count[frames.time > 0.25].min()  # the start has died away, the peak is at 0.375 s
        assert (least < 26) == opens  # two contacts for each drum


@pytest.mark.parametrize(("amplitude", "falls"), [(0.245, False), (0.275, True)])
def test_drums_come_down_from_0_26_g_on(amplitude: float, falls: bool) -> None:
    movement = drums_under(amplitude * STANDARD_GRAVITY).summary.movement
    assert movement is not None
    assert (movement.outcome == "fell") == falls


def test_at_half_of_gravity_the_upper_eight_drums_fall() -> None:
    final = run_shipped("drum_column").final
    assert (final["rotation_deg"].abs() > 60.0).tolist() == [False] * 5 + [True] * 8


def slope_of_cells(friction: str, end: float) -> Result:
    return run_shipped("voronoi_slope", **{"friction.block_block": friction, "time.end": end})


def test_slope_of_cells_begins_to_slide_below_the_friction_that_holds_it() -> None:
    falls, stands = (slope_of_cells(angle, 0.4).summary.movement for angle in ("15 deg", "20 deg"))
    assert falls is not None
    assert stands is not None
    assert falls.largest_displacement_mm > 20.0
    assert stands.largest_displacement_mm < 5.0


@pytest.mark.long
def test_slope_of_cells_falls_at_15_degrees_and_rests_at_20() -> None:
    assert slope_of_cells("20 deg", 5.0).reason == "at rest"
    result = slope_of_cells("15 deg", 5.0)
    moved = np.abs(result.frames.x[-1] - result.frames.x[0])
    assert np.mean(moved > 1.0) == pytest.approx(0.125, abs=0.04)
    assert float(result.final["x_mm"].min()) < -5000.0
