"""Four numbers at a time are each rounded as one alone, and records are read by place."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from blocksim.kernels.common.arrays import BODY, Records, zeros
from blocksim.kernels.common.jit import entry_kernel, kernel
from blocksim.kernels.common.simd import (
    WIDTH,
    Lane,
    Lanes,
    branch,
    greater,
    lesser,
    load,
    select,
    store,
)
from blocksim.kernels.nonsmooth.arrays import BEFORE, CONSTRAINT, PACK, STATE

FIELDS = {
    "LINE": (STATE, "vx vy spin inverse_mass inverse_inertia dx dy turned", 0),
    "BEFORE": (BEFORE, "vx vy spin lifted", 0),
    "ROW": (
        CONSTRAINT,
        "nx ny arm_a arm_b width shear_arm_a shear_arm_b gap_one gap_two normal_one normal_two shear",
        0,
    ),
    "BODY": (BODY, "x y angle cos sin", 0),
    "BODY, half sides": (BODY, "half_x half_y", 18),
}


@pytest.mark.parametrize(("kind", "names", "first"), FIELDS.values(), ids=FIELDS)
def test_records_have_their_fields_where_lanes_look_for_them(kind: np.dtype[Any], names: str, first: int) -> None:
    assert kind.fields is not None
    offsets = [kind.fields[name][1] for name in names.split()]
    assert offsets == [8 * (first + k) for k in range(len(offsets))]
    assert {kind[name] for name in names.split()} == {np.dtype(np.float64)}


@kernel
def mixed(x: Lanes, y: Lanes) -> Lanes:
    """Do a bit of everything."""
    sum_ = x + 2.0 * y - x / (y * y + 0.1)
    either = select((sum_ > 0.0) & (x <= y), greater(sum_, abs(y)), lesser(-x, y) * sum_)
    return branch(either > x, either, 0.5) + branch(x > 0.0, -0.5, y)


@kernel
def apply(group: Any, lane: Lane) -> None:
    """Apply it to two fields of a group."""
    store(lane, group.shear, mixed(load(lane, group.nx), load(lane, group.ny)))


@entry_kernel
def in_fours(groups: Records) -> None:
    """Apply it to all lanes at once."""
    for group in groups:
        apply(group, None)


@entry_kernel
def one_by_one(groups: Records) -> None:
    """Apply it to every lane alone."""
    for group in groups:
        for k in range(4):
            apply(group, k)


def random_groups(seed: int) -> Records:
    groups = zeros(50, PACK)
    random = np.random.default_rng(seed)
    groups["nx"], groups["ny"] = random.normal(size=(2, 50, WIDTH))
    return groups


def test_lanes_have_the_bits_of_single_numbers() -> None:
    fours, singles = random_groups(1), random_groups(1)
    in_fours(fours)
    one_by_one(singles)
    assert np.any(fours["shear"] != 0.0)
    assert np.array_equal(fours["shear"], singles["shear"])
    x, y = fours["nx"], fours["ny"]
    total = x + 2.0 * y - x / (y * y + 0.1)
    expected = np.where((total > 0.0) & (x <= y), np.maximum(total, np.abs(y)), np.minimum(-x, y) * total)
    expected = np.where(expected > x, expected, 0.5) + np.where(x > 0.0, -0.5, y)
    assert fours["shear"] == pytest.approx(expected, rel=1e-15)
