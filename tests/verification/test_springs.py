"""Springs and rigid contacts beyond the cases: phases, rocking, polygons, lists of pairs; what is wrong is noticed."""

from math import atan2, cos, radians, sin, sqrt, tan

import numpy as np
import pytest
from numpy.typing import NDArray

from blocksim.bench.harness import pushed_wall
from blocksim.kernels.common.arrays import REACHED, World
from blocksim.scenario import Model
from blocksim.scenario.geometry import Corners, centre_outline, regular, section_of
from blocksim.verification import impacts
from blocksim.verification.case import Setting
from blocksim.verification.impacts import LANDINGS
from blocksim.verification.scene import GOLDEN, HEIGHT, WIDTH, CaseScene, SteppedScene, Throw, Thrower
from blocksim.world import nonsmooth
from blocksim.world.build import build_world
from blocksim.world.interactions import damping_ratio
from tests.conftest import PaperBlock, Start
from tests.contacts import contact_records

G = 9.81
PHASES = tuple((GOLDEN * k) % 1.0 for k in range(14))  # of a step; zero begins exactly at one


@pytest.mark.parametrize("e", [0.1, 0.9])
@pytest.mark.parametrize("landing", LANDINGS)
def test_where_in_a_step_a_contact_begins_does_not_matter(landing: str, e: float) -> None:
    thrower = Thrower(Setting(), e)
    for phase in PHASES:
        body = thrower.throw(Throw(LANDINGS[landing], phase=phase))
        assert body.vy == pytest.approx(e, abs=0.005), f"at phase {phase}"
        assert abs(body.spin) * WIDTH < 1e-9


SQUEEZE, OFFSET = 1e-4, 1e-8  # m: overlap of a block between two others, and its start off the middle


def test_block_between_two_others_is_stable_at_any_damping(start: Start, paper_block: PaperBlock) -> None:
    """With the dashpots of the whole block for each pair it would not be from a product of 0.5 on."""
    w = sqrt(2.0 * paper_block.point_stiffness / paper_block.mass)

    def press(world: World) -> None:
        world.bodies[0].y += OFFSET - SQUEEZE
        world.bodies[1].y -= 2.0 * SQUEEZE

    lid = {"y": 1.5 * paper_block.height, "width": 0.05, "fixed": True}
    time = {"step": 2.5 / (damping_ratio(0.0) * w), "force_step": True}
    far = {"max_overlap": 0.5 * paper_block.height}  # what is unstable swings far
    bodies = [{"y": 0.5 * paper_block.height}, lid]
    scene = start(bodies, restitution=0.0, gravity=0.0, time=time, contact=far, change=press)
    speeds = [abs(float(scene.to_step(step).bodies[0].vy)) / (w * OFFSET) for step in range(2000)]
    assert scene.code == REACHED
    assert max(speeds) < 1.0
    assert speeds[-1] < 1e-3


RADIUS, TURN = 0.02, radians(2.0)  # m, rad: of the hexagon
BETA = radians(20.0)  # half the angle of the wedge


def table(corners: Corners, **values: object) -> dict[str, object]:
    """Return the table of a body with these corners (m)."""
    outline = centre_outline(corners)
    place = {axis: corner - own for axis, corner, own in zip("xy", corners[0], outline[0], strict=True)}
    return {**place, "outline": [list(corner) for corner in outline], **values}


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_wedge_slides_in_between_jaws_with_the_force_of_limit_equilibrium(friction: float) -> None:
    """N = W / (2 (sin b + mu cos b)) on either side as jaws become heavy; of these N (cos b - mu sin b) / M pushes."""
    low, high = 0.01, 0.05
    at_low, at_high = (0.01 + y * tan(BETA) for y in (low, high))
    shape = ((-at_low, low), (at_low, low), (at_high, high), (-at_high, high))
    jaw = ((0.01, 0.0), (1.0, 0.0), (1.0, high), (at_high, high))
    left = tuple((-x, y) for x, y in reversed(jaw))
    ratio = section_of(jaw)[0] / section_of(shape)[0]
    push, carry = cos(BETA) - friction * sin(BETA), sin(BETA) + friction * cos(BETA)
    sinks = G / (1.0 + 2.0 * ratio * tan(BETA) * carry / push)
    bodies = [table(corners) for corners in (shape, jaw, left)]
    run = CaseScene(bodies, restitution=0.0, friction=friction, ground_friction=0.0).start().to_time(0.005)
    assert run.bodies.vy[0] == pytest.approx(-sinks * run.time, rel=1e-3)
    assert run.bodies.vx[1] == pytest.approx(sinks * run.time * tan(BETA), rel=1e-3)


def test_hexagon_that_rolls_onto_its_next_face_keeps_eleven_seventeenths_of_its_spin() -> None:
    """About the new corner: w' (I + m R^2) = w (I + m R^2 cos 60 deg), I = 5/12 m R^2."""
    outline, spin = (
        [(cos(TURN) * x - sin(TURN) * y, sin(TURN) * x + cos(TURN) * y) for x, y in regular(6, RADIUS)],
        -8.0,
    )
    pivot = min(outline, key=lambda corner: corner[1])
    above = tuple((x, y - pivot[1]) for x, y in outline)
    moving: dict[str, object] = {"velocity": [spin * pivot[1], -spin * pivot[0]], "spin": spin}
    run = CaseScene(
        [table(above, **moving)], restitution=0.0, ground_friction=5.0, contact={"stiffness_scale": 0.1}
    ).start()
    spins = [float(run.to_time((k + 1) * 2e-5).bodies.spin[0]) for k in range(300)]
    fall = int(np.argmax(np.abs(np.diff(spins))))
    assert spins[fall + 15] / spins[fall - 15] == pytest.approx(11.0 / 17.0, rel=0.01)


def motion_bits(scene: SteppedScene) -> dict[str, bytes]:
    """Return the bits of all that moves, and of what the contacts remember."""
    names = ("x", "y", "angle", "cos", "sin", "vx", "vy", "spin", "ax", "ay", "spin_rate")
    return {name: scene.bodies[name].tobytes() for name in names} | {"contacts": contact_records(scene.world).tobytes()}


def test_a_crowd_moves_the_same_to_the_last_bit_with_any_skin_of_the_scenario() -> None:
    contact = {"stiffness_scale": 1e-3}
    usual = float(build_world(Model(pushed_wall(5, 8, contact=contact))).controls[0].skin)
    ends, rebuilds = [], []
    for share in (0.5, 1.0, 3.0):
        skin = {} if share == 1.0 else {"skin": share * usual}
        scene = SteppedScene(build_world(Model(pushed_wall(5, 8, contact={**contact, **skin})))).to_time(0.15)
        assert scene.code == REACHED
        ends.append(motion_bits(scene))
        rebuilds.append(int(scene.world.clock[0].rebuilds))
    assert ends[0] == ends[1] == ends[2]
    assert rebuilds[0] > rebuilds[1] > rebuilds[2] > 10


SETTING = Setting(scheme="nonsmooth")


def peaks(width: float, height: float, restitution: float) -> NDArray[np.float64]:
    """Return how far (rad) a block turns that is let continue one corner, each time that it turns back."""
    tilt = 0.5 * atan2(width, height)
    place = {"x": -cos(tilt) * width + sin(tilt) * height, "y": sin(tilt) * width + cos(tilt) * height}
    body = {"x": place["x"] / 2, "y": place["y"] / 2, "angle": -tilt, "width": width, "height": height}
    stepping = {"scheme": "nonsmooth", "end": 100.0}
    run = CaseScene([body], restitution=restitution, ground_friction=5.0, time=stepping).start()
    found: list[float] = []
    angle, spin = float(run.bodies.angle[0]), 0.0
    while len(found) < 4:
        before, had = angle, spin
        run.to_step(run.steps + 1)
        angle, spin = float(run.bodies.angle[0]), float(run.bodies.spin[0])
        if spin * had < 0.0:  # at an impact it turns on with both spins until it is where both say
            found.append(abs(before + had * (angle - before - spin * run.step) / (had - spin)))
    return np.array(found)


@pytest.mark.parametrize(
    ("width", "height", "restitution", "exact", "within"),
    [
        (0.032, 0.05, 0.0, [0.07366564, 0.02247022, 0.007063936, 0.002239554], 2e-3),
        (0.01, 0.04, 0.5, [0.09473264, 0.07505532, 0.06027335, 0.04882257], 2e-3),
        (0.032, 0.05, 0.8, [0.06595171, 0.01310729, 0.04265208, 0.008739528], 5e-3),  # it hops
    ],
)
def test_rocking_peaks_at_the_default_step_are_those_of_exact_impact_times(
    width: float, height: float, restitution: float, exact: list[float], within: float
) -> None:
    """Integrated from event to event (DOP853 to 1e-12) under Newton's restitution, none below 0.01 m/s, no slip.

    At 0.8 a restitution of 0.80008 would move the fourth peak of the squat block by 0.9 %.
    """
    assert peaks(width, height, restitution) == pytest.approx(exact, rel=within)


def test_energy_that_friction_took_and_nobody_tallied_is_noticed() -> None:
    slide = SETTING.start([{"y": HEIGHT / 2, "velocity": [0.5, 0.0]}]).to_time(0.1)
    assert slide.residual() < impacts.RIGID_LEDGER_TOLERANCE
    slide.scene.contacts.tallies.friction[:] *= 0.999
    assert slide.residual() > 1e-4


def test_energy_from_rebounds_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    throws = [Throw(radians(4.0), friction, phase) for friction in (0.7, 1.0) for phase in (0.1, 0.3, 0.5, 0.7, 0.9)]
    assert impacts.largest_gain(Thrower(SETTING, 1.0), throws) < impacts.ROUND_OFF
    monkeypatch.setattr(nonsmooth, "has_sequential_impacts", lambda *_: False)  # nobody watches
    assert impacts.largest_gain(Thrower(SETTING, 1.0), throws) > 1e-3
