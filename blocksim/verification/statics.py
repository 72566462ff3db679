"""V2 static overlap, V7 to V9 sliding and sticking, V13 overhanging stacks, V14 a stack that must not creep."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import accumulate
from math import degrees, radians

import numpy as np

from blocksim.scenario.laws import LAWS
from blocksim.verification import closed_forms as forms
from blocksim.verification.case import Row, Setting, count, farthest, relative
from blocksim.verification.scene import HEIGHT, WIDTH, PaperBlock, SteppedScene

CONTACT_RADIUS = 1e-3  # m
STANDING, FALLING = (10.5e-3, 0.99), (10.8e-3, 1.01)  # m, equal offset; share of the harmonic overhang
OBSERVED = 1.5  # s
FALLEN = 0.1  # of a block height
SOFT = 0.01  # stiffness scale of the quick size; linear sags stay a fifth of the margins
STILL, KEPT = 0.5, 1e-6  # s, m: a stack that stands keeps its place in the last half second
LOADING, LOADING_STEPS = 0.2, 200  # s


def static_overlap(setting: Setting) -> Iterator[Row]:
    """Let a block settle on the ground under its weight."""
    contact = {"contact_radius": CONTACT_RADIUS} if setting.hertzian else {}
    rest = setting.start([{"y": HEIGHT / 2}], contact=contact).to_time(0.05)
    expected = weight_overlap(setting)
    yield relative("overlap", "nm", 1e9 * expected, 1e9 * float(HEIGHT / 2 - rest.bodies[0].y), 1e-3)


def weight_overlap(setting: Setting) -> float:
    """Return the overlap (m) of the paper's block that rests on its face."""
    block, law = PaperBlock(), LAWS[setting.law]
    stiffness = block.modulus * law.size(block.depth, CONTACT_RADIUS)
    return forms.static_overlap(block.mass, 2.0 * stiffness, law.exponent)


def overhanging_stacks(setting: Setting) -> Iterator[Row]:
    """Three blocks of equal offset, and 1 to 4 blocks overhanging a table, just below and just above the limit."""
    standing = [outcome(setting, stack) for stack in stacks(*STANDING)]
    falling = [outcome(setting, stack) for stack in stacks(*FALLING)]
    yield count("below the limit, stand", len(standing), standing.count(False))
    yield count("above the limit, fall", len(falling), falling.count(True))


def stacks(offset: float, share: float) -> Iterator[Sequence[Mapping[str, object]]]:
    """Return the stack of three with an offset (m) and the overhangs with a share of the largest one."""
    yield [{"x": i * offset, "y": (i + 0.5) * HEIGHT} for i in range(3)]
    for number in range(1, 5):
        offsets = [share * offset for offset in reversed(forms.harmonic_offsets(number, WIDTH))]
        places = [{"x": x, "y": (level + 0.5) * HEIGHT} for level, x in enumerate(accumulate(offsets), start=1)]
        yield [{"y": 0.5 * HEIGHT, "fixed": True}, *places]


def outcome(setting: Setting, bodies: Sequence[Mapping[str, object]]) -> bool | None:
    """Return True if a stack falls; None where it neither falls nor comes to rest.

    It is loaded gently: at the limit a sudden release tips it, where contacts are soft. What a stack of three gains by
    sinking 1 micrometre, as under Hertz contacts, is thirty times what tips it at 99 % of the limit.
    """
    soft = setting.quick and not setting.hertzian
    stack = setting.start(bodies, contact={"stiffness_scale": SOFT if soft else 1.0})
    before = stack.state()
    controls = stack.world.controls[0]
    gravity = float(controls.gravity_y)
    for k in range(1, LOADING_STEPS + 1):
        controls.gravity_y = gravity * k / LOADING_STEPS
        stack.to_time(LOADING * k / LOADING_STEPS)
    middle = stack.to_time(LOADING + OBSERVED - STILL).state()
    after = stack.to_time(LOADING + OBSERVED).state()
    if (before - after)[:, 1].max() > FALLEN * HEIGHT:
        return True
    return False if np.abs(after - middle)[:, :2].max() < KEPT else None


def tower(setting: Setting) -> Iterator[Row]:
    """Ten blocks straight up: their creep speed and largest gain of mechanical energy over that at the start."""
    contact = {"stiffness_scale": SOFT if setting.quick else 1.0}
    stack = setting.start([{"y": (i + 0.5) * HEIGHT} for i in range(10)], contact=contact)
    gain, halves = 0.0, []
    for end in (0.5, 1.0) if setting.quick else (5.0, 10.0):
        for time in np.linspace(stack.time, end, 51)[1:]:
            gain = max(gain, stack.to_time(float(time)).mechanical - stack.start_energy)
        halves.append((stack.time, stack.state()[:, :2]))
    (begin, before), (end, after) = halves
    fall = float(stack.bodies.mass.sum()) * 9.81 * 1e-3
    yield Row("creep", "µm/s", 0.0, 1e6 * (np.abs(after - before).max() / (end - begin)), 1.0)
    yield Row("energy gained / m g 1 mm", "", 0.0, gain / fall, 1e-3)


SPACINGS = (5e-4, 1e-3, 4e-3)  # m
SPEED, LEVEL_FRICTION = 0.5, 0.38  # m/s, -
STOPPED = 1e-4  # of the first speed
POLL = 1e-4  # s
LONGEST = 0.5  # s
MARGIN = radians(0.5)
FRICTIONS = (0.31, 0.38)


def sliding_to_rest(setting: Setting) -> Iterator[Row]:
    """Push a block along level ground at three particle spacings; the farthest off counts."""
    slides = []  # where (m) and when (s) the block stops
    for spacing in setting.distinct(SPACINGS):
        body, contact = {"y": HEIGHT / 2, "velocity": [SPEED, 0.0]}, {"particle_spacing": spacing}
        scene = setting.start([body], ground_friction=LEVEL_FRICTION, contact=contact)
        while scene.bodies[0].vx > STOPPED * SPEED and scene.time < LONGEST:
            scene.to_time(scene.time + POLL)
        stop = scene.time
        slides.append((float(scene.to_time(stop + 0.02).bodies[0].x), stop))
    distance = forms.sliding_stop_distance(SPEED, LEVEL_FRICTION)
    time = forms.sliding_stop_time(SPEED, LEVEL_FRICTION)
    yield relative("distance", "mm", 1e3 * distance, 1e3 * farthest(distance, [end for end, _ in slides]), 0.005)
    yield relative("time", "s", time, farthest(time, [stop for _, stop in slides]), 0.005)


def on_slope(setting: Setting, slope: float, friction: float) -> SteppedScene:
    """Put a block on a slope (rad) that goes down towards +x."""
    return setting.start([{"y": HEIGHT / 2}], ground_friction=friction, tilt=-slope)


def slope(setting: Setting) -> Iterator[Row]:
    """Measure the acceleration of a block on a slope of 30 degrees between 0.1 and 0.3 s."""
    scene = on_slope(setting, radians(30.0), 0.31).to_time(0.1)
    time, speed = scene.time, float(scene.bodies[0].vx)
    scene.to_time(0.3)
    expected = forms.incline_acceleration(radians(30.0), 0.31)
    yield relative("acceleration", "m/s²", expected, (scene.bodies[0].vx - speed) / (scene.time - time), 0.005)


def friction_angle(setting: Setting) -> Iterator[Row]:
    """Half a degree below the friction angle nothing creeps, half a degree above the block slides."""
    begin, end = (1.0, 2.0) if setting.quick else (5.0, 10.0)
    for friction in FRICTIONS:
        limit = forms.sliding_slope(friction)
        name = f"{degrees(limit):.2f}°"
        rest = on_slope(setting, limit - MARGIN, friction).to_time(begin)
        time, place = rest.time, float(rest.bodies[0].x)
        creep = (float(rest.to_time(end).bodies[0].x) - place) / (rest.time - time)
        yield Row(f"{name} − 0.5°, creep", "µm/s", 0.0, 1e6 * creep, 1.0)
        expected = forms.fall_distance(0.5, forms.incline_acceleration(limit + MARGIN, friction))
        way = float(on_slope(setting, limit + MARGIN, friction).to_time(0.5).bodies[0].x)
        yield relative(f"{name} + 0.5°, way in 0.5 s", "mm", 1e3 * expected, 1e3 * way, 0.02)
