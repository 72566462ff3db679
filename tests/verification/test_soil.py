"""Cases of soil mechanics: the quick ones here, all at their full sizes in the long tier, against the printed table."""

from pathlib import Path

import pytest

from blocksim.errors import InvalidInputError
from blocksim.verification.case import Case, Setting, run_case
from blocksim.verification.cases import choose_cases
from blocksim.verification.reference import SOIL, STORE, read_store, rows_of
from blocksim.verification.soil import SOIL_CASES

ROOT = Path(__file__).parents[2]


def outside(case: Case, setting: Setting) -> list[str]:
    """Return the quantities of a case that miss their tolerances."""
    return [row.quantity for row in run_case(case, setting).rows if not row.is_inside]


@pytest.mark.long  # tests/simulation/test_soil.py has a wall that is drawn back
@pytest.mark.parametrize(("name", "missed"), [("s2", ["corrected: K, 5 mm"]), ("s4", [])])
def test_active_thrust_and_shear_band_are_those_of_a_yielding_wall(name: str, missed: list[str]) -> None:
    (case,) = choose_cases([name], Setting(), soil=True)
    assert outside(case, Setting(quick=True)) == missed


@pytest.mark.long
def test_the_shortened_walls_stand_and_topple_within_the_shortened_time() -> None:
    (case,) = choose_cases(["S6"], Setting(), soil=True)
    assert outside(case, Setting(quick=True)) == []


@pytest.mark.parametrize("name", ["S7", "S8"])
def test_energy_momentum_and_the_law_itself_are_exact_with_both_gradients(name: str) -> None:
    (case,) = choose_cases([name], Setting(), soil=True)
    assert outside(case, Setting(quick=True)) == []


@pytest.mark.long
@pytest.mark.parametrize("case", SOIL_CASES, ids=lambda case: case.id)
def test_cases_are_as_the_table_has_them(case: Case) -> None:
    kept = rows_of(read_store(ROOT / STORE), SOIL, case)
    assert outside(case, Setting()) == [row.quantity for row in kept if not row.is_inside]


def test_an_unknown_case_is_told_with_those_there_are() -> None:
    with pytest.raises(InvalidInputError, match="S12: no such case of soil; choose S1, S2"):
        choose_cases(["S12"], Setting(), soil=True)
