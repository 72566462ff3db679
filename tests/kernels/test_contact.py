"""Springs with history, clipping and what is booked, seen on one block."""

from __future__ import annotations

from math import cos, sin, sqrt
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from blocksim.kernels.arrays import INTERACTION, POINT, SLOT, zeros
from blocksim.kernels.contact import clip_to_cone, draw_spring, shared_step
from blocksim.kernels.laws import HERTZ_MINDLIN, LINEAR, elastic_force, tangent_stiffness

if TYPE_CHECKING:
    from tests.conftest import PaperBlock, Start
    from tests.kernels.conftest import MakeBody

SLOPE = 0.2
SOFT = {"stiffness_scale": 1e-4}  # a hundredth of the steps


@pytest.mark.parametrize(("of_a", "of_b", "times"), [(0, 0, 1.0), (2, 1, 1.0), (3, 2, 1.5), (1, 6, 3.0)])
def test_own_force_counts_more_where_more_than_two_pairs_act_on_a_body(
    make_body: MakeBody, of_a: int, of_b: int, times: float
) -> None:
    a, b = make_body(), make_body()
    a.pairs_before, b.pairs_before = of_a, of_b
    assert shared_step(a, b, 1e-6) == pytest.approx(times * 1e-6)


def test_pairs_of_a_fixed_body_do_not_count(make_body: MakeBody) -> None:
    a, ground = make_body(), make_body()
    ground.inverse_mass, ground.pairs_before, a.pairs_before = 0.0, 100, 1
    assert shared_step(a, ground, 1e-6) == shared_step(ground, a, 1e-6) == 1e-6


def test_pairs_in_contact_are_counted_for_every_body(start: Start, paper_block: PaperBlock) -> None:
    height = paper_block.height
    brick = {"x": 0.5 * 0.033, "y": 1.5 * height}
    wall = start([{"y": 0.5 * height}, {"x": 0.033, "y": 0.5 * height}, brick], contact=SOFT).to_time(1e-2)
    assert wall.bodies.pairs_before.tolist() == [2, 2, 2]
    assert wall.world.bodies[-1].pairs_before == 2


def test_sticking_block_pulls_its_shear_springs_against_the_slope(start: Start, paper_block: PaperBlock) -> None:
    rest = start([{"y": paper_block.height / 2}], tilt=-SLOPE, contact=SOFT).to_time(0.05)
    slots = rest.slots[0, :2]
    weight = paper_block.mass * 9.81
    assert slots.normal_force.sum() == pytest.approx(weight * cos(SLOPE), rel=1e-3)
    assert abs(slots.shear_force.sum()) == pytest.approx(weight * sin(SLOPE), rel=1e-3)
    assert slots.normal_force[1] > slots.normal_force[0]  # it leans downhill, towards +x
    lever = weight * sin(SLOPE) * paper_block.height / 2
    assert np.diff(slots.normal_force)[0] * paper_block.width / 2 == pytest.approx(lever, rel=1e-3)


def test_sliding_block_has_its_springs_at_the_cone(start: Start, paper_block: PaperBlock) -> None:
    slide = start([{"y": paper_block.height / 2, "velocity": [-0.5, 0.0]}], contact=SOFT).to_time(0.02)
    world = slide.world
    slots, stiffness = (
        slide.slots[0, :2],
        float(world.interactions[1, 0].normal_stiffness * world.interactions[1, 0].shear_ratio),
    )
    assert abs(slots.shear_force) == pytest.approx(0.38 * slots.normal_force, rel=1e-12)
    assert stiffness * slots.spring == pytest.approx(slots.shear_force, rel=1e-12)
    assert world.ledger[0].friction == pytest.approx(
        0.38 * paper_block.mass * 9.81 * abs(float(slide.bodies[0].x)), rel=1e-2
    )


def test_kinetic_friction_slows_a_sliding_block_and_static_friction_holds_it(
    start: Start, paper_block: PaperBlock
) -> None:
    def give_kinetic_friction(world: object) -> None:
        world.interactions.kinetic_friction[...] = 0.19  # type: ignore[attr-defined]

    sliding = {"y": paper_block.height / 2, "velocity": [0.5, 0.0]}
    slide = start([sliding], contact=SOFT, change=give_kinetic_friction).to_time(0.1)
    assert slide.bodies[0].vx == pytest.approx(0.5 - 0.19 * 9.81 * slide.time, rel=1e-3)
    lying = {"y": paper_block.height / 2}
    rest = start([lying], tilt=-0.35, restitution=0.0, contact=SOFT, change=give_kinetic_friction).to_time(0.1)
    assert abs(rest.bodies[0].vx) < 1e-6  # tan 0.35 = 0.365: between kinetic and static


def test_contact_never_pulls_while_it_ends(start: Start, paper_block: PaperBlock) -> None:
    impact = start([{"y": paper_block.height / 2 + 1e-7, "velocity": [0.0, -1.0]}], restitution=0.1, gravity=0.0)
    forces = [impact.to_step(step).slots[0].normal_force.copy() for step in range(1, 300)]
    assert np.min(forces) == 0.0
    assert np.max(forces) > 1e3
    assert impact.contacts == 0
    speed_change = np.sum(forces) * impact.step / paper_block.mass
    assert speed_change == pytest.approx(float(impact.bodies[0].vy) + 1.0, rel=1e-9)


DEEPEST = 1e-5  # m
STIFFNESS = 1e6  # N/m, or N/m^1.5


class Dragged:
    """One point whose overlap and slip are prescribed, with its shear spring."""

    def __init__(self, law: int, friction: float) -> None:
        self.law, self.friction = law, friction
        self.point, self.slot, self.values = zeros(1, POINT)[0], zeros(1, SLOT)[0], zeros(1, INTERACTION)[0]
        self.values.shear_ratio = 0.8
        self.values.static_friction = self.values.kinetic_friction = friction
        self.values.transition_speed = 1e-3
        self.work = self.lost = 0.0

    @property
    def stored(self) -> float:
        """Energy (J) in the shear spring."""
        return float(0.5 * self.slot.shear_stiffness * self.slot.spring**2)

    def reach(self, depth: float) -> float:
        """Return the longest spring (m) that sticks at an overlap (m)."""
        stiffness = 0.8 * tangent_stiffness(self.law, STIFFNESS, depth)
        return self.friction * elastic_force(self.law, STIFFNESS, depth) / stiffness

    def drag(self, depth: float, slip: float, drawn: float = 1.0) -> float:
        """Go to an overlap with a slip (m) of which `drawn` draws the spring; return what friction has taken (J)."""
        point, slot = self.point, self.slot
        point.normal_force = elastic_force(self.law, STIFFNESS, depth)
        point.stiffness = tangent_stiffness(self.law, STIFFNESS, depth)
        point.slipping, point.drawn = slip, drawn
        before, energy = float(slot.shear_force), self.stored
        lost = draw_spring(point, slot, self.values)
        self.lost += lost
        clip_to_cone(point, slot, self.values)
        self.work += 0.5 * (before + slot.shear_force) * slip
        assert lost == pytest.approx(0.5 * (before + slot.shear_force) * slip - (self.stored - energy), abs=1e-16)
        return lost


laws = pytest.mark.parametrize("law", [LINEAR, HERTZ_MINDLIN])
# overlaps as shares of the deepest one; slips as shares of the longest spring, or of twice that
paths = st.lists(st.tuples(st.floats(1e-3, 1.0), st.floats(-1.0, 1.0)), min_size=1, max_size=15)


@laws
@given(path=paths, friction=st.floats(0.01, 2.0))
def test_shear_spring_never_gives_back_more_than_was_put_in(
    law: int, path: list[tuple[float, float]], friction: float
) -> None:
    contact = Dragged(law, friction)
    scale = friction * elastic_force(law, STIFFNESS, DEEPEST) * DEEPEST
    for share, slip in path:
        depth = share * DEEPEST
        lost = contact.drag(depth, 0.0), contact.drag(depth, 2.0 * slip * contact.reach(depth))
        assert min(lost) >= -1e-15 * scale
        assert contact.work >= contact.stored - 1e-14 * scale
        limit = friction * elastic_force(law, STIFFNESS, depth)
        assert abs(contact.slot.shear_force) <= limit * (1.0 + 1e-12)


@laws
@given(path=paths)
def test_closed_path_of_overlap_and_slip_costs_energy(law: int, path: list[tuple[float, float]]) -> None:
    """There and back again, in overlap and in slip, in steps so small that their size does not matter."""
    contact = Dragged(law, 0.5)
    legs = [(share * DEEPEST, slip * contact.reach(DEEPEST)) for share, slip in path]
    legs += [(depth, -slip) for depth, slip in reversed(legs)]
    depth = legs[0][0]
    contact.drag(depth, 0.0)
    for end, slip in legs:
        for n in range(1, 21):
            contact.drag(depth + (end - depth) * n / 20, slip / 20)
        depth = end
    assert contact.work >= contact.stored - 1e-20


@given(path=paths)
def test_linear_spring_that_sticks_gives_everything_back(path: list[tuple[float, float]]) -> None:
    contact = Dragged(LINEAR, 1e6)
    for share, slip in path:
        lost = contact.drag(share * DEEPEST, slip * DEEPEST)
        assert abs(lost) < 1e-15 * STIFFNESS * (len(path) * DEEPEST) ** 2
    assert contact.work == pytest.approx(contact.stored, abs=1e-12 * STIFFNESS * DEEPEST**2)


@given(first=st.floats(0.05, 1.0), second=st.floats(0.05, 1.0), slip=st.floats(-1.0, 1.0))
def test_growing_overlap_keeps_the_hertzian_shear_force_and_falling_overlap_lowers_it(
    first: float, second: float, slip: float
) -> None:
    contact = Dragged(HERTZ_MINDLIN, 1e6)
    contact.drag(first * DEEPEST, slip * DEEPEST)
    force = float(contact.slot.shear_force)
    contact.drag(second * DEEPEST, 0.0)
    kept = min(1.0, sqrt(second / first))  # the stiffness goes with the root of the overlap
    assert contact.slot.shear_force == pytest.approx(kept * force, rel=1e-12)


@laws
@given(slip=st.floats(-20.0, 20.0), drawn=st.floats(0.0, 1.0))
def test_first_drift_draws_the_spring_for_its_part_in_contact(law: int, slip: float, drawn: float) -> None:
    contact = Dragged(law, 1e6)
    lost = contact.drag(DEEPEST, slip * DEEPEST, drawn)
    assert contact.slot.spring == pytest.approx(drawn * slip * DEEPEST)
    assert lost >= 0.0


@laws
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_steady_slip_costs_the_friction_force_times_the_way(law: int, way: float) -> None:
    contact = Dragged(law, 0.3)
    step = 0.05 * contact.reach(DEEPEST) * way
    for _ in range(40):
        contact.drag(DEEPEST, step)
    assert contact.point.stiffness == 0.0  # it slides: no dashpot
    lost, force = contact.lost, 0.3 * elastic_force(law, STIFFNESS, DEEPEST)
    for _ in range(100):
        contact.drag(DEEPEST, step)
    assert contact.lost - lost == pytest.approx(force * 100 * abs(step))
    assert contact.slot.shear_force == pytest.approx(way * force)
