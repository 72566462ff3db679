"""A sweep read back as series over one key."""

from pathlib import Path

import pytest

from blocksim.errors import InputMissingError, InvalidInputError
from blocksim.scenario import Document
from blocksim.study.many import sweep
from blocksim.study.plan import Values
from blocksim.study.series import SweepSeries, read_series

SHORT = {"time.end": 0.01}


def swept(nominal: Document, folder: Path, vary: dict[str, Values], mode: str | None = None) -> SweepSeries:
    sweep(nominal.with_values(SHORT), vary, mode=mode, out=folder, jobs=1)
    return read_series(folder)


def test_one_key_gives_one_series_in_the_order_of_its_values(nominal: Document, tmp_path: Path) -> None:
    found = swept(nominal, tmp_path, {"structures.0.overlap": ["11 mm", "9 mm", 0.01]})
    (series,) = found.series
    assert (found.key, found.unit, found.blocks) == ("structures.0.overlap", "m", ("1", "2", "3"))
    assert series.values.tolist() == [0.009, 0.010, 0.011]
    assert series.x_mm[:, 1].tolist() == sorted(series.x_mm[:, 1], reverse=True)
    assert series.label == ""


def test_second_key_gives_a_series_for_each_of_its_values(nominal: Document, tmp_path: Path) -> None:
    found = swept(nominal, tmp_path, {"contact.restitution": [0.1, 0.5], "gravity": [1.0, 5.0, 9.81]})
    assert (found.key, found.unit) == ("gravity", "m/s^2")
    assert [one.label for one in found.series] == ["contact.restitution = 0.1", "contact.restitution = 0.5"]
    assert all(one.values.tolist() == [1.0, 5.0, 9.81] for one in found.series)


def test_keys_that_go_together_are_one_series(nominal: Document, tmp_path: Path) -> None:
    found = swept(nominal, tmp_path, {"gravity": [1.0, 5.0], "contact.restitution": [0.1, 0.5]}, "list")
    (series,) = found.series
    assert (found.key, series.values.tolist()) == ("gravity", [1.0, 5.0])


def test_failed_cases_are_left_out(nominal: Document, tmp_path: Path) -> None:
    found = swept(nominal, tmp_path, {"contact.max_overlap": [1e-9, 1e-3]})
    assert found.series[0].values.tolist() == [1e-3]


def test_what_cannot_be_an_axis_is_refused(nominal: Document, tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match=r'values of time.step are no numbers \(one is "auto"\)'):
        swept(nominal, tmp_path / "words", {"time.step": ["auto"]})
    three: dict[str, Values] = {"gravity": [1.0], "contact.restitution": [0.1], "time.rest_speed": [1e-4]}
    with pytest.raises(InvalidInputError, match="3 keys are varied; a picture can show one or two"):
        swept(nominal, tmp_path / "three", three)
    with pytest.raises(InvalidInputError, match="no case of this sweep has finished"):
        swept(nominal, tmp_path / "failed", {"contact.max_overlap": [1e-9]})
    with pytest.raises(InputMissingError, match="no such file"):
        read_series(tmp_path / "nix")
