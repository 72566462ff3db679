"""The table of sizes and materials."""

from math import radians
from pathlib import Path

import pytest

from blocksim.analysis.experiment import load_properties
from blocksim.errors import InvalidInputError
from tests.analysis.broken import Mistake, rendered, written

SHIPPED = Path(__file__).parents[2] / "scenarios" / "experiments" / "three_blocks_properties.csv"
HEADER = "property,unit,value\n"


def test_table_1_and_the_sizes_arrive_in_si() -> None:
    assert dict(load_properties(SHIPPED).values) == pytest.approx(
        {
            "width": 0.032,
            "height": 0.025,
            "length": 0.050,
            "overlap": 0.010,
            "unit_weight": 26.7e3,
            "young_modulus": 69e9,
            "poisson_ratio": 0.3,
            "friction_block_block": 0.31,
            "friction_block_ground": 0.38,
            "ground_friction_angle": radians(21),
        },
        rel=1e-14,
    )


BROKEN: dict[str, tuple[str, Mistake]] = {
    "mistyped": ("widht,mm,32", (2, "property", "unknown property 'widht', did you mean 'width'?", "widht")),
    "unit": (
        "unit_weight,kg/m^3,26.7",
        (2, "unit", "'kg/m^3' is not a unit of unit_weight, write for example N/m^3", "kg/m^3"),
    ),
    "no unit": ("width,,32", (2, "unit", "nothing is not a unit of width, write for example m", ",32")),
    "number": ("width,mm,32mm", (2, "value", "'32mm' is not a number, write it as 71.69 or 7.169e1", "32mm")),
    "impossible": (
        "poisson_ratio,1,0.5",
        (2, "value", "0.5 is impossible, it must be above -1 and below 0.5", "0.5"),
    ),
    "negative": ("width,mm,-32", (2, "value", "-0.032 m is impossible, it must be above 0 m", "-32")),
    "twice": ("width,mm,32\nwidth,mm,33", (3, "property", "'width' is given twice", "width")),
    "empty": ("", (1, "", "the table has a header and no rows", HEADER.strip())),
}


@pytest.mark.parametrize(("rows", "mistake"), BROKEN.values(), ids=BROKEN.keys())
def test_a_broken_table_is_explained_where_it_is_broken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rows: str, mistake: Mistake
) -> None:
    written(tmp_path, HEADER + rows)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InvalidInputError) as caught:
        load_properties("table.csv")
    assert str(caught.value) == rendered(HEADER + rows, [mistake])
