"""Forces in the joints of a run, and their picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from blocksim import plot, replace, run
from blocksim.errors import InvalidInputError
from blocksim.view.thrust import run_joints

if TYPE_CHECKING:
    from pathlib import Path

    from blocksim.simulation.results import Result

STONE = {"density": 2000.0, "young_modulus": 1e10, "poisson_ratio": 0.2}
WEIGHT = 2000.0 * 9.81 * 0.2 * 0.1  # N


@pytest.fixture(scope="module")
def stack(tmp_path_factory: pytest.TempPathFactory) -> Result:
    """Two blocks on one another, the upper one 50 mm to the right, pushed to the right by a quarter of its weight."""
    push = {"kind": "force", "body": "2", "magnitude": 0.25 * WEIGHT}
    scenario = {
        "schema": 1,
        "name": "stack",
        "gravity": 9.81,
        "materials": {"stone": STONE},
        "blocks": {"b": {"width": 0.2, "height": 0.1, "length": 1.0, "material": "stone"}},
        "bodies": [{"block": "b", "x": 0.0, "y": 0.05}, {"block": "b", "x": 0.05, "y": 0.15}],
        "friction": {"block_block": 0.6, "block_ground": 0.6},
        "loads": [push],
        "start": {"settle": True},
        "time": {"scheme": "nonsmooth", "end": 0.02},
        "output": {"contacts": True},
    }
    return run(scenario, out=tmp_path_factory.mktemp("thrust") / "run")


def test_joints_of_a_run_carry_what_is_above_them_where_moments_put_it(stack: Result) -> None:
    upper, lower = sorted(run_joints(stack.frames, len(stack.frames) - 1), key=lambda one: -one.y_m)
    assert ({upper.one, upper.other}, {lower.one, lower.other}) == ({"1", "2"}, {None, "1"})
    for joint, count in ((upper, 1.0), (lower, 2.0)):
        up = 1.0 if joint.other == max(filter(None, (joint.one, joint.other))) else -1.0  # out of the lower body
        assert joint.normal == pytest.approx((0.0, up), abs=1e-4)
        assert joint.compression == pytest.approx(count * WEIGHT, rel=1e-3)
        assert abs(joint.shear) == pytest.approx(0.25 * WEIGHT, rel=1e-2)
    # moments about the joints: a quarter of the weight 50 and 150 mm above them, weights at 0 and 50 mm
    assert upper.x_m == pytest.approx(0.05 + 0.25 * 0.05, abs=1e-4)
    assert lower.x_m == pytest.approx((0.05 + 0.25 * 0.15) / 2.0, abs=1e-4)
    assert upper.margin_m == pytest.approx(0.1 - upper.x_m, abs=1e-3)  # the joint ends at 100 mm
    assert lower.margin_m == pytest.approx(0.1 - lower.x_m, abs=1e-3)


def test_thrust_of_a_run_is_a_picture_and_needs_contacts(stack: Result, tmp_path: Path) -> None:
    picture = plot(stack, kind="thrust", out=tmp_path / "thrust.png")
    assert picture.read_bytes().startswith(b"\x89PNG")
    bare = run(replace(stack.scenario, {"output.contacts": False}), out=tmp_path / "bare")
    with pytest.raises(InvalidInputError, match="has stored no contacts"):
        plot(bare, kind="thrust", out=tmp_path / "none.png")
