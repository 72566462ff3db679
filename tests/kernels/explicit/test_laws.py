"""Laws, friction, and what contacts remember: shear springs, and what becomes of them as contacts end."""

from math import exp

import numpy as np
import pytest
from hypothesis import given, strategies as st

from blocksim.kernels.common.arrays import ACTION, INTERACTION, Record, World, zeros
from blocksim.kernels.common.mechanics import friction_coefficient
from blocksim.kernels.explicit.history import change_contacts
from blocksim.kernels.explicit.kinematics import has_just_begun, resolve_point
from blocksim.kernels.explicit.laws import (
    clip_to_cone,
    coulomb_limit,
    draw_same_spring,
    draw_spring,
    elastic_force,
    stored_energy,
    tangent_stiffness,
)
from blocksim.kernels.explicit.sides import MOST_CORNERS, UPPER, side_normal
from blocksim.scenario.laws import LAWS
from tests.conftest import PaperBlock, Start
from tests.kernels.scenes import pose

K = 9.5e8


@pytest.mark.parametrize("law", LAWS)
@given(depth=st.floats(1e-10, 1e-3))
def test_force_is_the_slope_of_the_stored_energy_and_stiffness_that_of_the_force(law: str, depth: float) -> None:
    exponent, h = LAWS[law].exponent, 1e-3 * depth
    for whole, slope in ((stored_energy, elastic_force), (elastic_force, tangent_stiffness)):
        expected = (whole(exponent, K, depth + h) - whole(exponent, K, depth - h)) / (2.0 * h)
        assert slope(exponent, K, depth) == pytest.approx(expected, rel=1e-6)


SOFT_HERTZ = {"law": "hertz-mindlin", "stiffness_scale": 1e-2, "max_overlap": 5e-3}


@pytest.mark.parametrize("e", [0.0, 0.2, 0.5, 0.8])
def test_restitution_is_the_one_asked_at_any_speed(start: Start, paper_block: PaperBlock, e: float) -> None:
    for speed in (0.02, 0.5, 5.0):
        lying = {"y": paper_block.height / 2 + 1e-9, "velocity": [0.0, -speed]}
        scene = start([lying], restitution=e, gravity=0.0, ground_friction=0.0, contact=SOFT_HERTZ)
        while scene.contact_count or scene.bodies[0].vy < 0.0:
            scene.to_step(scene.steps + 1)
        assert scene.bodies[0].vy == pytest.approx(e * speed, abs=0.01 * speed)
        assert scene.residual() < 1e-3


DEEPEST = 1e-5  # m


@pytest.mark.parametrize("law", [1.0, 1.5])
@given(
    path=st.lists(st.tuples(st.floats(1e-3, 1.0), st.floats(-2.0, 2.0)), min_size=1, max_size=15),
    friction=st.floats(0.01, 2.0),
)
def test_shear_spring_never_gives_back_more_than_was_put_in(
    law: float, path: list[tuple[float, float]], friction: float
) -> None:
    """Of one point that is led to overlaps (of the deepest one) and slips (of the longest spring there)."""
    values = zeros(1, INTERACTION)[0]
    values.static_friction, values.kinetic_friction, values.transition_speed = friction, friction, 1e-3
    scale = friction * elastic_force(law, STIFFNESS, DEEPEST) * DEEPEST
    spring = before = force = work = stored = 0.0
    for share, slips in path:
        normal = elastic_force(law, STIFFNESS, share * DEEPEST)
        stiffness = 0.8 * tangent_stiffness(law, STIFFNESS, share * DEEPEST)
        for slip in (0.0, slips * friction * normal / stiffness):
            pulled, held = force, stored
            spring, limit, _, lost = draw_spring(values, stiffness, before, spring, slip, 1.0, normal, 0.0)
            force = clip_to_cone(values, stiffness * spring, limit, normal, 0.0)
            before, stored, done = stiffness, 0.5 * stiffness * spring**2, 0.5 * (pulled + force) * slip
            work += done
            assert lost == pytest.approx(done - (stored - held), abs=1e-16)
            assert lost >= -1e-15 * scale
            assert work >= stored - 1e-14 * scale
            assert abs(force) <= friction * normal * (1.0 + 1e-12)


REMEMBERED = ("spring", "depth", "normal_force", "shear_force")
STEP = 1e-6
RIGHT, LOWER = 1, 0  # faces
Contact = tuple[int, int]  # corner and face


def stacked(*before: Contact) -> World:
    """Return a block on another one that had these contacts, each with numbers of its own to remember."""
    world = pose((0.0, 1.025 - 1e-6, 0.0), (0.0, 1.0, 0.0))
    pair = world.pairs[0]
    assert (pair.a, pair.b, pair.near) == (0, 1, 4)
    pair.active = len(before)
    pair.stiffness = world.interactions[1, 1].normal_stiffness
    world.pairs["normal_left"] = world.pairs["shear_left"] = 5
    for n, (contact, (slot, face)) in enumerate(zip(world.contacts[0], before, strict=False), start=1):
        contact.slot, contact.face = slot, face
        contact.spring, contact.depth, contact.normal_force, contact.shear_force = np.array([1e-7, 1e-6, 50, 5]) * n
    return world


def find(world: World, *now: Contact, closing: float = 0.0) -> Record:
    """Let the pair have these contacts now, 1 um deep, and return what was lost; `closing` m/s."""
    a, b = world.bodies[:2]
    a.vy = -closing
    for point, (slot, face) in zip(world.points, now, strict=False):
        point.slot, point.face, point.depth = slot, face, 1e-6
        own, other, sign = (a, b, 1.0) if slot < MOST_CORNERS else (b, a, -1.0)
        normal = side_normal(other, None, face)
        point.x, point.y = own.x, other.y  # anywhere
        point.nx, point.ny = sign * normal[0], sign * normal[1]
        resolve_point(point, a, b, STEP)
    action = zeros(1, ACTION)[0]
    change_contacts(world, 0, len(now), STEP, action)
    return action


def kept(world: World) -> list[tuple[Contact, int]]:
    """Return corner and face of every contact, and which of the old ones its memory is from; 0: it has none."""
    found = []
    for contact in world.contacts[0, : world.pairs[0].active]:
        numbers = [contact[name] / unit for name, unit in zip(REMEMBERED, (1e-7, 1e-6, 50, 5), strict=True)]
        assert numbers == pytest.approx([numbers[0]] * 4)
        found.append(((int(contact.slot), int(contact.face)), round(numbers[0])))
    return found


def held(world: World, *which: int) -> float:
    """Return what the shear springs of the old contacts held (J)."""
    values = world.interactions[1, 1]
    return float(0.5 * values.shear_ratio * values.normal_stiffness * sum((1e-7 * n) ** 2 for n in which))


ONE, TWO, OTHER = (0, UPPER), (1, UPPER), (0, RIGHT)
OF_B, ALSO_OF_B = (MOST_CORNERS + 2, LOWER), (MOST_CORNERS + 3, LOWER)


CONTINUED: list[tuple[list[Contact], list[Contact], list[int], list[int]]] = [
    ([ONE, TWO], [ONE, TWO], [1, 2], []),
    ([ONE, TWO], [TWO], [2], [1]),
    ([ONE, TWO], [ONE], [1], [2]),
    ([TWO], [ONE, TWO], [0, 1], []),
    ([ONE], [ONE, OF_B], [1, 0], []),
    ([ONE, TWO], [], [], [1, 2]),
    ([ONE], [OTHER], [0], [1]),
    ([ONE, TWO], [OTHER, TWO], [0, 2], [1]),
    ([], [ONE, TWO], [0, 0], []),
]
HANDED_ON: list[tuple[list[Contact], list[Contact], list[int], list[int]]] = [
    ([TWO], [OF_B], [1], []),  # under another corner, of the other block
    ([ONE, TWO], [ONE, OF_B], [1, 2], []),
    ([ONE, TWO], [TWO, OF_B], [2, 1], []),
    ([ONE, TWO], [OF_B, ALSO_OF_B], [1, 2], []),
    ([OTHER], [OF_B], [0], [1]),  # their normals do not agree
    ([OTHER, TWO], [ONE, TWO], [0, 2], [1]),  # the corner itself has changed its face
    ([OTHER, TWO], [ONE], [0], [1, 2]),
]


@pytest.mark.parametrize(
    ("closing", "before", "now", "expected", "broken"),
    [(closing, *one) for closing, cases in ((2.0, CONTINUED), (0.0, HANDED_ON)) for one in cases],
)
def test_contact_continues_with_the_same_corner_and_face_or_takes_the_place_of_one_that_has_ended(
    closing: float, before: list[Contact], now: list[Contact], expected: list[int], broken: list[int]
) -> None:
    """A new one that closes by more than it is deep has just begun, and takes no other's place."""
    world = stacked(*before)
    lost = find(world, *now, closing=closing)
    assert closing > 0.0 or not has_just_begun(world.points[0])
    assert kept(world) == list(zip(now, expected, strict=True))
    assert lost.broken == pytest.approx(held(world, *broken))
    assert world.pairs[0].idle == 4 - len(now)
    for name in ("normal_left", "shear_left"):
        assert world.pairs[name][0] == 0
        assert (world.pairs[name][1:] == 5).all()


STATIC, KINETIC, SPEED = 0.31, 0.19, 0.005


def rubbing() -> np.record:
    """Return what the kernels know about two surfaces that rub."""
    values: np.record = zeros(1, INTERACTION)[0]
    values.static_friction, values.kinetic_friction, values.transition_speed = STATIC, KINETIC, SPEED
    return values


@given(speed=st.floats(-0.3, 0.3))
def test_friction_falls_exponentially_with_speed_either_way(speed: float) -> None:
    expected = KINETIC + (STATIC - KINETIC) * exp(-abs(speed) / SPEED)
    assert friction_coefficient(STATIC, KINETIC, SPEED, speed) == pytest.approx(expected, rel=1e-14)
    assert friction_coefficient(STATIC, KINETIC, SPEED, 1.0) == KINETIC
    assert friction_coefficient(0.38, 0.38, SPEED, speed) == 0.38


@given(force=st.floats(-1e3, 1e3), normal=st.floats(0.0, 1e3), speed=st.floats(-0.05, 0.05), spring=st.floats(0.0, 1.0))
def test_spring_and_dashpot_together_stay_within_the_cone(
    force: float, normal: float, speed: float, spring: float
) -> None:
    cone = friction_coefficient(STATIC, KINETIC, SPEED, speed) * normal
    limit = coulomb_limit(rubbing(), normal, speed, spring * cone)  # what the spring alone was within
    clipped = clip_to_cone(rubbing(), force, limit, normal, speed)
    assert clipped == (force if abs(force) <= cone else pytest.approx(np.copysign(cone, force), rel=1e-14))


STIFFNESS = 1e6  # N/m


@given(
    old=st.floats(-1e-6, 1e-6), slip=st.floats(-1e-6, 1e-6), normal=st.floats(0.0, 1.0), speed=st.floats(-0.02, 0.02)
)
def test_spring_of_the_same_stiffness_is_drawn_as_any_other(
    old: float, slip: float, normal: float, speed: float
) -> None:
    spring, limit, slides, lost = draw_same_spring(rubbing(), STIFFNESS, old, slip, normal, speed)
    expected = draw_spring(rubbing(), STIFFNESS, STIFFNESS, old, slip, 1.0, normal, speed)
    assert (spring, limit, slides) == expected[:3]
    assert lost == pytest.approx(expected[3], abs=1e-15 * STIFFNESS * 1e-12)
    assert slides or lost == 0.0
