"""Least thickness of semicircular arches by limit analysis, beside which `blocksim limit` is drawn.

An arch under its own weight stands where each joint can carry the part above it: with the force inside the joint and
inside of the friction cone. By symmetry two numbers are unknown, thrust and its moment at the crown, and every joint
cuts half-planes off the plane of both; the arch stands where something of it is left.

`python -m blocksim.verification.arches scenarios/published/arch_thickness.csv` writes the table for the picture.
"""

import sys
from collections.abc import Sequence
from itertools import pairwise
from math import cos, pi, sin
from pathlib import Path
from typing import NamedTuple

import numpy as np

from blocksim.scenario.geometry import area_of, centroid

RADIUS = 10.0  # m, of scenarios/arch.toml
VOUSSOIRS = 27  # in it
WIDEST = 1.0  # thickness over mean radius: what does not stand with it does not stand
HALVINGS = 26
FAR = 100.0  # thrust and its moment, in weights of a ring as thick as its mean radius, are below this
FRICTIONS = (0.3092, 0.3095, 0.31, *(0.3125 + 0.00625 * number for number in range(14)), 0.395832, 0.4, 0.45, 0.5)
JOINTS = 100  # of a ring; five times as many change its thickness by 3e-6
COCCHETTI_RIZZI = ((0.309215, 0.200637), (0.395832, 0.107426), (0.5, 0.107426))
"""Friction and least thickness over mean radius of a ring whose weight lies on its centre line.

Cocchetti & Rizzi 2020: the least friction at all, the least at which no joint slides, and one above it.
"""
HEAD = """\
# Least thickness of the semicircular arch of ../arch.toml, mean radius 10 m, over the friction of its joints.
# Cocchetti & Rizzi (2020) give values of a ring with its weight on the centre line: from a friction of 0.395832 on no
# joint slides, and below 0.309215 nothing stands. The curves are limit analysis, of that ring and of 27 straight-edged
# voussoirs. Written by: python -m blocksim.verification.arches scenarios/published/arch_thickness.csv
over,limit [m],series
"""

Point = tuple[float, float]


class ArchJoint(NamedTuple):
    """A joint at an angle (rad) from the crown, weight of what is between both, and its moment about the crown."""

    angle: float
    weight: float
    moment: float


def voussoirs(count: int, thickness: float) -> list[ArchJoint]:
    """Return the joints on one side of an arch of mean radius 1; faces of voussoirs are straight between joints."""
    inner, outer = 1.0 - 0.5 * thickness, 1.0 + 0.5 * thickness
    turn = pi / count
    first = [0.0] if count % 2 else []  # the crown is in the middle of a voussoir
    angles = [*first, *(turn * (number + 0.5 * (count % 2)) for number in range(count // 2 + 1))]
    weight = moment = 0.0
    joints = [] if first else [ArchJoint(0.0, 0.0, 0.0)]
    for begin, end in pairwise(angles):
        places = [(inner, end), (outer, end), (outer, begin), (inner, begin)]
        corners = [(radius * sin(angle), radius * cos(angle)) for radius, angle in places]
        if first and begin == 0.0:  # half a voussoir, whose faces are level
            corners[2:] = [(0.0, outer * cos(end)), (0.0, inner * cos(end))]
        weight += area_of(corners)
        moment += area_of(corners) * centroid(corners)[0]
        joints.append(ArchJoint(end, weight, moment))
    return joints


def ring(count: int) -> list[ArchJoint]:
    """Return so many joints of a ring whose weight lies on its centre line, as Cocchetti and Rizzi have it."""
    angles = np.linspace(0.0, 0.5 * pi, count).tolist()
    return [ArchJoint(angle, angle, 1.0 - cos(angle)) for angle in angles]


def stands(joints: Sequence[ArchJoint], thickness: float, friction: float) -> bool:
    """Return True where some thrust and moment at the crown let every joint carry what is above it.

    A joint needs a thrust + b moment >= c, for both senses of sliding and both of its ends. Normal force N = H cos +
    W sin, shear V = W cos - H sin; N acts where its moment about the centre is K + M, of the thrust H at the crown and
    of the weight W.
    """
    left: list[Point] = [(0.0, -FAR), (FAR, -FAR), (FAR, FAR), (0.0, FAR)]
    inner, outer = 1.0 - 0.5 * thickness, 1.0 + 0.5 * thickness
    for angle, weight, moment in joints:
        c, s = cos(angle), sin(angle)
        needs = (
            (friction * c + s, 0.0, weight * (c - friction * s)),
            (friction * c - s, 0.0, -weight * (c + friction * s)),
            (-inner * c, 1.0, inner * weight * s - moment),
            (outer * c, -1.0, moment - outer * weight * s),
        )
        for line in needs:
            left = _cut(left, line)
            if not left:
                return False
    return True


def _cut(corners: Sequence[Point], line: tuple[float, float, float]) -> list[Point]:
    """Return what a half-plane leaves of a convex polygon."""
    a, b, c = line
    over = [a * x + b * y - c for x, y in corners]
    found: list[Point] = []
    for number, (x, y) in enumerate(corners):
        here, before = over[number], over[number - 1]
        if (here >= 0.0) != (before >= 0.0):
            share = before / (before - here)
            u, v = corners[number - 1]
            found.append((u + share * (x - u), v + share * (y - v)))
        if here >= 0.0:
            found.append((x, y))
    return found


def least_thickness(friction: float, count: int | None = VOUSSOIRS) -> float | None:
    """Return the least thickness over mean radius of so many voussoirs; None where no thickness stands.

    Without `count` that of a ring with its weight on the centre line.
    """
    low, high = 0.0, 2.0 * WIDEST  # so the widest is tried first
    for _ in range(HALVINGS + 1):
        middle = 0.5 * (low + high)
        joints = ring(JOINTS) if count is None else voussoirs(count, middle)
        low, high = (low, middle) if stands(joints, middle, friction) else (middle, high)
        if low >= WIDEST:
            return None
    return high


def table() -> str:
    """Return the table that is drawn beside `blocksim limit`."""
    rows = [(friction, share, "Cocchetti & Rizzi (2020), a ring") for friction, share in COCCHETTI_RIZZI]
    for count, series in ((None, "limit analysis of that ring"), (VOUSSOIRS, f"the same of {VOUSSOIRS} voussoirs")):
        least = {friction: least_thickness(friction, count) for friction in FRICTIONS}
        rows += [(friction, share, series) for friction, share in least.items() if share is not None]
    return HEAD + "".join(f'{over:.6g},{RADIUS * least:.4f},"{series}"\n' for over, least, series in rows)


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(table(), encoding="utf-8")
