"""S1 to S6, S11: what soil does to walls that hold it or are drawn back, and to walls of blocks that slide or turn."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from blocksim.verification.case import Row, Setting, absolute, at_least, count, relative
from blocksim.verification.soil_scene import (
    ACTIVE,
    ACTIVE_OF_BANDS,
    ANGLE,
    AT_REST,
    COARSE,
    DENSITY,
    DEPTH,
    FAR,
    FINE,
    GRADIENTS,
    GRAVITY,
    HEIGHT,
    ROUGH,
    SMOOTH,
    TALL,
    UNIT_WEIGHT,
    WIDTH,
    SoilScene,
    gradients,
    pressure_share,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

TOPPLED = math.radians(45.0)
LEANING = math.radians(10.0)
TURNING = math.radians(1.0)
SLAB, PITCH = 0.029, 0.03  # m, of a surcharge: width and distance
SLIDING = 1e-4  # m in 0.1 s
BLOCK_SPACING = 0.003125  # m: an eighth of the height of a block


def at_rest(setting: Setting) -> Iterator[Row]:
    """Let a column 60 x 100 mm settle between smooth walls."""
    spacing, width = COARSE if setting.quick else FINE, 0.06
    for gradient, prefix in GRADIENTS:
        for start in ("ramp", "geostatic"):
            scene = SoilScene((width, TALL), spacing, walls=(0.0, width), base=SMOOTH, start=start, gradient=gradient)
            scene.to_time(0.3)
            thrust, base = scene.mean_force_on(1, 0.325)[0], scene.mean_force_on(-1, 0.35)[1]
            yield relative(f"{prefix}{start}: base / weight", "", 1.0, -base / scene.weight, 0.005)
            yield relative(f"{prefix}{start}: K on the wall", "", AT_REST, pressure_share(thrust, TALL), 0.01)


def drawn_back(spacing: float, base: float, speed: float, gradient: str) -> SoilScene:
    """Return soil at rest behind a smooth wall that begins to leave at a speed (m/s)."""
    blocks = {"wall": {"width": 0.04, "height": 0.16, "length": DEPTH, "material": "wall"}}
    bodies = [{"block": "wall", "x": -0.02, "y": 0.08, "fixed": True}, FAR]
    scene = SoilScene((0.15, TALL), spacing, walls=(0.15,), base=base, bodies=bodies, blocks=blocks, gradient=gradient)
    scene.to_time(0.05)
    scene.world.bodies.vx[0] = -speed
    return scene


def active_share(spacing: float, base: float, gradient: str) -> float:
    """Return K of a smooth wall drawn back by 1 % of the height at 5 mm/s: the mean over its second half."""
    scene = drawn_back(spacing, base, 0.005, gradient)
    scene.to_time(0.15)
    thrust, _ = scene.mean_force_on(0, 0.25)
    columns = np.arange(0.0, 0.02, spacing)
    x, y = scene.points["x"], scene.points["y"]
    tops = [y[(x >= left - 0.001) & (x < left + spacing)].max() for left in columns]
    return pressure_share(thrust, float(np.mean(tops)) + 0.5 * spacing)


def active(setting: Setting) -> Iterator[Row]:
    """Draw a smooth wall back from soil on a smooth base.

    K is Mohr and Coulomb's where all soil yields at once. Where it slips in bands, it is between that and the one of
    soil with the friction of a band.
    """
    for gradient, prefix in GRADIENTS:
        for spacing in (COARSE,) if setting.quick else (COARSE, FINE):
            found = active_share(spacing, SMOOTH, gradient)
            yield relative(f"{prefix}K, {1e3 * spacing:g} mm", "", ACTIVE, found, 0.02)
            yield at_least(f"{prefix}K of bands less K, {1e3 * spacing:g} mm", "", 0.0, ACTIVE_OF_BANDS - found)


def active_on_rough_base(setting: Setting) -> Iterator[Row]:
    """Draw a smooth wall back from soil on a rough base: the finer, the nearer to the value without friction."""
    for gradient, prefix in GRADIENTS:
        coarse = active_share(COARSE, ROUGH, gradient)
        yield at_least(f"{prefix}K, smooth base less rough, 5 mm", "", 0.0, ACTIVE - coarse)
        if not setting.quick:
            fine = active_share(FINE, ROUGH, gradient)
            yield at_least(f"{prefix}K, 2.5 mm less 5 mm", "", 0.0, fine - coarse)
            yield at_least(f"{prefix}K, smooth base less rough, 2.5 mm", "", 0.0, ACTIVE - fine)


def slope_of_wedge(scene: SoilScene, before: NDArray[np.float64]) -> float:
    """Return the angle (degrees) of the lower edge of what has moved by half of the wall's way, or more.

    A row of particles ends in the wedge where it last has moved so far; a line is laid through the ends of the rows
    between a fifth and four fifths of the height.
    """
    soils, spacing = scene.soils, float(2.0 * scene.soils.controls["radius"][0])
    start = before[:, soils.states["number"]]
    moved = np.hypot(scene.points["x"] - start[0], scene.points["y"] - start[1])
    way = -0.02 - float(scene.bodies[0].x)
    rows = np.rint(start[1] / spacing - 0.5).astype(int)
    ends = {
        (row + 0.5) * spacing: start[0][(rows == row) & (moved > 0.5 * way)].max(initial=0.0) for row in np.unique(rows)
    }
    heights = np.array([height for height in ends if 0.2 * TALL < height < 0.8 * TALL])
    rise = np.polyfit(heights, [ends[height] for height in heights], 1)[0]
    return math.degrees(math.atan2(1.0, rise))


def shear_band(setting: Setting) -> Iterator[Row]:
    """Draw a smooth wall back from soil on a rough base by 4 mm: inclination of the band that bounds the wedge."""
    spacing, coulomb = COARSE if setting.quick else FINE, 45.0 + 0.5 * math.degrees(ANGLE)
    for gradient, prefix in GRADIENTS:
        scene = drawn_back(spacing, ROUGH, 0.02, gradient)
        before = np.empty((2, len(scene.points)))
        before[:, scene.soils.states["number"]] = scene.points["x"], scene.points["y"]
        scene.to_time(0.25)
        name = f"{prefix}inclination, Roscoe to Coulomb, s {1e3 * spacing:g} mm"
        found = slope_of_wedge(scene, before)
        yield absolute(name, "°", 0.5 * (45.0 + coulomb), found, 0.5 * (coulomb - 45.0))


def wall_of(
    blocks: int, friction: float, spacing: float, base: float, *, gradient: str = "raw", load: float = 0.0
) -> SoilScene:
    """Return so many blocks on one another that hold soil of their height, under slabs that weigh a load (Pa)."""
    kinds = {"b": {"width": WIDTH, "height": HEIGHT, "length": DEPTH, "material": "block"}}
    bodies = [{"block": "b", "x": 0.5 * WIDTH, "y": HEIGHT * (k + 0.5)} for k in range(blocks)]
    if load:
        thick = load / (DENSITY * GRAVITY) * PITCH / SLAB
        kinds["s"] = {"width": SLAB, "height": thick, "length": DEPTH, "material": "block"}
        bodies += [{"block": "s", "x": WIDTH + PITCH * (k + 0.5), "y": blocks * HEIGHT + 0.5 * thick} for k in range(5)]
    return SoilScene(
        (0.15, blocks * HEIGHT),
        spacing,
        x=WIDTH,
        walls=(WIDTH + 0.15,),
        base=base,
        bodies=bodies,
        blocks=kinds,
        friction=friction,
        gradient=gradient,
    )


def friction_needed(setting: Setting) -> Iterator[Row]:
    """Let three blocks hold 75 mm with a ground friction 6 % below and above what the active thrust needs."""
    retained = 3.0 * HEIGHT
    needed = 0.5 * ACTIVE * UNIT_WEIGHT * retained**2 / (DENSITY * GRAVITY * WIDTH * retained)
    bases = ((SMOOTH, "smooth base"),) if setting.quick else ((SMOOTH, "smooth base"), (ROUGH, "rough base"))
    for gradient, prefix in gradients(setting):
        for base, name in bases:
            for share, slides in ((0.94, 1), (1.06, 0)):
                scene = wall_of(3, share * needed, FINE, base, gradient=gradient)
                scene.to_time(0.4)
                before = float(scene.bodies[0].x)
                scene.to_time(0.5)
                found = int(before - float(scene.bodies[0].x) > SLIDING)
                yield count(f"{prefix}{name}, {share:.2f} of the friction: slides", slides, found)


def first_to_turn(scene: SoilScene, blocks: int, end: float) -> int:
    """Return the number, from below, of the lowest block that turns when one has turned by 10 degrees; 0 if none."""
    while scene.time < end:
        scene.to_step(scene.steps + 100)
        angles = np.abs(scene.bodies[:blocks]["angle"])
        if angles.max() > LEANING:
            return 1 + int(np.argmax(angles > TURNING))
    return 0


def toppling(setting: Setting) -> Iterator[Row]:
    """Let two and six blocks hold soil of their height on ground that does not let them slide.

    Thrust turns about the toe with the third power of the height, weight with the first: the lowest joint opens.
    """
    end = 0.4 if setting.quick else 0.6
    for gradient, prefix in gradients(setting):
        for blocks, falls in ((2, 0), (6, 1)) if setting.quick else ((2, 0), (3, 0), (6, 1)):
            scene = wall_of(blocks, 1.2, BLOCK_SPACING, ROUGH, gradient=gradient)
            first = first_to_turn(scene, blocks, end)
            scene.to_time(end)
            own = scene.bodies[:blocks]
            turned = int(np.abs(own["angle"]).max() > TOPPLED)
            yield count(f"{prefix}{blocks} blocks: topple", falls, turned)
            if falls:
                yield count(f"{prefix}{blocks} blocks: lowest that turns", 1, first)
            else:
                moved = float(np.hypot(own["vx"], own["vy"]).max())
                yield absolute(f"{prefix}{blocks} blocks: speed at the end", "mm/s", 0.0, 1e3 * moved, 1.0)


def surcharge(setting: Setting) -> Iterator[Row]:
    """Load soil behind two smooth blocks with slabs of a fifth less and more than what turns them about the toe.

    K_a (gamma H^3/6 + q H^2/2) = W b/2 has the largest load q: 864 Pa.
    """
    height = 2.0 * HEIGHT
    weight = DENSITY * GRAVITY * WIDTH * height
    most = (0.5 * weight * WIDTH / ACTIVE - UNIT_WEIGHT * height**3 / 6.0) * 2.0 / height**2
    for gradient, prefix in gradients(setting):
        for share, falls in ((0.8, 0), (1.2, 1)):
            scene = wall_of(2, 1.2, BLOCK_SPACING, ROUGH, gradient=gradient, load=share * most)
            scene.to_time(0.4 if setting.quick else 0.6)
            leans = float(np.abs(scene.bodies[:2]["angle"]).max())
            yield count(f"{prefix}{share:g} of the load: topples", falls, int(leans > LEANING))
