"""CSV of contacts: a row each, bodies by name, units as the heads say."""

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from blocksim.errors import OutputError
from blocksim.simulation.contacts import SUPPORT, Contacts, empty_rows
from blocksim.simulation.stores.contacts_csv import COLUMNS, write_contacts_csv
from tests.view.made_up import HOSTILE, toppling


def test_every_contact_has_a_row_with_the_names_of_its_bodies(tmp_path: Path) -> None:
    frames = replace(toppling(2, steps=3), names=(HOSTILE[0], "two"))
    rows = empty_rows(3)
    rows["body_a"], rows["body_b"] = [0, 0, 1], [1, SUPPORT, SUPPORT]
    rows["x"], rows["overlap"] = [0.1, 0.2, 0.3], 1e-6
    rows["normal_y"], rows["normal_force"], rows["shear_force"] = 1.0, [1.5, 2.5, np.nan], -0.5
    assert write_contacts_csv(tmp_path / "contacts.csv", frames, Contacts(np.array([2, 2, 3]), rows)) == 3
    with (tmp_path / "contacts.csv").open(encoding="utf-8", newline="") as file:
        found = list(csv.DictReader(file))
    assert tuple(found[0]) == COLUMNS
    assert [row["time_s"] for row in found] == [str(float(frames.time[frame])) for frame in (0, 0, 2)]
    assert [(row["body_a"], row["body_b"]) for row in found] == [(HOSTILE[0], "two"), (HOSTILE[0], ""), ("two", "")]
    assert [float(row["x_mm"]) for row in found] == pytest.approx([100.0, 200.0, 300.0])
    assert [row["normal_force_N"] for row in found] == ["1.5", "2.5", ""]
    assert float(found[0]["overlap_mm"]) == pytest.approx(1e-3)


def test_trouble_is_reported_and_leaves_nothing(tmp_path: Path) -> None:
    contacts = Contacts(np.zeros(1, dtype=np.int64), empty_rows(0))
    with pytest.raises(OutputError, match="cannot be written: No such file"):
        write_contacts_csv(tmp_path / "none" / "contacts.csv", toppling(1, steps=1), contacts)
    assert list(tmp_path.iterdir()) == []
