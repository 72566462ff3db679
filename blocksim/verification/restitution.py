"""V4: measured restitution of flat and corner impacts is the requested one, at any speed and particle spacing."""

from __future__ import annotations

from itertools import product
from math import atan2
from typing import TYPE_CHECKING

from blocksim.verification.case import Row, Setting, absolute, farthest
from blocksim.verification.flight import SPACINGS
from blocksim.verification.scene import HEIGHT, WIDTH
from blocksim.verification.throws import GOLDEN, Throw, Thrower

if TYPE_CHECKING:
    from collections.abc import Iterator

ASKED = tuple(tenth / 10 for tenth in range(11))
SPEEDS = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0)  # m/s
LANDINGS = {"flat": 0.0, "corner": atan2(WIDTH, HEIGHT)}  # rad; the centre comes down upon the corner


def restitution(setting: Setting) -> Iterator[Row]:
    """Throw a block at 7 speeds for 11 restitutions at 4 spacings; the farthest off counts."""
    spacings = setting.distinct(SPACINGS[1:2] if setting.quick else SPACINGS)
    for landing, angle in LANDINGS.items():
        errors: dict[float, list[float]] = {asked: [] for asked in ASKED}
        for asked, spacing, (number, speed) in product(ASKED, spacings, enumerate(SPEEDS)):
            thrower = Thrower(setting, asked, speed, contact={"particle_spacing": spacing}, time=no_threshold(setting))
            body = thrower.throw(Throw(angle, phase=(GOLDEN * (number + 1 + 10 * asked)) % 1.0))
            errors[asked].append(float(body.vy) / speed - asked)
        worst = farthest(0.0, [error for asked in ASKED[1:] for error in errors[asked]])
        yield absolute(f"{landing}, e ≥ 0.1, off by", "", 0.0, worst, 0.01)
        yield absolute(f"{landing}, e = 0, rebound", "", 0.0, farthest(0.0, errors[0.0]), 0.01)


def no_threshold(setting: Setting) -> dict[str, object]:
    """Return the key of [time] that lets the slowest impacts rebound too; springs have no such threshold."""
    return {"restitution_threshold": 0.0} if setting.rigid else {}
