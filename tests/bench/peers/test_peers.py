"""Other engines on the same scenes, those that are installed, and the picture of accuracy against computing time."""

import json
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from blocksim.bench.harness import Benchmark, Effort, TimeSteps, single
from tests.bench.peers import __main__ as script, three_blocks as three_blocks_peers
from tests.bench.peers.__main__ import main
from tests.bench.peers.box2d_v3 import MISSING, STIFF, VARIABLE, Box2Dv3, library
from tests.bench.peers.bricks import BRICKS
from tests.bench.peers.engine import Box2D, Explicit, Final, Nonsmooth, Pymunk, Readings, Scene, Series, Solver
from tests.bench.peers.heap import HEAP, wasserstein
from tests.bench.peers.three_blocks import starts
from tests.bench.peers.work_precision import SMALLEST_SHARE, Curve, Panel, draw_work_precision, floor_of

# of the wrapper of Box2D
pytestmark = pytest.mark.filterwarnings("ignore:builtin type .* has no __module__ attribute:DeprecationWarning")
ENGINES = pytest.mark.parametrize(
    ("module", "solver"),
    [
        ("pymunk", Pymunk(2e-4, 30)),
        ("Box2D", Box2D(2e-4, 30)),
        (VARIABLE, Box2Dv3(2e-4, 4, STIFF)),
        ("blocksim", Explicit(1e-3, 0.1)),
        ("blocksim", Nonsmooth(TimeSteps(2e-4))),
    ],
    ids=["pymunk", "Box2D", "Box2D v3", "explicit", "non-smooth"],
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


@ENGINES
def test_blocks_start_alike_fall_freely_and_land_on_the_ground(module: str, solver: Solver) -> None:
    if module == VARIABLE and library() is None:
        pytest.skip(MISSING)
    if module != VARIABLE:
        pytest.importorskip(module, exc_type=ImportError)
    (scene,) = starts(1)
    soon = solver.solve(replace(scene, end=2e-3))
    assert soon.x == pytest.approx([0.016, 0.038, 0.060], abs=1e-5)
    assert soon.y == pytest.approx([0.025, 0.075, 0.125], abs=3e-5)
    rest = solver.solve(scene)
    assert rest.y == pytest.approx([0.025, 0.016, 0.016], abs=3e-5)  # upright, and two on their sides
    assert rest.x == pytest.approx([0.016, 0.068, 0.131], abs=3e-3)
    assert rest.seconds > 0.0


def test_a_heap_of_hexagons_is_timed_and_compared() -> None:
    for module in ("pymunk", "Box2D"):
        pytest.importorskip(module, exc_type=ImportError)
    found = HEAP.measure(Effort(quick=True, repeats=2))
    own, *others = found.numbers
    assert own.quantity == "non-smooth, step 1 ms / 4"
    assert [one.quantity for one in others][:2] == [
        f"{name}, 10 iterations: times that" for name in ("Box2D", "pymunk")
    ]
    assert all(len(one.samples) == 2 and min(one.samples) > 0.0 for one in found.numbers)
    meaning, mine, *_ = found.notes
    assert meaning.startswith("20 random hexagons")
    assert mine.startswith("non-smooth: mean height of the centres ")
    assert mine.endswith("mm, 0.0 and 0.0 mm off in x and y")


def test_bricks_are_raced_at_one_step_and_as_near_to_the_finest_answer() -> None:
    for module in ("pymunk", "Box2D"):
        pytest.importorskip(module, exc_type=ImportError)
    found = {one.quantity: one for one in BRICKS.measure(Effort(quick=True, repeats=2)).numbers}
    assert len(found["20 bricks: pymunk, 10 iterations: times that"].samples) == 2
    own, *others = [one.median for name, one in found.items() if name.endswith(": distance")]
    assert others
    assert max(others) <= 1.05 * own


@pytest.mark.parametrize(("path", "told"), [("nowhere.so", "nowhere.so"), ("libm.so.6", "no b2GetVersion")])
def test_what_is_no_library_of_the_third_box2d_is_wrong_usage(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], path: str, told: str
) -> None:
    for name in ("pymunk", "Box2D"):
        monkeypatch.setitem(sys.modules, name, sys)
    monkeypatch.setenv(VARIABLE, path)
    library.cache_clear()
    with pytest.raises(SystemExit):
        main(["heap"])
    library.cache_clear()
    assert told in capsys.readouterr().err


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


def test_wasserstein_distance_is_the_area_between_cumulative_curves() -> None:
    """Sorted values 0, 1, 2, 3 are 0, 1, 1, 2 away from 0, 2, 3, 5."""
    one = np.array([3.0, 0.0, 1.0, 2.0])
    assert wasserstein(one, np.array([2.0, 5.0, 0.0, 3.0])) == pytest.approx(4.0 / 4)
    assert wasserstein(one, np.flip(one)) == 0.0


@pytest.mark.parametrize("arguments", [["heap"], ["haep"]], ids=["package", "name"])
def test_a_missing_package_and_an_unknown_name_are_wrong_usage(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], arguments: list[str]
) -> None:
    for name in ("pymunk", "Box2D"):
        monkeypatch.setitem(sys.modules, name, sys)  # there, whatever it is
    if arguments == ["heap"]:
        monkeypatch.setitem(sys.modules, "Box2D", None)
    with pytest.raises(SystemExit):
        main(arguments)
    told = "package box2d is missing" if arguments == ["heap"] else "did you mean 'heap'?"
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


def test_zero_errors_are_drawn_at_the_floor(tmp_path: Path) -> None:
    exact = Curve("exact", "one", np.array([1.0, 2.0]), np.array([4.0, 0.0]))
    tiny = Curve("tiny", "two", np.array([1.0]), np.array([1e-12]))
    assert floor_of(Panel("", "", (exact,))) == 4.0
    assert floor_of(Panel("", "", (exact, tiny))) == pytest.approx(4.0 * SMALLEST_SHARE)
    none = Panel("", "", (Curve("none", "one", np.ones(1), np.zeros(1)),), 0.2)
    assert floor_of(none) == 0.2
    draw_work_precision([none], tmp_path / "none.png")
    assert (tmp_path / "none.png").stat().st_size > 0
