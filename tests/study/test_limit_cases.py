"""Limits of the literature, in both schemes: Goodman & Bray's slope, and diamonds of half-overlapped rows."""

from pathlib import Path
from typing import Any

import pytest

from blocksim.scenario import Document, load_scenario
from blocksim.study.limit import limit
from blocksim.study.limit_plan import with_scheme
from blocksim.study.run import run

SCHEMES = ("nonsmooth", "explicit")
SLOPE = Path(__file__).parents[2] / "scenarios" / "toppling_slope.toml"
FRICTION = "friction.block_block"
WIDTH, HEIGHT = 0.2, 0.1  # m
STONE = {"density": 2500, "young_modulus": "30 GPa", "poisson_ratio": 0.2}


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_slope_of_columns_topples_below_the_friction_of_its_limit_equilibrium(tmp_path: Path, scheme: str) -> None:
    document = with_scheme(Document.read(SLOPE), scheme)
    span = {FRICTION: {"from": "37.8 deg", "to": "38.6 deg", "count": 2}}
    (change,) = limit(
        document.with_values({"time.end": 6.0}), span, out=tmp_path, tolerance=1e-2, keep_runs=False
    ).limits
    # 38.15 degrees, a little more with springs. Admissible forces exist down to 33.4 degrees, but columns that nothing
    # has loaded before they move mobilise friction as the toppling mechanism does, which is what the textbook assumes.
    assert change.low < 38.3
    assert change.high > 38.0
    assert (change.below, change.above) == ("falls", "stands")


@pytest.mark.long
@pytest.mark.parametrize("scheme", SCHEMES)
def test_the_limit_of_the_slope_is_that_of_goodman_and_bray_within_a_tenth_of_a_degree(
    tmp_path: Path, scheme: str
) -> None:
    document = with_scheme(Document.read(SLOPE), scheme)
    (change,) = limit(document, {FRICTION: {"from": "33 deg", "to": "45 deg"}}, out=tmp_path, keep_runs=False).limits
    assert (change.low, change.high) == pytest.approx((38.15, 38.15), abs=0.1)


def rows_of(*counts: int, scheme: str) -> dict[str, Any]:
    """Return rows of so many blocks from below, each centred: half overlapped where they differ by one."""
    time = {"step": 2e-4} if scheme == "nonsmooth" else {}  # with 1 ms, what contacts give way grows to a fall
    return {
        "schema": 1,
        "name": "rows",
        "materials": {"stone": STONE},
        "blocks": {"b": {"width": WIDTH, "height": HEIGHT, "length": 0.1, "material": "stone"}},
        "bodies": [
            {"block": "b", "x": WIDTH * (i - 0.5 * (count - 1)), "y": HEIGHT * (row + 0.5)}
            for row, count in enumerate(counts)
            for i in range(count)
        ],
        "friction": {"block_block": 0.0, "block_ground": 0.0},
        "contact": {"restitution": 0.0} | ({"stiffness_scale": 0.1} if scheme == "explicit" else {}),
        "time": {"scheme": scheme, "end": 0.4, **time},
        "output": {"every": 0.05},
    }


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize(
    ("counts", "outcome"),
    [
        ((1, 2, 3, 4, 3, 2, 1), "stands"),
        ((1, 2, 3, 4, 5, 4, 3, 2, 1), "fell"),
        ((1, 2, 3), "fell"),
    ],
)
def test_of_frictionless_diamonds_the_one_with_four_blocks_across_is_the_largest_that_stands(
    counts: tuple[int, ...], outcome: str, scheme: str
) -> None:
    found = run(load_scenario(rows_of(*counts, scheme=scheme)))
    assert found.summary.movement is not None
    assert found.summary.movement.outcome == outcome
