"""V10 sliding and toppling on a slope, V11 and V12 a block that rocks, V17 a leaning ladder, V18 a row of dominoes.

Dominoes fall as fast as the collective model of J. M. J. van Leeuwen says (Am. J. Phys. 78 (2010) 721-727). They stand
with free gaps s, h high and d thick, and turn about their lower front edges, which do not slip; faces are frictionless
and collisions lose everything: a domino that has struck the next continues leaning on it. So all fallen dominoes and
the foremost one move with one degree of freedom, the foremost one's angle. Between two collisions their energy is kept.
In a collision the velocities are projected, in the metric of the kinetic energy, on those that the new contact allows;
impulses between leaning dominoes are what makes the projection. Lengths of the model are in units of h, time in units
of sqrt(h/g), angles from the vertical.
"""

from collections.abc import Callable, Iterator
from math import asin, cos, degrees, hypot, radians, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from blocksim.verification import case, closed_forms as forms
from blocksim.verification.scene import HEIGHT, WIDTH, SteppedScene

SLENDER, TALL = 0.010, 0.040  # m
NO_SLIP = 5.0  # friction coefficient
LONGEST = 0.2  # s
SETTLED = 1e-3  # s after the impact
GRAVITY = forms.GRAVITY


def start_rocking(setting: case.Setting, restitution: float) -> SteppedScene:
    """Let go of a slender block that stands on its right corner, turned by half the angle of balance."""
    tilt = forms.toppling_slope(SLENDER, TALL) / 2
    # the corner stays at x = SLENDER/2, y = 0; turned clockwise
    body = {
        "x": SLENDER / 2 - cos(tilt) * SLENDER / 2 + sin(tilt) * TALL / 2,
        "y": sin(tilt) * SLENDER / 2 + cos(tilt) * TALL / 2,
        "angle": -tilt,
        "width": SLENDER,
        "height": TALL,
    }
    return setting.start([body], restitution=restitution, ground_friction=NO_SLIP)


def quarter_period(setting: case.Setting) -> Iterator[case.Row]:
    """Time the way from release to standing upright."""
    time = until_upright(start_rocking(setting, 0.2))
    expected = forms.rocking_quarter_time(SLENDER, TALL, forms.toppling_slope(SLENDER, TALL) / 2)
    yield case.relative("time to upright", "s", expected, time, 0.005)


def until_upright(scene: SteppedScene) -> float:
    """Continue until the angle changes its sign; return the time (s) there, by interpolation."""
    block, steps = scene.bodies[0], scene.steps
    angle = float(block.angle)
    while block.angle < 0.0 and scene.time < LONGEST:
        angle, steps = float(block.angle), scene.steps
        scene.to_step(steps + 10)
    share = angle / (angle - float(block.angle))
    return (steps + share * (scene.steps - steps)) * scene.step


def housner(setting: case.Setting) -> Iterator[case.Row]:
    """Compare the spin about the new corner with that before the impact, both reckoned to the upright position.

    The impact takes a while; until it is over the block has turned a little, and the spin at the upright position
    follows from the energy about the corner, w^2 + (3/2) g (cos(alpha) - cos(alpha - |angle|)) / R.
    """
    scene = start_rocking(setting, 0.0)
    block = scene.to_time(until_upright(scene) + SETTLED).bodies[0]
    half, alpha = hypot(SLENDER, TALL) / 2, forms.toppling_slope(SLENDER, TALL)
    lifted = 1.5 * GRAVITY / half * (cos(alpha - abs(block.angle)) - cos(alpha))
    before = (1.5 * GRAVITY / half * (cos(alpha - alpha / 2) - cos(alpha))) ** 0.5  # let go at half of alpha
    after = (block.spin**2 + lifted) ** 0.5
    yield case.relative("spin ratio", "", forms.housner_ratio(SLENDER, TALL), after / before, 0.05)


ROUGH = 2.0  # friction coefficient at which no slope of this chart lets a block slide before it topples
BRACKET = radians(1.0)  # either way of the expected limit
SLOPE_HALVINGS, LADDER_HALVINGS = 6, 7
OBSERVED = 0.35  # s; enough to see a block go at a hundredth of a degree beyond a limit
SLID, TURNED = 1e-5, radians(1.0)  # m, before the block has turned by so much
LADDER, LADDER_THICKNESS, LADDER_SLOPE = 1.0, 0.01, radians(60.0)  # m, m, rad
WALL = 0.2  # m, thickness


def motion(setting: case.Setting, width: float, height: float, angle: float, friction: float) -> tuple[bool, bool]:
    """Return whether a block (m) on a slope (rad) slides, and whether it topples; the slope goes down towards +x.

    Sliding is seen while the block has hardly turned: a block that has toppled falls on its side and slides then.
    """
    body = {"y": height / 2, "width": width, "height": height}
    scene = setting.start([body], ground_friction=friction, tilt=-angle)
    slides = topples = False
    while scene.time < OBSERVED and not topples:
        block = scene.to_time(scene.time + 2e-3).bodies[0]
        topples = bool(-block.angle > TURNED)
        foot = block.x + cos(block.angle) * width / 2 + sin(block.angle) * height / 2
        slides = slides or bool(foot - width / 2 > SLID)
    return slides, topples


def chart(setting: case.Setting) -> Iterator[case.Row]:
    """Find the limits of sliding and toppling on a slope, and one point of every regime.

    The regimes are of a block on end. Steeper than both limits it slides without toppling where mu < b/h (friction, not
    gravity, turns it), topples first where mu is above `rolling_friction_limit`, and does both in between.
    """

    def row(name: str, width: float, height: float, friction: float, expected: float) -> case.Row:
        def goes(angle: float) -> bool:
            slides, topples = motion(setting, width, height, angle, friction)
            return topples if friction == ROUGH else slides

        found = limit(goes, expected - BRACKET, expected + BRACKET, SLOPE_HALVINGS)
        return case.Row(name, "°", degrees(expected), degrees(found), 0.2)

    for friction in (0.31, 0.38):
        yield row(f"slides, μ = {friction:g}", WIDTH, HEIGHT, friction, forms.sliding_slope(friction))
    for width, height, name in ((WIDTH, HEIGHT, "32 × 25"), (HEIGHT, WIDTH, "25 × 32")):
        yield row(f"topples, {name}", width, height, ROUGH, forms.toppling_slope(width, height))
    width, height = HEIGHT, WIDTH
    flat, steep = radians(30.0), radians(60.0)
    needed = forms.rolling_friction_limit(width, height, steep)
    points = (
        (flat, ROUGH, (False, False)),
        (flat, 0.5, (True, False)),
        (steep, 0.9 * width / height, (True, False)),
        (steep, 0.5 * (width / height + needed), (True, True)),
        (steep, 1.1 * needed, (False, True)),
    )
    as_expected = [motion(setting, width, height, angle, friction) == moves for angle, friction, moves in points]
    yield case.count("regimes", len(points), sum(as_expected))


def ladder(setting: case.Setting) -> Iterator[case.Row]:
    """Find the ground friction below which a ladder at a smooth wall slips: its foot is to the right of the wall."""
    along, across = (cos(LADDER_SLOPE), sin(LADDER_SLOPE)), (sin(LADDER_SLOPE), cos(LADDER_SLOPE))
    rod = {
        "x": (LADDER * along[0] + LADDER_THICKNESS * across[0]) / 2,
        "y": (LADDER * along[1] + LADDER_THICKNESS * across[1]) / 2,
        "width": LADDER_THICKNESS,
        "height": LADDER,
        "angle": radians(90.0) - LADDER_SLOPE,
    }
    wall = {"x": -WALL / 2, "y": LADDER / 2, "width": WALL, "height": LADDER, "fixed": True}

    def stays(friction: float) -> bool:
        scene = setting.start([rod, wall], friction=0.0, ground_friction=friction)
        return bool(abs(scene.to_time(1.0).bodies[0].angle - rod["angle"]) <= 1e-4)  # rad, of turning

    expected = forms.ladder_friction(LADDER_SLOPE, LADDER_THICKNESS / LADDER)
    found = limit(stays, 0.9 * expected, 1.1 * expected, LADDER_HALVINGS)
    yield case.relative("friction needed", "", expected, found, 0.02)


def limit(outcome: Callable[[float], bool], low: float, high: float, halvings: int) -> float:
    """Return where an outcome changes, by bisection: the middle of the last interval.

    NaN where `outcome` is not False at `low` and True at `high`.
    """
    if outcome(low) or not outcome(high):
        return float("nan")
    for _ in range(halvings):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if outcome(middle) else (middle, high)
    return 0.5 * (low + high)


Floats = NDArray[np.float64]
STEPS = 400  # of the foremost domino's angle between two collisions of the model
DOMINO_TALL, THICK = 0.048, 0.0075  # m
COUNT = 24
GAPS = (0.2, 0.3, 0.5, 0.7)  # of the height
FIRST, LAST = 10, 20
PUSH = 6.5  # spin of the first domino in units of sqrt(g/h): near that of the stationary wave for every gap
SOFT = 0.01  # stiffness scale of the quick size
POLL = 2e-4  # s


class DominoModel:
    """A row of dominoes, in units of their height."""

    def __init__(self, thickness: float, gap: float) -> None:
        """Take their thickness and the free gap between two."""
        self.thickness, self.gap = thickness, gap
        self.inertia = (1.0 + thickness**2) / 3.0  # about the lower edge, per mass
        self.strike = asin(gap)  # rad: angle at which a domino strikes the next, still upright one

    def lean(self, foremost: float, count: int) -> tuple[Floats, Floats]:
        """Return angles of `count` dominoes that lean on one another, foremost first, and d angle/d foremost.

        The upper front edge of one touches the back of the next: sin(a - b) = (s + d) cos b - d, a behind b.
        """
        angles, rates = [foremost], [1.0]
        pitch = self.gap + self.thickness
        for _ in range(count - 1):
            front = angles[-1]
            reach = pitch * cos(front) - self.thickness
            slope = 1.0 - pitch * sin(front) / sqrt(1.0 - reach**2)
            angles.append(front + asin(reach))
            rates.append(slope * rates[-1])
        return np.array(angles), np.array(rates)

    def struck_spin(self, fallen: int, spin: float) -> float:
        """Return the spin of the domino that is struck by the foremost of `fallen` ones turning with `spin`."""
        _, before = self.lean(self.strike, fallen)
        _, after = self.lean(0.0, fallen + 1)
        return spin * float(before @ after[1:]) / float(after @ after)

    def collision_times(self, count: int, spin: float) -> Floats:
        """Return the times at which domino 1, 2, ... `count` strikes the next; domino 1 starts upright with `spin`.

        Raises ValueError where the row stops before.
        """
        time, times = 0.0, []
        nodes = self.strike * np.linspace(0.0, 1.0, STEPS + 1)  # of the foremost one, from upright to the next
        for fallen in range(1, count + 1):
            states = [self.lean(float(angle), fallen) for angle in nodes]
            masses = np.array([0.5 * self.inertia * float(rates @ rates) for _, rates in states])
            heights = np.array(  # sums of those of all centres
                [float(0.5 * np.sum(np.cos(angles) + self.thickness * np.sin(angles))) for angles, _ in states]
            )
            squares = (masses[0] * spin**2 + heights[0] - heights) / masses
            if squares.min() <= 0.0:
                raise ValueError(f"the row stops at domino {fallen}")
            slowness = 1.0 / np.sqrt(squares)
            time += float(np.sum(0.5 * (slowness[1:] + slowness[:-1]) * np.diff(nodes)))
            times.append(time)
            spin = self.struck_spin(fallen, float(np.sqrt(squares[-1])))
        return np.array(times)

    def wave_speed(self, first: int, last: int, spin: float) -> float:
        """Return the speed of the wave between two collisions, in units of sqrt(g h)."""
        times = self.collision_times(last, spin)
        return (last - first) * (self.gap + self.thickness) / float(times[last - 1] - times[first - 1])


def dominoes(setting: case.Setting) -> Iterator[case.Row]:
    """Push the first of 24 dominoes, about its lower front edge; time the wave from collision 10 to collision 20.

    A domino strikes the next when that one starts to turn.
    """
    spin = -PUSH * sqrt(GRAVITY / DOMINO_TALL)  # clockwise
    moving = 1e-2 * sqrt(GRAVITY / DOMINO_TALL)  # rad/s
    for gap in GAPS[:2] if setting.quick else GAPS:
        pitch = gap * DOMINO_TALL + THICK
        bodies: list[dict[str, object]] = [
            {"x": i * pitch, "y": DOMINO_TALL / 2, "width": THICK, "height": DOMINO_TALL} for i in range(COUNT)
        ]
        bodies[0] |= {"spin": spin, "velocity": [-spin * DOMINO_TALL / 2, -spin * -THICK / 2]}
        contact = {"stiffness_scale": SOFT if setting.quick else 1.0}
        scene = setting.start(bodies, restitution=0.0, friction=0.0, ground_friction=NO_SLIP, contact=contact)
        times = [np.nan] * (COUNT - 1)
        while scene.time < 2.0 and np.isnan(times[LAST - 1]):  # s
            scene.to_time(scene.time + POLL)
            for i in np.flatnonzero(scene.bodies.spin[1:] < -moving):
                times[i] = scene.time if np.isnan(times[i]) else times[i]
        speed = (LAST - FIRST) * pitch / (times[LAST - 1] - times[FIRST - 1])
        model = DominoModel(THICK / DOMINO_TALL, gap).wave_speed(FIRST, LAST, PUSH) * sqrt(GRAVITY * DOMINO_TALL)
        yield case.relative(f"gap {gap:g} h, speed", "m/s", model, speed, 0.05)
