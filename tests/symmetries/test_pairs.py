"""Two blocks of any size, placed anyhow: forces do not know which of them comes first, and nothing blows up."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import strategies as st

from blocksim.kernels.common.arrays import World
from blocksim.verification.case import Setting
from blocksim.verification.scene import SteppedScene
from tests.symmetries.scenes import EXPLICIT, RIGID, RIGID_STEP, for_all, some

Change = Callable[[World], None]

FAR_UP = 2.0  # heights of the pair above the ground, at least
DEEP = 0.002  # overlap of neighbouring edges, as a share of the smaller side
CLOSING = 0.5  # m/s
RIGID_SHARE = 0.01  # of the smallest side, by which the blocks approach in a step of rigid contacts
SIZE = 0.05  # m
EPSILON = 1e-14
OTHER_SUMS = 1e-6  # of the push: sums in another order change an overlap by some 1e-16 m, and one may be of 1e-9 m only
SAME = 1e-9  # of the push: what round-off of some 1e-16 m leaves of an overlap of 1e-6 m or more
STEPS = 3
NEARLY_PARALLEL = 0.1  # rad
MODELS = [
    Setting("surface", "linear"),
    Setting("surface", "hertz-mindlin"),
    Setting("kernel", "linear"),
    Setting("particles", "hertz-mindlin"),
]
SHAPES = {  # sides (m) of a pair: from the smallest to the largest, by the size of the whole and the longest ratio
    "tiny": (1e-6, 4.0),
    "usual": (0.03, 4.0),
    "huge": (1e3, 4.0),
    "needles": (1.0, 1e4),
    "tiny needles": (1e-3, 1e3),
}


class Pair(NamedTuple):
    """A block on the side of another one, turned together with it and about itself."""

    sides: tuple[float, float, float, float]  # width and height of one, and of two; as shares of the size
    along: float  # place on the side of the first one, -1 to 1
    tilt: float  # of the second against the first (rad)
    turn: float  # of both (rad)
    slip: float  # speed along the side, as a share of the closing speed
    spin: float  # of the second, as a share of the closing speed over its longer side


def pairs(ratio: float = 4.0) -> st.SearchStrategy[Pair]:
    """Draw a pair whose sides are from 1 / ratio to 1."""
    share, speed = st.floats(0.0, 1.0).map(lambda power: ratio**-power), st.floats(-1.0, 1.0)
    tilt = st.one_of(st.just(0.0), st.floats(-0.7, 0.7))
    return st.builds(Pair, st.tuples(*[share] * 4), st.floats(-0.9, 0.9), tilt, st.floats(-3.0, 3.0), speed, speed)


def bodies_of(pair: Pair, size: float, *, gap: float) -> list[dict[str, object]]:
    """Return the two blocks of a pair whose longest possible side is `size` (m), far above the ground.

    The lowest point of the second lies `gap` times the smallest side above the side of the first.
    """
    width, height, wide, high = (size * side for side in pair.sides)
    lowest = 0.5 * (wide * abs(np.sin(pair.tilt)) + high * abs(np.cos(pair.tilt)))
    away = np.array([0.5 * pair.along * width, 0.5 * height + lowest + gap * min(width, height, wide, high)])
    cos, sin = np.cos(pair.turn), np.sin(pair.turn)
    turned = np.array([[cos, -sin], [sin, cos]])
    place = turned @ away + np.array([0.0, FAR_UP * 4.0 * size])
    velocity = turned @ np.array([pair.slip, -1.0]) * CLOSING
    first = {"x": 0.0, "y": FAR_UP * 4.0 * size, "width": width, "height": height, "length": size, "angle": pair.turn}
    second = {"x": float(place[0]), "y": float(place[1]), "width": wide, "height": high, "length": size}
    moving = {"velocity": velocity.tolist(), "spin": pair.spin * CLOSING / max(wide, high)}
    return [first, {**second, **moving, "angle": pair.turn + pair.tilt}]


def smallest(bodies: Sequence[dict[str, object]]) -> float:
    return min(float(str(body[name])) for body in bodies for name in ("width", "height"))


def started(setting: Setting, bodies: Sequence[dict[str, object]], change: Change | None = None) -> SteppedScene:
    """Start a pair without weight; overlaps may be as deep as half the smallest side."""
    side = smallest(bodies)
    contact: dict[str, object] = {"max_overlap": 0.5 * side}
    if setting.hertzian:
        contact["contact_radius"] = 0.05 * side
    if setting.model != "surface":
        contact["particle_spacing"] = 0.25 * side
    return setting.start(bodies, change, restitution=0.3, gravity=0.0, contact=contact)


class Pushed(NamedTuple):
    """Change of momentum (x, y; kg m/s) and of angular momentum about the origin (kg m2/s) of each body."""

    one: np.ndarray
    two: np.ndarray
    step: float  # s
    floor: float  # round-off of the momenta themselves


def pushed(setting: Setting, pair: Pair, order: int) -> Pushed:
    """Push two blocks for the first steps.

    The bodies begin inside each other, where springs are concerned; `order` -1 names them the other way round.
    """
    bodies = bodies_of(pair, SIZE, gap=0.0)
    depth = 0.0 if not setting.has_springs else DEEP * smallest(bodies)

    def press(world: World) -> None:
        second = world.bodies[:2][::order][1:]
        second["x"] += depth * np.sin(pair.turn)
        second["y"] -= depth * np.cos(pair.turn)

    scene = started(setting, bodies[::order], press)
    before = momenta(scene)
    scene.to_step(STEPS)
    one, two = (momenta(scene) - before)[::order]
    return Pushed(one, two, scene.step, EPSILON * float(np.abs(before).max()))


def momenta(scene: SteppedScene) -> np.ndarray:
    """Return momentum (x, y) and angular momentum about the origin, a row a body."""
    body = scene.bodies
    px, py = body["mass"] * body["vx"], body["mass"] * body["vy"]
    return np.array([px, py, body["inertia"] * body["spin"] + body["x"] * py - body["y"] * px]).T


def order_matters(pair: Pair, setting: Setting) -> float:
    """Return by what share of the push it may matter which body is named first: nothing but where there is a tie.

    Of two nearly parallel faces either may give rigid contacts their normal, and of two corners that lie on each other
    either may be where springs meet: then arms differ by the overlap, and with them speeds and so forces.
    """
    if abs(pair.tilt) >= NEARLY_PARALLEL:
        return 0.0
    if not setting.has_springs:
        return abs(pair.tilt)
    width, _, wide, high = pair.sides
    ends = [0.5 * pair.along * width + 0.5 * (side * wide + high * np.sin(pair.tilt)) for side in (-1.0, 1.0)]
    beside = min(abs(end - 0.5 * side * width) for end in ends for side in (-1.0, 1.0))
    return 2.0 * DEEP if beside <= 2.0 * DEEP else 0.0


@pytest.mark.parametrize(
    "setting",
    [*MODELS, Setting(scheme=RIGID, rigid_step=RIGID_STEP)],
    ids=lambda one: f"{one.model} {one.law} {one.scheme}",
)
@some(5, 200)
def test_forces_are_equal_and_opposite_and_know_no_order(setting: Setting, examples: int) -> None:
    met = []

    def check(pair: Pair) -> None:
        usual, renamed = pushed(setting, pair, 1), pushed(setting, pair, -1)
        largest = np.abs(usual.one[:2]).max()
        met.append(largest > 0.0)
        same = SAME * largest + usual.floor
        arm = same + 4.0 * CLOSING * STEPS * usual.step * largest  # arms differ by what blocks move meanwhile, at most
        order = (order_matters(pair, setting) + OTHER_SUMS) * largest
        for apart, allowed in (
            (usual.one + usual.two, 0.0),
            (usual.one - renamed.one, order),
            (usual.two - renamed.two, order),
        ):
            assert np.abs(apart[:2]).max() <= same + allowed
            assert abs(apart[2]) <= arm + SIZE * allowed

    for_all(pairs(), examples, check)
    assert any(met)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("scheme", [EXPLICIT, RIGID])
@some(4, 100)
def test_collision_of_any_shapes_is_finite_and_gains_no_energy(scheme: str, shape: str, examples: int) -> None:
    size, ratio = SHAPES[shape]
    met = []

    def check(pair: Pair) -> None:
        bodies = bodies_of(pair, size, gap=0.01)
        step = RIGID_SHARE * smallest(bodies) / (3.0 * CLOSING)
        scene = started(Setting(scheme=scheme, rigid_step=step), bodies)
        start = scene.kinetic
        for _ in range(20):
            scene.to_step(scene.steps + (20 if scheme == RIGID else 500))
            assert np.isfinite(scene.state()).all()
            assert scene.mechanical <= start * (1.0 + 1e-6)
        assert scene.residual() <= (1e-9 if scheme == RIGID else 1e-3)
        met.append(scene.bodies["spin"][0] != 0.0 or scene.bodies["vx"][0] != 0.0 or scene.bodies["vy"][0] != 0.0)

    for_all(pairs(ratio), examples, check)
    assert any(met)
