"""final.csv and run.json: what they say, back to the last bit, or refused with the reason."""

import json
import math
import os
import platform
from dataclasses import replace
from pathlib import Path

import llvmlite.binding
import numba
import numpy as np
import pandas as pd
import pytest

from blocksim.errors import InputMissingError, InvalidInputError
from blocksim.kernels.common.jit import source_hash
from blocksim.simulation import Result, provenance
from blocksim.simulation.results import read_summary
from blocksim.simulation.trajectory import COLUMNS, Frames, as_frame, csv_text, final_columns, read_table
from tests.simulation.conftest import Shipped
from tests.view.made_up import blocks_at, polygons


def row_of(frames: Frames) -> dict[str, float]:
    """Return the row of the only block of a frame that goes at 0.5 m/s and -0.25 m/s and turns by pi rad/s."""
    frames.vx[:], frames.vy[:], frames.spin[:] = 0.5, -0.25, np.pi
    return {name: values[0] for name, values in final_columns(frames).items()}


def near(row: dict[str, float], **expected: float) -> bool:
    return {name: row[name] for name in expected} == pytest.approx(expected)


def test_extents_are_those_of_the_turned_block() -> None:
    row = row_of(blocks_at([0.1], 0.2, -np.pi / 2))
    assert near(row, rotation_deg=-90.0, left_mm=75.0, right_mm=125.0, bottom_mm=184.0, top_mm=216.0)
    assert near(row, vx_mm_s=500.0, vy_mm_s=-250.0, spin_deg_s=180.0)
    row = row_of(polygons(blocks_at([0.1], 0.2, np.pi / 2), ((-0.01, -0.01), (0.02, -0.01), (-0.01, 0.02))))
    assert near(row, left_mm=80.0, right_mm=110.0, bottom_mm=190.0, top_mm=220.0)


def test_rotation_counts_from_the_start_and_is_not_wrapped() -> None:
    row = row_of(replace(blocks_at([0.1], 0.2, 0.3 + 4 * np.pi), start_angle=np.array([0.3])))
    assert row["rotation_deg"] == pytest.approx(720.0)
    assert row["right_mm"] - row["left_mm"] == pytest.approx(1e3 * (0.032 * np.cos(0.3) + 0.05 * np.sin(0.3)))


def test_file_gives_the_table_back_to_the_last_bit(kept: Result, folder: Path, tmp_path: Path) -> None:
    pd.testing.assert_frame_equal(as_frame(read_table(folder / "final.csv")), kept.final, check_exact=True)
    columns = {name: ['a "b",\nc', "nan"] if name == "block" else [math.nan, -1e-17] for name in COLUMNS}
    (tmp_path / "final.csv").write_text(csv_text(columns), encoding="utf-8")
    assert repr(read_table(tmp_path / "final.csv")) == repr(columns)


def test_csv_text_is_what_pandas_writes() -> None:
    numbers = [0.1 + 0.2, -0.0, 1e16, 1e-5, 123456789.125, np.pi * 1e-300, math.inf, math.nan]
    names = ["1", "with, comma", 'with "quotes"', "two\nlines", "ä", " ", "#", "nan"]
    columns = {name: names if name == "block" else numbers for name in COLUMNS}
    assert csv_text(columns) == as_frame(columns).to_csv(index=False, lineterminator="\n")


@pytest.mark.parametrize(
    ("name", "text", "told"),
    [
        *(
            ("final.csv", text, "not a final table")
            for text in (
                "",
                "block,x_mm\n1,2\n",
                ",".join(COLUMNS) + "\n1,abc" + 9 * ",0" + "\n",
                "\0\0\0",
                "a\n1,2,3\n",
            )
        ),
        *(("run.json", text, ".*Invalid JSON") for text in ("", "{", "\x00\xff")),
        ("run.json", "{}", ".*name: Field required"),
        ("run.json", '{"name": "' + "x" * 2_000_000 + '"}', "larger than 1 MB"),
        *(
            ("run.json", text, "not the summary of a run")
            for text in ("[]", "[" * 100_000, '{"name":' * 100_000, '{"steps": ' + "9" * 100_000 + "}")
        ),
        ("final.csv", None, "no such file"),
        ("run.json", None, "no such file"),
    ],
    ids=lambda text: None if text is None else text[:20],
)
def test_rubbish_is_refused_with_the_reason(tmp_path: Path, name: str, text: str | None, told: str) -> None:
    if text is not None:
        (tmp_path / name).write_text(text, encoding="utf-8")
    with pytest.raises(InputMissingError if text is None else InvalidInputError, match=rf"{name}: {told}"):
        (read_table if name == "final.csv" else read_summary)(tmp_path / name)


def test_wrong_value_is_named_and_energy_that_is_not_finite_survives(kept: Result, tmp_path: Path) -> None:
    ledger = kept.summary.energy_J.model_copy(update={"kinetic": math.nan})
    data = json.loads(kept.summary.model_copy(update={"energy_J": ledger}).to_json())
    assert data["energy_J"]["kinetic"] is None
    (tmp_path / "run.json").write_text(json.dumps(data))
    assert math.isnan(read_summary(tmp_path / "run.json").energy_J.kinetic)
    data["energy_J"]["friction"] = "much"
    (tmp_path / "run.json").write_text(json.dumps(data))
    with pytest.raises(InvalidInputError, match=r"energy_J\.friction: "):
        read_summary(tmp_path / "run.json")


def test_summary_of_an_older_version_is_read(kept: Result, tmp_path: Path) -> None:
    added = ("llvmlite", "cpu", "cpu_features", "code_kernels", "code_scenario", "code_simulation", "code_world")
    data = json.loads(kept.summary.to_json())
    data["environment"] = {name: text for name, text in data["environment"].items() if name not in added}
    del data["threads"], data["sha256"]
    (tmp_path / "run.json").write_text(json.dumps(data))
    back = read_summary(tmp_path / "run.json")
    assert (back.threads, back.sha256) == (1, {})
    assert back.final_state_sha256 == kept.summary.final_state_sha256


def test_rooms_are_reported_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    before = provenance.code_hashes()
    assert set(before) == set(provenance.ROOMS)
    assert len(set(before.values())) == len(before)

    def edited(folder: Path) -> str:
        return source_hash(folder) + ("edited" if folder.name == "world" else "")

    monkeypatch.setattr("blocksim.kernels.common.jit.source_hash", edited)
    after = provenance.code_hashes.__wrapped__()
    assert {room for room in after if after[room] != before[room]} == {"world"}


def test_run_tells_versions_processor_and_code(kept: Result) -> None:
    told = kept.summary.environment
    versions = (llvmlite.__version__, numba.__version__, platform.python_version())
    assert tuple(told[name] for name in ("llvmlite", "numba", "python")) == versions
    assert told["cpu"] == llvmlite.binding.get_host_cpu_name()
    present = {name for name, is_there in llvmlite.binding.get_host_cpu_features().items() if is_there}
    assert set() < set(told["cpu_features"].split()) <= present
    assert {f"code_{room}": digest for room, digest in provenance.code_hashes().items()}.items() <= told.items()


def test_command_with_a_name_that_is_no_text_can_be_written(kept: Result, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.argv", ["blocksim", os.fsdecode(b"caf\xe9")])
    summary = kept.summary.model_copy(update={"environment": provenance.environment()})
    assert json.loads(summary.to_json())["environment"]["command"] == "blocksim 'caf\\udce9'"


def test_edited_code_gives_runs_another_name(soft: Shipped, monkeypatch: pytest.MonkeyPatch) -> None:
    before = provenance.run_hash(soft())
    monkeypatch.setattr(provenance, "code_hash", lambda: "of other code")
    assert provenance.run_hash(soft()) != before
