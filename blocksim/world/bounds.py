"""How large, high and fast the blocks of a scene are at the start, and how fast they may become.

Time steps and skins are chosen by these bounds, known before anything moves.
"""

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.kernels.common.arrays import OUTLINE, Records
from blocksim.scenario import Scenario
from blocksim.scenario.drives import greatest_rate
from blocksim.scenario.motion import motion_pieces
from blocksim.world.applied import greatest_push, steepest_tilt
from blocksim.world.drives import driven_speed, highest_rise
from blocksim.world.interactions import Interactions
from blocksim.world.shapes import Shapes


class Kind(NamedTuple):
    """Blocks that are alike."""

    half_x: float  # m
    half_y: float  # m
    inverse_mass: float  # 1/kg
    inverse_inertia: float  # 1/(kg m2)
    contact_class: int


class Bounds(NamedTuple):
    """Of the blocks of one scene, without the ground and its pieces."""

    smallest: float  # m, smallest side; infinite where there are no blocks
    top: float  # m, no corner is higher
    speed: float  # m/s, no point is faster
    mass: float  # kg, of all free ones
    free: int  # blocks that are not fixed
    kinds: frozenset[Kind]
    grounds: frozenset[int]  # contact classes of the half-plane and its pieces
    standing: frozenset[Kind]  # blocks on each of their faces, as `standing_of` has them


def bounds_of(bodies: NDArray[np.record], blocks: int, shapes: Sequence[Shapes | None]) -> list[Bounds]:
    """Return the bounds of scenes, given their bodies (m, n + 1), of which so many are blocks, and shapes of blocks."""
    all_blocks = bodies[:, :blocks]
    columns = {name: np.ascontiguousarray(all_blocks[name]) for name in ("radius", "half_x", "half_y", "mass")}
    sides = 2.0 * np.minimum(columns["half_x"], columns["half_y"])
    if any(shape is not None for shape in shapes):
        sides = np.where(all_blocks["faces"] == OUTLINE, all_blocks["least_width"], sides)
    smallest = sides.min(axis=1, initial=math.inf)
    top = np.max(all_blocks["y"] + columns["radius"], axis=1, initial=-math.inf)
    speed = np.max(
        np.hypot(all_blocks["vx"], all_blocks["vy"]) + columns["radius"] * np.abs(all_blocks["spin"]),
        axis=1,
        initial=0.0,
    )
    # one by one: the order of a sum must not depend on which other scenes there are
    masses = [float(np.sum(mass[mass > 0.0])) for mass in columns["mass"]]
    free = np.count_nonzero(columns["mass"] > 0.0, axis=1).tolist()
    columns_of_kinds = zip(*(all_blocks[name].tolist() for name in Kind._fields), strict=True)
    kinds = [frozenset(map(Kind, *one)) for one in columns_of_kinds]
    standing = [
        one if shape is None else standing_of(bodies, shape)
        for one, bodies, shape in zip(kinds, all_blocks, shapes, strict=True)
    ]
    grounds = bodies["contact_class"][:, blocks:].tolist()
    rows = zip(smallest.tolist(), top.tolist(), speed.tolist(), masses, free, kinds, grounds, standing, strict=True)
    return [
        Bounds(side, height, pace, mass, count, kind, frozenset(ground), faces)
        for side, height, pace, mass, count, kind, ground, faces in rows
    ]


def standing_of(blocks: NDArray[np.record], shapes: Shapes) -> frozenset[Kind]:
    """Return the blocks of a scene as they stand, a polygon on each of its faces.

    In place of `half_x` is how far along the face a corner is from the foot of the centroid, at most, and in place of
    `half_y` the distance of the face: what half sides are to a rectangle.
    """
    kinds: set[Kind] = set()
    for block, first, size in zip(blocks, shapes.firsts, shapes.sizes, strict=False):
        kind = Kind(*(block[name].item() for name in Kind._fields))
        if block["faces"] == OUTLINE:
            faces = _faces_of(shapes.table[first : first + size].view(np.recarray))
            kinds.update(kind._replace(half_x=reach, half_y=distance) for reach, distance in faces)
        else:
            kinds.add(kind)
    return frozenset(kinds)


def _faces_of(corners: Records) -> Iterator[tuple[float, float]]:
    """Yield how far (m) the corners of each face are from the foot of the centroid, and its distance (m)."""
    tangents = np.stack([-corners["ny"], corners["nx"]])
    places = np.stack([corners["x"], corners["y"]])
    ends = np.abs(np.stack([(tangents * places).sum(axis=0), (tangents * np.roll(places, -1, axis=1)).sum(axis=0)]))
    yield from zip(ends.max(axis=0).tolist(), corners["distance"].tolist(), strict=True)


def fastest_fall(scenario: Scenario, bounds: Bounds) -> float:
    """Return the speed (m/s) at which the highest corner would reach the lowest ground, from rest."""
    lowest = min((y for _, y in scenario.ground.profile or ()), default=0.0)
    height = max(0.0, bounds.top + highest_rise(scenario) - lowest)
    return math.sqrt(2.0 * scenario.gravity * math.cos(scenario.ground.tilt) * height)


def impact_speed(scenario: Scenario, bounds: Bounds) -> float:
    """Return the bound (m/s) of the speed of any point of a block that does not slide downhill."""
    return math.hypot(given_speed(scenario, bounds), fastest_fall(scenario, bounds))


def given_speed(scenario: Scenario, bounds: Bounds) -> float:
    """Return the greatest speed (m/s) of any point of a block that the scenario itself gives."""
    new = (event.velocity for event in scenario.events)
    sizes = [math.hypot(block.size_x, block.size_y) for block in scenario.blocks.values()]
    given = (
        math.hypot(one.vx or 0.0, one.vy or 0.0) + 0.5 * max(sizes, default=0.0) * abs(one.spin or 0.0)
        for one in new
        if one is not None
    )
    return max(bounds.speed, driven_speed(scenario), *given)


def greatest_speed(scenario: Scenario, bounds: Bounds, table: Interactions) -> float:
    """Return the bound (m/s) of the speed of any point of a block."""
    tilt = steepest_tilt(scenario)
    held = least_support_friction(bounds, table) * math.cos(tilt)
    pull = max(0.0, scenario.gravity * (math.sin(tilt) - held) + greatest_push(scenario))
    return impact_speed(scenario, bounds) + pull * scenario.time.end


def least_support_friction(bounds: Bounds, table: Interactions) -> float:
    """Return the least kinetic friction of free blocks with the ground, its pieces and fixed blocks.

    On one another blocks do not slide farther than they are long.
    """
    free = {kind.contact_class for kind in bounds.kinds if kind.inverse_mass > 0.0}
    fixed = {kind.contact_class for kind in bounds.kinds if not kind.inverse_mass > 0.0}
    pairs = itertools.product({*fixed, *bounds.grounds}, free)
    return min((table[i][j].kinetic_friction for i, j in pairs), default=math.inf)


def support_speed(scenario: Scenario) -> float:
    """Return the greatest speed (m/s) of the support, zero where it does not move."""
    if scenario.motion is None:
        return 0.0
    return greatest_rate(motion_pieces(scenario))
