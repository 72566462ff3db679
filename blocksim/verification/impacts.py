"""V1 flight, V3 bounces, V4 to V6 and V16 impacts, V25 flat landings on several blocks; what energy they may gain.

V15 impacts never gain kinetic energy, V23 the energy ledger of every shipped scenario.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise, product
from math import atan2, cos, log2, nan, radians, sin
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from blocksim.kernels.common.arrays import AT_REST, REACHED
from blocksim.scenario import Document, Model
from blocksim.simulation.schemes import build
from blocksim.verification import closed_forms as forms
from blocksim.verification.case import Row, Setting, at_least, farthest, relative
from blocksim.verification.scene import (
    GOLDEN,
    HEIGHT,
    POLL,
    WIDTH,
    PaperBlock,
    SteppedScene,
    Throw,
    Thrower,
    kinetic_energy,
)

SPACINGS = (5e-4, 1e-3, 2e-3, 4e-3)  # m, of boundary particles
DROP, RESTITUTION = 0.1, 0.5  # m, -
LARGEST = 10.0  # m, m/s: the numbers of the flight are smaller
BOUNCE_TOLERANCES = (0.01, 0.02, 0.04)
LONGEST = 0.6  # s; all bounces are over by then


def free_flight(setting: Setting) -> Iterator[Row]:
    """Compare a flight with a parabola and its spin with a constant, to round-off times steps."""
    flight = setting.start([{"y": 2.0, "velocity": [1.5, 2.5], "spin": 30.0, "angle": 0.4}]).to_time(0.2)
    t, body = flight.time, flight.bodies[0]
    round_off = LARGEST * flight.steps * float(np.finfo(float).eps)
    aside, above = body.x - 1.5 * t, body.y - (2.0 + 2.5 * t - forms.fall_distance(t))
    yield Row("off the parabola", "m", 0.0, max(abs(aside), abs(above)), round_off)
    yield Row("off the speed", "m/s", 0.0, max(abs(body.vx - 1.5), abs(body.vy - 2.5 + 9.81 * t)), round_off)
    yield Row("off the angle", "rad", 0.0, abs(body.angle - 0.4 - 30.0 * t), round_off)
    yield Row("change of spin", "rad/s", 0.0, abs(body.spin - 30.0), round_off)


def bounces(setting: Setting) -> Iterator[Row]:
    """Drop a block flat; apexes and flight time at four particle spacings, the farthest off counts."""
    flat, spacings = {"y": HEIGHT / 2 + DROP}, setting.distinct(SPACINGS)
    drops = (setting.start([flat], restitution=RESTITUTION, contact={"particle_spacing": one}) for one in spacings)
    found = [observe_bounces(one) for one in drops]
    for impact, tolerance in enumerate(BOUNCE_TOLERANCES, start=1):
        expected = forms.apex_height(DROP, RESTITUTION, impact)
        apex = farthest(expected, [apexes[impact - 1] for _, apexes in found])
        yield relative(f"apex {impact}", "mm", 1e3 * expected, 1e3 * apex, tolerance)
    expected = forms.flight_time(DROP, RESTITUTION, 1)
    flight = farthest(expected, [times[1] - times[0] for times, _ in found])
    yield relative("first flight", "s", expected, flight, BOUNCE_TOLERANCES[0])


def observe_bounces(fall: SteppedScene) -> tuple[list[float], list[float]]:
    """Return the times (s) of the impacts and one more, and the apexes (m) between them; NaN where there is none.

    The time of an impact is that of the steepest change of speed, half a poll either way.
    """
    times: list[float] = []
    apexes = [0.0]
    falling = True
    poll = max(5e-5, fall.step)  # s
    while len(times) <= len(BOUNCE_TOLERANCES) and fall.time < LONGEST:
        body = fall.to_time(fall.time + poll).bodies[0]
        if falling and body.vy > 0.0:
            times.append(fall.time - poll / 2)
            apexes.append(0.0)
        falling = body.vy < 0.0
        apexes[-1] = max(apexes[-1], float(body.y) - HEIGHT / 2)
    missing = [np.nan] * (len(BOUNCE_TOLERANCES) + 1 - len(times))
    return times + missing, apexes[1:-1] + missing


ASKED = tuple(tenth / 10 for tenth in range(11))
SPEEDS = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0)  # m/s
LANDINGS = {"flat": 0.0, "corner": atan2(WIDTH, HEIGHT)}  # rad; the centre comes down upon the corner
TILT = radians(30.0)
FALLING = forms.Velocity(0.0, -1.0, 0.0)
STICKING = 2.0  # friction coefficient
EXACT = 1e-9  # m/s, rad/s: rigid impacts are those of the closed forms
WIDTH_TWO = 0.03  # m: of the second of two blocks that collide
REBOUNDS, REBOUND = (0.2, 0.8), 1e-3  # restitutions; off them by, as arms are those before a step


def restitution(setting: Setting) -> Iterator[Row]:
    """Throw a block at 7 speeds for 11 restitutions at 4 spacings; the farthest off counts."""
    spacings = setting.distinct(SPACINGS[1:2] if setting.quick else SPACINGS)
    no_threshold = {} if setting.has_springs else {"restitution_threshold": 0.0}  # the slowest impacts rebound too
    for landing, angle in LANDINGS.items():
        errors: dict[float, list[float]] = {asked: [] for asked in ASKED}
        for asked, spacing, (number, speed) in product(ASKED, spacings, enumerate(SPEEDS)):
            thrower = Thrower(setting, asked, speed, contact={"particle_spacing": spacing}, time=no_threshold)
            body = thrower.throw(Throw(angle, phase=(GOLDEN * (number + 1 + 10 * asked)) % 1.0))
            errors[asked].append(float(body.vy) / speed - asked)
        worst = farthest(0.0, [error for asked in ASKED[1:] for error in errors[asked]])
        yield Row(f"{landing}, e ≥ 0.1, off by", "", 0.0, worst, 0.01)
        yield Row(f"{landing}, e = 0, rebound", "", 0.0, farthest(0.0, errors[0.0]), 0.01)


def frictionless_corner(setting: Setting) -> Iterator[Row]:
    """Turn a fall into spin: impulse through one corner, without friction."""
    block, arm = PaperBlock(), forms.lowest_corner(WIDTH, HEIGHT, TILT)
    for e in (0.0, 0.5):
        body = Thrower(setting, e).throw(Throw(TILT), POLL if setting.has_springs else 1)
        expected = forms.corner_impact(block.mass, block.inertia, arm, FALLING, e, sticks=False)
        yield Row(f"v_y at e = {e:g}", "m/s", expected.vy, body.vy, 0.01 if setting.has_springs else EXACT)
        yield Row(f"spin at e = {e:g}", "rad/s", expected.spin, body.spin, 0.5 if setting.has_springs else EXACT)


def sticking_corner(setting: Setting) -> Iterator[Row]:
    """Let a corner stop by friction, so that the block turns about it."""
    block, arm = PaperBlock(), forms.lowest_corner(WIDTH, HEIGHT, TILT)
    body = Thrower(setting, 0.0).throw(Throw(TILT, friction=STICKING), POLL if setting.has_springs else 1)
    expected = forms.corner_impact(block.mass, block.inertia, arm, FALLING, 0.0, sticks=True)
    yield relative("spin", "rad/s", expected.spin, body.spin, 0.02)


def collision(setting: Setting, restitution: float) -> SteppedScene:
    """Start two free blocks that will meet off-centre, both turning."""
    one = {"y": 0.1, "velocity": [1.0, 0.1], "spin": 5.0}
    two = {"y": 0.112, "x": 0.0335, "velocity": [-0.6, 0.0], "angle": 0.05, "spin": -12.0, "width": WIDTH_TWO}
    return setting.start([one, two], restitution=restitution, gravity=0.0)


def momenta(scene: SteppedScene) -> NDArray[np.float64]:
    """Return momentum along x and y (kg m/s) and the angular momentum (kg m2/s) about the origin."""
    b = scene.bodies
    spin = b.inertia * b.spin + b.mass * (b.x * b.vy - b.y * b.vx)
    return np.array([(b.mass * b.vx).sum(), (b.mass * b.vy).sum(), spin.sum()])


def two_blocks(setting: Setting) -> Iterator[Row]:
    """Collide two blocks; momentum and angular momentum are kept to round-off times steps.

    Of rigid blocks, impulses act with the arms that they had when the step began, and so may create angular momentum.
    Blocks that pass each other at u are h u apart from there when the velocity pass adds its impulses J: h u J, with
    J = m' u (1 + e) at most, m' a quarter of both masses; both are of 1 m/s here.
    """
    scenes = [collision(setting, e) for e in (0.0, 0.2, 1.0)]
    before = [momenta(scene) for scene in scenes]
    step = scenes[0].step
    steps = 20_000 if setting.has_springs else round(4e-3 / step)  # s, of rigid blocks
    after = [momenta(scene.to_step(steps)) for scene in scenes]
    worst = np.abs(np.array(after) - np.array(before)).max(axis=0)
    mass = float(scenes[0].bodies.mass.sum())
    round_off = steps * float(np.finfo(float).eps) * mass  # speeds of 1 m/s
    turning = 0.1 * round_off if setting.has_springs else step * 0.25 * mass * 2.0  # arms of 0.1 m
    yield Row("momentum", "kg m/s", 0.0, max(worst[0], worst[1]), round_off)
    yield Row("angular momentum", "kg m²/s", 0.0, worst[2], turning)
    if not setting.has_springs:
        yield from (Row(f"rebound at e = {e:g}", "", e, rebound(collision(setting, e)), REBOUND) for e in REBOUNDS)


def rebound(scene: SteppedScene) -> float:
    """Return how fast the points that meet first part, as a share of how fast they approached.

    The upper right corner of the left block meets the left face of the other one. Impulses act where the blocks are
    when the step begins, or, as steps of strong impacts of few blocks end at these, where they meet.
    """
    before = after = scene.state()
    while after[0, 3] == before[0, 3]:
        before, after = after, scene.to_step(scene.steps + 1).state()
    place, time = before.copy(), 0.0
    if scene.scene.contacts.stepping[0].is_guarded:
        for _ in range(10):  # Newton's method
            gap, speed = gap_and_speed(before, place)
            time -= gap / speed
            place[:, :3] = before[:, :3] + time * before[:, 3:]
    return -gap_and_speed(after, place)[1] / gap_and_speed(before, place)[1]


def gap_and_speed(state: NDArray[np.float64], place: NDArray[np.float64]) -> tuple[float, float]:
    """Return the gap (m) between corner and face, and the speed (m/s) in a state at which they part.

    Places and angles are those of another state.
    """
    (x, y, angle), (x_two, y_two, angle_two) = place[:, :3]
    corner_x = x + (cos(angle) * WIDTH - sin(angle) * HEIGHT) / 2
    corner_y = y + (sin(angle) * WIDTH + cos(angle) * HEIGHT) / 2
    gap = cos(angle_two) * (x_two - corner_x) + sin(angle_two) * (y_two - corner_y) - WIDTH_TWO / 2
    (vx, vy, spin), (vx_two, vy_two, spin_two) = state[:, 3:]
    along = vx_two - spin_two * (corner_y - y_two) - vx + spin * (corner_y - y)
    across = vy_two + spin_two * (corner_x - x_two) - vy - spin * (corner_x - x)
    return gap, float(cos(angle_two) * along + sin(angle_two) * across)


FAR = 0.05  # m, where the outermost seats end, beyond the block
OVERHANG = 1e-4  # m, that lies on the second seat, or beyond both ends of one
SEATS = {
    "one seat": (-FAR, FAR),
    "overhanging": (OVERHANG - 0.5 * WIDTH, 0.5 * WIDTH - OVERHANG),
    "joint in the middle": (-FAR, 0.0, FAR),
    "joint 6 mm off": (-FAR, 6e-3, FAR),
    "0.1 mm on the second": (-FAR, 0.5 * WIDTH - OVERHANG, FAR),
    "three seats": (-FAR, -4e-3, 3e-3, FAR),
}  # m: ends of the seats from the centre of the block
LOOSE = (-WIDTH, 0.0, WIDTH)  # m, as wide as the block
SEAT_RESTITUTIONS = (0.0, 0.2, 0.5, 0.8, 1.0)
LANDING_POLL, MOST_STEPS = 10, 4000


def seats(setting: Setting) -> Iterator[Row]:
    """Drop a block on seats of several lengths for five restitutions; the farthest off counts."""
    for name, ends in SEATS.items():
        landings = [(asked, land(setting, ends, asked)) for asked in SEAT_RESTITUTIONS]
        rebounds = [vy - asked for asked, (vy, _) in landings]
        yield Row(f"{name}, e off by", "", 0.0, farthest(0.0, rebounds), 0.01)
        yield Row(f"{name}, spin", "rad/s", 0.0, farthest(0.0, [spin for _, (_, spin) in landings]), 0.05)
    if not setting.hertzian:
        vy, spin = land(setting, LOOSE, 1.0, fixed=False)
        yield Row("two loose blocks, elastic, speed", "m/s", 0.5, vy, 0.01)
        yield Row("two loose blocks, elastic, spin", "rad/s", 0.0, spin, 0.05)


def land(setting: Setting, ends: Sequence[float], restitution: float, *, fixed: bool = True) -> tuple[float, float]:
    """Return the speed (m/s) and spin (rad/s) with which a block leaves that has come down flat at 1 m/s."""
    under = [
        {"x": 0.5 * (left + right), "width": right - left, "y": 0.5 * HEIGHT, "fixed": fixed}
        for left, right in pairwise(ends)
    ]

    def start(height: float) -> SteppedScene:
        block = {"y": 1.5 * HEIGHT + height, "velocity": [0.0, -1.0]}
        return setting.start([*under, block], restitution=restitution, gravity=0.0)

    scene = start(100.37 * start(0.5 * HEIGHT).step)  # of flight, so that a contact begins within a step
    body = scene.world.bodies[len(under)]
    for steps in range(LANDING_POLL, MOST_STEPS, LANDING_POLL):
        scene.to_step(steps)
        if body.pairs_before == 0 and body.vy >= 0.0:
            break
    return float(body.vy), float(body.spin)


ANGLES = tuple(range(90))  # degrees
FRICTIONS = tuple(tenth / 10 for tenth in range(11))
LOSSY = (0.0, 0.3, 0.6, 0.9)  # restitutions
SAFETY = 0.05  # the default; the stiffest mode has frequency times step = 2 safety
PHASES = (0.1, 0.3, 0.5, 0.7, 0.9)  # of a step, at which an impact begins
ROUND_OFF = 1e-12
RIGID_LEDGER_TOLERANCE = 1e-11  # what impulses take is known to round-off
# Blocks of 1 to 10 MN, whose weights do 1e5 to 1e6 times the energy in play on their heights: every step rounds that by
# 1e-16, and the dam lies for 30 000 of them. Nothing else drifts: friction, impacts and loads balance to 1e-13. The
# slope of cells has 119 MJ of potential energy, and hardly anything in play at first.
HEAVY = {"dam": 1e-8, "toppling_slope": 1e-10, "voronoi_slope": 1e-10}
SOFT = 0.01  # stiffness scale of the quick size; crowds keep their own
LESS_SOFT = 0.1  # with driven bodies: what starts at full speed is off by half a step of it, before anything has fallen
STIFFER = 10.0  # where the scenario's own stiffness is too soft for a law
CROWD = 100  # blocks; scenes of more on springs are run for their first moments only
CROWD_END_PARTICLES = 0.002  # s, for the models with boundary particles, which take fifty times as long
SCENARIOS = Path(__file__).parents[2] / "scenarios"


def gains(setting: Setting) -> Iterator[Row]:
    """Throw a block at 90 angles with 11 frictions and 5 restitutions; the largest gain counts.

    With springs, also how fast the gain of elastic impacts without friction falls with the step.
    """
    throws = [
        Throw(radians(angle), friction, (GOLDEN * number) % 1.0)
        for number, (angle, friction) in enumerate(product(ANGLES, FRICTIONS))
    ]
    lossy = max(largest_gain(Thrower(setting, e), throws) for e in LOSSY)
    yield Row("gain, e ≤ 0.9", "", 0.0, max(lossy, 0.0), ROUND_OFF)
    bound = (2.0 * SAFETY) ** 2 / 4.0 if setting.has_springs else ROUND_OFF
    yield Row("gain, e = 1", "", 0.0, max(largest_gain(Thrower(setting, 1.0), throws), 0.0), bound)
    if setting.has_springs:
        smooth = [Throw(radians(angle), phase=phase) for angle, phase in product(ANGLES[::9], PHASES)]
        safeties = (2.0 * SAFETY, SAFETY / 2.0)
        coarse, fine = (largest_gain(Thrower(setting, 1.0, time={"safety": one}), smooth) for one in safeties)
        yield at_least("gain, e = 1, order in dt", "", 1.8, log2(coarse / fine) / 2.0 if fine > 0.0 else nan)


def largest_gain(thrower: Thrower, throws: Iterable[Throw]) -> float:
    """Return the largest gain of kinetic energy in an impact, as a share of that before; negative for a loss."""
    before = 0.5 * float(thrower.world.bodies[0].mass)  # 1 m/s
    return max(kinetic_energy(thrower.throw(throw)) / before - 1.0 for throw in throws)


def ledgers(setting: Setting) -> Iterator[Row]:
    """Run every shipped scenario, large ones for their first moments, and check the ledger at every output.

    The largest residual of a run counts, as a share of the energy in play; NaN where the run fails. A scenario keeps
    its own model and law unless the setting asks for others than the defaults, or has rigid contacts; and its own step.
    All can have rigid contacts; those that ship with them have no springs.
    """
    usual = Setting()
    for path in sorted(SCENARIOS.glob("*.toml")):
        document = Document.read(path)
        own = document.build()
        if setting.has_springs and not own.time.has_springs:
            continue
        is_crowd = len(Model(own).bodies) > CROWD
        name, tolerance = path.stem, 1e-3
        changes: dict[str, object] = {"contact.model": setting.model, "contact.law": setting.law}
        if not setting.has_springs:
            tolerance = HEAVY.get(path.stem, RIGID_LEDGER_TOLERANCE)
            changes["time.scheme"] = setting.scheme
            time = document.data.get("time")
            if isinstance(time, Mapping):  # without what only springs have
                left = {key: value for key, value in time.items() if key != "safety"}
                document = replace(document, data={**document.data, "time": left})
        else:
            changes = {key: value for key, value in changes.items() if value not in {usual.model, usual.law}}
            if is_crowd:
                name = f"{path.stem}, first moments"
                changes["time.end"] = 0.05 if setting.model == usual.model else CROWD_END_PARTICLES  # s
        if setting.quick and not is_crowd:
            is_driven = any(body.motion is not None for body in own.bodies)
            changes["contact.stiffness_scale"] = LESS_SOFT if is_driven else SOFT
        if setting.law != usual.law and (is_crowd or own.contact.model != usual.model):
            # the scenario's own stiffness, meant for the linear law, is too soft for that of Hertz and Mindlin
            stiffness_scale = changes.get("contact.stiffness_scale", own.contact.stiffness_scale)
            changes["contact.stiffness_scale"] = STIFFER * float(str(stiffness_scale))
        scenario = document.with_values(changes).build()
        run, worst = SteppedScene(build(Model(scenario))), 0.0  # the largest residual over the energy in play
        for k in range(1, round(scenario.time.end / scenario.output.every) + 1):
            worst = max(worst, run.to_time(k * scenario.output.every).residual())
            if run.code != REACHED:
                break
        yield Row(name, "", 0.0, worst if run.code in {REACHED, AT_REST} else nan, tolerance)
