"""Blocks and polygons on springs beyond the cases: phases, losses, other frictions and closed forms of polygons."""

from __future__ import annotations

from math import atan, cos, radians, sin, sqrt, tan
from typing import TYPE_CHECKING

import numpy as np
import pytest

from blocksim.bench.harness import pushed_wall
from blocksim.kernels.common.arrays import AT_REST, REACHED, World
from blocksim.scenario.geometry import Corners, centre_outline, regular, section_of
from blocksim.verification import closed_forms as forms
from blocksim.verification.case import Setting
from blocksim.verification.collapse import FINAL, collapse
from blocksim.verification.impacts import LANDINGS
from blocksim.verification.scene import GOLDEN, HEIGHT, WIDTH, CaseScene, Simulation, Throw, Thrower, kinetic_energy
from blocksim.world.build import build_world
from blocksim.world.interactions import damping_ratio

if TYPE_CHECKING:
    from tests.conftest import PaperBlock, Start

G = 9.81
BOTH = ["linear", pytest.param("hertz-mindlin", marks=pytest.mark.long)]
PHASES = tuple((GOLDEN * k) % 1.0 for k in range(14))  # of a step; zero begins exactly at one


@pytest.mark.parametrize("offset", [0.0, 1e-12, -1e-9])
def test_aligned_stack_stands_on_two_points_per_face(start: Start, paper_block: PaperBlock, offset: float) -> None:
    count = 4
    height = paper_block.height
    places = [{"x": offset * (i % 2), "y": (i + 0.5) * height} for i in range(count)]
    stack = start(places).to_time(0.05)
    assert stack.contacts == 2 * count
    sag_of_one = forms.static_overlap(paper_block.mass, 2.0 * paper_block.point_stiffness)
    tops = [0.0, *(float(y) for y in stack.bodies.y + height / 2)]
    for i, (below, body) in enumerate(zip(tops, stack.bodies, strict=False)):
        sag = below - (body.y - height / 2)
        assert sag == pytest.approx((count - i) * sag_of_one, rel=1e-3)
    assert np.abs(stack.bodies.x - [place["x"] for place in places]).max() < 1e-12
    assert np.abs(stack.bodies.angle).max() < 1e-9
    assert stack.kinetic < 1e-18


@pytest.mark.parametrize("law", BOTH)
@pytest.mark.parametrize("e", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("landing", LANDINGS)
def test_where_in_a_step_a_contact_begins_does_not_matter(law: str, landing: str, e: float) -> None:
    thrower = Thrower(Setting(law=law), e)
    for phase in PHASES:
        body = thrower.throw(Throw(LANDINGS[landing], phase=phase))
        assert body.vy == pytest.approx(e, abs=0.005), f"at phase {phase}"
        assert abs(body.spin) * WIDTH < 1e-9


@pytest.mark.parametrize("law", BOTH)
@pytest.mark.parametrize("speed", [0.1, 1.0, 10.0])
@pytest.mark.parametrize("e", [0.3, 0.5, 0.8, 1.0])
def test_impact_beside_the_centre_loses_the_asked_share_of_its_energy(law: str, speed: float, e: float) -> None:
    """1 - e^2 of the energy along the normal, m_eff v^2/2.

    The ratio of normal velocities at the corner is e only while the block hardly turns during the impact: a soft Hertz
    contact at 10 m/s turns it by 3 degrees, its lever arm grows, and the corner leaves up to 0.07 v faster.
    """
    thrower = Thrower(Setting(law=law), e, speed)
    before = kinetic_energy(thrower.world.bodies[0])
    body = thrower.throw(Throw(radians(30.0)))
    arm = forms.lowest_corner(WIDTH, HEIGHT, radians(30.0))[0]
    along_normal = 0.5 * speed**2 / (1.0 / body.mass + arm**2 / body.inertia)
    assert (before - kinetic_energy(body)) / along_normal == pytest.approx(1.0 - e**2, abs=0.004)


def test_soft_blocks_come_to_rest_where_stiff_ones_do() -> None:
    scene = collapse(Setting(), 0.0, scale=0.001).to_time(2.0)
    assert scene.status == AT_REST
    for block, x, tolerance, angle in FINAL:
        assert 1e3 * scene.bodies[block - 1].x == pytest.approx(x, abs=tolerance)
        assert np.degrees(scene.bodies[block - 1].angle) == pytest.approx(angle, abs=0.5)


SQUEEZE, OFFSET = 1e-4, 1e-8  # m: overlap of a block between two others, and its start off the middle


def recurrence(w: float, z: float, h: float) -> np.ndarray:
    """Return the matrix of one step h on place, speed and force of one pair, of a unit mass between two pairs.

    Each pair has a spring of stiffness w^2 and a dashpot c = 2 z w/2^(1/2), implicit in its own force.
    """
    c, columns = 2.0 * z * w / sqrt(2.0), []
    for x, u, f in np.eye(3):
        half = u - h * f
        moved = x + h * half
        free = half - h * f + h * (f - w * w * moved)
        force = w * w * moved + c * free / (1.0 + h * c)
        columns.append((moved, half - h * force, force))
    return np.array(columns).T


def squeezed(start: Start, block: PaperBlock, e: float, product: float | None) -> tuple[Simulation, float]:
    """Put a block between the ground and a fixed lid; return it and the frequency of one of the two pairs."""
    w = sqrt(2.0 * block.point_stiffness / block.mass)

    def press(world: World) -> None:
        world.bodies[0].y += OFFSET - SQUEEZE
        world.bodies[1].y -= 2.0 * SQUEEZE

    lid = {"y": 1.5 * block.height, "width": 0.05, "fixed": True}
    time = {} if product is None else {"step": product / (damping_ratio(e) * w), "force_step": True}
    bodies = [{"y": 0.5 * block.height}, lid]
    far = {"max_overlap": 0.5 * block.height}  # what is unstable swings far
    scene = start(bodies, restitution=e, gravity=0.0, time=time, contact=far, change=press)
    return scene, w


@pytest.mark.parametrize("e", [0.0, 0.1, 0.5])
def test_two_pairs_move_a_block_as_the_recurrence_says(start: Start, paper_block: PaperBlock, e: float) -> None:
    scene, w = squeezed(start, paper_block, e, None)
    middle = 0.5 * paper_block.height - SQUEEZE
    matrix = recurrence(w, damping_ratio(e), scene.step)
    state = np.array([OFFSET, 0.0, w * w * OFFSET])
    for _ in range(300):
        assert scene.bodies[0].y - middle == pytest.approx(state[0], abs=1e-16)
        assert scene.bodies[0].vy == pytest.approx(state[1], abs=1e-16 * w)
        state = matrix @ state
        scene.to_step(scene.steps + 1)


def test_block_between_two_others_is_stable_at_any_damping(start: Start, paper_block: PaperBlock) -> None:
    """With the dashpots of the whole block for each pair it was unstable from a product of 0.5 on."""
    scene, w = squeezed(start, paper_block, 0.0, 2.5)
    speeds = [abs(float(scene.to_step(step).bodies[0].vy)) / (w * OFFSET) for step in range(2000)]
    assert scene.status == REACHED
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


@pytest.mark.parametrize("corners", [3, 6])
@pytest.mark.parametrize(("degrees", "slides"), [(-0.5, False), (0.5, True)])
def test_slope_holds_a_polygon_below_the_friction_angle_only(corners: int, degrees: float, slides: bool) -> None:
    outline, tilt = regular(corners, RADIUS), atan(0.3) + radians(degrees)
    lifted = tuple((x, y - min(y for _, y in outline)) for x, y in outline)
    values: dict[str, object] = {"ground_friction": 0.3, "tilt": -tilt, "contact": {"stiffness_scale": 0.01}}
    run = CaseScene([table(lifted)], restitution=0.0, **values).start().to_time(0.05)  # type: ignore[arg-type]
    place, speed, began = float(run.bodies.x[0]), float(run.bodies.vx[0]), run.time
    run.to_time(0.1)
    if slides:
        rate = G * (sin(tilt) - 0.3 * cos(tilt))
        assert run.bodies.vx[0] - speed == pytest.approx(rate * (run.time - began), rel=1e-4)
    else:
        assert abs(run.bodies.x[0] - place) < 1e-9
    assert abs(run.bodies.angle[0]) < 1e-5


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


# work space


def motion_bits(scene: Simulation) -> dict[str, bytes]:
    """Return the bits of all that moves, and of what the contacts remember."""
    names = ("x", "y", "angle", "cos", "sin", "vx", "vy", "spin", "ax", "ay", "spin_rate")
    return {name: scene.bodies[name].tobytes() for name in names} | {"contacts": scene.contact_records.tobytes()}


@pytest.mark.parametrize(
    "contact",
    [
        {"stiffness_scale": 1e-3},
        pytest.param({"stiffness_scale": 1e-3, "law": "hertz-mindlin"}, marks=pytest.mark.long),
        pytest.param(
            {"stiffness_scale": 1e-4, "model": "kernel", "particle_spacing": 4e-3, "max_overlap": 5e-3},
            marks=pytest.mark.long,
        ),
    ],
)
def test_a_crowd_moves_the_same_to_the_last_bit_with_any_skin_of_the_scenario(contact: dict[str, object]) -> None:
    usual = float(build_world(pushed_wall(5, 8, contact=contact)).controls[0].skin)
    ends, rebuilds = [], []
    for share in (0.5, 1.0, 3.0):
        skin = {} if share == 1.0 else {"skin": share * usual}
        scene = Simulation(build_world(pushed_wall(5, 8, contact={**contact, **skin}))).to_time(0.15)
        assert scene.status == REACHED
        ends.append(motion_bits(scene))
        rebuilds.append(int(scene.world.clock[0].rebuilds))
    assert ends[0] == ends[1] == ends[2]
    assert rebuilds[0] > rebuilds[1] > rebuilds[2] > 10


@pytest.mark.parametrize(("slope", "slides"), [(0.3, False), (0.5, True)])
def test_friction_history_survives_a_new_pair_list(
    start: Start, paper_block: PaperBlock, slope: float, slides: bool
) -> None:
    seldom, often = (
        start([{"y": paper_block.height / 2}], tilt=-slope, contact={"skin": skin}).to_time(0.02)
        for skin in (1e-2, 4e-6)
    )
    assert seldom.status == often.status == REACHED
    assert seldom.world.clock[0].rebuilds == 1
    assert not slides or often.world.clock[0].rebuilds > 20
    assert motion_bits(seldom) == motion_bits(often)
    assert abs(often.contact_records.shear_force).min() > 0.05
