"""Scenarios that are damaged, hostile or odd: refused with the place, or sound; never a traceback, a hang or a NaN."""

import csv
import json
import math
import shutil
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from hypothesis import strategies as st

from tests.fuzz.child import Child
from tests.fuzz.conftest import ROOT, assert_harmless, check_damaged, search, tries
from tests.fuzz.mutations import SCENARIO, damaged, removals
from tests.sizes import in_all

WITH_SOIL = tuple(path.read_bytes() for path in sorted((ROOT / "scenarios" / "soil").glob("*.toml")))
TEXTS = tuple(path.read_bytes() for path in sorted((ROOT / "scenarios").glob("*.toml")))
USUAL = (ROOT / "scenarios" / "three_blocks_nominal.toml").read_bytes()
DAMAGED = st.sampled_from(TEXTS + WITH_SOIL).flatmap(lambda text: damaged(text, SCENARIO))


@tries(5000)
def test_damaged_scenarios_are_refused_with_their_place(child: Child, folder: Path, tried: int) -> None:
    search(tried, DAMAGED, lambda content: check_damaged(child, folder, content))


@pytest.mark.parametrize("texts", [(USUAL,), pytest.param(TEXTS, marks=pytest.mark.long)], ids=["one", "all"])
def test_scenario_without_a_table_or_a_key_is_read_or_refused_with_its_place(
    child: Child, folder: Path, texts: tuple[bytes, ...]
) -> None:
    for text in texts:
        for content in removals(text):
            check_damaged(child, folder, content)


ENDED = {0, 65, 76}  # finished, refused, or a numerical failure that is told
MOST_TIME = 15.0  # s: what a run may take
COMPILING = 500.0  # s, where the kernels are not there yet
ODD_VALUE: st.SearchStrategy[Any] = st.sampled_from(
    [math.nan, math.inf, -1.0, 0.0, 1e-12, 1e30, "1 parsec", "-5 deg", "90 deg", True, [], [1.0], "rods"]
)


def mostly(values: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    """Draw a sound value, and once in forty times an odd one."""
    return st.integers(0, 39).flatmap(lambda kind: ODD_VALUE if kind == 17 else values)


def between(low: float, high: float) -> st.SearchStrategy[Any]:
    return mostly(st.floats(low, high).map(lambda value: round(value, 6)))


SIDE = between(0.02, 0.1)
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
    st.fixed_dictionaries({"kind": st.just("rectangle"), "x": st.tuples(st.just(0.0), SIDE).map(list)}),
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
def soils(draw: st.DrawFn) -> dict[str, Any]:
    """Draw a block beside a body of soil of any material, which may rest on a second one."""
    soils = [{"name": "one", "material": "earth", "y": [0.0, draw(SIDE)], **draw(SHAPE), **draw(SOIL)}]
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


def run_soil(child: Child, folder: Path, data: dict[str, Any]) -> None:
    (folder / "bad.toml").write_text(tomli_w.dumps(data), encoding="utf-8")
    shutil.rmtree(folder / "out", ignore_errors=True)
    left = child.call(folder, "run", "bad.toml", "--out", "out", "--quiet", patience=COMPILING)
    assert_harmless(left, ENDED, MOST_TIME)
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


@pytest.mark.long
def test_odd_scenes_with_soil_run_to_finite_numbers_or_are_refused(child: Child, folder: Path) -> None:
    search(in_all(300), soils(), lambda data: run_soil(child, folder, data))


MAGNITUDE = st.sampled_from([1.0] * 12 + [1e-320, 1e-18, 1e-9, 1e-3, 1e9, 1e30, 1e200, 1e308])
NUMBER: st.SearchStrategy[Any] = st.one_of(
    st.floats(-1.0, 1.0),
    st.sampled_from([0.0, -0.0, 1.0, math.nan, math.inf, -math.inf, 1e308, 5e-324, 2**70, True, "1 m", "x", [], None]),
)
PLACE = st.one_of(st.lists(NUMBER, min_size=2, max_size=2), st.lists(NUMBER, max_size=3))
ANY = st.lists(PLACE, max_size=18)
DUST = st.sampled_from([0.0] * 6 + [1e-16, 1e-12, 1e-9, 1e-6, 1e-3, 0.1])


ODD = st.integers(0, 9).map(lambda kind: kind == 0)


@st.composite
def nearly_convex(draw: st.DrawFn) -> list[list[float]]:
    """Draw corners on an ellipse that is moved, stretched, and slightly wrong."""
    angles = draw(st.lists(st.floats(0.0, 6.28), min_size=2, max_size=17))
    flat, size, dust = draw(DUST) or 1.0, draw(MAGNITUDE), draw(DUST)
    x, y = draw(st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)))
    far = draw(st.sampled_from([0.0, 0.0, 1.0, 1e6, 1e12]))
    order = angles if draw(st.integers(0, 5)) == 0 else sorted(angles, reverse=draw(st.booleans()))
    shifts = draw(st.lists(st.floats(-1.0, 1.0), min_size=len(order), max_size=len(order)))
    return [
        [size * (math.cos(a) + dust * shift + far * x), size * (flat * math.sin(a) + far * y)]
        for a, shift in zip(order, shifts, strict=True)
    ]


OUTLINE = st.integers(0, 5).flatmap(lambda kind: nearly_convex() if kind else ANY)


@st.composite
def shaped(draw: st.DrawFn) -> dict[str, Any]:
    """Draw a scenario of one block with an outline, or of a structure of such cells."""
    stone = {"density": 2000, "young_modulus": 1e9, "poisson_ratio": 0.2}
    data: dict[str, Any] = {"schema": 1, "name": "bad", "materials": {"stone": stone}}
    block = {"depth": draw(st.floats(1e-3, 10.0) | NUMBER) if draw(ODD) else 1, "material": "stone"}
    if draw(st.booleans()):
        return data | {
            "blocks": {"b": {**block, "outline": draw(OUTLINE)}},
            "bodies": [{"block": "b", "x": 0, "y": 10}],
        }
    region = {"kind": "voronoi", "count": draw(st.integers(1, 40)), "region": draw(OUTLINE)}
    cells = {"kind": "polygons", "cells": [{"outline": draw(OUTLINE)} for _ in range(draw(st.integers(0, 3)))]}
    return data | {"blocks": {"b": block}, "structures": [{"block": "b", **draw(st.sampled_from([region, cells]))}]}


def _without_none(value: Any) -> Any:
    match value:
        case dict():
            return {key: _without_none(one) for key, one in value.items() if one is not None}
        case list():
            return [_without_none(one) for one in value if one is not None]
        case _:
            return value


@tries(3000)
def test_odd_outlines_are_refused_with_their_place_or_have_a_mass(child: Child, folder: Path, tried: int) -> None:
    def check(data: dict[str, Any]) -> None:
        (folder / "bad.toml").write_text(tomli_w.dumps(_without_none(data)), encoding="utf-8")
        left = child.call(folder, "check", "bad.toml", "--json")
        assert_harmless(left, {0, 65})
        if left.code == 0:
            bodies = json.loads(left.out, parse_constant=pytest.fail)["bodies"]
            assert bodies
            assert all(body["mass"] > 0.0 and body["inertia"] > 0.0 for body in bodies)
        else:
            assert "bad.toml:" in left.err, left.err

    search(tried, shaped(), check)
