"""Measured tables, curves and tables of properties: numbers that are printed, and what is said of broken ones."""

from pathlib import Path

import numpy as np
import pytest

from blocksim.analysis.compare import Verdict
from blocksim.analysis.curves import Envelope, compare_curves, load_curves
from blocksim.analysis.experiment import has_curves, load_properties, load_table
from blocksim.errors import InvalidInputError
from tests.golden import Golden, read

EXPERIMENTS = Path(__file__).parents[2] / "scenarios" / "experiments"
HEADER = "block,quantity,unit,replicate,value\n"


def written(folder: Path, text: str) -> Path:
    path = folder / "table.csv"
    path.write_bytes(text.encode())
    return path


def test_statistics_of_the_paper_match_numpy_and_the_design() -> None:
    centres = load_table(EXPERIMENTS / "three_blocks.csv")
    statistics = centres.statistics().set_index(["block", "quantity"]).to_dict(orient="index")
    second, third = statistics["2", "x"], statistics["3", "x"]
    assert (second["n"], second["minimum"], second["maximum"]) == (6, 71.69, 78.53)
    assert (third["n"], third["minimum"], third["maximum"]) == (6, 128.55, 136.05)
    assert second["s"] == pytest.approx(np.std(centres.values("2", "x"), ddof=1), rel=1e-12)
    assert second["s"] == pytest.approx(2.60, abs=0.005)
    assert third["s"] == pytest.approx(2.84, abs=0.005)


TABLES = {
    "units": "1,x,cm,1,2.5\n1,y,m,1,-0.001\n1,rotation,rad,1,-1.5707963267948966\n1,left,in,1,1\n",
    **{f"a cell of {cell!r}": f"1,x,mm,1,3\n1,x,mm,2,{cell}\n1,x,mm,3,5\n" for cell in ("", " ", "NaN", "nan", "NA")},
    "three of them, and a row that is absent": "1,x,mm,1,3\n1,x,mm,2,\n1,x,mm,3,5\n1,x,mm,4,\n1,x,mm,5,\n2,x,mm,2,7\n",
}
HABITS = '\ufeff# a "note"\r\n\r\nvalue , block,quantity,unit,replicate\r\n 1.5e1, "left, ""L""" ,x,mm, 2\r\n'


def test_tables_are_understood_as_they_were_read(golden: Golden, tmp_path: Path) -> None:
    """In millimetres and degrees, with the habits of spreadsheets; repeats without a value are left out and told."""
    texts = []
    for name, text in {"habits": HABITS, **{name: HEADER + rows for name, rows in TABLES.items()}}.items():
        table = load_table(written(tmp_path, text))
        rows = [", ".join(str(cell) for cell in row) for row in table.data.itertuples(index=False)]
        counts = f"repeats {[row.n for row in table.summaries()]}"
        texts.append("\n".join([f"{name}: {counts}", *rows, *table.messages, *table.notes]))
    golden("\n\n".join(texts), rules=["digits"])


def test_table_1_and_the_sizes_arrive_in_si(golden: Golden) -> None:
    values = load_properties(EXPERIMENTS / "three_blocks_properties.csv").values
    golden("\n".join(f"{name}: {value}" for name, value in values.items()), rules=["digits"])


SPOILT = {
    "nothing in it": b"",
    "null characters": b"block\0\n",
    "terminal codes": f"{HEADER}1,x,\x1b[31mred,1,1\n".encode(),
    "flood of mistakes": (HEADER + "1,x,kg,1,1\n" * 50).encode(),
    "UTF-16": HEADER.encode("utf-16"),
    "huge line": (HEADER + "1,x,mm,1," + "9" * 100_000).encode(),
    "huge file": (HEADER + "1,x,mm,1,16\n" * 90_000).encode(),
}


def test_broken_tables_are_explained_where_they_are_broken(
    golden: Golden, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    broken = {name: f"{text}\n".encode() for name, text in read(Path(__file__).with_name("broken.txt")).items()}
    for name, content in (broken | SPOILT).items():
        load = {b"prop": load_properties, b"prob": load_curves}.get(content[:4], load_table)
        Path("table.csv").write_bytes(content)
        with pytest.raises(InvalidInputError) as caught:
            load(Path("table.csv"))
        golden(str(caught.value), name)


RISE = "jack,1,0,0\njack,1,1,10\njack,1,2,10\njack,1,4,6\njack,2,0,0\njack,2,1,12\njack,2,2,11\njack,2,4,8\n"
HEAD = "probe,replicate,displacement_mm,force_kN\n"


def table(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "curves.csv"
    path.write_text(text)
    return path


def record(*points: tuple[float, float]) -> dict[str, np.ndarray]:
    """Return a record in SI from points in mm and kN."""
    x, y = np.array(points, float).T
    return {"time": np.arange(len(x), dtype=float), "displacement": 1e-3 * x, "force": 1e3 * y}


def test_numbers_of_a_curve_that_rises_and_falls() -> None:
    curve = Envelope.of(np.array([0.0, 1.0, 2.0, 4.0]), np.array([0.0, 10.0, 10.0, 6.0]), 1.0)
    assert (curve.peak, curve.place_of_peak, curve.place_of_fall) == (10.0, 1.0, 4.0)
    assert curve.stiffness == pytest.approx(10.0)
    assert curve.area(3.0) == pytest.approx(5.0 + 10.0 + 9.0)


def test_the_envelope_of_cycles_are_the_points_reached_first_in_each_direction() -> None:
    x = np.array([0.0, 1.0, 0.0, -1.0, 0.0, 1.0, 2.0, 0.0, -2.0, 0.0])
    y = np.array([0.0, 5.0, 1.0, -4.0, 0.0, 3.0, 6.0, 0.0, -7.0, 0.0])
    there, back = Envelope.of(x, y, 1.0), Envelope.of(x, y, -1.0)
    assert (there.x.tolist(), there.y.tolist()) == ([0.0, 1.0, 2.0], [0.0, 5.0, 6.0])
    assert (back.x.tolist(), back.y.tolist()) == ([0.0, 1.0, 2.0], [-0.0, 4.0, 7.0])


def test_a_curve_is_judged_by_the_range_of_the_repeats(tmp_path: Path) -> None:
    measured = load_curves(table(tmp_path, HEAD + RISE))
    inside = compare_curves({"jack": record((0, 0), (1, 11), (2, 10.5), (4, 7))}, measured)
    assert {row.quantity: row.verdict for row in inside.rows} == dict.fromkeys(
        ("peak", "at peak", "area", "stiffness"), Verdict.INSIDE
    )
    weak = compare_curves({"jack": record((0, 0), (1, 8), (2, 9), (4, 7))}, measured)
    peak, *_ = weak.rows
    assert (peak.simulated, peak.minimum, peak.maximum, peak.verdict) == (9.0, 10.0, 12.0, Verdict.OUTSIDE)
    assert peak.distance == pytest.approx(1.0)
    wide = compare_curves({"jack": record((0, 0), (1, 8), (2, 9), (4, 7))}, measured, 0.1)
    assert wide.rows[0].verdict is Verdict.INSIDE
    assert "of the peak from the mean curve" in weak.messages[0]


def test_both_directions_are_judged_where_both_were_measured_and_simulated(tmp_path: Path) -> None:
    mirrored = "".join(f"jack,3,-{i},-{i}\n" for i in (1, 2, 3))
    measured = load_curves(table(tmp_path, HEAD + RISE + mirrored))
    found = compare_curves({"jack": record((0, 0), (1, 11), (0, 0), (-1, -1), (-3, -3))}, measured)
    assert [row.quantity for row in found.rows if row.quantity.startswith("peak")] == ["peak", "peak back"]
    (back,) = [row for row in found.rows if row.quantity == "peak back"]
    assert (back.simulated, back.n, back.verdict) == (3.0, 1, Verdict.INSIDE)


def test_probes_and_columns_that_a_run_lacks_are_named(tmp_path: Path) -> None:
    measured = load_curves(table(tmp_path, HEAD + RISE))
    with pytest.raises(InvalidInputError, match="unknown probe 'jack', did you mean 'jakc'"):
        compare_curves({"jakc": record((0, 0), (1, 1))}, measured)
    with pytest.raises(InvalidInputError, match="records no force"):
        compare_curves({"jack": {"displacement": np.zeros(2)}}, measured)
    with pytest.raises(InvalidInputError, match="goes nowhere where it was measured"):
        compare_curves({"jack": record((0, 0), (-1, -1))}, measured)


def test_a_table_is_one_of_curves_or_of_final_positions(tmp_path: Path) -> None:
    path = table(tmp_path, HEAD + RISE)
    assert has_curves(path)
    with pytest.raises(InvalidInputError, match=r"a table of final positions .* is needed"):
        load_table(path)
    path.write_text("block,quantity,unit,replicate,value\n1,x,mm,1,2\n")
    assert not has_curves(path)


FAR = {
    "a point that slipped": "71.3 70.2 7.13 72.5 69.9 71.8",
    "a thousand times": "0.0713 70.2 72.5 69.9 71.8",
    "two of six in cm": "7.02 70.2 7.13 72.5 69.9 71.8",
    "one of three in m": "70.2 0.0713 72.5",
    "two, one in cm": "7.13 71.3",
    "far, and of no unit": "70.2 72.5 69.9 71.8 90.0",
    "just below": "70 71 72 73 77.9",
    "within the reading": "16 16 16 16 18",
    "beyond the reading": "16 16 16 16 19",
    "of another sign": "70.2 72.5 69.9 71.8 -71.1",
    "two, the first in metres": "0.036 36",
    "two, a ratio of no units": "-21.4 -262",
    "two that scatter": "36 72",
    "two within readings": "0.2 2",
    "two on either side": "-36 36000",
}


def test_values_far_from_the_others_are_warned_of_with_their_line(
    golden: Golden, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    texts = []
    for name, values in FAR.items():
        rows = "".join(f"1,x,mm,{number},{value}\n" for number, value in enumerate(values.split(), 1))
        Path("far.csv").write_text(HEADER + rows)
        texts.append("\n".join([f"{name}: {values}", *load_table("far.csv").warnings]))
    turned = "".join(f"1,rotation,deg,{number},{value}\n" for number, value in enumerate((-90, -90, -1.571, -89), 1))
    Path("far.csv").write_text(HEADER + turned)
    texts.append("\n".join(["radians", *load_table("far.csv").messages]))
    curves = "".join(f"jack,{n},{k},{n + 10 * k}\n" for n in range(1, 6) for k in range(4))
    for old, new in {"": "", "jack,2,2,22": "jack,2,2,220", "jack,3,1,": "jack,3,10,", "4,3,34": "4,3,90"}.items():
        Path("curves.csv").write_text(HEAD + curves.replace(old or HEAD, new or HEAD))
        texts.append("\n".join([f"curves, {old} as {new}", *load_curves("curves.csv").warnings]))
    golden("\n\n".join(texts))


def test_semicolons_and_decimal_commas_are_read_as_commas_and_points(tmp_path: Path) -> None:
    text = HEADER + "1,x,mm,1,71.69\n1,x,mm,2,7.3e1\n1,x,mm,3,70\n"
    table = load_table(written(tmp_path, text))
    for foreign in (text.replace(",", ";"), text.replace(",", ";").replace(".", ",")):
        assert load_table(written(tmp_path, foreign)).measurements == table.measurements
