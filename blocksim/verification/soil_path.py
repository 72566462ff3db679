"""S8: the path of one particle, by the law itself: compression beside a constant pressure, shear, a rigid turn."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from blocksim.kernels.common.arrays import zeros
from blocksim.kernels.soil.arrays import STATE
from blocksim.kernels.soil.stress import invariants, strain
from blocksim.verification.case import Row, Setting, absolute, relative
from blocksim.verification.soil_scene import ACTIVE, COARSE, FAR, SoilScene

if TYPE_CHECKING:
    from collections.abc import Iterator

STEP = 1e-5  # s
STEPS = 3000  # at a strain rate of 1/s: a strain of 3 %, a hundred times that at yield
PRESSURE = 1e3  # Pa
NUDGE = 0.01  # 1/s
STRESSES = ("sxx", "syy", "szz", "sxy")


def _under(sxx: float, syy: float, szz: float, sxy: float = 0.0) -> Any:
    state = zeros(1, STATE)[0]
    for name, value in zip(STRESSES, (sxx, syy, szz, sxy), strict=True):
        state[name] = value
    return state


def _strained(state: Any, kind: Any, sideways: float) -> Any:
    """Return a copy of a particle after a step of upright compression and a strain rate (1/s) sideways."""
    after = state.copy()
    strain(after, kind, sideways, 0.0, 0.0, -1.0, STEP)
    return after


def _least_over_largest(kind: Any) -> float:
    """Compress a particle upright beside a constant pressure; return the ratio of the stresses."""
    state, sideways = _under(-PRESSURE, -PRESSURE, -PRESSURE), 0.0
    for _ in range(STEPS):
        for _ in range(2):  # the stress sideways is all but linear in the strain of one step
            one, other = (_strained(state, kind, rate).sxx for rate in (sideways, sideways + NUDGE))
            sideways -= NUDGE * (one + PRESSURE) / (other - one)
        state = _strained(state, kind, sideways)
    return float(state.sxx / state.syy)


def _shear_over_strength(kind: Any) -> float:
    """Shear a particle under pressure; return the root of J2 over a I1."""
    state = _under(-PRESSURE, -PRESSURE, -PRESSURE)
    for _ in range(STEPS):
        strain(state, kind, 0.0, 1.0, 0.0, 0.0, STEP)
    total, deviator = invariants(state.sxx, state.syy, state.szz, state.sxy)
    return float(deviator / (kind.cohesion - kind.slope * total))


def _stress_of_a_turn(kind: Any) -> float:
    """Turn a stressed particle by 90 degrees; return how far its stress is from the turned one, as a share."""
    before = (-600.0, -500.0, -550.0, 30.0)  # inside the yield surface
    state = _under(*before)
    steps = round(0.5 * math.pi / (100.0 * STEP))
    spin = 0.5 * math.pi / (steps * STEP)
    for _ in range(steps):
        strain(state, kind, 0.0, -spin, spin, 0.0, STEP)
    turned = (before[1], before[0], before[2], -before[3])
    off = max(abs(float(state[name]) - value) for name, value in zip(STRESSES, turned, strict=True))
    return off / abs(before[0])


def path(_: Setting) -> Iterator[Row]:
    """Lead one particle of the soil of all cases along three paths."""
    kind = SoilScene((0.04, 0.04), COARSE, bodies=[FAR]).soils.kinds[0]
    yield relative("compression: least / largest stress", "", ACTIVE, _least_over_largest(kind), 1e-4)
    yield relative("shear: √J₂ / α I₁", "", 1.0, _shear_over_strength(kind), 1e-4)
    yield absolute("turn by 90°: stress off / stress", "", 0.0, _stress_of_a_turn(kind), 0.005)
