"""Numbers of kernels/common/tolerances.py, ten times as large and a tenth of it, of both schemes."""

import math
from types import SimpleNamespace
from typing import Any

import pytest

from blocksim.kernels.common import neighbours
from blocksim.kernels.common.arrays import AHEAD, NO_FACE, NORMAL, REACHED, TOO_FAST
from blocksim.kernels.common.jit import config
from blocksim.kernels.common.shapes import slab_depth
from blocksim.kernels.common.simd import WIDTH
from blocksim.kernels.common.tolerances import CONE_TOLERANCE, FLAT
from blocksim.kernels.explicit import (
    bearing,
    broad_phase,
    contact,
    damping,
    forces,
    inertia,
    kinematics,
    sides as shapes,
    sliver_axes,
    slivers,
)
from blocksim.kernels.explicit.laws import HERTZ_MINDLIN, LINEAR
from blocksim.kernels.explicit.models import PARTICLES, SURFACE, surface
from blocksim.kernels.explicit.sliver_axes import Jet
from blocksim.kernels.nonsmooth import (
    arrays,
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
SQUARE = record(
    half_x=1.0, half_y=1.0, radius=math.sqrt(2.0), x=0.0, y=0.0, cos=1.0, sin=0.0, faces=15, least_width=2.0
)
sides = pytest.mark.parametrize


class Rows(list[Any]):
    """Records in a row."""

    @property
    def size(self) -> int:
        """How many there are."""
        return len(self)


@sides(("deeper", "touches"), [(1.0, True), (9.0, False)])
def test_point_in_the_end_of_a_slab_touches_it_where_it_is_not_much_deeper_than_behind_the_end(
    deeper: float, touches: bool
) -> None:
    assert (slab_depth(0.99, 1.0 - 0.01 * deeper, SQUARE) > 0.0) == touches


@sides(("tilt", "is_parallel"), [(0.0034, True), (0.03, False)])
def test_faces_share_the_stiffness_by_length_while_they_are_parallel(tilt: float, is_parallel: bool) -> None:
    found = bearing.bearing_at(math.sin(tilt), 1.0, 0.3, 0.0, FLAT, CONE_TOLERANCE)
    assert (found.share == 0.3) == is_parallel


@sides(("change", "is_renewed"), [(0.003, False), (0.03, True)])
def test_stiffness_that_changes_fast_is_measured_at_once(change: float, is_renewed: bool) -> None:
    pair = record(slide=1.0, turn=0.0, stiffness=1.0, normal_left=9, shear_left=9)
    bearing.measure_soon(pair, change / 32, 0.0, HERTZ_MINDLIN, None)
    assert (pair.normal_left == 0) == is_renewed


@sides(("turn", "is_same"), [(0.2, True), (1.2, False)])
def test_corners_are_one_end_where_their_faces_look_the_same_way(turn: float, is_same: bool) -> None:
    one = record(nx=0.0, ny=1.0, slot=0)
    two = record(nx=math.sin(turn), ny=math.cos(turn), slot=shapes.MOST_CORNERS)
    assert surface.is_same_end(one, two, SQUARE, SQUARE, None) == is_same


@sides(("apart", "is_one"), [(2.7, True), (24.0, False)])
def test_corners_meet_in_one_place_where_they_are_nearer_than_some_overlaps(apart: float, is_one: bool) -> None:
    one, two = record(x=0.0, y=0.0, depth=1.0), record(x=apart, y=0.0, depth=0.5)
    assert surface.do_meet(one, two, CONE_TOLERANCE) == is_one


@sides(("below", "is_beside"), [(0.034, True), (0.3, False)])
def test_second_face_counts_where_the_corner_is_not_far_below_it(below: float, is_beside: bool) -> None:
    corner = surface.Corner(0.99, 1.0 - below * SQUARE.radius, 1.0, 0.0, 0.0, 1.0, 2.0, 2.0)
    found = surface.side_below(corner, SQUARE, None, CONE_TOLERANCE)
    assert found[0] == 1
    assert math.isfinite(found[2]) == is_beside


@sides(("change", "is_kept"), [(3e-6, True), (3e-5, False)])
def test_operator_lasts_while_its_overlap_hardly_changes(change: float, is_kept: bool) -> None:
    assert forces.is_kept(record(depth=1.0), record(depth=1.0 + change)) == is_kept


def test_dashpot_of_a_corner_that_jams_has_a_tenth_of_the_mass() -> None:
    assert 0.03 < damping.sliding_mass(1.0, 5.0, 1.0, AHEAD) < 0.3


def test_piece_of_a_body_keeps_a_tenth_of_its_inertia_however_far_its_joint_is() -> None:
    body = record(seats=2, inverse_mass=1.0, inverse_inertia=1.0, k_xx=0.0, k_xy=0.0, k_yy=2.0, k_x=0.0, k_y=0.0)
    piece = inertia.piece_of(body, 1.0, 0.0, 1.0, 5.0, NORMAL)
    assert 0.03 < piece.inverse_mass / piece.inverse_inertia < 0.3


def test_contacts_that_change_all_the_time_have_the_sums_made_every_thirty_steps() -> None:
    clock, share = record(next_share=10**9, last_share=0), record(asks=1, steps=0)
    inertia.note_contacts(clock, share)
    assert 10 < clock.next_share < 100


@sides(("over", "has_begun"), [(3e-7, True), (3e-6, False)])
def test_contact_has_just_begun_where_it_is_no_deeper_than_its_way_in_a_step(over: float, has_begun: bool) -> None:
    assert kinematics.has_just_begun(record(closing=1.0, depth=1.0 + over)) == has_begun


@sides(("beside", "stops"), [(3.4, False), (30.0, True)])
def test_face_that_a_corner_leaves_within_a_third_of_an_impact_cannot_stop_it(beside: float, stops: bool) -> None:
    point, pair = record(beside=beside, closing=-1.0, weight=1.0), record(normal_left=9, shear_left=9)
    contact.spare_lost_faces(record(points=[point], pairs=[pair]), 0, 1)
    assert (point.weight, pair.normal_left, pair.shear_left) == ((1.0, 9, 9) if stops else (0.0, 0, 0))


@sides(("steps", "rises"), [(5.4, True), (48.0, False)])
def test_dashpot_of_hertz_rises_at_the_begin_of_a_contact(steps: float, rises: bool) -> None:
    point = record(weight=1.0, depth=steps, closing=1.0)
    assert (kinematics.weight_of(point, HERTZ_MINDLIN) != 1.0) == rises
    assert kinematics.weight_of(point, LINEAR) == 1.0


@sides(("given", "limit"), [(0.0, 0.1), (0.3, 0.3), (0.9, 0.9), (9.0, 1.0)])
def test_overlap_has_a_limit_and_none_is_beyond_the_middle(given: float, limit: float) -> None:
    assert broad_phase.overlap_limit(SQUARE, SQUARE, given) == pytest.approx(limit)


def test_overlap_of_particles_is_less_than_where_centres_of_two_rows_meet_and_more_than_in_their_gaps() -> None:
    world = record(controls=[record(model=PARTICLES, particle_size=0.1)], bodies=[SQUARE, SQUARE])
    assert 0.035 < contact.reach_of_contacts(world, record(a=0, b=1, limit=0.1)) < 0.1


@sides(("steps", "is_coming"), [(16.0, True), (144.0, False)])
def test_bodies_count_as_touching_some_dozen_steps_before(
    monkeypatch: pytest.MonkeyPatch, steps: float, is_coming: bool
) -> None:
    monkeypatch.setattr(inertia, "steps_apart", lambda *_: steps)
    monkeypatch.setattr(inertia, "steps_to_approach", lambda *_: math.inf)
    pair = record(a=0, b=1, active=0, is_coming=9)
    bodies = Rows([record(coming=9), record(coming=9), record()])
    inertia.find_coming(
        record(controls=[None], bodies=bodies, clock=[record(pair_count=1)], pairs=[pair], corners=None)
    )
    assert (pair.is_coming == 1) == is_coming


@sides(("steps", "all_of_them"), [(86, False), (770, True)])
def test_sums_of_all_bodies_are_made_anew_from_time_to_time(
    monkeypatch: pytest.MonkeyPatch, steps: int, all_of_them: bool
) -> None:
    monkeypatch.setattr(inertia, "find_coming", lambda _: math.inf)
    monkeypatch.setattr(inertia, "choose_bodies", lambda _, is_due: is_due != all_of_them)
    clock = record(steps=steps, last_sums=0, next_share=0)
    inertia.share_out(record(clock=[clock], controls=[record(model=SURFACE)], bodies=None))
    assert (clock.last_sums == steps) == all_of_them
    assert 40 < clock.next_share - steps < 400


@sides(("way", "answer"), [(0.08, REACHED), (0.8, TOO_FAST)])
def test_two_bodies_may_not_come_nearer_by_a_good_part_of_a_side_in_a_step(
    monkeypatch: pytest.MonkeyPatch, way: float, answer: int
) -> None:
    monkeypatch.setattr(neighbours, "top_speed", lambda *_: way / 2.0)
    monkeypatch.setattr(broad_phase, "unseen_steps", lambda *_: 1)
    clock, bodies = record(steps=0, rebuilds=1, next_update=0), Rows([record(y=-math.inf, least_width=1.0)])
    world = record(clock=[clock], controls=[record(skin=10.0, step=1.0)], bodies=bodies, loads=())
    assert broad_phase.update_pairs(world) == answer


@sides(("share", "is_short"), [(0.034, False), (0.3, True)])
def test_pair_whose_overlaps_on_two_axes_are_alike_is_a_sliver(
    monkeypatch: pytest.MonkeyPatch, share: float, is_short: bool
) -> None:
    monkeypatch.setattr(sliver_axes, "next_axis", lambda *_: record(depth=1.0))
    monkeypatch.setattr(shapes, "cone_of", lambda *_: 0.2)
    assert sliver_axes.is_short(record(depth=share), -1, None, None, None) == is_short


def test_second_of_two_tilted_ends_counts_less_before_faces_are_no_longer_parallel() -> None:
    assert 3e-3 < sliver_axes.least_ratio(0.02) < 0.02


@sides(
    ("deep", "excess", "limit", "are_both"),
    [(1.0, 3e-4, 0.0, True), (1.0, 3e-3, 0.0, False), (3e-7, 1.0, 1.0, True), (3e-6, 1.0, 1.0, False)],
)
def test_points_are_both_ends_of_an_interval_where_they_hold_as_much(
    monkeypatch: pytest.MonkeyPatch, deep: float, excess: float, limit: float, are_both: bool
) -> None:
    monkeypatch.setattr(slivers, "across_from", lambda *_: record(other=record(value=deep)))
    world = record(controls=[record(exponent=LINEAR)], points=[record(depth=deep * math.sqrt(1.0 + excess))] * 2)
    nearest: Any = record(depth=deep)
    assert slivers.has_both_ends(world, 2, nearest, 0, limit, None, None, None) == are_both


def test_force_of_a_sliver_along_its_normal_is_a_tenth_of_that_of_a_spring_at_least(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(slivers, "mean_energy", lambda *_: Jet(1.0, 0.0, 0.0, 0.0))
    monkeypatch.setattr(slivers, "place_nearest", lambda *_: None)
    point = record(x=0.0, y=0.0, nx=0.0, ny=1.0)
    body = record(x=0.0, y=0.0, contact_class=0)
    table: Any = {(0, 0): record(normal_stiffness=1.0)}
    world = record(
        controls=[record(exponent=LINEAR)], points=[point], pairs=[record(a=0, b=0)], bodies=[body], interactions=table
    )
    slivers.place_sliver(world, 0, record(depth=1.0), None)
    assert 3.0 < point.depth < 30.0


def test_corners_of_a_sliver_are_one_end_where_they_are_nearer_than_about_its_overlap(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    widths: list[float] = []

    def across_from(_axis: object, _across: int, _deep: Jet, wide: Jet, *_: object) -> Any:
        widths.append(wide.value)
        return record(other=Jet(0.0, 0.0, 0.0, 0.0), length=None)

    one, none = Jet(1.0, 0.0, 0.0, 0.0), Jet(0.0, 0.0, 0.0, 0.0)
    monkeypatch.setattr(shapes, "cone_of", lambda *_: 0.2)
    for name, value in {"tilt_of": none, "depth_behind": one, "share_of": one}.items():
        monkeypatch.setattr(slivers, name, lambda *_, value=value: value)
    monkeypatch.setattr(slivers, "across_from", across_from)
    axis: Any = record(of_b=True, face=0, corner=0, depth=1.0)
    slivers.energy_of_faces(axis, 0, one, none, 2.0, None, None, None)
    assert 0.15 < widths[0] < 1.5


def test_axes_of_a_sliver_weigh_by_about_the_square_of_their_overlaps(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shapes, "number_of_corners", lambda *_: 0)
    monkeypatch.setattr(slivers, "axis_depth", lambda *_: Jet(2.0, 0.0, 0.0, 0.0))
    monkeypatch.setattr(shapes, "cone_of", lambda *_: 0.2)
    found = slivers.nearness_of(None, 0, None, None, None)  # type: ignore[arg-type]
    assert 0.1 < found.weight.value < 0.6


def test_no_axis_of_a_sliver_is_left_out_that_weighs_something(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beyond the overlap over SLIVER its weight is zero, but two faces that look at each other have one."""
    reaches: list[float] = []
    monkeypatch.setattr(shapes, "number_of_corners", lambda *_: 1)
    monkeypatch.setattr(slivers, "quotient", lambda *_: None)

    def axis_of(*given: Any) -> Any:
        reaches.append(given[-1])
        return record(depth=math.inf)

    monkeypatch.setattr(slivers, "axis_of", axis_of)
    slivers.mean_energy(record(depth=1.0), 2.0, None, None, None)
    assert 10.0 < reaches[0] < 100.0


@sides(("deep", "is_under"), [(0.0034, True), (0.03, False)])
def test_corner_lies_under_the_sharp_end_of_a_face_where_it_is_not_deep(
    monkeypatch: pytest.MonkeyPatch, deep: float, is_under: bool
) -> None:
    for name in ("can_touch", "leads_in", "is_behind_others"):
        monkeypatch.setattr(surface, name, lambda *_: True)
    faces = [record(nx=1.0, ny=0.0, distance=0.0), *[record(nx=-0.6, ny=0.8, distance=0.0)] * 2]
    monkeypatch.setattr(shapes, "number_of_corners", lambda *_: 3)
    monkeypatch.setattr(shapes, "corner_of", lambda _body, _table, k: faces[k])
    corner: Any = record(x=0.0, y=-deep / 0.8)
    found = surface.side_over_end(corner, 0, -0.1 * deep, record(radius=1.0), None, 0.2)
    assert (found[0] != NO_FACE) == is_under


def block(x: float, y: float, turn: float = 0.0) -> faces.Block:
    """Return a square of 2 m."""
    return faces.Block(x, y, math.cos(turn), math.sin(turn), 1.0, 1.0)


@sides(("better", "is_of_b"), [(2e-6, True), (2e-5, False)])
def test_face_of_body_a_has_to_be_better_by_a_tie(better: float, is_of_b: bool) -> None:
    turn, y = 0.3, 2.2
    aside = (y * (1.0 - math.cos(turn)) + better) / math.sin(turn)
    assert references.reference_of_rectangles(block(-aside, y, turn), block(0.0, 0.0)).is_of_b == is_of_b


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
    still = record(vx=0.0, vy=0.0, spin=0.0)
    assert (cuts.held_change(state, still, 1.0, 1.0)[1] != 0.0) == is_known


def test_interval_of_an_impact_is_a_small_part_of_a_step_and_a_step_has_some_dozens(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    lengths: list[float] = []
    monkeypatch.setattr(cuts, "is_continued", lambda _: False)
    monkeypatch.setattr(cuts, "time_to_impact", lambda _: 0.0)
    monkeypatch.setattr(cuts, "set_length", lambda _, length: lengths.append(length))
    stepping = record(cuts=0, length=1.0, gone=0.0)
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
    assert impact_rounds.has_gain(record(now=1.0 + gain, then=1.0)) == counts


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
    monkeypatch.setattr(passes, "coupling", lambda *_: factor)
    found = passes.approached(None, None, None, 0.0, 2.0, 1.0)  # type: ignore[arg-type]
    assert (found < 1.0) == is_strong


def test_shear_is_held_back_after_some_dozen_sweeps(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[str] = []
    monkeypatch.setattr(passes, "sweep", lambda *_: calls.append("sweep"))
    monkeypatch.setattr(passes, "agree", lambda *_: math.inf)
    monkeypatch.setattr(passes, "hold_back", lambda *_: calls.append("hold back"))
    counts = {"sweeps": 0, "passes": 0, "unsolved": 0, "worst_residual": 0.0, "has_held": 1}
    contacts: Any = record(stepping=[record(velocity_sweeps=1000, **counts)])
    passes.velocity_pass(contacts, None, 0, 0, 1e-9)  # type: ignore[arg-type]
    assert 16 < calls.index("hold back") < 150
    assert calls[-2:] == ["hold back", "sweep"]  # one that goes all the way


@sides(("apart", "is_flush"), [(2.5e-6, True), (4e-5, False)])
def test_faces_meet_as_faces_up_to_an_angle_that_no_brick_is_flat_to(apart: float, is_flush: bool) -> None:
    stepping: Any = record(threshold=0.01)
    for sign in (-1.0, 1.0):
        assert bool(passes.meets_flush(-1.0, -0.5, 0.1 * sign * apart, 0.1, stepping)) == is_flush
    assert not passes.meets_flush(-1.0, 0.5, 0.1 * apart, 0.1, stepping)  # one parts


@sides(("tilt", "is_of_block"), [(0.0034, False), (0.03, True)])
def test_block_that_reaches_beyond_both_ends_of_a_segment_meets_it_as_faces_while_they_are_parallel(
    tilt: float, is_of_block: bool
) -> None:
    wide = faces.Block(0.0, 2.0, math.cos(tilt), math.sin(tilt), 3.0, 1.0)
    found = manifold_on_segment(wide, None, block(0.0, 0.0), 0, True, 0.1)
    assert found.points.is_of_b != is_of_block
