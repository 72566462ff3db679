"""How large, high and fast the blocks of a scene are at the start: what steps and skins are chosen by."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Kind(NamedTuple):
    """Blocks that are alike."""

    half_x: float  # m
    half_y: float  # m
    inverse_mass: float  # 1/kg
    inverse_inertia: float  # 1/(kg m2)
    contact_class: int


class Bounds(NamedTuple):
    """Of the blocks of one scene, without the ground and its pieces."""

    smallest: float  # m, smallest side
    top: float  # m, no corner is higher
    speed: float  # m/s, no point is faster
    mass: float  # kg, of all free ones
    free: int  # blocks that are not fixed
    kinds: frozenset[Kind]
    grounds: frozenset[int]  # contact classes of the half-plane and its pieces


def bounds_of(bodies: NDArray[np.record], blocks: int) -> list[Bounds]:
    """Return the bounds of scenes, given their bodies (m, n + 1) of which so many are blocks."""
    all_blocks = bodies[:, :blocks]
    columns = {name: np.ascontiguousarray(all_blocks[name]) for name in ("radius", "half_x", "half_y", "mass")}
    smallest = 2.0 * np.minimum(columns["half_x"].min(axis=1), columns["half_y"].min(axis=1))
    top = np.max(all_blocks["y"] + columns["radius"], axis=1)
    speed = np.max(
        np.hypot(all_blocks["vx"], all_blocks["vy"]) + columns["radius"] * np.abs(all_blocks["spin"]), axis=1
    )
    # one by one: the order of a sum must not depend on which other scenes there are
    masses = [float(np.sum(mass[mass > 0.0])) for mass in columns["mass"]]
    free = np.count_nonzero(columns["mass"] > 0.0, axis=1).tolist()
    kinds = zip(*(all_blocks[name].tolist() for name in Kind._fields), strict=True)
    grounds = bodies["contact_class"][:, blocks:].tolist()
    rows = zip(smallest.tolist(), top.tolist(), speed.tolist(), masses, free, kinds, grounds, strict=True)
    return [
        Bounds(side, height, pace, mass, count, frozenset(map(Kind, *kind)), frozenset(ground))
        for side, height, pace, mass, count, kind, ground in rows
    ]
