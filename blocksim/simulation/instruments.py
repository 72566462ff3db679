"""What samples a run, and never changes it: frames of the world at output times, probes at steps of their own.

Probes are time histories of forces, points, joints and energies, sampled between compiled calls.
"""

import hashlib
import math
import sys
from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from operator import attrgetter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario import Model, PlacedBody, events
from blocksim.scenario.models.timeline import STEP, ActuatorProbe, ForceProbe, JointProbe, PointProbe
from blocksim.simulation import balance, observables, trajectory
from blocksim.world.systems import systems_of
from blocksim.world.systems.blocks import BLOCKS, block_system
from blocksim.world.systems.system import Floats, System, SystemInScene, Track

if TYPE_CHECKING:
    import pandas as pd

    from blocksim.simulation.schemes import AnyScene
    from blocksim.simulation.stores.hdf5 import FrameFile


FORCE, POINT, JOINT, ACTUATOR, ENERGY = "force", "point", "joint", "actuator", "energy"
TABLE_UNITS = {"m": ("_mm", 1e3), "m/s": ("_mm_s", 1e3), "rad": ("_deg", math.degrees(1.0)), "N": ("_N", 1.0),
           "J": ("_J", 1.0), "1": ("", 1.0)}  # fmt: skip
"""Ending of the name and factor of a column in tables for people, by its SI unit."""
ROWS_AT_ONCE = 50_000
CHUNK_ROWS = 1024  # of a column in run.h5
DIGITS = 20  # characters of a number in CSV


COLUMNS: Mapping[str, Mapping[str, str]] = {
    # x, y: point of application, weighted by normal forces; mobilised: shear forces over normal forces times static
    # friction; contacts: their number
    FORCE: {"fx": "N", "fy": "N", "x": "m", "y": "m", "mobilised": "1", "contacts": "1"},
    # x, y: place; dx, dy: displacement from the start; relative: to the support; rotation: angle turned since the start
    POINT: {
        **dict.fromkeys(("x", "y", "dx", "dy", "relative_dx", "relative_dy"), "m"),
        **dict.fromkeys(("vx", "vy", "relative_vx", "relative_vy"), "m/s"),
        "rotation": "rad",
    },
    # opening: gap in the middle of the joint, at its first end (on the left, seen from the first body) and at its last;
    # slip: displacement of the second body along the joint, towards +x where it lies on the first; rotation: angle that
    # the second body has turned relative to the first
    JOINT: {"opening": "m", "opening_first": "m", "opening_last": "m", "slip": "m", "rotation": "rad"},
    # force on the body along the direction of the actuator; displacement of its point since time zero and of its head,
    # both along it; work done on the body
    ACTUATOR: {"force": "N", "displacement": "m", "head": "m", "work": "J"},
}
"""What each kind of probe records, by name: the unit (SI)."""


@dataclass(frozen=True, repr=False)
class ProbeSeries:
    """The n samples of one probe in SI."""

    name: str
    kind: str
    step: NDArray[np.int64]  # (n,) step numbers
    time: Floats  # (n,) s
    columns: dict[str, Floats] = field(repr=False)  # (n,) each
    units: dict[str, str]  # SI, by column

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.step)

    def __getitem__(self, column: str) -> Floats:
        """Return a column. Raises KeyError for one that this kind of probe does not have."""
        return self.columns[column]

    def __repr__(self) -> str:
        """Return a line: name, kind, samples, columns."""
        return f"<Probe {self.name}: {self.kind}, {len(self)} samples of {', '.join(self.columns)}>"

    def table_values(self) -> dict[str, Floats]:
        """Return the columns as tables for people have them, in mm, degrees, N and J, by names with their units."""
        return {
            f"{name}{TABLE_UNITS[self.units[name]][0]}": TABLE_UNITS[self.units[name]][1] * values
            for name, values in self.columns.items()
        }

    def to_frame(self) -> "pd.DataFrame":
        """Return a pandas table, one row per sample: time_s, then the columns in mm, degrees, N and J."""
        import pandas as pd

        return pd.DataFrame({"time_s": self.time, **self.table_values()})

    def csv_lines(self) -> Iterator[str]:
        """Yield the CSV in parts: step, time_s and the columns; numbers read back exactly, nan where there is none."""
        columns = self.table_values()
        yield ",".join(["step", "time_s", *columns]) + "\n"
        for first in range(0, len(self), ROWS_AT_ONCE):
            part = slice(first, first + ROWS_AT_ONCE)
            lists = [values[part].tolist() for values in (self.step, self.time, *columns.values())]
            rows = zip(*lists, strict=True)
            yield "".join(",".join(map(repr, row)) + "\n" for row in rows)


def bytes_of_series(model: Model, steps: int, step: float, energies: int) -> int:
    """Return the bytes that the probes of a run of so many steps (s) take in its folder, with so many energies."""
    total = 0.0
    for probe in model.probes.values():
        every = step if probe.every == STEP else float(probe.every or model.scenario.output.every)
        columns = energies if probe.kind == ENERGY else len(COLUMNS[probe.kind])
        rows = steps * step / max(every, step) + 1
        total += (2 + columns) * (8 * CHUNK_ROWS * math.ceil(rows / CHUNK_ROWS) + DIGITS * rows)
    return int(total)


def series_of(
    name: str, kind: str, units: Mapping[str, str], rows: Sequence[tuple[int, Sequence[float]]], time_step: float
) -> ProbeSeries:
    """Return samples from rows of step and values; `time_step` in s."""
    steps = np.array([step for step, _ in rows], dtype=np.int64)
    values = np.array([row for _, row in rows], dtype=np.float64).reshape(len(rows), len(units))
    return ProbeSeries(
        name,
        kind,
        steps,
        np.multiply(steps, time_step, dtype=np.float64),
        {name: np.ascontiguousarray(values[:, place]) for place, name in enumerate(units)},
        dict(units),
    )


Values = Sequence[float]
Sampler = Callable[["Snapshot"], Values]


class Snapshot:
    """The scene at a step; what several probes need is worked out once."""

    def __init__(
        self, scene: "AnyScene", support: observables.MovingSupport, parts: Sequence[tuple[System, int]] = ()
    ) -> None:
        """Take the scene as it is now, with the systems beside blocks and supports and the numbers of their parts."""
        self.scene, self.parts = scene, parts
        self.bodies = scene.world.bodies
        clock, controls = scene.world.clock[0], scene.world.controls[0]
        self.step = int(clock.steps)
        self.support = support
        self.time = self.step * float(controls.step)

    @cached_property
    def contacts(self) -> tuple[Any, NDArray[np.float64], NDArray[np.float64]]:
        """Contacts with the numbers of all bodies, supports too; forces (N) on a, (c, 2); static frictions, (c,).

        Parts of further systems have numbers after all bodies.
        """
        rows = balance.solver_module("simulation.schemes").scheme_of(self.scene).contacts(self.scene, self.bodies.size)
        classes = self.bodies["contact_class"]
        table = self.scene.world.interactions["static_friction"]
        friction = table[classes[rows["body_a"]], classes[rows["body_b"]]]
        first = self.bodies.size
        for (system, count), arrays in zip(self.parts, getattr(self.scene, "systems", ()), strict=True):
            if system.touching is not None:
                its = system.touching(arrays, self.scene.world)
                added = np.zeros(len(its.body), trajectory.CONTACT_ROW)  # of bodies a with parts b
                added["body_a"], added["body_b"] = its.body, first + its.part
                (added["x"], added["y"]), (added["normal_x"], added["normal_y"]) = its.place.T, its.normal.T
                added["normal_force"], added["shear_force"] = its.normal_force, its.shear_force
                rows, friction = np.concatenate([rows, added]), np.concatenate([friction, its.friction])
            first += count
        return rows, trajectory.forces_on_a(rows), friction

    @cached_property
    def energies(self) -> Values:
        """Energies (J) of the ledger."""
        schemes = balance.solver_module("simulation.schemes")
        energies: list[float] = schemes.measure_row(self.scene)[: len(schemes.ledger_names(self.scene))].tolist()
        return energies


def force_sampler(on: NDArray[np.bool_], by: NDArray[np.bool_]) -> Sampler:
    """Return what samples the force on some bodies by others, both as flags of all bodies, (n,)."""

    def sample(moment: Snapshot) -> Values:
        rows, forces, friction = moment.contacts
        a, b = rows["body_a"], rows["body_b"]
        is_of_a, is_of_b = on[a] & by[b], on[b] & by[a]
        sign = is_of_a.astype(np.float64) - is_of_b
        fx, fy = (sign @ forces).tolist() if len(rows) else (0.0, 0.0)
        chosen = is_of_a | is_of_b
        normal = np.where(chosen, np.abs(rows["normal_force"]), 0.0)
        total = float(normal.sum())
        if total == 0.0:
            return fx, fy, math.nan, math.nan, math.nan, float(np.count_nonzero(chosen))
        limit = float((friction * normal).sum())
        shear = float(np.abs(rows["shear_force"][chosen]).sum())
        x, y = float(normal @ rows["x"]) / total, float(normal @ rows["y"]) / total
        share = shear / limit if limit > 0.0 else math.nan
        return fx, fy, x, y, share, float(np.count_nonzero(chosen))

    return sample


def point_sampler(body: int, placed: PlacedBody, at: tuple[float, float]) -> Sampler:
    """Return what samples the motion of a point of body number `body`, given in its own axes (m)."""
    ax, ay = _arm(placed.angle, at)
    start = placed.x + ax, placed.y + ay

    def sample(moment: Snapshot) -> Values:
        record = moment.bodies[body]
        angle, spin = float(record.angle), float(record.spin)
        rx, ry = _arm(angle, at)
        x, y = float(record.x) + rx, float(record.y) + ry
        vx, vy = float(record.vx) - spin * ry, float(record.vy) + spin * rx
        (ux, uy), (wx, wy) = moment.support.at(moment.time)
        dx, dy = x - start[0], y - start[1]
        return x, y, dx, dy, dx - ux, dy - uy, vx, vy, vx - wx, vy - wy, angle - placed.angle

    return sample


def joint_sampler(bodies: tuple[int, int], placed: tuple[PlacedBody, PlacedBody], joint: events.Joint) -> Sampler:
    """Return what samples the joint between two bodies by number."""
    turned = placed[1].angle - placed[0].angle

    def sample(moment: Snapshot) -> Values:
        a, b = (moment.bodies[one] for one in bodies)
        cosine, sine = math.cos(a.angle), math.sin(a.angle)
        opening, slip = [], []
        for of_a, of_b in zip(joint.ends_of_a, joint.ends_of_b, strict=True):
            px, py = _arm(float(b.angle), of_b)
            x, y = float(b.x) + px - float(a.x), float(b.y) + py - float(a.y)
            gap = cosine * x + sine * y - of_a[0], cosine * y - sine * x - of_a[1]
            opening.append(gap[0] * joint.normal[0] + gap[1] * joint.normal[1])
            slip.append(gap[0] * joint.tangent[0] + gap[1] * joint.tangent[1])
        middle = 0.5 * (opening[0] + opening[1])
        return middle, *opening, 0.5 * (slip[0] + slip[1]), float(b.angle) - float(a.angle) - turned

    return sample


def actuator_sampler(number: int) -> Sampler:
    """Return what samples an actuator, given its number among all loads, from the end where negative."""

    def sample(moment: Snapshot) -> Values:
        world = moment.scene.world
        load = world.loads[number]
        body = world.bodies[load.body]
        arm_x, arm_y = _arm(float(body.angle), (float(load.x), float(load.y)))
        way = (body.x + arm_x - load.base_x) * load.fx + (body.y + arm_y - load.base_y) * load.fy
        force = load.last_fx * load.fx + load.last_fy * load.fy
        return float(force), float(way), value_of(world, load, moment.time), float(load.work)

    return sample


def value_of(world: Any, load: Any, time: float) -> float:
    """Return the value of a load at a time (s), as kernels find it: a factor, a level, a tilt or a displacement."""
    pieces = world.load_pieces[load.first_piece : load.last_piece]
    piece = pieces[max(0, int(np.searchsorted(pieces["start"], time, side="right")) - 1)]
    since = time - piece.start
    return float(piece.value + since * (piece.rate + since * (0.5 * piece.acceleration + since * piece.jerk / 6.0)))


def _arm(angle: float, at: tuple[float, float]) -> tuple[float, float]:
    cosine, sine = math.cos(angle), math.sin(angle)
    return cosine * at[0] - sine * at[1], sine * at[0] + cosine * at[1]


class ProbeChannel:
    """One probe and its samples that are held: a row each, step and values."""

    def __init__(self, name: str, kind: str, units: Mapping[str, str], period: float, sampler: Sampler) -> None:
        """Begin without samples; `period` is the number of steps between two of them, not rounded."""
        self.name, self.kind, self.units, self.period, self.sampler = name, kind, units, period, sampler
        self.rows: list[tuple[int, Values]] = []
        self.last = -1  # step of the last sample

    def next_step(self, done: int) -> int:
        """Return the next step to sample after `done` steps."""
        return int(balance.solver_module("kernels.common.members").next_frame(done, self.period))

    def sample(self, moment: Snapshot) -> None:
        """Add a sample if one is due at this step, wherever the run ends, and it is not there yet."""
        step = moment.step
        if step > self.last and (step == 0 or self.next_step(step - 1) == step):
            self.rows.append((step, self.sampler(moment)))
            self.last = step

    def count_until(self, step: int) -> int:
        """Return the number of samples up to a step, that at the start included."""
        count, done = 1, self.next_step(0)
        while done <= step:
            count, done = count + 1, self.next_step(done)
        return count

    def take_over(self, series: ProbeSeries, last_step: int) -> bool:
        """Begin with the samples up to a step; return False where some of them are missing."""
        kept = int(np.searchsorted(series.step, last_step, side="right"))
        values = np.stack([*series.columns.values()], axis=1)[:kept].tolist()
        self.rows = [*zip(series.step[:kept].tolist(), values, strict=True)]
        self.last = last_step
        return kept == self.count_until(last_step)


@dataclass(frozen=True, eq=False)
class Probes:
    """All probes of a run."""

    all: Sequence[ProbeChannel]
    support: observables.MovingSupport  # its motion
    time_step: float  # s
    parts: Sequence[tuple[System, int]] = ()  # further systems and the number of their parts

    def next_step(self, done: int) -> int:
        """Return the next step at which any probe is sampled after `done` steps."""
        return min((probe.next_step(done) for probe in self.all), default=sys.maxsize)

    def sample(self, scene: "AnyScene") -> None:
        """Add a sample of the present state to all probes that are due."""
        if not self.all:
            return
        moment = Snapshot(scene, self.support, self.parts)
        for probe in self.all:
            probe.sample(moment)

    def series(self) -> dict[str, ProbeSeries]:
        """Return the samples that are held by the names of their probes."""
        return {one.name: series_of(one.name, one.kind, one.units, one.rows, self.time_step) for one in self.all}


NO_PROBES = Probes((), observables.AT_REST, 1.0)


def probes_of(model: Model, time_step: float, ledger: Sequence[str]) -> Probes:
    """Return the probes of a scenario with steps of this length (s); `ledger` names its energies (J)."""
    parts = [(one, () if one.parts is None else one.parts(model)) for one in systems_of(model)]
    placed, named = model.bodies, _numbers(model, [part for _, parts_of in parts for part in parts_of])
    count = 1 + max(number for numbers in named.values() for number in numbers)

    def flags(name: str) -> NDArray[np.bool_]:
        flags = np.zeros(count, dtype=np.bool_)
        flags[[*named[name]]] = True
        return flags

    made = []
    for name, probe in model.probes.items():
        sampler: Sampler = attrgetter("energies")
        match probe:
            case ForceProbe():
                on = flags(probe.on)
                sampler = force_sampler(on, (~on if probe.by is None else flags(probe.by)) & ~on)
            case PointProbe():
                (number,) = named[probe.body]
                sampler = point_sampler(number, placed[number], probe.at)
            case JointProbe():
                (first,), (second,) = (named[name] for name in probe.bodies)
                joint = events.joint_between(placed[first], placed[second])
                assert joint is not None  # noqa: S101 - the scenario was checked
                sampler = joint_sampler((first, second), (placed[first], placed[second]), joint)
            case ActuatorProbe():
                names = events.actuator_names(model.scenario)
                sampler = actuator_sampler(names.index(probe.actuator) - len(names))
        every = model.scenario.output.every if probe.every is None else probe.every
        period = 1.0 if every == STEP else max(float(every) / time_step, 1.0)
        columns = dict.fromkeys(ledger, "J") if probe.kind == ENERGY else COLUMNS[probe.kind]
        made.append(ProbeChannel(name, probe.kind, columns, period, sampler))
    systems = [(one, len(parts_of)) for one, parts_of in parts]
    return Probes(made, observables.MovingSupport(model if made else None), time_step, systems)


def _numbers(model: Model, parts: Sequence[str]) -> dict[str, Sequence[int]]:
    """Return which bodies names mean: blocks, pieces of ground, walls, the half-plane, then parts of systems."""
    placed, blocks = model.bodies, len(model.bodies)
    count = blocks + len(model.segments) + 1
    walls = range(count - 1 - len(model.scenario.walls), count - 1)
    return {
        events.SUPPORTS: [*(number for number, body in enumerate(placed) if body.fixed), *range(blocks, count)],
        events.GROUND: [number for number in range(blocks, count) if number not in walls],
        events.WALLS: walls,
        **{name: [wall] for name, wall in zip(events.wall_names(model.scenario), walls, strict=True)},
        **{part: [number] for number, part in enumerate(parts, start=count)},
        **{body.name: [number] for number, body in enumerate(placed)},
    }


MOTION = tuple(one.name for one in BLOCKS.quantities)
POSITION = MOTION[:3]


class Frame(NamedTuple):
    """One recorded state of all systems, SI."""

    step: int
    states: tuple[Floats, ...]  # (q, b) of each system, as its `quantities`; blocks first
    measured: NDArray[np.float64]  # energies, number of contacts, largest overlap
    contacts: trajectory.Rows | None = None  # where they are recorded

    def digest(self, before: bytes = b"") -> bytes:
        """Return the SHA-256 of all its bits, and of the digest of the frame before it."""
        states = (state.tobytes() for state in self.states)
        contacts = b"" if self.contacts is None else self.contacts.tobytes()
        parts = (before, np.int64(self.step).tobytes(), *states, self.measured.tobytes(), contacts)
        return hashlib.sha256(b"".join(parts)).digest()


class Recorder:
    """Frames, growing as the run continues; with a sink only the last one, so that long runs need no more memory."""

    def __init__(
        self,
        placed: Sequence[PlacedBody],
        every: float,
        step: float,
        *,
        others: Sequence[SystemInScene] = (),
        contacts: bool = False,
        probes: Probes = NO_PROBES,
        support: observables.MovingSupport = observables.AT_REST,
    ) -> None:
        """Record every `every` seconds, at the nearest step of length `step` (s).

        `others` are the systems beside the blocks. With `contacts` the contacts of every frame are recorded as well.
        `probes` are sampled at steps of their own. What has moved is seen from the `support`.
        """
        self.placed = tuple(placed)
        self.systems = (block_system(placed), *others)
        self.time_step = step
        self.sink: FrameFile | None = None  # where frames go but the last, from when on it is there
        self.steps_per_frame = max(every / step, 1.0)
        self.steps: list[int] = []
        self.digests: list[bytes] = []  # of each frame and all before it
        self.altered: list[int] = []  # steps of frames of an earlier part that have come out otherwise when repeated
        self.held: list[Frame] = []  # the last ones: all, or one
        self.ledger: tuple[str, ...] = ()
        self.with_contacts = contacts
        self.probes = probes
        self.watch = observables.Watch([self.placed], [support])

    def next_step(self, done: int) -> int:
        """Return the next step to record after `done` steps, wherever those end."""
        return int(balance.solver_module("kernels.common.members").next_frame(done, self.steps_per_frame))

    def count_until(self, step: int) -> int:
        """Return the number of frames up to a step."""
        return bisect_right(self.steps, step)

    def digest_until(self, step: int) -> str:
        """Return the SHA-256 of all frames up to a step."""
        count = self.count_until(step)
        return self.digests[count - 1].hex() if count else ""

    def take_over(self, rows: "FrameRows") -> None:
        """Begin with the frames of an earlier part of the run at output times, which are not recorded again.

        Those after its checkpoint are among them, as the run would only repeat them; that of the moment at which it was
        stopped is not.
        """
        tables = [None if rows.contacts is None else rows.contacts.at(k) for k in range(len(rows.steps))]
        states = zip(*rows.states, strict=True)
        frames = (Frame(*one) for one in zip(rows.steps.tolist(), states, rows.measured, tables, strict=True))
        self.held = [one for one in frames if one.step == 0 or self.next_step(one.step - 1) == one.step]
        self.steps, self.digests, self.ledger = [frame.step for frame in self.held], [], rows.ledger
        for frame in self.held:
            self.watch.follow([0], frame.states[0][None], [frame.step * self.time_step])
            self.digests.append(frame.digest(self.digests[-1] if self.digests else b""))

    def sample(self, scene: "AnyScene") -> None:
        """Add a frame of the present state, unless this step has one already: then look whether that is the same."""
        schemes, step = balance.solver_module("simulation.schemes"), int(scene.world.clock[0].steps)
        row = schemes.measure_row(scene)
        arrays = (scene.world, *getattr(scene, "systems", ()))
        states = tuple(one.system.state(its, one.count) for one, its in zip(self.systems, arrays, strict=True))
        self.watch.follow([0], states[0][None], [step * self.time_step])
        self.ledger = schemes.ledger_names(scene)
        touching = schemes.scheme_of(scene).contacts(scene, len(self.placed)) if self.with_contacts else None
        frame = Frame(step, states, row, touching)
        if self.steps and self.steps[-1] >= step:
            place = self.count_until(step) - 1
            before = self.digests[place - 1] if place > 0 else b""
            if self.steps[place] == step and frame.digest(before) != self.digests[place]:
                self.altered.append(step)
            return
        self.steps.append(step)
        self.digests.append(frame.digest(self.digests[-1] if self.digests else b""))
        if self.sink is not None:
            self.sink.append(frame)
            self.held.clear()
        self.held.append(frame)

    def frames(self) -> trajectory.Frames:
        """Return all frames that are held: those so far, or, with a sink, the last one."""
        steps, states, measured, tables = zip(*self.held, strict=True)
        contacts = trajectory.join_contacts(tables) if self.with_contacts else None
        values = tuple(np.stack(one) for one in zip(*states, strict=True))
        rows = FrameRows(np.array(steps, dtype=np.int64), values, np.stack(measured), self.ledger, contacts)
        return frames_from_rows(self.systems, self.time_step, rows)


class FrameRows(NamedTuple):
    """What n frames of all systems consist of."""

    steps: NDArray[np.int64]  # (n,)
    states: tuple[Floats, ...]  # (n, q, b) of each system, as its `quantities`; blocks first
    measured: NDArray[np.float64]  # (n, e + 2): energies, number of contacts, largest overlap
    ledger: tuple[str, ...]  # names of the e energies
    contacts: trajectory.Contacts | None = None  # of all frames


def frames_from_rows(systems: Sequence[SystemInScene], time_step: float, rows: FrameRows) -> trajectory.Frames:
    """Return frames of systems, blocks first, with these steps (s)."""
    columns = rows.measured.T
    blocks, *others = (Track(one, values) for one, values in zip(systems, rows.states, strict=True))
    return trajectory.Frames(
        step=rows.steps,
        time=np.multiply(rows.steps, time_step, dtype=np.float64),
        **{name: blocks[name] for name in (*MOTION, "size_x", "size_y", "mass", "inertia")},
        energy=dict(zip(rows.ledger, columns, strict=False)),
        contact_count=columns[-2],
        largest_overlap=columns[-1],
        names=blocks.names,
        start_angle=blocks.at_start("angle"),
        contacts=rows.contacts,
        others=tuple(others),
        outlines=blocks.present.elements.outlines,
    )
