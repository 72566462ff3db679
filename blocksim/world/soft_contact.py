"""Feedback of the position pass of rigid contacts: a spring and a dashpot that follow from the substep alone."""

import math
from typing import NamedTuple

FREQUENCY = 0.125  # of the soft contact, per substep: w h = 2 pi / 8. Above 0.15 walls spread like a fluid
DAMPING = 10.0  # damping ratio of the soft contact


class SoftContact(NamedTuple):
    """Feedback of the position pass; see blocksim.kernels.nonsmooth."""

    bias: float  # 1/s: b
    softness: float  # -: gamma / A
    frequency: float  # 1/s: w, so that the stiffness at rest is w^2 / A


def soft_contact(substep: float) -> SoftContact:
    """Return the feedback for a substep (s)."""
    turn = 2.0 * math.pi * FREQUENCY  # w h
    return SoftContact(turn / substep / (turn + 2.0 * DAMPING), 1.0 / (turn * (turn + 2.0 * DAMPING)), turn / substep)
