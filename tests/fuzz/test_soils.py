"""Scenes with soil, sound and slightly wrong: refused with their place, or run to finite numbers; never a traceback."""

from __future__ import annotations

import csv
import json
import math
import shutil
from typing import TYPE_CHECKING, Any

import pytest
import tomli_w
from hypothesis import given, settings, strategies as st

from tests.fuzz.conftest import LONG, QUICK, ROOT, assert_harmless, check_damaged
from tests.fuzz.mutations import SCENARIO, damaged
from tests.sizes import in_all

if TYPE_CHECKING:
    from pathlib import Path

    from tests.fuzz.child import Child

TEXTS = tuple(path.read_bytes() for path in sorted((ROOT / "scenarios" / "soil").glob("*.toml")))
ENDED = {0, 65, 76}  # finished, refused, or a numerical failure that is told
USUAL = 15.0  # s: what a run may take
COMPILING = 500.0  # s, where the kernels are not there yet
ODD: st.SearchStrategy[Any] = st.sampled_from(
    [math.nan, math.inf, -1.0, 0.0, 1e-12, 1e30, "1 parsec", "-5 deg", "90 deg", True, [], [1.0], "rods"]
)


def mostly(values: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    """Draw a sound value, and once in forty times an odd one."""
    return st.integers(0, 39).flatmap(lambda kind: ODD if kind == 17 else values)


def between(low: float, high: float) -> st.SearchStrategy[Any]:
    return mostly(st.floats(low, high).map(lambda value: round(value, 6)))


LENGTH = between(0.02, 0.1)
DEGREES = mostly(st.integers(0, 50).map(lambda angle: f"{angle} deg"))
MATERIAL = st.fixed_dictionaries(
    {
        "unit_weight": between(1e3, 3e4),
        "young_modulus": mostly(st.sampled_from([1e5, 1e6, 5.84e6, 1e8])),
        "poisson_ratio": between(0.0, 0.49),
        "friction_angle": DEGREES,
    },
    optional={"cohesion": between(0.0, 1e4)},
)
SHAPE = st.one_of(
    st.fixed_dictionaries({"kind": st.just("rectangle"), "x": st.tuples(st.just(0.0), LENGTH).map(list)}),
    st.fixed_dictionaries(
        {
            "kind": st.just("slope"),
            "x": st.tuples(st.just(0.0), between(0.11, 0.2)).map(list),
            "angle": mostly(st.integers(40, 140).map(lambda angle: f"{angle} deg")),
        }
    ),
)
SOIL = st.fixed_dictionaries(
    {"spacing": mostly(st.sampled_from([0.004, 0.005]))},
    optional={
        "start": mostly(st.sampled_from(["geostatic", "ramp"])),
        "gradient": mostly(st.sampled_from(["raw", "corrected"])),
    },
)


@st.composite
def scenes(draw: st.DrawFn) -> dict[str, Any]:
    """Draw a block beside a body of soil of any material, which may rest on a second one."""
    soils = [{"name": "one", "material": "earth", "y": [0.0, draw(LENGTH)], **draw(SHAPE), **draw(SOIL)}]
    if draw(st.integers(0, 3)) == 2:
        high = [0.2, draw(between(0.23, 0.3))]
        soils.append({**soils[0], "name": draw(st.sampled_from(["two", "two", "two", "one"])), "y": high})
    body = {"block": "stone", "x": draw(between(-0.1, -0.021)), "y": draw(between(0.02, 0.05))}
    walls = [{"from": [0.21, 0.0], "to": [0.21, 0.3], "material": "granite"}] if draw(st.booleans()) else []
    return {
        "schema": 1,
        "name": "bad",
        "materials": {
            "earth": draw(MATERIAL),
            "granite": {"density": 2700, "young_modulus": 5e7, "poisson_ratio": 0.2},
        },
        "blocks": {"stone": {"width": 0.04, "height": 0.04, "length": 0.05, "material": "granite"}},
        "bodies": [body],
        "walls": walls,
        "soils": soils,
        "pairs": {"earth": {"granite": {"friction": draw(mostly(st.one_of(st.floats(0.0, 1.5), DEGREES)))}}},
        "ground": {"tilt": draw(mostly(st.integers(-40, 40).map(lambda tilt: f"{tilt} deg")))},
        "time": {"end": 2e-3},
        "output": {"every": 1e-3},
    }


def _run(child: Child, folder: Path, data: dict[str, Any]) -> None:
    (folder / "bad.toml").write_text(tomli_w.dumps(data), encoding="utf-8")
    shutil.rmtree(folder / "out", ignore_errors=True)
    left = child.call(folder, "run", "bad.toml", "--out", "out", "--quiet", patience=COMPILING)
    assert_harmless(left, ENDED, USUAL)
    if left.code == 65:
        assert "bad.toml:" in left.err, left.err
        return
    told = json.loads((folder / "out" / "run.json").read_text(), parse_constant=pytest.fail)
    assert told["status"] == ("finished" if left.code == 0 else "failed")
    if left.code == 0:
        for name in ("final.csv", "soils.csv"):
            rows = list(csv.reader((folder / "out" / name).read_text().splitlines()))
            assert len(rows) > 1
            assert not [cell for row in rows for cell in row if cell.lower() in {"nan", "inf", "-inf"}], rows


@settings(max_examples=QUICK // 5)
@given(data=st.data())
def test_damaged_scenarios_with_soil_are_refused_with_their_place(
    child: Child, folder: Path, data: st.DataObject
) -> None:
    check_damaged(child, folder, data.draw(damaged(data.draw(st.sampled_from(TEXTS)), SCENARIO)))


@pytest.mark.long
@settings(LONG, max_examples=in_all(1000))
@given(data=st.data())
def test_a_thousand_damaged_scenarios_with_soil(child: Child, folder: Path, data: st.DataObject) -> None:
    check_damaged(child, folder, data.draw(damaged(data.draw(st.sampled_from(TEXTS)), SCENARIO)))


@pytest.mark.long
@settings(LONG, max_examples=in_all(300))
@given(data=scenes())
def test_three_hundred_odd_scenes_with_soil_run_to_finite_numbers_or_are_refused(
    child: Child, folder: Path, data: dict[str, Any]
) -> None:
    _run(child, folder, data)
