"""Outlines of any kind: refused with the place, or blocks of a finite mass; never a traceback, a hang or a NaN."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import pytest
import tomli_w
from hypothesis import given, settings, strategies as st

from tests.fuzz.conftest import LONG, QUICK, assert_harmless
from tests.sizes import in_all

if TYPE_CHECKING:
    from pathlib import Path

    from tests.fuzz.child import Child

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
LENGTH = st.integers(0, 15).flatmap(lambda kind: st.floats(1e-3, 10.0) if kind else st.one_of(NUMBER, MAGNITUDE))
COUNT = st.integers(0, 15).flatmap(
    lambda kind: st.integers(1, 40) if kind else st.one_of(NUMBER, st.integers(-1, 2000))
)
SHAPED = st.one_of(
    st.fixed_dictionaries(
        {"kind": st.just("arch"), "count": COUNT, "thickness": LENGTH, "radius": LENGTH},
        optional={
            "abutments": st.booleans(),
            "left": LENGTH,
            "embrace": st.sampled_from(["90 deg", "1 rad", 2, "1e-9 deg"]),
        },
    ),
    st.fixed_dictionaries(
        {"kind": st.just("column"), "count": COUNT, "height": LENGTH, "width": LENGTH}, optional={"top_width": LENGTH}
    ),
    st.fixed_dictionaries(
        {"kind": st.just("voronoi"), "count": COUNT, "width": LENGTH, "height": LENGTH},
        optional={"smallest": LENGTH, "relax": st.integers(0, 3)},
    ),
    st.fixed_dictionaries({"kind": st.just("voronoi"), "count": COUNT, "region": OUTLINE}),
    st.fixed_dictionaries(
        {"kind": st.just("rubble"), "count": COUNT, "columns": COUNT, "smallest": LENGTH, "largest": LENGTH},
        optional={"exponent": LENGTH, "gap": LENGTH},
    ),
    st.fixed_dictionaries(
        {
            "kind": st.just("polygons"),
            "cells": st.lists(st.fixed_dictionaries({"outline": OUTLINE}, optional={"fixed": NUMBER}), max_size=3),
        }
    ),
)


@st.composite
def scenes(draw: st.DrawFn) -> dict[str, Any]:
    """Draw a scenario of one block with an outline, or of one structure that shapes its blocks."""
    data: dict[str, Any] = {
        "schema": 1,
        "name": "bad",
        "materials": {"stone": {"density": 2000, "young_modulus": 1e9, "poisson_ratio": 0.2}},
        "time": {"scheme": "nonsmooth", "end": 0.01},
    }
    if draw(st.booleans()):
        block = (
            {"sides": draw(COUNT), "radius": draw(LENGTH)}
            if draw(ODD)
            else draw(st.fixed_dictionaries({"outline": OUTLINE}, optional={"upright": NUMBER} if draw(ODD) else {}))
        )
        body = {"block": "b", "x": draw(LENGTH), "y": draw(st.just(10.0) | LENGTH)}
        return data | {"blocks": {"b": {"depth": 1, "material": "stone", **block}}, "bodies": [body]}
    return data | {
        "blocks": {"b": {"depth": 1, "material": "stone"}},
        "structures": [{"block": "b", **draw(SHAPED)}],
    }


def _without_none(value: Any) -> Any:
    match value:
        case dict():
            return {key: _without_none(one) for key, one in value.items() if one is not None}
        case list():
            return [_without_none(one) for one in value if one is not None]
        case _:
            return value


def _check(child: Child, folder: Path, data: dict[str, Any]) -> None:
    (folder / "bad.toml").write_text(tomli_w.dumps(_without_none(data)), encoding="utf-8")
    left = child.call(folder, "check", "bad.toml", "--json")
    assert_harmless(left, {0, 65})
    if left.code == 0:
        bodies = json.loads(left.out, parse_constant=lambda word: pytest.fail(f"{word} in what check tells"))["bodies"]
        assert bodies
        assert all(body["mass"] > 0.0 and body["inertia"] > 0.0 for body in bodies)
    else:
        assert "bad.toml:" in left.err, left.err


@settings(max_examples=QUICK)
@given(data=scenes())
def test_odd_outlines_are_refused_with_their_place_or_have_a_mass(
    child: Child, folder: Path, data: dict[str, Any]
) -> None:
    _check(child, folder, data)


@pytest.mark.long
@settings(LONG, max_examples=in_all(3000))
@given(data=scenes())
def test_three_thousand_odd_outlines(child: Child, folder: Path, data: dict[str, Any]) -> None:
    _check(child, folder, data)
