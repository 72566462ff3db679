"""Other engines on the same scenes; those that are not installed are left out."""

import json
import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from blocksim.bench.harness import Benchmark, Effort, TimeSteps, single, three_blocks
from blocksim.scenario import Scenario
from blocksim.scenario.geometry import edges_of
from tests.bench.peers import __main__ as script, three_blocks as three_blocks_peers, wall
from tests.bench.peers.__main__ import main
from tests.bench.peers.blocksim_engine import Explicit, Nonsmooth
from tests.bench.peers.box2d_engine import Box2D
from tests.bench.peers.engine import Final, Readings, Scene, Series, Solver, Stepper
from tests.bench.peers.heap import HEAP, SMALL as SMALL_HEAP, Heap
from tests.bench.peers.pymunk_engine import Pymunk
from tests.bench.peers.series import three_blocks_series, wall_racers, wall_series
from tests.bench.peers.three_blocks import starts
from tests.bench.peers.wall import SMALL, Computed, distances, raced, wasserstein
from tests.bench.peers.work_precision import Curve, Panel

ENGINES = pytest.mark.parametrize(
    ("module", "solver"),
    [
        ("pymunk", Pymunk(2e-4, 30)),
        ("Box2D", Box2D(2e-4, 30)),
        ("blocksim", Explicit(1e-3, 0.1)),
        ("blocksim", Nonsmooth(TimeSteps(2e-4))),
    ],
    ids=["pymunk", "Box2D", "explicit", "non-smooth"],
)
QUICK = Effort(quick=True)


@dataclass(frozen=True)
class Shifted:
    """An engine that puts all blocks so far (m) from the start, for a second of computing a metre or so many."""

    by: float
    seconds: float | None = None

    @property
    def setting(self) -> str:
        return f"by {self.by:g}"

    def calls(self, scene: Scene) -> int:
        return int(scene.end)

    def solve(self, scene: Scene) -> Final:
        placed = scene.placed()
        x, y = np.array([(body.x, body.y) for body in placed]).T
        return Final(x + self.by, y, self.by if self.seconds is None else self.seconds)


def solved(module: str, solver: Solver, scene: Scene) -> Final:
    if module == "Box2D":
        pytest.importorskip(module, exc_type=ImportError)
    pytest.importorskip(module)
    return solver.solve(scene)


@ENGINES
@pytest.mark.filterwarnings("ignore:builtin type .* has no __module__ attribute:DeprecationWarning")  # Box2D's wrapper
def test_blocks_start_alike_fall_freely_and_land_on_the_ground(module: str, solver: Solver) -> None:
    (scene,) = starts(1)
    soon = solved(module, solver, replace(scene, end=2e-3))
    assert soon.x == pytest.approx([0.016, 0.038, 0.060], abs=1e-5)
    assert soon.y == pytest.approx([0.025, 0.075, 0.125], abs=3e-5)
    rest = solved(module, solver, scene)
    assert rest.y == pytest.approx([0.025, 0.016, 0.016], abs=3e-5)  # upright, and two on their sides
    assert rest.x == pytest.approx([0.016, 0.068, 0.131], abs=3e-3)
    assert rest.seconds > 0.0


@ENGINES
@pytest.mark.filterwarnings("ignore:builtin type .* has no __module__ attribute:DeprecationWarning")
def test_a_sliding_wall_is_stopped_by_the_friction_of_the_ground(module: str, solver: Solver) -> None:
    """One block, pushed with 0.5 m/s at its centre, slides v^2 / (2 mu g)."""
    scene = replace(SMALL._replace(columns=1, rows=1).scene(), end=0.3)
    final = solved(module, solver, scene)
    assert final.x[0] - 0.016 == pytest.approx(0.5**2 / (2.0 * 0.38 * 9.81), rel=0.02)
    assert final.y[0] == pytest.approx(0.0125, abs=3e-5)


@ENGINES
@pytest.mark.filterwarnings("ignore:builtin type .* has no __module__ attribute:DeprecationWarning")
def test_a_hexagon_comes_to_rest_on_one_of_its_sides(module: str, solver: Solver) -> None:
    scene = Heap(1, 1, 0.6).scene()
    (block,) = scene.placed()
    heights = [ax * nx + ay * ny for (ax, ay), _, (nx, ny) in edges_of(block.corners)]
    assert len(heights) == 6
    final = solved(module, solver, scene)
    assert min(abs(float(final.y[0]) - height) for height in heights) < 5e-5


@pytest.mark.parametrize("engine", [Pymunk(1e-3, 10), Box2D(1e-3, 10)], ids=["pymunk", "Box2D"])
@pytest.mark.filterwarnings("ignore:builtin type .* has no __module__ attribute:DeprecationWarning")
def test_hexagons_have_their_own_mass_and_inertia_in_every_engine(engine: Stepper) -> None:
    pytest.importorskip(type(engine).__name__ if isinstance(engine, Box2D) else "pymunk", exc_type=ImportError)
    scene = SMALL_HEAP.scene()
    placed = scene.placed()
    _, bodies = engine.made(scene)
    for block, body in zip(placed, bodies, strict=True):
        inertia = body.inertia / engine.units**2 if isinstance(engine, Box2D) else body.moment
        assert body.mass / bodies[0].mass == pytest.approx(block.mass / placed[0].mass, rel=1e-5)
        assert inertia / body.mass == pytest.approx(block.inertia / block.mass, rel=1e-5)
    assert len({round(block.mass, 9) for block in placed}) == len(placed)


@pytest.mark.filterwarnings("ignore:builtin type .* has no __module__ attribute:DeprecationWarning")
def test_a_heap_of_hexagons_is_timed_and_compared() -> None:
    for module in ("pymunk", "Box2D"):
        pytest.importorskip(module, exc_type=ImportError)
    found = HEAP.measure(Effort(quick=True, repeats=2))
    own, *others = found.numbers
    assert own.quantity == "non-smooth, step 1 ms / 4"
    assert [one.quantity for one in others] == [f"{name}, 10 iterations: times that" for name in ("Box2D", "pymunk")]
    assert all(len(one.samples) == 2 and min(one.samples) > 0.0 for one in found.numbers)
    meaning, mine, *_ = found.notes
    assert meaning.startswith("20 random hexagons")
    assert mine.startswith("non-smooth: mean height of the centres ")
    assert mine.endswith("mm, 0.0 and 0.0 mm off in x and y")


def test_starts_differ_by_a_micrometre_and_are_the_same_every_time() -> None:
    shifts = np.array([scene.shift for scene in starts(16)])
    assert np.abs(shifts).max() <= 1e-6
    assert len(np.unique(shifts)) == shifts.size
    assert np.array_equal(shifts, [scene.shift for scene in starts(16)])
    scene = starts(2, 0.0)[1]
    assert [body.x for body in scene.placed()] == (np.array([0.016, 0.038, 0.060]) + scene.shift).tolist()
    assert scene.restitution == scene.make(time={"end": 0.1}).contact.restitution.block_block == 0.0


def test_error_is_the_distance_from_the_reference_of_the_same_start(monkeypatch: pytest.MonkeyPatch) -> None:
    levels = tuple(Shifted(by) for by in (1.9e-3, 3e-3, 2.1e-3, 2.05e-3))  # the first is right by chance
    series = (Series("made up", "made up, a", levels, Shifted(2e-3)), Series("made up", "b", levels[1:2], Shifted(9.0)))
    monkeypatch.setattr(three_blocks_peers, "three_blocks_series", lambda *_, **__: series)
    monkeypatch.setattr(three_blocks_peers, "_calls", lambda _: {})
    found = three_blocks_peers.PAPER.measure(QUICK)
    assert [row["error_mm"] for row in found.details] == pytest.approx([0.1, 1.0, 0.1, 0.05, 1.0])
    best, none = found.numbers
    assert best.quantity == "made up, a: by 0.00205"  # of two that are close it takes less time
    assert best.median == pytest.approx(2.05)
    assert (none.quantity, none.median) == ("b: none", np.inf)
    assert isinstance(found, Readings)
    assert found.panel is not None
    assert [curve.label for curve in found.panel.curves] == ["made up, a", "b"]


def test_others_are_reported_as_multiples_of_the_non_smooth_scheme_with_and_without_calls(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of made up engines, that are called once a second."""
    tables = {"pymunk": (9.0, 6.0), "Box2D": (8.0,), "explicit": (4.0,), "non-smooth": (2.0, 2.5)}
    series = [
        Series(engine, f"{engine} {seconds}", (Shifted(1.0, seconds),), Shifted(1.0))
        for engine, row in tables.items()
        for seconds in row
    ]
    monkeypatch.setattr(three_blocks_peers, "three_blocks_series", lambda *_, **__: series)
    monkeypatch.setattr(three_blocks_peers, "END", 3.0)
    monkeypatch.setattr(three_blocks_peers, "_calls", lambda _: {"pymunk": 1.0, "Box2D": 2.0, "non-smooth": 0.5})
    found = {one.quantity: one.median for one in three_blocks_peers.PAPER.measure(QUICK).numbers}
    for engine, times in (("pymunk", 3.0), ("Box2D", 4.0), ("explicit", 2.0)):
        assert found[f"{engine}: times non-smooth"] == pytest.approx(times)
    assert found["pymunk: the same without calls"] == pytest.approx((6.0 - 3.0) / (2.0 - 1.5))
    assert found["Box2D: the same without calls"] == pytest.approx((8.0 - 6.0) / (2.0 - 1.5))
    assert "explicit: the same without calls" not in found


def test_blocksim_is_called_once_a_run_and_the_others_once_a_step() -> None:
    (scene,) = starts(1)
    assert Nonsmooth(TimeSteps(1e-3)).calls(scene) == Explicit(1.0, 0.1).calls(scene) == 1
    assert Pymunk(1e-3, 10).calls(scene) == Box2D(1e-3, 10).calls(scene) == 400
    assert 0.0 < Nonsmooth(TimeSteps(1e-3)).call_time(scene) < 0.01


@pytest.mark.parametrize(("restitution", "quick"), [(0.0, False), (0.2, True)])
def test_every_engine_has_one_finest_setting_finer_than_its_levels(restitution: float, quick: bool) -> None:
    series = three_blocks_series(restitution, quick=quick)
    assert {one.engine for one in series} == {"pymunk", "Box2D", "explicit", "non-smooth"}
    for one in series:
        assert {other.reference for other in series if other.engine == one.engine} == {one.reference}
        assert one.reference not in one.levels
        if isinstance(one.reference, Nonsmooth):
            steppings = [level.stepping for level in one.levels if isinstance(level, Nonsmooth)]
            assert one.reference.stepping.step < min(stepping.step for stepping in steppings)
            assert {stepping.velocity_sweeps == 1 for stepping in steppings} == {restitution == 0.0}


def test_levels_have_the_iterations_that_their_curve_is_labelled_with() -> None:
    for one in (*three_blocks_series(0.2, quick=False), *wall_series(quick=False)):
        for level in one.levels:
            if isinstance(level, Stepper):
                assert one.label == f"{one.engine}, {level.iterations} iterations"
            if isinstance(level, Nonsmooth):
                assert one.label.startswith(f"non-smooth, {level.stepping.substeps} substep")
            if isinstance(level, Explicit):
                assert one.label in ("explicit", f"explicit, safety {level.safety:g}")


def test_wasserstein_distance_is_the_area_between_cumulative_curves() -> None:
    """Sorted values 0, 1, 2, 3 are 0, 1, 1, 2 away from 0, 2, 3, 5."""
    one = np.array([3.0, 0.0, 1.0, 2.0])
    assert wasserstein(one, np.array([2.0, 5.0, 0.0, 3.0])) == pytest.approx(4.0 / 4)
    assert wasserstein(one, np.flip(one)) == 0.0


def test_heaps_are_compared_level_by_level() -> None:
    scene = SMALL.scene()
    levels = tuple(Shifted(by) for by in (7e-3, 5e-3, 4e-3))
    finals = tuple(solver.solve(scene) for solver in levels)
    one = Computed(Series("made up", "made up", levels, levels[-1]), finals, finals[0])
    assert one.changes == pytest.approx(np.array([[2.0, 0.0], [1.0, 0.0]]))
    assert one.scatter == pytest.approx((2.0, 0.0))
    assert distances(finals[0], finals[2]) == pytest.approx((3.0, 0.0))


def test_a_wall_is_measured_by_blocksim_alone_where_it_is_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    series = tuple(one for one in wall_series(quick=True) if one.engine == "explicit")
    monkeypatch.setattr(wall, "wall_series", lambda **_: series)
    monkeypatch.setattr(wall, "wall_racers", lambda: {"made up": Shifted(1.0)})
    found = wall.WALL.measure(QUICK)
    coarse, fine, change, _ = found.numbers
    assert 0.0 < coarse.median < fine.median
    assert 0.0 < change.median < 2.0
    assert found.details[1]["change_x_mm"] is None


def test_walls_are_raced_in_turns_at_the_same_step() -> None:
    racers: dict[str, Solver] = {"first": Shifted(2.0), "second": Shifted(6.0)}
    own, other = raced(racers, SMALL, 2)
    assert (own.quantity, own.samples) == ("first, by 2, in turns", (2.0, 2.0))
    assert (other.quantity, other.samples) == ("second: times that", (3.0, 3.0))
    first, *others = wall_racers().values()
    assert isinstance(first, Nonsmooth)
    steps = {one.step for one in others if isinstance(one, Stepper)}
    assert steps == {first.stepping.step} == {1e-3}


def test_a_run_of_blocksim_that_breaks_off_has_no_answer() -> None:
    def make(*, contact: Mapping[str, object] | None = None, time: Mapping[str, object] | None = None) -> Scenario:
        return three_blocks(contact={**(contact or {}), "max_overlap": 1e-6}, time=time)

    (scene,) = starts(1)
    assert np.isfinite(Explicit(1e-4, 0.1).solve(scene).x).all()
    assert np.isnan(Explicit(1e-4, 0.1).solve(replace(scene, make=make)).x).all()


@pytest.mark.parametrize("arguments", [["heap"], ["wals"]], ids=["package", "name"])
def test_a_missing_package_and_an_unknown_name_are_wrong_usage(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], arguments: list[str]
) -> None:
    for name in ("pymunk", "Box2D"):
        monkeypatch.setitem(sys.modules, name, sys)  # there, whatever it is
    if arguments == ["heap"]:
        monkeypatch.setitem(sys.modules, "Box2D", None)
    with pytest.raises(SystemExit):
        main(arguments)
    told = "package box2d is missing" if arguments == ["heap"] else "did you mean 'wall'?"
    assert told in capsys.readouterr().err


def test_the_script_writes_numbers_and_draws_the_picture_beside_them(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    panel = Panel("made up", "error (mm)", (Curve("a", "a", np.ones(2), np.ones(2)),))
    findings = Readings((single("time", "CPU ms", 1.0),), panel=panel)
    monkeypatch.setattr(script, "PEERS", (Benchmark("drawn", "made up", lambda _: findings, quick="less"),))
    for module in ("pymunk", "Box2D"):
        monkeypatch.setitem(sys.modules, module, sys)
    main(["--quick", "--out", str(tmp_path / "peers.json")])
    assert "drawn: made up\n  time" in capsys.readouterr().out
    assert json.loads((tmp_path / "peers.json").read_text())["measurements"][0]["shortened"] == "less"
    assert (tmp_path / "peers.png").stat().st_size > 0
