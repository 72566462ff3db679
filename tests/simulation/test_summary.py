"""run.json is read back exactly or refused with the reason."""

import json
import math
from pathlib import Path

import pytest

from blocksim.errors import InputMissingError, InvalidInputError
from blocksim.simulation import Result
from blocksim.simulation.results import read_summary


def test_missing_summary_is_reported(tmp_path: Path) -> None:
    with pytest.raises(InputMissingError, match=r"run\.json: no such file"):
        read_summary(tmp_path / "run.json")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "Invalid JSON"),
        ("{", "Invalid JSON"),
        ("[]", "not the summary of a run"),
        ("{}", "name: Field required"),
        ("\x00\xff", "Invalid JSON"),
    ],
)
def test_rubbish_is_refused(tmp_path: Path, text: str, told: str) -> None:
    (tmp_path / "run.json").write_text(text)
    with pytest.raises(InvalidInputError, match=told):
        read_summary(tmp_path / "run.json")


def test_wrong_value_is_named(kept: Result, tmp_path: Path) -> None:
    data = json.loads(kept.summary.to_json())
    data["energy_J"]["friction"] = "much"
    (tmp_path / "run.json").write_text(json.dumps(data))
    with pytest.raises(InvalidInputError, match=r"energy_J\.friction: "):
        read_summary(tmp_path / "run.json")


def test_energy_that_is_not_finite_survives_json(kept: Result, tmp_path: Path) -> None:
    ledger = kept.summary.energy_J.model_copy(update={"kinetic": math.nan})
    broken = kept.summary.model_copy(update={"energy_J": ledger})
    (tmp_path / "run.json").write_text(broken.to_json())
    assert json.loads(broken.to_json())["energy_J"]["kinetic"] is None
    assert math.isnan(read_summary(tmp_path / "run.json").energy_J.kinetic)


def test_summary_of_any_size_is_not_read(tmp_path: Path) -> None:
    (tmp_path / "run.json").write_text('{"name": "' + "x" * 2_000_000 + '"}', encoding="utf-8")
    with pytest.raises(InvalidInputError, match=r"run\.json: larger than 1 MB"):
        read_summary(tmp_path / "run.json")


@pytest.mark.parametrize("text", ["[" * 100_000, '{"name":' * 100_000, '{"steps": ' + "9" * 100_000 + "}"])
def test_endless_structures_are_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "run.json").write_text(text, encoding="utf-8")
    with pytest.raises(InvalidInputError, match=r"run\.json: not the summary of a run"):
        read_summary(tmp_path / "run.json")
