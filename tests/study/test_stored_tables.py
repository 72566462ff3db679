"""Tables of sweeps and of sensitivities read back, as pictures need them."""

from pathlib import Path

import numpy as np
import pytest

from blocksim.errors import InputMissingError, InvalidInputError
from blocksim.scenario import Document
from blocksim.study.pictures import plot, read_indices, read_sweep_data
from blocksim.study.plan import Values, with_sweep
from blocksim.study.sweep import sweep
from blocksim.study.sweep_folder import prepare
from blocksim.view.sweeps.data import SweepData
from tests.study.plans import OVERLAP, TILT

ENDS = ("x_mm", "y_mm", "rotation_deg", "left_mm", "right_mm")


def stored(
    nominal: Document, folder: Path, vary: dict[str, Values], rows: list[str], heads: tuple[str, ...] = ()
) -> SweepData:
    """Write what a sweep writes, with rows of key values and status, and read it back."""
    prepare(folder, with_sweep(nominal, vary).build(), "made-up", overwrite=False)
    ends = [f"{block}.{end}" for block in "123" for end in ENDS]
    lines = [",".join(["case", *(heads or vary), "status", "reason", "seconds", *ends])]
    lines += [f"case{number},{row}" for number, row in enumerate(rows)]
    (folder / "sweep.csv").write_text("\n".join([*lines, ""]), encoding="utf-8")
    return read_sweep_data(folder)


def ended(x2: float, x3: float) -> str:
    blocks = ((16.0, 0.0), (x2, -90.0), (x3, -90.0))
    return ",".join(["finished,at rest,0.5", *(f"{x},16,{turn},{x - 25},{x + 25}" for x, turn in blocks)])


def test_values_are_in_si_and_keep_the_unit_that_was_typed(quick: Document, tmp_path: Path) -> None:
    vary: dict[str, Values] = {OVERLAP: ["0.9 cm", 0.01], TILT: ["0.01 rad", "0.02 rad"]}
    folder = sweep(quick, vary, out=tmp_path).folder
    overlap, tilt = read_sweep_data(folder).inputs
    assert [(one.key, one.unit, one.typed and one.typed.unit) for one in (overlap, tilt)] == [
        (OVERLAP, "m", "cm"),
        (TILT, "rad", "rad"),
    ]
    assert overlap.values.tolist() == pytest.approx([0.009, 0.009, 0.01, 0.01])
    assert overlap.label(0.009) == "0.9 cm"
    for kind, second in (("map", "ground.tilt (rad)"), ("lines", "ground.tilt = 0.01 rad")):
        plot(folder, tmp_path / f"{kind}.svg", kind=kind)
        drawn = (tmp_path / f"{kind}.svg").read_text()
        assert "<!-- structures.0.overlap (cm) -->" in drawn
        assert f"<!-- {second} -->" in drawn


def test_words_become_levels_and_keys_keep_their_order_but_those_of_one_value(
    nominal: Document, tmp_path: Path
) -> None:
    words, numbers = ["explicit", "nonsmooth"], [1.0, 2.0]
    vary: dict[str, Values] = {"time.scheme": words, "contact.restitution": [0.1], "gravity": numbers}
    rows = [f"{word},0.1,{g},{ended(74.0, 130.0)}" for word in words for g in numbers]
    scheme, gravity = stored(nominal, tmp_path, vary, rows).inputs
    assert (scheme.levels, scheme.values.tolist()) == (("explicit", "nonsmooth"), [0.0, 0.0, 1.0, 1.0])
    assert (gravity.key, gravity.levels, gravity.unit) == ("gravity", (), "m/s^2")


def test_cases_are_inside_by_the_rules_of_compare_and_failed_ones_never(nominal: Document, tmp_path: Path) -> None:
    failed = "failed,too large,0.1" + "," * 15
    rows = [f"1.0,{ended(74.0, 130.0)}", f"2.0,{ended(67.0, 130.0)}", f"3.0,{failed}"]
    found = stored(nominal, tmp_path / "swept", {"gravity": [1.0, 2.0, 3.0]}, rows)
    assert found.inside is not None
    assert found.inside.tolist() == [True, False, False]
    assert found.finished.tolist() == [True, True, False]
    assert np.isnan(found.x_mm[2]).all()
    assert found.outcomes == [(0, -90, -90), (0, -90, -90), None]
    known = found.measured  # repeats come with their range and prediction interval
    assert known.x_mm["2"].tolist() == [71.69, 76.57, 72.70, 73.22, 73.73, 78.53]
    assert known.prediction_mm["2"] == pytest.approx((67.18, 81.63), abs=0.01)
    assert "1" not in known.prediction_mm  # repeats that are all equal predict nothing
    assert known.outcome == (0, -90, -90)
    data = {key: table for key, table in nominal.data.items() if key != "experiment"}
    unmeasured = Document(data, nominal.source, nominal.folder, nominal.overrides)
    found = stored(unmeasured, tmp_path / "unmeasured", {"gravity": [1.0]}, rows[:1])
    assert (found.inside, found.measured.x_mm) == (None, {})
    with pytest.raises(InvalidInputError, match="no case of this sweep has finished"):
        stored(nominal, tmp_path / "failed", {"gravity": [3.0]}, rows[2:])
    with pytest.raises(InputMissingError, match="no such file"):
        read_sweep_data(tmp_path / "nix")


SOBOL = "output,unit,key,S1,± S1,ST,± ST\nx of block 2,mm,a,0.1,0.2,0.7,0.3\nx of block 2,mm,b,0.2,nan,0.4,\n"
MORRIS = "output,unit,key,mu*,±,mu,sigma\nx of block 2,mm,a,5,1,-5,0\nmeasured outcome,share,a,0.5,0.1,0.5,0\n"


def written(folder: Path, text: str) -> Path:
    path = folder / "indices.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_bars_are_total_indices_with_those_of_the_key_alone_or_effects_with_their_unit(tmp_path: Path) -> None:
    (bars,), labels = read_indices(written(tmp_path, SOBOL))
    assert (bars.title, bars.keys) == ("x of block 2", ("a", "b"))
    assert bars.values.tolist() == [0.7, 0.4]
    assert bars.part is not None
    assert bars.part.tolist() == [0.1, 0.2]
    assert bars.half_widths[0] == 0.3
    assert np.isnan(bars.half_widths[1])
    assert "variance" in labels[0]

    (x, outcome), labels = read_indices(written(tmp_path, MORRIS))
    assert (x.title, x.values.tolist(), x.part) == ("x of block 2 (mm)", [5.0], None)
    assert outcome.title == "measured outcome"
    assert labels[1] == ""


def test_other_tables_are_refused(tmp_path: Path) -> None:
    for text, told in (
        ("block,quantity\n1,x\n", "not the table of `blocksim sensitivity --out`"),
        (SOBOL.replace("0.7", "much"), "indices.csv:2"),
        (SOBOL.splitlines()[0] + "\n", "no result varies"),
    ):
        with pytest.raises(InvalidInputError, match=told):
            read_indices(written(tmp_path, text))
