"""Pushed walls with the non-smooth scheme: time of a substep, its growth, and the end of a collapse."""

from __future__ import annotations

from dataclasses import dataclass

from blocksim.bench.measurement import Findings, Number, Setting, single
from blocksim.bench.scenes import LOW_COURSES, pushed_wall
from blocksim.bench.stepping import Stepping
from blocksim.bench.timing import Rerun
from blocksim.bench.walls import Size, growth
from blocksim.simulation.loop import last_step_of

QUICK = "walls of 40 and 160 blocks for 0.1 s"
SIZES = (Size(40, 25), Size(90, 56), Size(180, 112))
QUICK_SIZES = (Size(8, 5), Size(16, 10))
END = 1.0  # s, of the first wall; where it ends is known
COMMON, QUICK_END = 0.5, 0.1  # s, of all walls
USUAL = Stepping(1e-3)


@dataclass(frozen=True)
class Wall:
    """Result for one size."""

    size: Size
    seconds: tuple[float, ...]  # CPU time of every repeat
    steps: int
    rebuilds: int  # of the pair list
    sweeps: int  # of the velocity pass, over all substeps
    mean_x: float  # m, of all centres at the end
    mean_y: float  # m

    @property
    def substeps(self) -> int:
        """Substeps of the run."""
        return self.steps * USUAL.substeps

    @property
    def times(self) -> Number:
        """Time of a block and substep."""
        share = 1e9 / (self.substeps * self.size.blocks)
        name = f"{self.size.blocks} blocks, a substep"
        return Number(name, "ns/block", tuple(share * one for one in self.seconds))

    @property
    def step_time(self) -> float:
        """Time (ns) of one substep of the whole wall."""
        return self.times.median * self.size.blocks

    def detail(self) -> dict[str, object]:
        """Return it for programs."""
        return {
            "blocks": self.size.blocks,
            "columns": self.size.columns,
            "rows": self.size.rows,
            "cpu_s": self.step_time * 1e-9 * self.substeps,
            "ns_per_block_and_substep": self.times.median,
            "rebuilds": self.rebuilds,
            "sweeps_per_substep": self.sweeps / self.substeps,
            "mean_x_m": self.mean_x,
            "mean_y_m": self.mean_y,
        }


def measure(setting: Setting) -> Findings:
    """Measure all sizes from the same start, over the same time, and the smallest over its whole collapse."""
    end, common = (QUICK_END, QUICK_END) if setting.quick else (END, COMMON)
    sizes = QUICK_SIZES if setting.quick else SIZES
    whole = _measured(sizes[0], end, setting.repeats)
    walls = [_measured(size, common, setting.repeats) for size in sizes]
    name = f"{whole.size.blocks} blocks"
    numbers = (
        Number(f"{name}, {end:g} s", "CPU s", whole.seconds),
        Number(f"{name}, {end:g} s, a substep", "ns/block", whole.times.samples),
        *(wall.times for wall in walls),
        single("growth exponent of a substep's time", "", growth(walls)),
        single(f"{name}, mean x at {end:g} s", "mm", 1e3 * whole.mean_x),
        single(f"{name}, mean y at {end:g} s", "mm", 1e3 * whole.mean_y),
    )
    first, last = walls[0], walls[-1]
    note = (
        f"running bond of 32 x 25 mm, pushed with 1 m/s y/H, restitution 0.1, {USUAL.setting}; a substep and growth: "
        f"the first {common:g} s of every wall (a smaller part of higher walls has fallen), {first.rebuilds} to "
        f"{last.rebuilds} pair list updates, {first.sweeps / first.substeps:.2f} to "
        f"{last.sweeps / last.substeps:.2f} velocity sweeps a substep"
    )
    return Findings(numbers, notes=(note,), details=tuple(wall.detail() for wall in (whole, *walls)))


def wall_scene(size: Size) -> Rerun:
    """Return the wall of the non-smooth scheme, at its start."""
    return Rerun(pushed_wall(size.columns, size.rows, time=USUAL.time(), upright=LOW_COURSES))


def _measured(size: Size, end: float, repeats: int) -> Wall:
    scene = wall_scene(size)
    last = last_step_of(end, scene.step)
    runs = [scene.run(last) for _ in range(repeats)]
    bodies, scene_at_end = runs[-1].bodies, runs[-1].scene  # every run ends with the same bits
    return Wall(
        size,
        tuple(run.seconds for run in runs),
        last,
        rebuilds=int(scene_at_end.world.clock[0].rebuilds),
        sweeps=int(scene_at_end.contacts.stepping[0].sweeps),
        mean_x=float(bodies.x.mean()),
        mean_y=float(bodies.y.mean()),
    )
