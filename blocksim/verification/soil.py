"""S1 to S10: soil by itself and with blocks, against closed forms, measurements and another code; `verify --soil`.

S4 (angle of the shear band) is not measured; S8 (the law along one path) needs no scene and is in the tests of
kernels/soil/stress.py.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from blocksim.verification.case import Case, Row, Setting, absolute, at_least, count, relative
from blocksim.verification.soil_scene import (
    ANGLE,
    DENSITY,
    DEPTH,
    FAR,
    HEIGHT,
    ROUGH,
    SMOOTH,
    UNIT_WEIGHT,
    WIDTH,
    SoilScene,
    pressure_share,
)
from blocksim.world.systems.soil_shown import connected

if TYPE_CHECKING:
    from collections.abc import Iterator

SINE = math.sin(ANGLE)
ACTIVE = (1.0 - SINE) / (1.0 + SINE)
AT_REST = (1.0 - SINE / math.sqrt(3.0)) / (1.0 + 2.0 * SINE / math.sqrt(3.0))
COARSE, FINE = 0.005, 0.0025  # m
TALL = 0.1  # m
GRAVITY = 9.81
TOPPLED = math.radians(45.0)
SLIDING = 1e-4  # m in 0.1 s


def at_rest(setting: Setting) -> Iterator[Row]:
    """Let a column 60 x 100 mm settle between smooth walls."""
    spacing, width = COARSE if setting.quick else FINE, 0.06
    for start, tolerance in (("ramp", 0.01), ("geostatic", 0.01)):
        scene = SoilScene((width, TALL), spacing, walls=(0.0, width), base=SMOOTH, start=start)
        scene.to_time(0.3)
        thrust, base = scene.mean_force_on(1, 0.325)[0], scene.mean_force_on(-1, 0.35)[1]
        yield relative(f"{start}: base / weight", "", 1.0, -base / scene.weight, 0.005)
        yield relative(f"{start}: K on the wall", "", AT_REST, pressure_share(thrust, TALL), tolerance)


def active_share(spacing: float, base: float) -> float:
    """Return K of a smooth wall drawn back by 1 % of the height at 5 mm/s: the mean over its second half."""
    blocks = {"wall": {"width": 0.04, "height": 0.16, "length": DEPTH, "material": "wall"}}
    bodies = [{"block": "wall", "x": -0.02, "y": 0.08, "fixed": True}, FAR]
    scene = SoilScene((0.15, TALL), spacing, walls=(0.15,), base=base, bodies=bodies, blocks=blocks)
    scene.to_time(0.05)
    scene.world.bodies.vx[0] = -0.005
    scene.to_time(0.15)
    thrust, _ = scene.mean_force_on(0, 0.25)
    columns = np.arange(0.0, 0.02, spacing)
    x, y = scene.points["x"], scene.points["y"]
    tops = [y[(x >= left - 0.001) & (x < left + spacing)].max() for left in columns]
    return pressure_share(thrust, float(np.mean(tops)) + 0.5 * spacing)


def active(_: Setting) -> Iterator[Row]:
    """Draw a smooth wall back from soil on a smooth base."""
    yield relative("K, 5 mm", "", ACTIVE, active_share(COARSE, SMOOTH), 0.02)


def active_on_rough_base(setting: Setting) -> Iterator[Row]:
    """Draw a smooth wall back from soil on a rough base: the finer, the nearer to the value without friction."""
    coarse = active_share(COARSE, ROUGH)
    yield at_least("K, smooth base less rough, 5 mm", "", 0.0, ACTIVE - coarse)
    if not setting.quick:
        fine = active_share(FINE, ROUGH)
        yield at_least("K, 2.5 mm less 5 mm", "", 0.0, fine - coarse)
        yield at_least("K, smooth base less rough, 2.5 mm", "", 0.0, ACTIVE - fine)


def wall_of(blocks: int, friction: float, spacing: float, base: float) -> SoilScene:
    """Return so many blocks on one another that hold soil of their height."""
    kinds = {"b": {"width": WIDTH, "height": HEIGHT, "length": DEPTH, "material": "block"}}
    bodies = [{"block": "b", "x": 0.5 * WIDTH, "y": HEIGHT * (k + 0.5)} for k in range(blocks)]
    return SoilScene(
        (0.15, blocks * HEIGHT),
        spacing,
        x=WIDTH,
        walls=(WIDTH + 0.15,),
        base=base,
        bodies=bodies,
        blocks=kinds,
        friction=friction,
    )


def friction_needed(setting: Setting) -> Iterator[Row]:
    """Let three blocks hold 75 mm with a ground friction 6 % below and above what the active thrust needs."""
    retained = 3.0 * HEIGHT
    needed = 0.5 * ACTIVE * UNIT_WEIGHT * retained**2 / (DENSITY * GRAVITY * WIDTH * retained)
    for base, name in ((SMOOTH, "smooth base"),) if setting.quick else ((SMOOTH, "smooth base"), (ROUGH, "rough base")):
        for share, slides in ((0.94, 1), (1.06, 0)):
            scene = wall_of(3, share * needed, FINE, base)
            scene.to_time(0.4)
            before = float(scene.bodies[0].x)
            scene.to_time(0.5)
            found = int(before - float(scene.bodies[0].x) > SLIDING)
            yield count(f"{name}, {share:.2f} of the friction: slides", slides, found)


def toppling(setting: Setting) -> Iterator[Row]:
    """Let two and six blocks hold soil of their height on ground that does not let them slide."""
    spacing = 0.003125
    for blocks, falls in ((2, 0), (4, 1)) if setting.quick else ((2, 0), (3, 0), (6, 1)):
        scene = wall_of(blocks, 1.2, spacing, ROUGH)
        scene.to_time(0.4 if setting.quick else 0.6)
        own = scene.bodies[:blocks]
        turned = int(np.abs(own["angle"]).max() > TOPPLED)
        moved = float(np.hypot(own["vx"], own["vy"]).max())
        yield count(f"{blocks} blocks: topple", falls, turned)
        if not falls:
            yield absolute(f"{blocks} blocks: speed at the end", "mm/s", 0.0, 1e3 * moved, 1.0)


def conservation(_: Setting) -> Iterator[Row]:
    """Let a column 50 x 100 mm collapse, with both gradients; let particles fly without gravity."""
    for gradient in ("raw", "corrected"):
        scene = SoilScene((0.05, TALL), COARSE, walls=(0.0,), gradient=gradient)
        before = scene.entries()
        scene.to_time(0.25)
        after = scene.entries()
        residual = sum(after.values()) - sum(before.values())
        yield absolute(f"{gradient}: energy off / at the start", "", 0.0, residual / before["soils_potential"], 0.002)


REFERENCES = ((0.1 / 0.7, "143"), (0.1, "100"), (0.1 / 1.5, "67"))  # m


def columns_of_rods(setting: Setting) -> Iterator[Row]:
    """Let columns 100 mm high of three widths collapse: height left and run-out of the connected front."""
    cases = [(width, COARSE, f"{name} mm, s 5 mm") for width, name in REFERENCES]
    cases.append((REFERENCES[1][0], FINE, f"{REFERENCES[1][1]} mm, s 2.5 mm"))
    for width, spacing, name in cases[1:2] if setting.quick else cases:
        place = spacing * round(width / spacing)
        scene = SoilScene((place, TALL), spacing, walls=(0.0,), wall=ROUGH)
        scene.to_time(1.0)
        ratio = TALL / place
        x, y = scene.points["x"], scene.points["y"]
        front = connected(x, 2.0 * spacing)[1] + 0.5 * spacing
        height = float(y[x < 2.0 * spacing].max()) + 0.5 * spacing
        left = 1.0 if ratio <= 0.65 else 1.0 / (1.42 * ratio ** (2.0 / 3.0))  # noqa: PLR2004 - of the source
        run_out = 3.25 * ratio**0.96 if ratio <= 1.5 else 3.80 * ratio**0.73  # noqa: PLR2004 - of the source
        yield relative(f"{name}: height left", "", left, height / TALL, 0.07)
        yield relative(f"{name}: run-out, connected", "", run_out, (front - place) / place, 0.15)
        last = float(x.max()) + 0.5 * spacing
        yield relative(f"{name}: run-out, last particle", "", run_out, (last - place) / place, 0.15)


def energy_kept(setting: Setting) -> Iterator[Row]:
    """Let a column 200 x 100 mm collapse: potential energy left over that at the start."""
    for spacing in (COARSE,) if setting.quick else (COARSE, 0.004):
        scene = SoilScene((0.2, TALL), spacing, walls=(0.0,), wall=ROUGH)
        before = scene.entries()["soils_potential"]
        scene.to_time(1.0)
        left = scene.entries()["soils_potential"] / before
        yield absolute(f"energy left, s {1e3 * spacing:g} mm", "", 0.691, left, 0.03)


ROUGH_BASE = "a rough base carries part of the thrust; the formula knows none"
SHOCK = "soil on its yield surface keeps part of the sideways stress of the shock at the start"
SHORT = "fronts of few particles stop early, and the viscosity takes a part: shorter the coarser and the taller"
SOIL_CASES = (
    Case(
        "S1",
        "column at rest between smooth walls",
        "pressure at rest",
        at_rest,
        quick="5 mm instead of 2.5 mm",
        remarks={"surface": SHOCK},
    ),
    Case("S2", "smooth wall drawn back, smooth base", "active pressure, Mohr and Coulomb", active),
    Case("S3", "smooth wall drawn back, rough base", "below S2", active_on_rough_base, quick="5 mm only"),
    Case(
        "S5", "three blocks hold 75 mm", "½ K_a γ H² / W", friction_needed, "smooth base only", {"surface": ROUGH_BASE}
    ),
    Case("S6", "walls of blocks that stand and topple", "moments about the toe", toppling, quick="two and four blocks"),
    Case("S7", "energy of a collapse", "conservation", conservation),
    Case(
        "S9",
        "columns of rods 100 mm high",
        "true two-dimensional rods, arXiv 1512.05180",
        columns_of_rods,
        quick="one column, 5 mm",
        remarks={"surface": SHORT},
    ),
    Case("S10", "energy that a column 200 × 100 mm keeps", "SPHinXsys", energy_kept, quick="5 mm only"),
)
