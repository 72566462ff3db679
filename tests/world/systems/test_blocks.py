"""What blocks show in tables, exports and histories; ground and walls as cells, solid inwards, beyond all blocks."""

import csv
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

import blocksim
from blocksim.scenario import load_scenario
from blocksim.simulation import Result
from blocksim.simulation.stores.exports import write_frames_csv, write_vtkhdf
from blocksim.simulation.trajectory import data_set, tidy_table
from blocksim.view.history import MOTIONS, FramesInView
from blocksim.view.run_data import Support, drawable_frames
from blocksim.world.systems.blocks import placed_points, support_motion, support_quads
from tests.golden import Golden
from tests.view.made_up import toppling

SCENARIOS = Path(__file__).parents[3] / "scenarios"


@pytest.fixture(scope="module")
def fallen() -> Result:
    return blocksim.run(SCENARIOS / "three_blocks.toml")


def test_kinetic_energies_of_blocks_add_up_to_that_of_the_ledger(fallen: Result, tmp_path: Path) -> None:
    frames, blocks = fallen.frames, 3
    table = tidy_table(frames)["kinetic_energy_J"].to_numpy().reshape(-1, blocks)
    np.testing.assert_allclose(table.sum(axis=1), frames.energy["kinetic"], rtol=1e-12)
    assert table.max() > 1e-3
    write_frames_csv(tmp_path / "run.csv", frames)
    with (tmp_path / "run.csv").open() as file:
        exported = [float(row["kinetic_energy_J"]) for row in csv.DictReader(file)]
    np.testing.assert_array_equal(exported, table.ravel())
    write_vtkhdf(tmp_path / "run.vtkhdf", frames, fallen.scenario)
    with h5py.File(tmp_path / "run.vtkhdf") as file:
        cells = file["VTKHDF/CellData/kinetic_energy_J"][:].reshape(len(frames), -1)
    np.testing.assert_array_equal(cells[:, :blocks], table)
    found = data_set(frames, "three")["kinetic_energy"]
    assert (found.attrs["units"], found.shape) == ("J", table.shape)
    panel = MOTIONS["kinetic_energy"](FramesInView(frames, drawable_frames(frames), Support()))
    assert panel.label == "kinetic energy (mJ)"
    np.testing.assert_allclose(panel.values, 1e3 * table)


def test_masses_that_frames_do_not_know_leave_the_cells_empty(fallen: Result) -> None:
    unknown = replace(fallen.frames, mass=None, inertia=None)
    assert tidy_table(unknown)["kinetic_energy_J"].isna().all()


def test_corners_turn_counter_clockwise_with_their_block() -> None:
    corners = np.array([[[1.0, 0.0], [0.0, 2.0]]])
    found = placed_points(corners, np.array([3.0]), np.array([4.0]), np.array([np.pi / 2.0]))
    np.testing.assert_allclose(found, [[[3.0, 5.0], [1.0, 4.0]]], atol=1e-15)


def test_ground_and_walls_are_cells_solid_inwards_beyond_all_blocks(golden: Golden) -> None:
    """Corners run counter-clockwise; a profile is filled below, a wall behind its face, from which no blocks come."""
    texts = []
    for name, count in (("slope", 2), ("three_blocks", 30)):
        quads = support_quads(load_scenario(SCENARIOS / f"{name}.toml"), toppling(count).tracks[0])
        texts += [f"{name}: {', '.join(f'({x:.9g}, {y:.9g})' for x, y in quad)}" for quad in quads.tolist()]
    golden("\n".join(texts))


def test_table_moves_as_the_scenario_says() -> None:
    scenario = load_scenario(SCENARIOS / "shaking_table.toml")
    times = np.linspace(0.0, 0.5, 2001)
    displacement, velocity = support_motion(scenario, times)
    assert np.ptp(displacement[:, 0]) > 1e-3
    np.testing.assert_allclose(np.gradient(displacement[:, 0], times)[1:-1], velocity[1:-1, 0], atol=1e-3)
    assert support_motion(load_scenario(SCENARIOS / "slope.toml"), times)[1].max() == pytest.approx(0.0)
