"""What `check` says of rigid contacts is what blocks do."""

from __future__ import annotations

from typing import Any

import pytest

from blocksim.bench.scenes import three_blocks
from blocksim.scenario import place_bodies
from blocksim.verification.scene import HEIGHT, Scene
from blocksim.world.describe import describe
from blocksim.world.sag import column_sag, point_stiffness


def stack(count: int, **time: Any) -> Scene:
    bodies = [{"y": (i + 0.5) * HEIGHT} for i in range(count)]
    rigid = {"scheme": "nonsmooth", "step": 1e-3, "velocity_tolerance": 1e-6, "end": 10.0, **time}
    return Scene(bodies, restitution=0.0, time=rigid)


@pytest.mark.parametrize(("count", "substeps"), [(1, 4), (5, 1), (5, 4)])
def test_column_sinks_by_what_is_told(count: int, substeps: int) -> None:
    scene = stack(count, substeps=substeps)
    told = describe(scene.scenario()).rigid
    run = scene.start().to_time(2.0)
    assert told is not None
    assert told.blocks == count
    assert (count - 0.5) * HEIGHT - run.bodies.y[-1] == pytest.approx(told.sag, rel=1e-3)


def test_sag_goes_with_the_square_of_the_substep_and_not_with_the_mass() -> None:
    one = place_bodies(stack(1).scenario())[0]
    heavy = one._replace(density=2.0 * one.density)
    assert column_sag(2e-4, one, 3, 9.81) == pytest.approx(4.0 * column_sag(1e-4, one, 3, 9.81))
    assert point_stiffness(1e-4, [one, one]) == pytest.approx(0.5 * point_stiffness(1e-4, [one]))
    assert column_sag(1e-4, heavy, 3, 9.81) == pytest.approx(column_sag(1e-4, one, 3, 9.81))


def test_pairs_are_told_without_springs_and_with_what_they_give_way_by() -> None:
    ground, block = describe(three_blocks(time={"scheme": "nonsmooth"})).pairs
    for pair in (ground, block):
        assert pair.normal_damping_ratio is pair.shear_damping_ratio is pair.shear_stiffness_ratio is None
        assert set(pair.rules) == {"friction", "restitution"}
        assert pair.stiffness_unit == "N/m"
    assert ground.normal_stiffness == pytest.approx(2.0 * block.normal_stiffness)


def test_springs_have_no_sag_to_tell_of() -> None:
    assert describe(three_blocks()).rigid is None
