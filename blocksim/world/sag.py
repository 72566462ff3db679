"""Overlap of rigid contacts at rest: the position pass holds blocks apart like springs, stiffer for small steps.

At rest s = -F A / w^2 for a contact point that carries F, A = J M^-1 J^T, w = 2 pi f / h (blocksim.kernels.nonsmooth):
a spring of w^2 / A, proportional to 1 / h^2. Of two blocks in face contact A = sum of 1/m + r^2/I over both, with half
a side as the lever arm r, as far as the point is from the middle.
"""

import math
from collections import defaultdict
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from blocksim.scenario import PlacedBody
from blocksim.world.loads import loads_at_rest

FREQUENCY = 0.125  # of the soft contact, per substep: w h = 2 pi / 8. Above 0.15 walls spread like a fluid
DAMPING = 10.0  # damping ratio of the soft contact
WARNING_SHARE = 0.01  # of the smallest side
MILLI = 1e3


class SoftContact(NamedTuple):
    """Feedback of the position pass; see blocksim.kernels.nonsmooth."""

    bias: float  # 1/s: b
    softness: float  # -: gamma / A
    frequency: float  # 1/s: w, so that the stiffness at rest is w^2 / A


def soft_contact(substep: float) -> SoftContact:
    """Return the feedback for a substep (s)."""
    turn = 2.0 * math.pi * FREQUENCY  # w h
    return SoftContact(turn / substep / (turn + 2.0 * DAMPING), 1.0 / (turn * (turn + 2.0 * DAMPING)), turn / substep)


def inverse_mass(body: PlacedBody) -> float:
    """Return A (1/kg) of one block for a point at the end of its lower face, as it was made; zero where it is fixed."""
    return 0.0 if body.fixed else 1.0 / body.mass + (0.5 * body.size_x) ** 2 / body.inertia


def point_stiffness(substep: float, blocks: Iterable[PlacedBody]) -> float:
    """Return the stiffness (N/m) of one contact point of one block with the ground, or of two with each other."""
    total = sum(map(inverse_mass, blocks))
    return soft_contact(substep).frequency ** 2 / total if total > 0.0 else float("inf")


class Sag(NamedTuple):
    """Sag of blocks in the initial arrangement (m): the one that sinks most, and the contact that overlaps most."""

    sag: float
    block: str
    overlap: float


def scene_sag(substep: float, placed: Sequence[PlacedBody], gravity: float) -> Sag:
    """Return the sag of the blocks of a scene at rest on one another; see loads.py.

    The stiffness w^2 / A of a contact goes with the smaller mass of its pair, not with what it carries. So a heavy
    block on a light one sinks by their ratio further than equal blocks.
    """
    square = soft_contact(substep).frequency ** 2
    sunk = [0.0] * len(placed)
    most = 0.0
    loads = list(loads_at_rest(placed, gravity))
    total: defaultdict[int, float] = defaultdict(float)
    for load in loads:
        total[load.upper] += load.force
    for load in reversed(loads):  # from below upwards
        if load.force > 0.0:
            lower = None if load.lower is None else placed[load.lower]
            compliance = _inverse_mass_at(placed[load.upper], load.x) + (
                _inverse_mass_at(lower, load.x) if lower else 0.0
            )
            overlap = load.force * compliance / square
            below = 0.0 if load.lower is None else sunk[load.lower]
            sunk[load.upper] += load.force / total[load.upper] * (overlap + below)
            most = max(most, overlap)
    deepest = max(range(len(placed)), key=sunk.__getitem__)
    return Sag(sunk[deepest], placed[deepest].name, most)


def _inverse_mass_at(body: PlacedBody, x: float) -> float:
    """Return A (1/kg) of one block for a vertical force at x (m)."""
    return 0.0 if body.fixed else 1.0 / body.mass + (x - body.x) ** 2 / body.inertia


def arch_shortening(voussoir: PlacedBody, count: int, thickness: float, gravity: float) -> float:
    """Return w^2 times the overlap (m) of all joints of an arch of a thickness (m), if each gives way as the lowest do.

    The springings carry half the weight each, N = n m g / 2, as far from the middle of the joint as its end:
    s = N A / w^2 with A = 2 (1/m + (t/2)^2 / I). So an arch of n voussoirs is shorter by n^2 g (1 + m t^2 / 4 I) / w^2.
    """
    return count**2 * gravity * (1.0 + 0.25 * voussoir.mass * thickness**2 / voussoir.inertia)


def overlap_warning(overlap: float, smallest: float) -> str:
    """Return a warning of an overlap (m) at rest, given the smallest side (m); nothing where it is small."""
    if not overlap > WARNING_SHARE * smallest:
        return ""
    return (
        f"rigid contacts overlap by {MILLI * overlap:.3g} mm at rest, above {WARNING_SHARE:.0%} of the smallest side "
        f"({MILLI * smallest:.4g} mm): a light block carries a heavy one; overlaps grow with time.step squared"
    )
