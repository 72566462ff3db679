"""Every kind of picture, drawn from made-up data: (path, paper) of each by name."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from blocksim.analysis.experiment import load_table
from blocksim.scenario import Model, PlacedSegment, scenario_from_mapping
from blocksim.scenario.geometry import regular
from blocksim.scenario.models.loads import Force, Horizontal, Moment, Pressure, Stretch
from blocksim.scenario.motion import MotionPieces
from blocksim.scenario.open_faces import NO_FACE
from blocksim.simulation.safety import Safety, SafetyRow, ThrustRow
from blocksim.simulation.trajectory import Frames
from blocksim.view import style
from blocksim.view.final import draw_final
from blocksim.view.history import draw_history
from blocksim.view.joint_panels import draw_joints
from blocksim.view.kinds import SWEEP_KINDS
from blocksim.view.paints import by_speed, by_turn
from blocksim.view.run_data import LoadOverTime, Support, support_of
from blocksim.view.scene import PictureOptions
from blocksim.view.strip import draw_strip
from blocksim.view.studies import Bars, LevelPanel, draw_levels, draw_tornado
from blocksim.view.style import Paper
from blocksim.view.sweeps.data import SweepData
from blocksim.view.sweeps.lines import Series, draw_series
from tests.bench.peers.work_precision import Curve, Panel as Work, draw_work_precision
from tests.view.made_up import HOSTILE, blocks_at, polygons, pressed, stacked, toppling
from tests.view.made_up_sweeps import grid, made_up, samples

Drawing = Callable[[Path, Paper], None]

TABLE = load_table(Path(__file__).parents[2] / "scenarios" / "experiments" / "three_blocks.csv").summaries()
RUN = PictureOptions("a run", TABLE)
KEYS = ("contact.restitution", "friction.block_block.static", "friction.block_ground.static")
PIECES = MotionPieces(np.array([0.0, 0.3, 1.0]), np.array([[0.0, 0.0, 0.1, 0.0], [0.009, 0.0, 0.0, 0.0]]), 0.0)
MOVING = Support(motion=PIECES, direction=(np.cos(0.3), np.sin(0.3)), fixed=(True, False, False), weight=12.0)
STEP = Support(profile=((0.05, 0.0), (0.05, -0.05)), fixed=(True, False, False))
TILTED = Support(tilt=-0.2)
LEGEND = ("total", "alone")
TOP = ((-0.016, 0.025), (0.016, 0.025), (0.0, 1.0))
RISING = (Stretch(0.0, 0.0, 2.0), Stretch(0.5, 1.0, 0.0))
LOADED = Support(
    loads=(
        LoadOverTime(Force(kind="force", body="1", magnitude=-2e3, point=(0.016, 0.0)), 0, NO_FACE, RISING, np.inf),
        LoadOverTime(Moment(kind="moment", body="2", magnitude=0.5), 1, NO_FACE, RISING, np.inf),
        LoadOverTime(Pressure(kind="pressure", body="3", face="top", magnitude=5e6), 2, TOP, RISING, 0.5),
        LoadOverTime(Horizontal(kind="horizontal", magnitude=0.25), -1, NO_FACE, RISING, np.inf),
    ),
    motion=PIECES,
)


HELD = Support(fixed=(True, False))
CLIFF = Support(profile=((0.12, 0.0), (0.12, -10.0)))
DEEP = Support(profile=((-1e4, 0.0), (0.0, 0.0), (0.0, -1e4), (0.01, -1e4), (0.01, 1e4)))
MOVED = Support(motion=MotionPieces(np.array([0.0, 1.0]), np.array([[0.0, 0.03, 0.0, 0.0]]), 0.03))
WEDGE = ((-0.01, -0.01), (0.02, -0.01), (-0.01, 0.02))


def wall(x0: float, y0: float, x1: float, y1: float, *, from_cover: bool = False) -> PlacedSegment:
    """Return a wall (m) whose first end is free, or reaches into what covers it."""
    ends = {"extends_start": from_cover, "extends_end": False, "touches_start": False, "touches_end": False}
    return PlacedSegment(x0, y0, x1, y1, material=None, **ends)


FAR = Support(profile=((-5.0, 0.01), (-4.0, 0.0)), walls=(wall(3.0, 0.0, 3.0, 100.0),))
JOINED = (
    *(wall(0.15, 0.1, 0.15, 0.0, from_cover=True), wall(0.15, 0.0, 0.16, 0.0)),
    *(wall(0.05, 0.0, 0.05, 0.01), wall(0.05, 0.01, 0.06, 0.01)),
    *(wall(0.0, 0.0, 0.1, 0.0), wall(0.1, 0.0, 0.0, 0.005)),
)
SINKING = Support(walls=(wall(0.15, 0.0, 0.15, 0.05),), direction=(0.0, -1.0), motion=MOVED.motion)
BODY = {"block": "brick", "x": 0.0, "y": 0.2, "name": "1"}
RAMP = {"kind": "ramp", "distance": 1.0, "speed": 0.5}
FORCES: tuple[Mapping[str, object], ...] = (
    {"kind": "force", "name": "push", "body": "1", "magnitude": 6.0, "point": [-0.1, 0.1]},
    {"kind": "force", "name": "pull", "body": "1", "magnitude": 12.0, "point": [0.1, 0.0], "axes": "body"}
    | {"history": {"kind": "ramp", "end": 4.0}},
)
SLOPE = {"tilt": "30 deg"}
END = [{"at": 2.5, "unload": ["push"]}]
PRESSURES: tuple[Mapping[str, object], ...] = (
    {"kind": "pressure", "body": "1", "face": "left", "water_level": 0.3},
    {"kind": "pressure", "body": "1", "face": "top", "magnitude": -1471.5},  # suction of half the water's
)
COEFFICIENTS: tuple[Mapping[str, object], ...] = (
    {"kind": "horizontal", "magnitude": -0.3},
    {"kind": "horizontal", "magnitude": 0.05},
    {"kind": "gravity", "to": "30 deg", "rate": "30 deg/s"},
)


def acting(loads: Sequence[Mapping[str, object]], **tables: Any) -> Support:
    """Return the support of a scene with one block and these loads."""
    block = {"width": 0.2, "height": 0.4, "length": 0.1, "material": "oak"}
    oak = {"density": 1000, "young_modulus": 1e9, "poisson_ratio": 0.3}
    scene = {"schema": 1, "name": "a", "materials": {"oak": oak}, "blocks": {"brick": block}, "bodies": [BODY]}
    return support_of(Model(scenario_from_mapping({**scene, "time": {"end": 9.0}, "loads": loads, **tables})))


def slab(angles: Sequence[float], x: float = 0.0) -> Frames:
    """Return the block of such a scene at these angles, a second apart."""
    return blocks_at(np.full(len(angles), x), 0.2, angles, size=(0.2, 0.4))


def driven() -> Frames:
    """Return such a block that is driven."""
    frames = slab([0.0, 0.0])
    frames.x[1], frames.vx[1], frames.vy[1] = 0.1, 0.3, 0.4
    return frames


def turned() -> Frames:
    """Return a block that has turned by one and a half turns, from half a turn on."""
    frames = toppling(1)
    frames.angle[:, 0] = np.linspace(np.pi, 4.0 * np.pi, len(frames))
    frames.start_angle[0] = np.pi
    return frames


def rounded() -> Frames:
    """Return a block that moves by no more than round-off."""
    frames = toppling(1)
    frames.x[:] = 0.1 + 1e-15 * np.arange(len(frames))[:, None]
    return frames


def constant(speed: float) -> Frames:
    """Return a block whose speed (m/s) hardly changes."""
    frames = toppling(1)
    frames.vx[:] = speed + 1e-9 * np.sin(frames.time)[:, None]
    return frames


def panel(blocks: int = 3, levels: int = 4, size_mm: float = 1.0, **more: Any) -> LevelPanel:
    """Return distances that fall by ten from level to level and grow with the block; the first block stays."""
    off = size_mm * 10.0 ** -np.arange(levels)[:, None] * np.arange(blocks) / max(blocks - 1, 1)
    off[-1] = 0.0
    made = LevelPanel(
        title="time step",
        key="time.safety",
        verdict="converged",
        values=np.array([0.1 * 0.5**level for level in range(levels)]),
        blocks=tuple(f"b{number}" for number in range(blocks)),
        off_mm=off,
        largest_off_mm=off.max(axis=1),
        tolerance_mm=0.1,
        own=0.05,
        recommended=0.025,
    )
    return replace(made, **more)


LONG = panel(3, 9, title="velocity tolerance", key="time.velocity_tolerance", verdict="not yet converged")


def work() -> list[Work]:
    """Return curves of three codes, and one of a single point."""
    seconds = np.array([1e-3, 1e-2, 1e-1, 1.0])
    curves = [
        Curve(label, group, seconds, factor * 1e-2 / seconds, 5e-3 / seconds, 2e-2 / seconds)
        for label, group, factor in (("fast", "one", 1.0), ("faster", "one", 0.5), ("slow", "two", 1.0))
    ]
    bare = Work("wall", "change (mm)", (Curve("heap", "three", np.ones(1), np.ones(1)),))
    return [Work("stairs", "error (mm)", tuple(curves), 0.2, "enough"), bare]


def series(blocks: int, label: str = "", runs: int = 11) -> Series:
    """Return blocks of which the first stays and every further one goes farther with the value."""
    values = np.linspace(9.999e-3, 10.001e-3, runs)
    return Series(label, values, 70.0 + np.linspace(-1.0, 1.0, runs)[:, None] * np.arange(blocks))


def bars() -> list[Bars]:
    """Return total and own effects on three results, of which one does not vary."""
    known, unknown = np.array([0.1, 0.2, np.nan]), np.array([0.1, 1e5, 0.02])
    one = Bars("x of block 2", KEYS, np.array([0.2, 0.7, 0.1]), known, np.array([0.1, -0.05, 0.0]))
    other = Bars("x of block 3", KEYS, np.array([0.1, 0.7, 0.2]), unknown)
    return [Bars("x of block 1", KEYS, np.zeros(3), np.zeros(3)), one, other]


def of_run(draw: Callable[..., None], frames: Frames, **values: Any) -> Drawing:
    return lambda path, paper: draw(frames, path, replace(RUN, paper=paper, **values))


def of_sweep(kind: str, sweep: SweepData) -> Drawing:
    return partial(SWEEP_KINDS[kind].draw, sweep)


def of_series(*values: Any, **more: Any) -> Drawing:
    def draw(path: Path, paper: Paper) -> None:
        with draw_series(*values, paper=paper, **more) as figure:
            style.save_figure(figure, path)

    return draw


def failed() -> Frames:
    """Return a run whose last frame is no number."""
    frames = toppling(2, steps=7)
    frames.x[-1] = np.nan
    return frames


def riding() -> Frames:
    """Return a block that stays where it is on a moving support."""
    frames = toppling(1)
    frames.x[:, 0], frames.y[:, 0] = MOVING.offset(frames.time).T + np.array([[0.0], [0.025]])
    frames.angle[:] = 0.0
    return frames


def far() -> Frames:
    """Return many blocks of which one goes far."""
    frames = toppling(20)
    frames.x[-1, 7] += 1.0
    return frames


def spun() -> Frames:
    """Return many blocks of which five have turned by more than half a turn."""
    frames = toppling(1000)
    frames.angle[-1, :5] = -10.0
    return frames


def odd(blocks: int) -> Frames:
    """Return blocks with names that nobody expects."""
    return replace(toppling(blocks), names=HOSTILE[:blocks])


def courses(name: str, count: int, size: float, *, active: bool = True) -> Safety:
    """Return a wall of so many courses of this size (m), with soil on its right."""
    rows = []
    for number in range(count):
        above = count - number
        values = (name, number, 1e3 * size * number, 1e3 * above, -10.0 * above**2, -5.0 * above, 2.4e3 * size)
        factors = (60.0 / above, 6.0 / above, 90.0 / above, 9.0 / above) if active else (None, 2.5, None, None)
        named = zip(SafetyRow.model_fields, (*values, 4e2 * size, *factors, None, None), strict=True)
        rows.append(SafetyRow.model_validate(dict(named)))
    thrust = dict(zip(ThrustRow.model_fields, ("sand", name, "right", -10.0 * count**2, -9.0 * count), strict=False))
    place = {"x_mm": 0.0, "y_mm": 4e2 * size * count, "inclination_deg": 5.0, "mobilised": 0.1, "share": 0.3}
    return Safety(joints=tuple(rows), thrusts=(ThrustRow.model_validate(thrust | place),) * active)


def joints(path: Path, paper: Paper) -> None:
    """Draw a wall beside soil at the end, and one that has fallen as it settled."""
    fallen = courses("stack", 3, 0.025, active=False)
    draw_joints({"settled": fallen, "end": courses("wall", 8, 0.5)}, path, "a run: joints", paper)


def odd_joints(path: Path, paper: Paper) -> None:
    """Draw more structures than a page has, with names that nobody expects."""
    walls = [courses(name, 1, 1.0, active=False) for name in ODD]
    draw_joints({"end": Safety(joints=tuple(row for one in walls for row in one.joints))}, path, ODD[0], paper)


ODD = ("W" * 200, *HOSTILE)
CHOICE: dict[str, Any] = {"panels": ("displacement", "energy"), "blocks": ("3",)}
DRAWINGS: dict[str, Drawing] = {
    "strip": of_run(draw_strip, toppling(3)),
    "strip at chosen times": of_run(draw_strip, toppling(3, steps=61), times=[0.1, 0.3]),
    "strip at the end": of_run(draw_strip, toppling(2), times=[0.6]),
    "strip on a step": of_run(draw_strip, toppling(3), support=STEP),
    "strip on a moving support": of_run(draw_strip, toppling(3, steps=61), support=MOVING, times=[0.0, 0.1, 0.3]),
    "strip of a ride": of_run(draw_strip, riding(), support=replace(MOVING, fixed=())),
    "strip on tilted ground": of_run(draw_strip, toppling(1), support=TILTED),
    "strip on steep moving ground": of_run(draw_strip, toppling(3), support=Support(tilt=-0.9, motion=PIECES)),
    "strip with loads": of_run(draw_strip, toppling(3, steps=61), support=LOADED, times=[0.0, 0.1, 0.3, 0.6]),
    "strip of a tower": of_run(draw_strip, stacked(12), title=None),
    "strip with forces": of_run(draw_strip, pressed(toppling(7)), forces=True),
    "strip with odd names": of_run(draw_strip, odd(3), title="100 % $x_1$"),
    "final": of_run(draw_final, toppling(3)),
    "final of a tower": of_run(draw_final, stacked(10)),
    "final on tilted ground": of_run(draw_final, toppling(10), support=TILTED),
    "final of a high tower": of_run(draw_final, stacked(24), support=TILTED),
    "final at a moment": of_run(draw_final, toppling(3, steps=61), times=[0.3]),
    "final of a failed run": of_run(draw_final, failed()),
    "final of many": of_run(draw_final, toppling(1000)),
    "final of many, by turn": of_run(draw_final, spun(), paint=by_turn(spun())),
    "final that nobody measured": of_run(draw_final, replace(toppling(2), names=("a", "b"))),
    "final with forces, by speed": of_run(draw_final, pressed(toppling(3)), forces=True, paint=by_speed(toppling(3))),
    "final with odd names": of_run(draw_final, odd(7), title="<b>" * 100),
    "final on a cliff": of_run(draw_final, blocks_at([0.1]), support=CLIFF),
    "final below a cliff": of_run(draw_final, blocks_at([0.1, 0.2], [0.025, 0.0]), support=CLIFF),
    "final on a profile of kilometres": of_run(draw_final, blocks_at([0.0]), support=DEEP),
    "final far from corners and walls": of_run(draw_final, blocks_at([0.1], 0.025), support=FAR),
    "final between walls that join": of_run(draw_final, blocks_at([0.1], 0.025), support=Support(walls=JOINED)),
    "final on steep ground": of_run(draw_final, blocks_at([0.0, 1.0], 0.025), support=Support(tilt=0.5)),
    "final of polygons": of_run(
        draw_final, polygons(blocks_at([[0.1, 0.2]] * 2, 0.05, 1.57), WEDGE, regular(6, 0.03))
    ),
    "final with a fixed block": of_run(draw_final, blocks_at([[0.1, 0.2]], 0.025), support=HELD),
    "final of a turn before the start": of_run(draw_final, turned()),
    "strip on a sinking pier": of_run(draw_strip, blocks_at([0.1, 0.1], 0.025), support=SINKING),
    "strip of a block that is moved": of_run(
        draw_strip, blocks_at([0.1, 0.11], 0.025), support=replace(MOVED, fixed=(True,))
    ),
    "strip with forces that turn and end": of_run(
        draw_strip, slab([0.0, 1.57, 1.57, 0.0], 1.0), support=acting(FORCES, events=END)
    ),
    "strip with water and air": of_run(draw_strip, slab([0.0]), support=acting(PRESSURES)),
    "strip with water on tilted ground": of_run(draw_strip, slab([0.0]), support=acting(PRESSURES[:1], ground=SLOPE)),
    "strip with coefficients and a tilt": of_run(draw_strip, slab([0.0, 0.0]), support=acting(COEFFICIENTS)),
    "strip of a driven body": of_run(draw_strip, driven(), support=acting((), bodies=[{**BODY, "motion": RAMP}])),
    "history": of_run(draw_history, toppling(3)),
    "history of round-off": of_run(draw_history, rounded(), panels=("x", "dx")),
    "history of a constant speed": of_run(draw_history, constant(123.456789), panels=("vx", "x")),
    "history of a slow constant speed": of_run(draw_history, constant(-0.123456789), panels=("vx", "x")),
    "history of twenty": of_run(draw_history, far()),
    "history of fixed blocks": of_run(draw_history, toppling(2), support=Support(fixed=(True, True))),
    "history of a failed run": of_run(draw_history, failed()),
    "history of a shaken run": of_run(draw_history, pressed(toppling(3)), support=MOVING, forces=True),
    "history of impacts": of_run(draw_history, pressed(toppling(3)), support=Support(weight=0.1)),
    "history seen from the ground": of_run(
        draw_history, toppling(3), support=MOVING, relative=True, **CHOICE
    ),
    "history of velocities seen from the ground": of_run(
        draw_history, toppling(3), support=MOVING, relative=True, panels=("velocity",), blocks=("3",)
    ),
    "history of chosen panels": of_run(draw_history, toppling(20), support=MOVING, **CHOICE),
    "history with many names": of_run(
        draw_history, toppling(20), panels=("x", "energy"), blocks=tuple(map(str, range(1, 13)))
    ),
    "history with odd names": of_run(draw_history, odd(6), title=HOSTILE[0] * 20),
    "joints": joints,
    "joints of odd names": odd_joints,
    "levels": lambda path, paper: draw_levels([panel()], path, title="slide", measured={"b1": 7.0}, paper=paper),
    "levels of three studies": lambda path, paper: draw_levels([LONG] * 3, path, title="slide", paper=paper),
    "work": lambda path, paper: draw_work_precision(work(), path, title="engines " * 30, paper=paper),
    "levels with odd names": lambda path, paper: draw_levels(
        [replace(panel(8), blocks=ODD)] * 3, path, title=ODD[0], measured=dict.fromkeys(ODD, 7.0), paper=paper
    ),
    "tornado": lambda path, paper: draw_tornado(bars(), LEGEND, path, "Which inputs matter", paper),
    "series": of_series(
        [series(3, "e = 0.3"), series(3, "e = 0.5")], ("1", "2", "brick"), ("overlap", "m"), title="jitter",
        measured={"2": (60.0, 75.0)},
    ),
    "narrow series": of_series(
        [series(3, f"friction.block_block.kinetic = 0.{number}") for number in range(4)], ("1", "2", "3"),
        ("gravity", ""),
    ),
    "series with odd names": of_series(
        [series(8, name) for name in ODD[:4]], ODD, (f"blocks.{ODD[0]}.width", "m"), title=ODD[1],
        measured={ODD[2]: (1.0, 2.0)},
    ),
    "lines": of_sweep("lines", made_up(grid())),
    "map": of_sweep("map", made_up(grid(3), failed=5)),
    "map without measurements": of_sweep("map", made_up(grid(), measured=False)),
    "map of samples": of_sweep("map", made_up(samples(4)[:4], "sobol")),
    "matrix": of_sweep("matrix", made_up(samples(3), "sobol", failed=5)),
    "matrix without measurements": of_sweep("matrix", made_up(samples(2), "sobol", measured=False)),
    "histogram": of_sweep("histogram", made_up(samples(1)[:1], "sobol")),
    "histogram without measurements": of_sweep("histogram", made_up(samples(1)[:1], "sobol", measured=False)),
}  # fmt: skip
