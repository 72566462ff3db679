"""The final table: extents of turned blocks, and back from its file to the last bit."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from blocksim.errors import InputMissingError, InvalidInputError
from blocksim.simulation import Frames, Result
from blocksim.simulation.trajectory import COLUMNS, as_frame, csv_text, final_columns, read_table


def frames_of(angle: float, start_angle: float) -> Frames:
    one = np.ones((1, 1))
    return Frames(
        step=np.zeros(1, dtype=np.int64),
        time=np.zeros(1),
        x=0.1 * one,
        y=0.2 * one,
        angle=angle * one,
        vx=0.5 * one,
        vy=-0.25 * one,
        spin=np.pi * one,
        energy={},
        contact_count=np.zeros(1),
        largest_overlap=np.zeros(1),
        names=("a",),
        size_x=np.array([0.032]),
        size_y=np.array([0.05]),
        start_angle=np.array([start_angle]),
    )


def test_extents_are_those_of_the_turned_block() -> None:
    row = as_frame(final_columns(frames_of(-np.pi / 2, 0.0))).iloc[0]
    assert row["rotation_deg"] == pytest.approx(-90.0)
    assert [row["left_mm"], row["right_mm"]] == pytest.approx([75.0, 125.0])
    assert [row["bottom_mm"], row["top_mm"]] == pytest.approx([184.0, 216.0])
    assert [row["vx_mm_s"], row["vy_mm_s"], row["spin_deg_s"]] == pytest.approx([500.0, -250.0, 180.0])


def test_extents_of_a_polygon_are_those_of_its_corners() -> None:
    wedge = np.array([[[-0.01, -0.01], [0.02, -0.01], [-0.01, 0.02], [-0.01, 0.02]]])
    row = as_frame(final_columns(replace(frames_of(np.pi / 2, 0.0), outlines=wedge))).iloc[0]
    assert [row["left_mm"], row["right_mm"]] == pytest.approx([80.0, 110.0])
    assert [row["bottom_mm"], row["top_mm"]] == pytest.approx([190.0, 220.0])


def test_rotation_counts_from_the_start_and_is_not_wrapped() -> None:
    row = as_frame(final_columns(frames_of(0.3 + 4 * np.pi, 0.3))).iloc[0]
    assert row["rotation_deg"] == pytest.approx(720.0)
    assert row["right_mm"] - row["left_mm"] == pytest.approx(1e3 * (0.032 * np.cos(0.3) + 0.05 * np.sin(0.3)))


def test_file_gives_the_table_back_to_the_last_bit(kept: Result) -> None:
    assert kept.folder is not None
    pd.testing.assert_frame_equal(as_frame(read_table(kept.folder / "final.csv")), kept.final, check_exact=True)


def test_csv_text_is_what_pandas_writes() -> None:
    numbers = [0.1 + 0.2, -0.0, 1e16, 1e-5, 123456789.125, np.pi * 1e-300, math.inf, math.nan]
    names = ["1", "with, comma", 'with "quotes"', "two\nlines", "ä", " ", "#", "nan"]
    columns = {name: names if name == "block" else numbers for name in COLUMNS}
    assert csv_text(columns) == as_frame(columns).to_csv(index=False, lineterminator="\n")


def test_file_of_odd_names_and_numbers_gives_the_columns_back(tmp_path: Path) -> None:
    columns = {name: ['a "b",\nc', "nan"] if name == "block" else [math.nan, -1e-17] for name in COLUMNS}
    (tmp_path / "final.csv").write_text(csv_text(columns), encoding="utf-8")
    assert repr(read_table(tmp_path / "final.csv")) == repr(columns)


@pytest.mark.parametrize(
    "text", ["", "block,x_mm\n1,2\n", ",".join(COLUMNS) + "\n1,abc" + 9 * ",0" + "\n", "\0\0\0", "a\n1,2,3\n"]
)
def test_rubbish_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "final.csv").write_text(text)
    with pytest.raises(InvalidInputError, match=r"final\.csv: not a final table"):
        read_table(tmp_path / "final.csv")


def test_missing_table_is_reported(tmp_path: Path) -> None:
    with pytest.raises(InputMissingError, match="no such file"):
        read_table(tmp_path / "final.csv")
