"""Capacity of what actuators push or pull: peak force, stiffness, softening and energy of their records.

Beside them stand what shows how slow the run was, and the bound of statics: no equilibrium carries more, as it is at
the start.
"""

import math
from collections.abc import Iterator, Mapping
from contextlib import suppress
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from blocksim.analysis.compare import plain
from blocksim.analysis.curves import STIFF, CurveTable, Envelope
from blocksim.errors import InvalidInputError
from blocksim.notebook import Shown
from blocksim.scenario import Model, Scenario, events, placement
from blocksim.scenario.models.actuators import Actuator
from blocksim.scenario.models.loads import Force
from blocksim.simulation import Result, read_result
from blocksim.simulation.balance import solver_module
from blocksim.simulation.instruments import ACTUATOR, ProbeSeries
from blocksim.simulation.trajectory import Frames
from blocksim.study import run_folder
from blocksim.view import style, time_panels as view

if TYPE_CHECKING:
    import pandas as pd

LEAST_SHARE = 1e-6  # of the displacement of the head: less is no way in that direction
RISING = 0.9  # of the way: from there on a peak may be none, as the head slows down where the curve ends
WINDOWS = 100  # over which changes of momentum are averaged
SLOW = 0.01  # of work, peak and bound: more inertia, force of dashpots or excess than that is warned of


class Capacity(NamedTuple):
    """What an actuator found in one direction (push, along it, or pull); SI, NaN where there is no such number."""

    actuator: str
    sense: str
    peak: float  # N
    displacement: float  # m, of its point at the peak
    fallen: float  # m: where its force has fallen to 0.8 of the peak
    stiffness: float  # N/m: secant between 0.15 and 0.4 of the peak
    work: float  # J, done on the structure by the end
    bound: float  # N, by statics
    kinetic_share: float  # kinetic energy over work done, at most, up to `fallen`
    inertia_share: float  # force of inertia over the peak, at most, up to there
    dashpot_share: float  # loss in the dashpots of contacts over work done, until the end of the secant
    rises: bool  # whether the peak is where the curve ends
    exceeds: bool  # whether the peak is above the bound by more than a change of geometry may bring


class CapacityAnswer(Shown):
    """The capacities of one run, by actuator and direction."""

    def __init__(self, run: Result, found: tuple[Capacity, ...]) -> None:
        """Keep the run and what was found."""
        self.run, self.all = run, found

    @property
    def folder(self) -> Path | None:
        """Where the run lies."""
        return self.run.folder

    @property
    def warnings(self) -> tuple[str, ...]:
        """What may be wrong in the numbers."""
        rising = (
            f"{one.actuator}: the force still rises at {1e3 * one.displacement:.4g} mm, where the run ends; go farther"
            for one in self.all
            if one.rises
        )
        fast = (
            f"{one.actuator}: not slow: kinetic energy up to {one.kinetic_share:.1%} of the work, inertia up to "
            f"{one.inertia_share:.1%} of the peak; a lower rate is nearer to statics"
            for one in self.all
            if max(one.kinetic_share, one.inertia_share) > SLOW
        )
        damped = (
            f"{one.actuator}: dashpots of contacts take {one.dashpot_share:.1%} of the work up to {STIFF[1]:g} of the "
            "peak, so that the stiffness may be too high; lower the rate, or raise contact.restitution"
            for one in self.all
            if one.dashpot_share > SLOW
        )
        above = (
            f"{one.actuator}: the {one.sense} has its peak {one.peak / one.bound - 1.0:.1%} above the bound, "
            f"at {1e3 * one.displacement:.4g} mm, too early for hardening: a jolt; lower the rate or time.step"
            for one in self.all
            if one.exceeds
        )
        return (*rising, *fast, *damped, *above)

    def to_frame(self) -> "pd.DataFrame":
        """Return one row a capacity, columns as in `Capacity`."""
        import pandas as pd

        return pd.DataFrame(list(self.all))

    def to_dict(self) -> dict[str, object]:
        """Return plain values for JSON; a missing number is None."""
        rows = [{name: plain(value) for name, value in one._asdict().items()} for one in self.all]
        return {"run": str(self.folder), "capacities": rows, "warnings": list(self.warnings)}

    def __repr__(self) -> str:
        """Return a line with the peaks."""
        peaks = ", ".join(f"{one.actuator} {one.sense} {one.peak / 1e3:.4g} kN" for one in self.all)
        return f"<Capacity of {self.run.name}: {peaks}>"

    def _repr_html_(self) -> str:
        """Return the same line, the table and the picture, for notebooks."""
        return f"<p>{escape(repr(self)[1:-1])}</p>{self.to_frame().to_html(index=False)}{super()._repr_html_()}"


def capacity(run: Result | Path | str) -> CapacityAnswer:
    """Return what the actuators of a finished run have found.

    A run is a result or what `run_folder.find_run` takes. Raises InvalidInputError for a run without actuators or
    without samples of them, and what reading it raises.

    >>> pushed = run(load("scenarios/walls/pushed_granite_wall.toml", {"time.end": 0.2}), out="results/pushed")
    >>> capacity(pushed)
    <Capacity of pushed_granite_wall: jack push 2.331 kN>
    """
    result = run if isinstance(run, Result) else read_result(run_folder.find_run(run))
    if not result.scenario.actuators:
        raise InvalidInputError(f"{result.name}: the scenario has no [[actuators]], which move a structure to its peak")
    return CapacityAnswer(result, tuple(_capacities(result)))


def _capacities(result: Result) -> Iterator[Capacity]:
    scenario, records = result.scenario, records_of(result.probes)
    side = placement.smallest_width(result.model.bodies)
    for name, actuator in zip(events.actuator_names(scenario), scenario.actuators, strict=True):
        record = records[name]
        far = float(np.abs(record["head"]).max(initial=0.0))
        for sense, sign in (("push", 1.0), ("pull", -1.0)):
            reached = sign * record["displacement"]
            if not reached.max(initial=0.0) > LEAST_SHARE * far or float((sign * record["force"]).max()) <= 0.0:
                continue
            envelope = Envelope.of(record["displacement"], record["force"], sign)
            fallen = envelope.place_of_fall
            last = np.flatnonzero(reached >= (fallen if math.isfinite(fallen) else reached.max()))[0]
            shares = _shares_of_motion(result.frames, record, actuator, float(record.time[last]), envelope.peak)
            bound, place = bound_of(scenario, actuator, sign), sign * envelope.place_of_peak
            # geometry changes forces by shares of about what the point has moved over a side
            most = (1.0 + SLOW + abs(place) / side) * bound
            yield Capacity(
                name,
                sense,
                envelope.peak,
                place,
                sign * fallen,
                envelope.stiffness if scenario.time.has_springs else math.nan,
                float(record["work"][-1]),
                bound,
                *shares,
                _dashpot_share(result.frames, record, sign, envelope.peak),
                envelope.place_of_peak > RISING * float(envelope.x[-1]),
                envelope.peak > most,
            )


def records_of(probes: Mapping[str, ProbeSeries]) -> dict[str, ProbeSeries]:
    """Return the records of actuators by name. Raises InvalidInputError where one has no samples."""
    found = {name: one for name, one in probes.items() if one.kind == ACTUATOR}
    for name, one in found.items():
        if not len(one):
            raise InvalidInputError(f"the actuator {name} of this run has no samples")
    return found


def _shares_of_motion(
    frames: Frames, record: ProbeSeries, actuator: Actuator, until: float, peak: float
) -> tuple[float, float]:
    """Return kinetic energy over the work done and inertia over the peak (N), the largest until a time (s)."""
    if not (until > 0.0 < peak):
        return math.nan, math.nan
    early, mass = frames.time <= until, np.nan_to_num(frames.mass if frames.mass is not None else np.zeros(1))
    work = float(np.interp(until, record.time, record["work"]))
    kinetic = float(frames.energy["kinetic"][early].max(initial=0.0))
    ways = math.cos(actuator.direction), math.sin(actuator.direction)
    momentum = np.nan_to_num(ways[0] * frames.vx + ways[1] * frames.vy) @ mass
    times = np.linspace(0.0, until, WINDOWS + 1)  # what jumps from one frame to the next is no force
    force = np.diff(np.interp(times, frames.time, momentum)) / np.diff(times)
    return kinetic / work if work > 0.0 else math.nan, float(np.abs(force).max()) / peak


def _dashpot_share(frames: Frames, record: ProbeSeries, sign: float, peak: float) -> float:
    """Return what dashpots lose over the work done until the force has come to STIFF of its peak (N); NaN for none."""
    until = record.time[np.flatnonzero(sign * record["force"] >= STIFF[1] * peak)[0]]
    work = float(np.interp(until, record.time, record["work"]))
    if "dashpot" not in frames.energy or not work > 0.0:
        return math.nan
    return float(np.interp(until, frames.time, frames.energy["dashpot"])) / work


def bound_of(scenario: Scenario, actuator: Actuator, sign: float) -> float:
    """Return the force (N) beyond which no equilibrium carries what an actuator exerts; NaN where statics has none."""
    blockwork, programme = (solver_module(f"statics.{name}") for name in ("blockwork", "programme"))
    alone = scenario.model_copy(update={"actuators": ()})
    with suppress(InvalidInputError):
        at_rest = blockwork.Blockwork.of(Model(alone))
        weight = float(at_rest.gravity * at_rest.masses.sum()) or 1.0  # N: a small force is round-off beside it
        force = {"body": actuator.body, "magnitude": sign * weight, "direction": f"{actuator.direction!r} rad"}
        unit = Force.model_validate({"kind": "force", "point": actuator.point, **force})
        pushed = blockwork.Blockwork.of(Model(alone.model_copy(update={"loads": (*scenario.loads, unit)})))
        found = programme.Programme(at_rest).greatest(at_rest.forces, pushed.forces - at_rest.forces)
        if found is not None and found.factor > 0.0:
            return weight * float(found.factor)
    return math.nan


def draw_capacity(
    scenario: Scenario,
    probes: Mapping[str, ProbeSeries],
    measured: CurveTable | None,
    path: Path,
    paper: style.Paper = style.OWN,
) -> None:
    """Draw force over displacement of all actuators of a run, with the bound of statics, before measured curves.

    Raises InvalidInputError for a run without actuators, an unknown format or too small a page, OutputError.
    """
    if not scenario.actuators:
        raise InvalidInputError(f"{scenario.name}: the scenario has no [[actuators]], whose records this picture shows")
    curves = []
    records = records_of(probes)
    for name, actuator in zip(events.actuator_names(scenario), scenario.actuators, strict=True):
        record = records[name]
        ways = [sign for sign in (1.0, -1.0) if (sign * record["force"]).max() > 0.0 < (sign * record["head"]).max()]
        repeats = measured.points(name, "displacement", "force") if measured is not None else []
        bounds = [sign * bound_of(scenario, actuator, sign) for sign in ways]
        curves.append(view.CapacityCurve(name, record["displacement"], record["force"], bounds, repeats))
    view.draw_curves(curves, path, scenario.description or scenario.name, paper)
