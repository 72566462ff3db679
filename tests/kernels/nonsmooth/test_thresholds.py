"""What is decided on each side of a tolerance of rigid contacts, from a third of it to three times as much.

Without the compiler: the functions get bare numbers, and no records.
"""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import pytest

from blocksim.kernels.common.jit import config
from blocksim.kernels.common.simd import WIDTH
from blocksim.kernels.nonsmooth import (
    arrays,
    cone,
    contact_groups,
    cuts,
    faces,
    impact_rounds,
    impacts,
    manifold,
    motion,
    passes,
    references,
)
from blocksim.kernels.nonsmooth.manifold import Meeting, manifold_on_segment, touches_edge

pytestmark = pytest.mark.skipif(not config.DISABLE_JIT, reason="calls kernels without records")
record: Any = SimpleNamespace
sides = pytest.mark.parametrize


def block(x: float, y: float, turn: float = 0.0) -> faces.Block:
    """Return a square of 2 m."""
    return faces.Block(x, y, math.cos(turn), math.sin(turn), 1.0, 1.0)


@sides(("better", "is_of_b"), [(2e-6, True), (2e-5, False)])
def test_face_of_body_a_has_to_be_better_by_a_tie(better: float, is_of_b: bool) -> None:
    turn, y = 0.3, 2.2
    aside = (y * (1.0 - math.cos(turn)) + better) / math.sin(turn)
    assert references.reference_of_rectangles(block(-aside, y, turn), block(0.0, 0.0)).is_of_b == is_of_b


@sides(("deep", "passes"), [(3e-3, True), (3e-2, False)])
def test_side_that_is_met_over_a_sliver_is_passed_by(deep: float, passes: bool) -> None:
    """The other block has sunk in by `deep`, and its side is nearer than that."""
    found = references.reference_of_rectangles(block(2.0 - 0.3 * deep, 2.0 - deep), block(0.0, 0.0))
    assert (found.side.nx == 0.0) == passes


@sides(("width", "points"), [(6e-6, 1), (6e-5, 2)])
def test_two_points_with_next_to_nothing_between_them_are_one(width: float, points: int) -> None:
    face = faces.Face(0.0, 1.0, 0.0, 0.0, 1.0, -1.0, 1.0)
    edge = faces.Edge(0.0, -1e-3, width, -1e-3, True, True)
    found, _ = manifold.points_of(face, edge, block(0.0, 2.0), block(0.0, 0.0), True, 0.1)
    assert sum(gap < 0.5 * arrays.FAR for gap in (found.gap_one, found.gap_two)) == points


@sides(("cosine", "touches"), [(-3.4e-3, False), (-3e-2, True)])
def test_edge_of_a_step_is_for_faces_that_look_away_from_it(cosine: float, touches: bool) -> None:
    edge = faces.Edge(0.0, -1e-3, 1.0, 0.0, True, True)
    assert touches_edge(Meeting(None, edge, -1e-3, cosine), 0) == touches  # type: ignore[arg-type]


@sides(("off", "flies"), [(3e-10, True), (3e-9, False)])
def test_body_is_in_flight_where_its_velocity_changes_by_its_kick(off: float, flies: bool) -> None:
    assert motion.is_in_flight(record(vx=0.0, vy=1.0 + off), record(vx=0.0, vy=0.0), 0.0, 1.0) == flies


@sides(("acceleration", "is_known"), [(0.9, True), (2.5, False)])
def test_acceleration_of_what_turns_is_known_up_to_about_that_of_gravity(acceleration: float, is_known: bool) -> None:
    state = record(vx=0.0, vy=acceleration, spin=0.0, inverse_mass=1.0, inverse_inertia=1.0)
    still, controls = record(vx=0.0, vy=0.0, spin=0.0), record(gravity_x=0.0, gravity_y=-1.0)
    assert (cuts.held_change(state, still, 1.0, controls)[1] != 0.0) == is_known


def test_interval_of_an_impact_is_a_small_part_of_a_step_and_a_step_has_some_dozens(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    lengths: list[float] = []
    monkeypatch.setattr(cuts, "is_continued", lambda _: False)
    monkeypatch.setattr(cuts, "time_to_impact", lambda _: 0.0)
    monkeypatch.setattr(cuts, "set_length", lambda _, length: lengths.append(length))
    stepping = record(cuts=0, length=1.0)
    scene = record(contacts=record(stepping=[stepping]), world=record(controls=[record(step=1.0)]))
    while cuts.cut(scene):
        stepping.cuts += 1
    assert 10 < stepping.cuts < 100
    assert 0.005 < lengths[0] < 0.05


@sides(("of_pass", "of_impacts"), [(1.0, 1e-7), (1e-4, 1e-8), (1e6, 1e-4)])
def test_impacts_are_solved_better_than_a_velocity_pass(of_pass: float, of_impacts: float) -> None:
    assert impacts.tolerance_of(record(tolerance=of_pass, threshold=1.0)) == pytest.approx(of_impacts)


@sides(("gain", "counts"), [(3e-10, False), (3e-9, True)])
def test_energy_that_impacts_create_counts_beyond_what_they_are_solved_to(gain: float, counts: bool) -> None:
    assert contact_groups.has_gain(record(now=1.0 + gain, then=1.0)) == counts


@sides(("slope", "presses"), [(0.034, False), (0.3, True)])
def test_what_is_not_upright_presses_at_the_start_of_a_run(slope: float, presses: bool) -> None:
    face = record(nx=math.sqrt(1.0 - slope * slope), ny=slope, is_struck=arrays.NOT_STRUCK)
    lanes = record(held=[0.0] * WIDTH)
    contacts: Any = record(packs=[record(constraint=[0] * WIDTH, count=1)], constraints=[face], impact_lanes=[lanes])
    world = record(controls=[record(gravity_x=0.0, gravity_y=-1.0)])
    impact_rounds.hold(record(contacts=contacts, world=world), 0, 1, 1.0)
    assert (lanes.held[0] == arrays.FAR) == presses


@sides(("factor", "is_strong"), [(0.25, False), (2.25, True)])
def test_shear_that_couples_strongly_goes_a_share_of_its_way(
    monkeypatch: pytest.MonkeyPatch, factor: float, is_strong: bool
) -> None:
    monkeypatch.setattr(cone, "coupling", lambda *_: factor)
    found = cone.approached(None, None, None, 0.0, 2.0, 1.0)  # type: ignore[arg-type]
    assert (found < 1.0) == is_strong


def test_shear_is_held_back_after_some_dozen_sweeps(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[str] = []
    monkeypatch.setattr(passes, "sweep", lambda *_: calls.append("sweep"))
    monkeypatch.setattr(passes, "agree", lambda *_: math.inf)
    monkeypatch.setattr(passes, "hold_back", lambda *_: calls.append("hold back"))
    contacts: Any = record(stepping=[record(velocity_sweeps=1000, sweeps=0)])
    passes.velocity_pass(contacts, None, 0, 0, 1e-9)  # type: ignore[arg-type]
    assert 16 < calls.index("hold back") < 150


@sides(("tilt", "is_of_block"), [(0.0034, False), (0.03, True)])
def test_block_that_reaches_beyond_both_ends_of_a_segment_meets_it_as_faces_while_they_are_parallel(
    tilt: float, is_of_block: bool
) -> None:
    wide = faces.Block(0.0, 2.0, math.cos(tilt), math.sin(tilt), 3.0, 1.0)
    found = manifold_on_segment(wide, None, block(0.0, 0.0), 0, True, 0.1)
    assert found.points.is_of_b != is_of_block
