"""A scene under way: `Simulation` for all who step one, the loop of a run, events on the way, how it can end.

Compiled code runs until a frame, an energy check, an event or a checkpoint is due. Events fall on fixed steps, so that
no output, checkpoint or number of threads decides about them. What happens is written into the arrays; then the pair
list is made anew, with springs the forces at the same moment too, and what the scene holds less afterwards is booked as
an entry of its own in the ledger.
"""

import copy
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from operator import index
from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np

from blocksim.errors import BlocksimError, ExitCode, InvalidInputError
from blocksim.kernels.common import arrays, mechanics, tolerances
from blocksim.kernels.common.loads import value_at
from blocksim.scenario import Model, PlacedBody, Source, events
from blocksim.scenario.models.timeline import Event
from blocksim.simulation import balance, checkpoint, instruments, observables, results, safety, schemes, trajectory
from blocksim.simulation.rest_state import ACCELERATIONS, VELOCITIES, initial_scene
from blocksim.world import systems

if TYPE_CHECKING:
    import pandas as pd

NEVER = np.iinfo(np.int64).max
NOT_THERE = {"mass", "inertia", "inverse_mass", "inverse_inertia"}
OF_CONTACTS = ("fx", "fy", "torque", "pairs_now", "pairs_before", "pairs_changed")
OF_PIECES = ("seats", "coming", "is_asked", "sums_changed")  # see kernels/explicit/inertia.py
OF_FREE_BODIES = (*NOT_THERE, *VELOCITIES, *ACCELERATIONS, *OF_CONTACTS, *OF_PIECES)  # mass, motion and forces


class SteppingError(BlocksimError):
    """A scene cannot be advanced further: a block too fast, contacts lost, energy that does not add up."""

    exit_code = ExitCode.NUMERICAL_FAILURE


def renewed(
    scene: schemes.AnyScene, team: schemes.Team, bodies: arrays.Records, before: float
) -> tuple[schemes.AnyScene, int, float]:
    """Have the pair list of a changed scene made anew, and the contacts of this moment where the scheme asks.

    Take the bodies and the energy (J) before; return the scene, its status code, and the energy booked under `events`.
    """
    code = arrays.REACHED
    scene.world.clock[0].rebuilds = 0
    if schemes.scheme_of(scene).after_event(scene, bodies):
        scene, code = team.advance(scene, int(scene.world.clock[0].steps))
    energy = before - balance.start_energy(scene)
    scene.world.clock[0].checks_at_rest = 0
    scene.world.ledger[0].events += energy
    return scene, code, energy


class Timeline:
    """The events of one run, and how far they have come."""

    def __init__(self, model: Model, step: float) -> None:
        """Take the time step (s)."""
        scenario = model.scenario
        self.events, self.placed, self.step = scenario.events, model.bodies, step
        self.names = {body.name: number for number, body in enumerate(model.bodies)}
        self.walls = events.wall_names(scenario)
        self.loads = [one.load.name for one in model.acting_loads]
        self.loads += events.actuator_names(scenario)
        self.records: tuple[results.EventRecord, ...] = ()
        order = events.in_order(self.events)
        timed = ((self.events[number].at, number) for number in order)
        self.timed = [(max(1, round(at / step)), number) for at, number in timed if at is not None]
        self.at_rest = [number for number in order if self.events[number].at is None]

    @property
    def pending(self) -> list[int]:
        """Numbers of the events that have not happened."""
        done = {one.event for one in self.records}
        return [number for number in range(len(self.events)) if number not in done]

    def next_step(self, done: int) -> int:
        """Return the next step after `done` at which an event is due."""
        return min((step for step, _ in self.timed if step > done), default=NEVER)

    def act(self, scene: schemes.AnyScene, team: schemes.Team, status: int) -> tuple[schemes.AnyScene, int]:
        """Let happen what is due at the step that a scene has come to; return it and the status code.

        Rest ends no run to which anything has yet to happen.
        """
        pending = self.pending
        if not pending or status not in (arrays.REACHED, arrays.AT_REST):
            return scene, status
        done = int(scene.world.clock[0].steps)
        due = [number for step, number in self.timed if step == done and number in pending]
        if status == arrays.AT_REST:
            due = due or [number for number in self.at_rest if number in pending][:1]
            scene.world.clock[0].checks_at_rest = 0
            status = arrays.REACHED
        for number in due:
            scene, status = self._happen(scene, team, number)
        return scene, status

    def _happen(self, scene: schemes.AnyScene, team: schemes.Team, number: int) -> tuple[schemes.AnyScene, int]:
        """Let an event happen and record it; return the scene and the status code."""
        before, event, bodies = balance.start_energy(scene), self.events[number], scene.world.bodies.copy()
        scene, status, energy = renewed(self._changed(scene, event), team, bodies, before)
        steps = int(scene.world.clock[0].steps)
        what, seconds = events.describe_event(event), steps * self.step
        record = results.EventRecord(event=number, step=steps, time_s=seconds, what=what, energy_J=energy)
        self.records = (*self.records, record)
        return scene, status

    def _changed(self, scene: Any, event: Event) -> Any:
        """Return the scene with what an event does in its arrays."""
        world = scene.world
        for name in event.remove:
            # walls are the last before the half-plane
            walls = {wall: world.bodies.size - 1 - k for k, wall in enumerate(reversed(self.walls), start=1)}
            world = remove_body(world, {**walls, **self.names}[name])
        for name in event.fix:
            world = fix_body(world, self.names[name])
        for name in event.free:
            world = free_body(world, self.names[name], self.placed[self.names[name]])
        for load in [world.loads[number] for number, name in enumerate(self.loads) if name in event.unload]:
            controls = world.controls[0]
            now, last = world.clock[0].steps * controls.step, int(load.last_piece) - 1
            piece, value = world.load_pieces[last], 0.0
            if load.kind == arrays.LOAD_ACTUATOR:  # it lets go, and its head stops
                value, load.stiffness, load.damping = value_at(world, load, now), 0.0, 0.0
            piece.start, piece.value = now, value  # from now on
            piece.rate = piece.acceleration = piece.jerk = 0.0
            load.first_piece = last
            controls.loads_end = world.load_pieces["start"][world.loads["last_piece"] - 1].max()
        if event.velocity is not None:
            body = world.bodies[self.names[event.velocity.body]]
            for rate in VELOCITIES if body.inverse_mass > 0.0 else ():
                if (value := getattr(event.velocity, rate)) is not None:
                    body[rate] = value
        return world if isinstance(scene, arrays.World) else scene._replace(world=world)


def remove_body(world: arrays.World, number: int) -> arrays.World:
    """Return a world without a body: it stays where it is, touches nothing, has no mass and never moves."""
    body = world.bodies[number]
    world = _without(world, number)
    body.is_moved = arrays.REMOVED
    body.half_x = body.half_y = -1e12  # m: half sides of what is not there: farther than that from everything
    body.faces = body.corners = body.particle_count = 0
    for name in OF_FREE_BODIES:
        body[name] = 0
    return world


def fix_body(world: arrays.World, number: int) -> arrays.World:
    """Return a world with a body that moves with the support from now on; what is not there or fixed is left."""
    body = world.bodies[number]
    if body.is_moved in (arrays.SUPPORT, arrays.REMOVED):
        return world
    world = _without(world, number)
    for name in OF_FREE_BODIES:
        body[name] = 0
    body.is_moved = arrays.SUPPORT
    ground, controls = world.bodies[-1], world.controls[0]
    body.vx, body.vy = ground.vx, ground.vy
    clock = world.clock[0]
    time, first = float(clock.steps * controls.step), int(clock.motion_piece)
    initial = int(np.searchsorted(world.motion["start"][first:], time, side="right"))
    piece = world.motion[first + max(0, initial - 1)]
    t = time - piece.start
    moved = float(piece.c0 + t * (piece.c1 + t * (piece.c2 + t * piece.c3)))  # m, of the support so far
    extended = arrays.zeros(world.moved.size + 1, world.moved.dtype)
    extended[1:] = world.moved  # those of the support come first
    first = extended[0]
    first.body, first.x, first.y = number, body.x - controls.motion_x * moved, body.y - controls.motion_y * moved
    return world._replace(moved=extended)


def free_body(world: arrays.World, number: int, placed: PlacedBody) -> arrays.World:
    """Return a world with a body that is free from now on, as fast as it is; what is not there or free is left."""
    body = world.bodies[number]
    if body.is_moved not in (arrays.SUPPORT, arrays.DRIVEN):
        return world
    world = _without(world, number)
    body.is_moved = 0
    body.mass, body.inertia = placed.mass, placed.inertia
    body.inverse_mass, body.inverse_inertia = 1.0 / placed.mass, 1.0 / placed.inertia
    return world


def _without(world: arrays.World, number: int) -> arrays.World:
    """Return a world whose support and paths do not move a body."""
    kept = world.moved["body"] != number
    if kept.all():
        return world
    moved = arrays.zeros(int(np.count_nonzero(kept)), world.moved.dtype)
    moved[:] = world.moved[kept]
    world.controls[0].driven = np.count_nonzero(moved["shift_end"])
    return world._replace(moved=moved)


MILLI = 1e3


@dataclass(frozen=True)
class Outcome:
    """What a run came to; `reason` says why it ended."""

    status: Literal["finished", "failed", "interrupted"]
    reason: str
    exit_code: ExitCode


END_OF_TIME = Outcome("finished", "end of simulated time", ExitCode.SUCCESS)
REST = Outcome("finished", "at rest", ExitCode.SUCCESS)
RESIDUAL = Outcome(
    "failed", f"energy residual above {balance.RESIDUAL_LIMIT:.0%} of the energy in play", ExitCode.NUMERICAL_FAILURE
)
CREATED = Outcome(
    "failed",
    f"impacts created more than {balance.RESIDUAL_LIMIT:.0%} of the energy in play: shorten time.step, or lower the "
    "restitution",
    ExitCode.NUMERICAL_FAILURE,
)

BY_CODE = {
    arrays.REACHED: END_OF_TIME,
    arrays.AT_REST: REST,
    arrays.NOT_FINITE: Outcome("failed", "a position or velocity is no longer finite", ExitCode.NUMERICAL_FAILURE),
    arrays.TOO_FAST: Outcome(
        "failed", "a block moves too far in one step for its contacts to be detected", ExitCode.NUMERICAL_FAILURE
    ),
    arrays.OVERLAP_LIMIT: Outcome("failed", "an overlap exceeds contact.max_overlap", ExitCode.NUMERICAL_FAILURE),
}


def diagnose(outcome: Outcome, code: int, scene: schemes.AnyScene, placed: Sequence[PlacedBody]) -> Outcome:
    """Return the outcome of a run that failed with the step and the block in its reason; of others as it is."""
    if outcome.status != "failed":
        return outcome
    scheme, world, reason, who = schemes.scheme_of(scene), scene.world, outcome.reason, ""
    bodies = world.bodies[: len(placed)]
    with np.errstate(all="ignore"):  # not finite numbers are what is searched for
        if code == arrays.OVERLAP_LIMIT:
            overlaps = scheme.overlaps(scene)
            reason = scheme.lost_contact(scene, overlaps) or reason
            worst = int(np.nanargmax(overlaps.depth / overlaps.limit))
            depth, limit = (MILLI * one[worst] for one in (overlaps.depth, overlaps.limit))
            pair = " and ".join(_name(world, placed, int(one[worst])) for one in (overlaps.a, overlaps.b))
            is_capped = overlaps.limit[worst] < world.controls[0].max_overlap
            most = f", more than half of a side of {2.0 * limit:.3g} mm" if is_capped else ""
            who = f"{pair} by {depth:.3g} mm{most}"
        elif code == arrays.NOT_FINITE:
            lost = ~np.all([np.isfinite(bodies[name]) for name in instruments.MOTION], axis=0)
            who = f"block {placed[int(np.argmax(lost))].name}" if lost.any() else _lost_system(scene)
        if not who:
            speed = np.hypot(bodies["vx"], bodies["vy"]) + bodies["radius"] * np.abs(bodies["spin"])
            fastest = int(np.argmax(speed))
            who = f"the fastest is block {placed[fastest].name} with {speed[fastest]:.3g} m/s"
        if code == arrays.TOO_FAST:  # see kernels/explicit/broad_phase.py
            controls, width = world.controls[0], float(world.bodies["least_width"].min())
            safe = 0.5 * min(float(controls.skin), tolerances.WAY_SHARE * width) / float(controls.step)
            who += f", while {safe:.3g} m/s are safe: shorten time.step"
    return replace(outcome, reason=f"{reason} ({who}, step {int(world.clock[0].steps)})")


def _lost_system(scene: schemes.AnyScene) -> str:
    """Return the first of the further systems that has a number which is not finite; empty where none has."""
    for system in getattr(scene, "systems", ()):
        for array in system:
            fields = [array] if array.dtype.names is None else [array[name] for name in array.dtype.names]
            if not all(np.isfinite(one).all() for one in fields):
                return type(system).__name__.lower()
    return ""


def _name(world: arrays.World, placed: Sequence[PlacedBody], body: int) -> str:
    if body < len(placed):
        return f"block {placed[body].name}"
    is_wall = body < world.bodies.size - 1 and math.isfinite(world.bodies[-1].y)
    return "a wall" if is_wall else "the ground"


LONGEST_CALL = 0.2  # s, with all that is sampled on the way
BODY_STEPS_AT_FIRST = 100_000  # ten milliseconds or so; particles and rigid contacts take longer
MOST_GROWTH = 4  # from one call to the next: the first steps of a scene may be quick, as nothing touches


@dataclass(frozen=True)
class Progress:
    """Where a run stands, for whoever shows it."""

    time: float  # s simulated
    end: float  # s
    steps: int
    relative_residual: float


Watcher = Callable[[Progress], None]


@dataclass(frozen=True)
class RunControl:
    """What happens between two compiled calls; nothing by default."""

    on_progress: Watcher = lambda _: None
    stop: Callable[[], str] = lambda: ""  # why to stop now; nothing as long as the run may continue
    checkpoints: checkpoint.CheckpointWriter | None = None
    timeline: Timeline | None = None  # where there are events


UNCONTROLLED = RunControl()


@dataclass(frozen=True)
class LoopResult:
    """The scene at the end, why it ended, where the energy went, the seconds spent in compiled code and its threads.

    `overlap` (m) is the largest one of all contacts at the end, `code` the status of the scene.
    """

    scene: schemes.AnyScene
    outcome: Outcome
    ledger: balance.EnergyLedger
    solver_seconds: float
    threads: int
    overlap: float
    code: int
    events: tuple[results.EventRecord, ...] = ()
    pending: tuple[int, ...] = ()  # numbers of events that have not happened


def last_step_of(end: float, step: float) -> int:
    """Return the number of steps (at least one) that comes nearest to `end` (s)."""
    return max(1, round(end / step))


def outcome_of(code: int, ledger: balance.EnergyLedger) -> Outcome:
    """Return what a run came to that was not interrupted: its status code, and whether its energy adds up."""
    outcome = BY_CODE[code]
    if balance.creates(ledger) and outcome.status == "finished":
        return CREATED
    return RESIDUAL if outcome.status == "finished" and not balance.adds_up(ledger) else outcome


STOPPED = "stopped: "  # begin of the reason of a run that an overlap has ended after the fall


def after_a_fall(outcome: Outcome, code: int, ledger: balance.EnergyLedger, response: object) -> Outcome:
    """Return what a run came to that an overlap has ended after the structure had fallen, as one that fell.

    Where its energy does not add up, nothing is known: what broke its contacts may have flung the blocks.
    """
    if code != arrays.OVERLAP_LIMIT or response != observables.Response.FELL or not balance.adds_up(ledger):
        return outcome
    return Outcome("finished", f"{STOPPED}{outcome.reason}", ExitCode.SUCCESS)


def run_loop(
    scene: schemes.AnyScene,
    recorder: instruments.Recorder,
    end: float,
    *,
    team: schemes.Team = schemes.ALONE,
    control: RunControl = UNCONTROLLED,
    since: checkpoint.Position | None = None,
) -> LoopResult:
    """Advance a scene to `end` (s) or until it rests, fails or is stopped; the recorder samples on the way.

    `since` is where the scene of a checkpoint stood. Raises what keeping frames and checkpoints raises.
    """
    run = _Run(scene, recorder, end, team, control, since)
    why = ""
    while run.code == arrays.REACHED and run.steps < run.last and not (run.is_lost or why):
        why = control.stop()
        if not why:
            run.advance_towards(min(recorder.next_step(run.steps), run.last))
    if why:
        run.write_checkpoint()
    recorder.sample(run.scene)  # wherever it ended
    ledger = run.energy()
    outcome = Outcome("interrupted", why, ExitCode.STOPPED_EARLY) if why else outcome_of(run.code, ledger)
    outcome = diagnose(outcome, run.code, run.scene, recorder.placed)
    overlap = float(schemes.measure_row(run.scene)[-1])
    pending = () if run.timeline is None else tuple(run.timeline.pending)
    return LoopResult(run.scene, outcome, ledger, run.seconds, team.threads, overlap, run.code, run.events, pending)


def steps_of_call(before: int, steps: int, seconds: float) -> int:
    """Return how many steps the next compiled call may take, after one that took so many and so long (s).

    So that signals and limits take effect soon and progress is shown; `before` is what that call was allowed. No bits
    depend on where calls end.
    """
    fitting = 0.05 * steps / max(seconds, 1e-9)
    return max(1, int(min(fitting, MOST_GROWTH * max(steps, before)))) if steps > 0 else before


@dataclass(frozen=True, repr=False, eq=False)
class KeptMoment:
    """A moment of a simulation, as `Simulation.copy` keeps and `restore` takes it.

    `bodies` has x, y (m), angle (rad), vx, vy (m/s) and spin (rad/s) of all blocks in order of placement. What is
    written there is what the scene has after `restore`; the energy of the change is booked in the ledger under
    `events`, negative where it is brought in.
    """

    bodies: Any  # (n,) record array
    scenario: str  # its hash
    scene: schemes.AnyScene
    samples: tuple[tuple[int, tuple[Any, ...]], ...]  # of each probe: step of the last one, and all
    events: tuple[results.EventRecord, ...]
    code: int


class Simulation:
    """A scene under way, stepped from Python to the same bits as by `blocksim.run`, wherever calls end.

    Settling before time zero, events, loads, motions and probes are included. Compiled code runs between two calls;
    nothing of it calls Python.

    Parameters
    ----------
    source :
        A `Model`, or what `blocksim.load` takes.
    threads :
        Threads, of use for scenes of 200 blocks and more. Results do not depend on it.

    Attributes
    ----------
    model, names : what is simulated, and the names of its blocks in order of placement
    step : length of a step (s)
    settled : how the scene came to rest before time zero, None where it did not have to

    Raises
    ------
    ScenarioError
        With all mistakes in a scenario.
    SettleError, SceneTooLargeError, StepError
        As `blocksim.run`, before the first step.

    Examples
    --------
    >>> from blocksim import Simulation, load
    >>> simulation = Simulation(load("scenarios/slide.toml", {"contact.stiffness_scale": 0.01}))
    >>> while simulation.bodies.x[0] < 0.02:  # m
    ...     simulation = simulation.advance(steps=100)
    >>> round(simulation.time, 2), round(float(simulation.bodies.vx[0]), 2)
    (0.05, 0.32)
    """

    model: Model
    settled: results.RestState | None = None  # how the scene came to rest before time zero, where it did
    probe_channels: instruments.Probes = instruments.NO_PROBES

    def __init__(self, source: Source, *, threads: int = 1) -> None:
        """Build the scene and let it settle where the scenario says so; time is zero then."""
        self.model = model = Model(source)
        schemes.compile_kernels(schemes.kernels_of(model.scenario))
        scene = schemes.build(model)
        step, elements = float(scene.world.controls[0].step), sum(one.count for one in systems.others_of(model))
        with schemes.team_for(scene, threads, elements) as self.team:
            scene, self.settled = initial_scene(scene, model, self.team)
            self._take(scene, model.bodies, Timeline(model, step), self.team)
        self.probe_channels = instruments.probes_of(model, step, schemes.ledger_names(self.scene))
        self.probe_channels.sample(self.scene)

    def _take(
        self,
        scene: schemes.AnyScene,
        placed: Sequence[PlacedBody] = (),
        timeline: Timeline | None = None,
        team: schemes.Team = schemes.ALONE,
        start_energy: float | None = None,
    ) -> None:
        """Take a scene that began with so much energy (J), or is to begin now: with its first contacts."""
        self.scene, self.placed, self.timeline, self.team = scene, placed, timeline, team
        self.names = tuple(body.name for body in placed)  # of the blocks, in order of placement
        self.step = float(scene.world.controls[0].step)  # s
        self.code, self.seconds = arrays.REACHED, 0.0  # s in compiled code
        self.pace = max(1, BODY_STEPS_AT_FIRST // max(scene.world.bodies.size - 1, 1))
        if start_energy is None:
            self._call(0)
        self.start_energy = balance.start_energy(self.scene) if start_energy is None else start_energy  # J

    @classmethod
    def of(cls, scene: schemes.AnyScene, placed: Sequence[PlacedBody], timeline: Timeline | None, start: float) -> Self:
        """Return a scene under way that began with so much energy (J)."""
        self = cls.__new__(cls)
        self._take(scene, placed, timeline, start_energy=start)
        return self

    def _call(self, last_step: int) -> None:
        """Advance to a step in one compiled call."""
        self.seconds -= time.perf_counter()
        self.scene, self.code = self.team.advance(self.scene, last_step)
        self.seconds += time.perf_counter()

    def __repr__(self) -> str:
        """Return a line with the name, the time and the status."""
        return f"<Simulation {self.model.scenario.name}: {self.time:.6g} s, {len(self.names)} blocks, {self.status}>"

    @property
    def steps(self) -> int:
        """Steps since the start."""
        return int(self.scene.world.clock[0].steps)

    @property
    def time(self) -> float:
        """Time (s) since the start."""
        return self.steps * self.step

    @property
    def status(self) -> str:
        """`at rest` once all blocks were for as long as the scenario asks, else, or if it does not, `under way`."""
        needed, checks = self.scene.world.controls[0].rest_checks, self.scene.world.clock[0].checks_at_rest
        return "at rest" if 0 < needed <= checks else "under way"

    @property
    def bodies(self) -> Any:
        """The blocks at present: x, y (m), angle (rad), vx, vy (m/s), spin (rad/s), a read-only record array.

        They are in order of placement, as `names` has them; one that was removed stays where it was. The values change
        with the next step, and arrays from before `restore` show the scene of then: `bodies.x.copy()` keeps numbers.
        """
        view = self.scene.world.bodies[: len(self.placed)][list(instruments.MOTION)].view(np.recarray)
        view.flags.writeable = False
        return view

    @property
    def probes(self) -> dict[str, instruments.ProbeSeries]:
        """Samples so far, by the names of the probes."""
        return self.probe_channels.series()

    @property
    def events(self) -> tuple[results.EventRecord, ...]:
        """Events of the scenario that have happened, with time (s) and energy (J)."""
        return () if self.timeline is None else self.timeline.records

    def advance(self, *, to: float | None = None, steps: int | None = None) -> Self:
        """Advance to the step nearest to a time, or by a number of steps; return the simulation.

        A scene at rest goes on as well, and says so by `status`; time.end of the scenario does not end it.

        Parameters
        ----------
        to :
            Time (s) since the start, not before the present.
        steps :
            How many.

        Raises
        ------
        SteppingError
            Where a run would fail: with the reason, the block and the step. Energy is checked at the steps of a run.
        ValueError
            For none or both, or a time before the present.
        """
        if (to is None) == (steps is None):
            raise ValueError("give either a time (to) or a number of steps")
        if to is not None and not math.isfinite(to):
            raise ValueError(f"a finite time (s) is needed, not {to}")
        last = self.steps + index(steps) if steps is not None else round((to or 0.0) / self.step)
        if last < self.steps:
            raise ValueError(f"{last * self.step:.6g} s is before the present, {self.time:.6g} s: restore a moment")
        with schemes.Team(self.team.threads) as self.team:
            while (done := self.steps) < last:
                look = balance.next_energy_check(done, self.scene.world.bodies.size - 1)
                began = time.perf_counter()
                self.step_to(min(last, look, self.probe_channels.next_step(done), done + self.pace))
                self.pace = steps_of_call(self.pace, self.steps - done, time.perf_counter() - began)
                self.probe_channels.sample(self.scene)
                outcome = outcome_of(self.code, self.energy()) if self.steps == look else BY_CODE[self.code]
                self._refuse_failure(outcome, self.code, self.scene)
        return self

    def step_to(self, last: int) -> None:
        """Advance to a step, or an event before it, in one compiled call, and let happen what is due there."""
        done = self.steps
        self._call(last if self.timeline is None else min(last, self.timeline.next_step(done)))
        if self.timeline is not None and self.steps > done:
            self.scene, self.code = self.timeline.act(self.scene, self.team, self.code)

    def _refuse_failure(self, outcome: Outcome, code: int, scene: schemes.AnyScene) -> None:
        if outcome.status == "failed":
            raise SteppingError(diagnose(outcome, code, scene, self.placed).reason)

    def contacts(self) -> "pd.DataFrame":
        """Return the contact points of the last step: names of both bodies, place (m), normal, overlap (m), forces (N).

        The normal points from body b to body a; the name of ground and walls is empty. There are none before a step.
        """
        import pandas as pd

        rows = schemes.scheme_of(self.scene).contacts(self.scene, len(self.placed))
        table = pd.DataFrame({name: rows[name] for name in rows.dtype.names or ()})
        for name in ("body_a", "body_b"):
            table[name] = [self.names[number] if number >= 0 else "" for number in table[name]]
        return table

    def joints(self) -> "pd.DataFrame":
        """Return the joints across structures with the forces of the last step, as joints.csv has them.

        Examples
        --------
        >>> from blocksim import Simulation
        >>> simulation = Simulation("scenarios/dam.toml").advance(to=4)  # the water is at the crest
        >>> simulation.joints().round(2)[["structure", "joint", "sliding", "overturning"]].values.tolist()
        [['dam', 0, 1.44, 1.15]]
        """
        found = safety.columns_of({"": safety.safety_of(self.model, self.scene)})
        return trajectory.as_frame({name: found[name] for name in safety.SafetyRow.model_fields})

    def energy(self) -> balance.EnergyLedger:
        """Return where the energy (J) is and went, with the residual."""
        return balance.energy_ledger(self.scene, self.start_energy)

    def copy(self) -> KeptMoment:
        """Return the present moment, to be changed or restored; the simulation shares nothing with it."""
        bodies = np.array(self.bodies).view(np.recarray)
        samples = tuple((one.last, tuple(one.rows)) for one in self.probe_channels.all)
        return KeptMoment(bodies, self.model.hash, copy.deepcopy(self.scene), samples, self.events, self.code)

    def restore(self, moment: KeptMoment) -> Self:
        """Go to a moment; return the simulation. From one that was not changed it goes on to the same bits.

        Parameters
        ----------
        moment :
            What `copy` of a simulation of the same model returned; its `bodies` may have been changed.

        Raises
        ------
        InvalidInputError
            For a moment of another scenario, numbers that are not finite, changes of a block that is not free, and
            other places beside soil and further systems. Nothing is changed then.
        SteppingError
            Where blocks on springs are too deep in one another; rigid ones are pressed apart. Nothing is changed then.
        """
        if getattr(moment, "scenario", None) != self.model.hash:
            how = "write its bodies into a moment of this one to go on from there with other values"
            raise InvalidInputError(f"restore takes what copy() of a simulation of the same scenario returned; {how}")
        scene, code = copy.deepcopy(moment.scene), moment.code
        bodies = scene.world.bodies[: len(self.placed)]
        is_changed = np.array([moment.bodies[name] != bodies[name] for name in instruments.MOTION])
        for number in np.flatnonzero(is_changed.any(axis=0)):
            if not bodies[number].inverse_mass > 0.0:
                raise InvalidInputError(f"body {self.names[number]} is not free: it is held, driven or removed")
            if not np.isfinite(moment.bodies[number].tolist()).all():
                raise InvalidInputError(f"body {self.names[number]}: places and velocities have to be finite numbers")
            if getattr(scene, "systems", ()) and is_changed[:3, number].any():
                how = "only velocities can be changed beside soil and further systems"
                raise InvalidInputError(f"body {self.names[number]} is elsewhere: {how}")
        if is_changed.any():
            for name in instruments.MOTION:
                bodies[name] = moment.bodies[name]
            mechanics.renew_rotations(scene.world.bodies)
            with schemes.Team(self.team.threads) as team:
                scene, code, _ = renewed(scene, team, moment.scene.world.bodies, balance.start_energy(moment.scene))
            self._refuse_failure(BY_CODE[code], code, scene)
        self.scene, self.code = scene, code
        if self.timeline is not None:
            self.timeline.records = moment.events
        for channel, (last, rows) in zip(self.probe_channels.all, moment.samples, strict=True):
            channel.last, channel.rows = last, [*rows]
        return self


class _Run(Simulation):
    """A run: a simulation with frames, checkpoints and whatever stops it."""

    def __init__(
        self,
        scene: schemes.AnyScene,
        recorder: instruments.Recorder,
        end: float,
        team: schemes.Team,
        control: RunControl,
        since: checkpoint.Position | None,
    ) -> None:
        """Evaluate the contacts at the start, or take over what an earlier part of the run has left."""
        self.recorder, self.end, self.control = recorder, end, control
        self._take(scene, recorder.placed, control.timeline, team, None if since is None else since.start_energy)
        self.last, self.is_lost = last_step_of(end, self.step), False
        if since is not None:
            self.seconds = since.solver_seconds
            if self.timeline is not None:
                self.timeline.records = since.events
            return
        self.recorder.sample(self.scene)
        self.recorder.probes.sample(self.scene)

    def advance_towards(self, wanted: int) -> None:
        """Advance towards a step at which a frame is wanted, as far as one call goes."""
        done, before = self.steps, time.perf_counter()
        look = balance.next_energy_check(done, self.scene.world.bodies.size - 1)
        event = wanted if self.timeline is None else self.timeline.next_step(done)
        checkpoints = self.control.checkpoints
        due = checkpoint.NEVER if checkpoints is None else checkpoints.next_step(done)
        self._advance_by_probes(min(wanted, look, event, done + self.pace, due))
        self.pace = steps_of_call(self.pace, self.steps - done, time.perf_counter() - before)
        if self.timeline is not None:
            self.scene, self.code = self.timeline.act(self.scene, self.team, self.code)
        self.recorder.probes.sample(self.scene)  # like frames after what happens at this step
        if self.recorder.probes.all and self.recorder.sink is not None:
            self.recorder.sink.keep_up()  # with the samples
        if self.steps == wanted:
            self.recorder.sample(self.scene)
        ledger = self.energy()
        self.is_lost = self.steps == look and not balance.adds_up(ledger)
        is_sound = self.code == arrays.REACHED and balance.adds_up(ledger) and self.steps < self.last
        if is_sound and checkpoints is not None and checkpoints.is_due(self.steps):
            self.write_checkpoint()
        self.control.on_progress(Progress(self.steps * self.step, self.end, self.steps, ledger.relative_residual))

    def _advance_by_probes(self, last_step: int) -> None:
        """Advance to a step in one call, or in several where probes are to be sampled on the way.

        It ends early where that takes long, as sampling may take longer than the steps.
        """
        probes, began = self.recorder.probes, time.perf_counter()
        if not probes.all:
            self._call(last_step)
            return
        while self.code == arrays.REACHED and self.steps < last_step:
            self._call(min(last_step, probes.next_step(self.steps)))
            if time.perf_counter() - began > LONGEST_CALL:
                return
            if self.code == arrays.REACHED and self.steps < last_step:
                probes.sample(self.scene)

    def write_checkpoint(self) -> None:
        """Keep the present state, before the frame of a moment that is no output time is recorded."""
        if self.control.checkpoints is None:
            return
        position = checkpoint.Position(
            step=self.steps,
            frames=self.recorder.count_until(self.steps),
            frames_sha256=self.recorder.digest_until(self.steps),
            start_energy=self.start_energy,
            solver_seconds=self.seconds,
            threads=self.team.threads,
            events=self.events,
        )
        self.control.checkpoints.write(self.scene, position)
