"""Cases whose values are given: combinations, lists, and tables of cases."""

from pathlib import Path

import pytest

from blocksim.errors import BlocksimError
from blocksim.scenario import Document
from blocksim.study import plan as mode
from blocksim.study.plan import Design, design_of, with_sweep
from tests.study.plans import cases, plan_of


def test_combinations_go_through_the_last_key_first() -> None:
    design = Design({"a": (1, 2), "b": ("x", "y", "z")}, is_grid=True)
    assert [tuple(row.values()) for row in design] == [(1, "x"), (1, "y"), (1, "z"), (2, "x"), (2, "y"), (2, "z")]
    assert [list(row) for row in design] == [["a", "b"]] * 6


def test_any_row_can_be_asked_for_alone() -> None:
    design = Design({str(key): range(10) for key in range(18)}, is_grid=True)
    assert len(design) == 10**18
    assert "".join(str(value) for value in design[123456789012345678].values()) == "123456789012345678"
    assert design[-1] == dict.fromkeys(design[0], 9)
    assert list(Design({"a": (1, 2, 3), "b": (4, 5, 6)}))[1:] == [{"a": 2, "b": 5}, {"a": 3, "b": 6}]


GOOD = """\
# overlaps measured with a feeler gauge
structures.0.overlap [mm], friction.block_block.kinetic ,time.scheme,structures.0.count
10.1,0.19,nonsmooth,3
9.8,0.21,nonsmooth,4
"""


@pytest.fixture
def document(nominal: Document, tmp_path: Path) -> Document:
    """Give a scenario that names a table which is not there yet."""
    data = {key: entry for key, entry in nominal.data.items() if key != "experiment"}
    data["sweep"] = {"mode": "table", "table": "samples.csv"}
    return Document(data, nominal.source, tmp_path)


def told(document: Document, text: str) -> str:
    """Return what a user is told of a table with this text."""
    (document.folder / "samples.csv").write_text(text)
    with pytest.raises(BlocksimError) as caught:
        with_sweep(document, None)
    assert caught.value.exit_code == 65
    return str(caught.value)


def test_every_row_is_a_case(document: Document) -> None:
    (document.folder / "samples.csv").write_text(GOOD)
    made = cases(document)
    assert [tuple(case.settings.values()) for case in made] == [
        ("10.1 mm", 0.19, "nonsmooth", 3),
        ("9.8 mm", 0.21, "nonsmooth", 4),
    ]
    assert list(made[0].settings)[:2] == ["structures.0.overlap", "friction.block_block.kinetic"]
    assert [case.problem for case in made] == ["", ""]


def test_the_design_of_a_table_is_the_same_as_that_of_its_lists(document: Document) -> None:
    (document.folder / "samples.csv").write_text(GOOD)
    named, listed = plan_of(document), plan_of(with_sweep(document, None))
    assert (named.mode, listed.mode) == ("table", "list")
    assert list(design_of(named)) == list(design_of(listed))


def test_cells_may_have_units_of_their_own(document: Document) -> None:
    (document.folder / "samples.csv").write_text("structures.0.overlap,ground.tilt\n10 mm,1 deg\n0.9 cm,0\n")
    assert plan_of(with_sweep(document, None)).vary == {
        "structures.0.overlap": ("10 mm", "0.9 cm"),
        "ground.tilt": ("1 deg", 0),
    }


def test_a_wrong_number_far_down_is_found(document: Document, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mode, "MOST_TRIED", 3)
    found = told(document, "contact.restitution\n" + "".join(f"{k / 1000}\n" for k in range(1, 400)) + "1.5\n0.1\n")
    assert "samples.csv:401: contact.restitution: 1.5 is too large" in found
