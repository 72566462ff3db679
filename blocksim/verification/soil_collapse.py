"""S7, S9, S10: what soil that moves conserves, how far columns of it run, how much of their energy they keep."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from blocksim.verification.case import Row, Setting, absolute, relative
from blocksim.verification.soil_scene import COARSE, DENSITY, DEPTH, FINE, GRADIENTS, ROUGH, TALL, SoilScene
from blocksim.world.systems.soil_shown import connected

if TYPE_CHECKING:
    from collections.abc import Iterator

FINEST = 0.00125  # m
REFERENCES = ((0.1 / 0.7, "143"), (0.1, "100"), (0.1 / 1.5, "67"))  # m: widths of the source's columns
STRIKER = 0.04  # m: side of a block that is thrown at soil
THROWN = 2.0  # m/s


def momentum_gained(gradient: str) -> float:
    """Throw a block at soil that flies apart, without gravity; return the momentum gained over all that moves.

    The last is the sum of m |v| of particles and block at the start.
    """
    striker = {"block": "striker", "x": -0.6 * STRIKER, "y": 0.52, "velocity": [THROWN, -0.3 * THROWN]}
    sides = {"width": STRIKER, "height": STRIKER, "length": DEPTH, "material": "block"}
    scene = SoilScene(
        (0.05, 0.05), COARSE, y=0.5, bodies=[striker], blocks={"striker": sides}, gravity=0.0, gradient=gradient
    )
    points = scene.points
    mass = scene.soils.kinds["mass"][scene.soils.states["kind"]]
    random = np.random.default_rng(7)
    for name in ("vx", "vy"):
        points[name] = random.uniform(-0.5, 0.5, len(points))
    block = DENSITY * STRIKER**2 * DEPTH

    def momentum() -> tuple[float, float]:
        body = scene.bodies[0]
        return (
            float(block * body["vx"] + mass[0] * scene.points["vx"].sum()),
            float(block * body["vy"] + mass[0] * scene.points["vy"].sum()),
        )

    moving = float(
        block * np.hypot(*scene.bodies[0][["vx", "vy"]].item()) + mass @ np.hypot(points["vx"], points["vy"])
    )
    before = momentum()
    scene.to_time(0.02)
    after = momentum()
    return float(np.hypot(after[0] - before[0], after[1] - before[1])) / moving


def conservation(_: Setting) -> Iterator[Row]:
    """Let a column 50 x 100 mm collapse, with both gradients; throw a block at soil that flies without gravity."""
    for gradient, prefix in GRADIENTS:
        scene = SoilScene((0.05, TALL), COARSE, walls=(0.0,), gradient=gradient)
        before = scene.entries()
        scene.to_time(0.25)
        after = scene.entries()
        residual = sum(after.values()) - sum(before.values())
        share = residual / before["soils_potential"]
        yield absolute(f"{prefix}energy off / at the start", "", 0.0, share, 0.002)
        yield absolute(f"{prefix}momentum gained / moving", "", 0.0, momentum_gained(gradient), 1e-12)


def columns_of_rods(setting: Setting) -> Iterator[Row]:
    """Let columns 100 mm high of three widths collapse: height left and run-out.

    The source's run-out is the largest, that of the last particle; the connected front is shown beside it.
    """
    square = REFERENCES[1]
    cases = [(column, COARSE, "raw") for column in REFERENCES]
    cases += [(square, spacing, "raw") for spacing in (FINE, FINEST)]
    cases += [(square, spacing, "corrected") for spacing in (COARSE, FINE)]
    for (width, name), spacing, gradient in cases[1:2] if setting.quick else cases:
        place = spacing * round(width / spacing)
        scene = SoilScene((place, TALL), spacing, walls=(0.0,), wall=ROUGH, gradient=gradient)
        scene.to_time(1.0)
        ratio = TALL / place
        x, y = scene.points["x"], scene.points["y"]
        front = connected(x, 2.0 * spacing)[1] + 0.5 * spacing
        height = float(y[x < 2.0 * spacing].max()) + 0.5 * spacing
        left = 1.0 if ratio <= 0.65 else 1.0 / (1.42 * ratio ** (2.0 / 3.0))  # noqa: PLR2004 - of the source
        run_out = 3.25 * ratio**0.96 if ratio <= 1.5 else 3.80 * ratio**0.73  # noqa: PLR2004 - of the source
        head = f"{dict(GRADIENTS)[gradient]}{name} mm, s {1e3 * spacing:g} mm"
        yield relative(f"{head}: height left", "", left, height / TALL, 0.07)
        last = float(x.max()) + 0.5 * spacing
        yield relative(f"{head}: run-out, last particle", "", run_out, (last - place) / place, 0.15)
        yield relative(f"{head}: run-out, connected", "", run_out, (front - place) / place, 0.15)


def energy_kept(setting: Setting) -> Iterator[Row]:
    """Let a column 200 x 100 mm collapse: potential energy left over that at the start.

    SPHinXsys has one yield surface, that called plane-strain-associated here: a weaker soil, sin(phi) = 3 a.
    """
    its, own = ("rods_of_SPHinXsys", "its surface"), ("rods", "Mohr–Coulomb")
    cases = [(COARSE, its, "raw"), (COARSE, own, "raw")]
    if not setting.quick:
        cases += [(0.004, its, "raw"), (0.004, own, "raw"), (FINE, its, "raw"), (0.002, its, "raw")]
        cases += [(COARSE, its, "corrected"), (FINE, its, "corrected")]
    for spacing, (material, name), gradient in cases:
        scene = SoilScene((0.2, TALL), spacing, walls=(0.0,), wall=ROUGH, material=material, gradient=gradient)
        before = scene.entries()["soils_potential"]
        scene.to_time(1.0)
        left = scene.entries()["soils_potential"] / before
        yield absolute(f"{dict(GRADIENTS)[gradient]}{name}, energy left, s {1e3 * spacing:g} mm", "", 0.691, left, 0.03)
