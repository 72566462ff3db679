"""The three blocks: V22 and V24 places, V19 and V21 symmetry, V20 convergence."""

from collections.abc import Iterator, Sequence
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from blocksim.kernels.common.arrays import World
from blocksim.scenario.laws import LAWS
from blocksim.verification import case, closed_forms as forms, statics
from blocksim.verification.scene import HEIGHT, SteppedScene, Throw, Thrower

SIZES = {"width": 0.032, "height": 0.05, "length": 0.025}  # m, upright = "length"
STEP_X = 0.022  # m, offset of each block against the one below: an overlap of 10 mm
BEFORE_FIRST_IMPACT = {  # time (s): x, y (mm), angle (degrees) of blocks 2 and 3, by pymunk at a step of 1e-5 s
    0.05: ((40.330, 74.323, -5.409), (63.160, 122.385, -5.409)),
    0.10: ((46.623, 71.146, -21.171), (74.432, 113.995, -21.171)),
    0.15: ((55.200, 61.301, -49.670), (94.447, 92.863, -48.415)),
    0.20: ((64.446, 32.025, -85.583), (116.650, 48.972, -79.664)),
}
FINAL = ((1, 16.0, 0.1, 0.0), (2, 67.3, 0.6, -90.0), (3, 128.8, 1.0, -90.0))  # block, x, tolerance (mm), angle (°)
LONGEST = 2.0  # s


def staircase(order: Sequence[int] = (0, 1, 2), side: float = 1.0, shift: float = 0.0) -> list[dict[str, object]]:
    """Return the bodies, block `order[i]` at place i of the list; to the other side for `side` = -1."""
    return [{"x": shift + side * (0.016 + STEP_X * level), "y": 0.025 + 0.05 * level, **SIZES} for level in order]


def collapse(setting: case.Setting, restitution: float, spacing: float = 1e-3, scale: float = 1.0) -> SteppedScene:
    """Let go of the three blocks; they stop once they rest."""
    contact = {"particle_spacing": spacing, "stiffness_scale": scale}
    time = {"stop_at_rest": True, "end": LONGEST}
    return setting.start(staircase(), restitution=restitution, contact=contact, time=time)


def before_impact(setting: case.Setting) -> Iterator[case.Row]:
    """Compare positions and angles of blocks 2 and 3 at four times; the farthest off counts.

    Restitution 0, as in V22: no impact yet, but the weight comes suddenly upon the springs at the start, and the rigid
    contacts of the reference do not swing back from that.
    """
    scene = collapse(setting, 0.0)
    for time, blocks in BEFORE_FIRST_IMPACT.items():
        upper = scene.to_time(time).bodies[1:]
        places = np.array([1e3 * upper.x, 1e3 * upper.y, np.degrees(upper.angle)]).T
        off = np.abs(places - np.array(blocks)).max(axis=0)
        yield case.Row(f"{time:.2f} s, place off by", "mm", 0.0, max(off[0], off[1]), 0.1)
        yield case.Row(f"{time:.2f} s, angle off by", "°", 0.0, off[2], 0.15)


def at_rest(setting: case.Setting) -> Iterator[case.Row]:
    """Compare the final places with those that ten independent engines agree on."""
    bodies = collapse(setting, 0.0).to_time(LONGEST).bodies
    for block, x, tolerance, angle in FINAL:
        allowed = 2.0 if setting.hertzian else tolerance  # mm
        yield case.Row(f"block {block}, x", "mm", x, 1e3 * bodies[block - 1].x, allowed)
        yield case.Row(f"block {block}, angle", "°", angle, np.degrees(bodies[block - 1].angle), 0.5)


BEFORE, AFTER = 0.2, 0.45  # s: just before the first impact; all impacts are over
MIRROR = np.array([-1.0, 1.0, -1.0, -1.0, 1.0, -1.0])  # x, y, angle, vx, vy, spin
RELABELLED = (2, 1, 0)
CORNER = 0.03  # m, from the centre of a block
SAME, REORDERED = 1e-9, 1e-6  # m, before impacts
SOLVED = {"velocity_tolerance": 1e-12}  # m/s: round-off may decide on one sweep more or less of rigid contacts


def symmetries(setting: case.Setting) -> Iterator[case.Row]:
    """Let the three blocks collapse in a mirror, under other numbers, and one metre aside.

    Rigid contacts are gone through one after the other, in an order that goes by the numbers of blocks, once a position
    pass. So overlaps depend on the numbers by a share of themselves (1e-9 m at a step h of 1e-5 s), and with them the
    step in which a point of a face lifts off, after 0.1 s. One step sooner changes a velocity by less than g h, and a
    place by less than g h 0.1 s until the first impact, which is 1e-5 m; a tenth of that is allowed.
    """

    def states(bodies: Sequence[dict[str, object]]) -> list[NDArray[np.float64]]:
        scene = setting.start(bodies, time={} if setting.has_springs else SOLVED)
        return [scene.to_time(time).state() for time in (BEFORE, AFTER)]

    usual = states(staircase())
    for name, others, allowed in (
        ("mirrored", [state * MIRROR for state in states(staircase(side=-1.0))], SAME),
        (
            "relabelled",
            [state[np.argsort(RELABELLED)] for state in states(staircase(RELABELLED))],
            SAME if setting.has_springs else REORDERED,
        ),
        (
            "moved 1 m",
            [state - np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0]) for state in states(staircase(shift=1.0))],
            SAME,
        ),
    ):
        before, after = (distance(one, two) for one, two in zip(usual, others, strict=True))
        yield case.Row(f"{name}, before impacts", "m", 0.0, before, allowed)
        yield case.Row(f"{name}, at the end", "mm", 0.0, 1e3 * after, 0.05)


def distance(one: NDArray[np.float64], two: NDArray[np.float64]) -> float:
    """Return how far (m) centres or corners of two states are apart at most."""
    apart = np.abs(one - two)
    return float(max(apart[:, :2].max(), CORNER * apart[:, 2].max()))


def fixed_block(setting: case.Setting) -> Iterator[case.Row]:
    """Let a tilted block slide and tumble over the ground and over a fixed block, at one step: the same motion."""
    body = {"y": HEIGHT, "angle": 0.4, "velocity": [0.3, -0.5]}
    fixed = {"x": 0.0, "y": 0.05, "width": 1.0, "height": 0.1, "fixed": True}
    plinth = setting.start([{**body, "y": 0.1 + HEIGHT}, fixed], friction=0.38, ground_friction=0.38)
    ground = setting.start([body], friction=0.38, ground_friction=0.38, time={"step": plinth.step})
    apart = 0.0
    for time in np.linspace(0.0, 0.3, 31)[1:]:  # s
        one, two = (scene.to_time(float(time)).state()[:1] for scene in (ground, plinth))
        apart = max(apart, distance(one, two - np.array([0.0, 0.1, 0.0, 0.0, 0.0, 0.0])))
    yield case.Row("motions apart", "µm", 0.0, 1e6 * apart, 1.0)


ORDER = 1.8
REFINEMENTS = (1, 2, 4)
COARSEST = 0.1  # frequency times step
PERIODS, SAMPLES = 3, 24  # of the oscillation
PHASES = 32  # of a step, at which an impact begins
SAFETIES = (0.1, 0.05, 0.025)
RESTITUTION = 0.5
SOFT = 0.01  # stiffness scale of the run-out


def convergence(setting: case.Setting) -> Iterator[case.Row]:
    """Order in dt of an oscillation and of the restitution; change of the run-out when the spacing is halved."""
    coarse, middle, fine = (oscillation(setting, refinement) for refinement in REFINEMENTS)
    yield case.at_least("oscillation, order in dt", "", ORDER, np.log2(rms(coarse - middle) / rms(middle - fine)))
    errors = []
    for safety in SAFETIES:  # of flat impacts that begin at different phases of a step
        thrower = Thrower(setting, RESTITUTION, time={"safety": safety})
        throws = [thrower.throw(Throw(phase=(k + 0.5) / PHASES)).vy for k in range(PHASES)]
        errors.append(rms(np.array(throws) - RESTITUTION))
    order = np.log2(errors[0] / errors[-1]) / np.log2(SAFETIES[0] / SAFETIES[-1])
    yield case.at_least("restitution, order in dt", "", ORDER, order)
    one, half = (collapse(setting, 0.2, spacing, SOFT).to_time(LONGEST).bodies.x for spacing in (1e-3, 5e-4))
    yield case.Row("run-out, spacing halved", "mm", 0.0, 1e3 * float(np.abs(one - half).max()), 1.0)  # mm


def rms(values: NDArray[np.float64]) -> float:
    """Return the root of the mean square."""
    return float(np.sqrt(np.mean(values**2)))


def oscillation(setting: case.Setting, refinement: int) -> NDArray[np.float64]:
    """Return heights (m) at fixed times of an undamped block that starts half of its overlap too high: no lift-off."""
    overlap = statics.weight_overlap(setting)
    frequency = sqrt(LAWS[setting.law].exponent * forms.GRAVITY / overlap)  # slope of d^n: n force/overlap
    step = COARSEST / frequency / refinement

    def press(world: World) -> None:
        world.bodies[0].y -= 0.5 * overlap

    contact = {"contact_radius": statics.CONTACT_RADIUS} if setting.hertzian else {}
    time = {"step": step, "force_step": True}
    scene = setting.start([{"y": HEIGHT / 2}], press, restitution=1.0, contact=contact, time=time)
    every = refinement * round(2.0 * np.pi / COARSEST * PERIODS / SAMPLES)
    return np.array([scene.to_step(every * k).bodies[0].y for k in range(1, SAMPLES + 1)])
