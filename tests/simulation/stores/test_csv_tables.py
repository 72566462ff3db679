"""CSV of frames and contacts: tidy, a row each, with units, every number to the last bit."""

import csv
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from blocksim.errors import OutputError
from blocksim.simulation.stores.exports import CONTACT_COLUMNS, FRAME_COLUMNS, write_contacts_csv, write_frames_csv
from blocksim.simulation.trajectory import CONTACT_ROW, SUPPORT, Contacts, Frames
from tests.view.made_up import HOSTILE, toppling


def rows_of(path: Path, frames: Frames) -> list[dict[str, str]]:
    assert write_frames_csv(path, frames) == len(frames)
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_every_frame_has_a_row_for_every_block_in_the_units_of_its_heads(tmp_path: Path) -> None:
    frames = toppling(3, steps=5)
    rows = rows_of(tmp_path / "frames.csv", frames)
    assert tuple(rows[0]) == FRAME_COLUMNS
    assert len(rows) == 15
    assert [row["block"] for row in rows[:4]] == ["1", "2", "3", "1"]
    for key, values in {
        "x_mm": 1000.0 * frames.x,
        "y_mm": 1000.0 * frames.y,
        "rotation_deg": np.degrees(frames.rotation),
        "vx_mm_s": 1000.0 * frames.vx,
        "vy_mm_s": 1000.0 * frames.vy,
        "spin_deg_s": np.degrees(frames.spin),
        "time_s": np.repeat(frames.time, 3),
    }.items():
        assert [float(row[key]) for row in rows] == values.ravel().tolist()


def test_rotation_counts_from_the_placed_angle(tmp_path: Path) -> None:
    frames = replace(toppling(1, steps=2), start_angle=np.array([0.5]))
    assert float(rows_of(tmp_path / "frames.csv", frames)[0]["rotation_deg"]) == -math.degrees(0.5)


def test_what_is_not_finite_is_an_empty_cell(tmp_path: Path) -> None:
    frames = toppling(1, steps=2)
    frames.x[1] = np.nan
    assert [row["x_mm"] for row in rows_of(tmp_path / "frames.csv", frames)] == ["0.0", ""]


def test_trouble_is_reported_and_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="cannot be written: No such file"):
        write_frames_csv(tmp_path / "none" / "frames.csv", toppling(1))
    (tmp_path / "folder.csv").mkdir()
    with pytest.raises(OutputError, match=r"folder\.csv: cannot be written"):
        write_frames_csv(tmp_path / "folder.csv", toppling(1))
    assert [path.name for path in tmp_path.iterdir()] == ["folder.csv"]


def test_every_contact_has_a_row_with_the_names_of_its_bodies(tmp_path: Path) -> None:
    frames = replace(toppling(2, steps=3), names=(HOSTILE[0], "two"))
    rows = np.zeros(3, CONTACT_ROW)
    rows["body_a"], rows["body_b"] = [0, 0, 1], [1, SUPPORT, SUPPORT]
    rows["x"], rows["overlap"] = [0.1, 0.2, 0.3], 1e-6
    rows["normal_y"], rows["normal_force"], rows["shear_force"] = 1.0, [1.5, 2.5, np.nan], -0.5
    assert write_contacts_csv(tmp_path / "contacts.csv", frames, Contacts(np.array([2, 2, 3]), rows)) == 3
    with (tmp_path / "contacts.csv").open(encoding="utf-8", newline="") as file:
        found = list(csv.DictReader(file))
    assert tuple(found[0]) == CONTACT_COLUMNS
    assert [row["time_s"] for row in found] == [str(float(frames.time[frame])) for frame in (0, 0, 2)]
    assert [(row["body_a"], row["body_b"]) for row in found] == [(HOSTILE[0], "two"), (HOSTILE[0], ""), ("two", "")]
    assert [float(row["x_mm"]) for row in found] == pytest.approx([100.0, 200.0, 300.0])
    assert [row["normal_force_N"] for row in found] == ["1.5", "2.5", ""]
    assert float(found[0]["overlap_mm"]) == pytest.approx(1e-3)
