"""Run one scenario: room on the disk, build the scene, step it, keep what it did."""

import math
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import cast

import numpy as np

from blocksim.errors import OutputError
from blocksim.kernels.common import arrays, compiler
from blocksim.kernels.common.tolerances import MOST_ROUNDS
from blocksim.options import silent
from blocksim.scenario import Model, Scenario, events, motion, placement
from blocksim.scenario.models.motion import Pulse
from blocksim.scenario.models.timeline import Nonsmooth
from blocksim.simulation import balance, checkpoint, files, instruments, loop, observables, provenance, results, schemes
from blocksim.simulation.interruption import WallTime, stop_requests
from blocksim.simulation.rest_state import initial_scene
from blocksim.simulation.safety import Safety, safety_of
from blocksim.simulation.stores.hdf5 import FrameFile
from blocksim.simulation.trajectory import final_columns
from blocksim.world import build, free_memory, memory, sag, systems

CHECKPOINT_FILES = len(files.CHECKPOINTS) + 1  # the last one while it is written


def refuse_full_disk(folder: Path, model: Model, scene: schemes.AnyScene) -> None:
    """Raise OutputError where a run may leave more than there is room for on the disk of a folder (yet to be made)."""
    needed = bytes_needed(model, scene)
    place = next(path for path in (folder.absolute(), *folder.absolute().parents) if path.exists())
    free = shutil.disk_usage(place).free
    if needed > free:
        asked, left = free_memory.readable(needed), free_memory.readable(free)
        raise OutputError(
            f"{folder}: the results may take {asked}, but only {left} are free there; write elsewhere with --out DIR, "
            "or store fewer frames (output.every, time.end)"
        )


def bytes_needed(model: Model, scene: schemes.AnyScene) -> int:
    """Return the bytes that the frames of a run and its checkpoints take at most."""
    scenario, step = model.scenario, float(scene.world.controls[0].step)
    steps = loop.last_step_of(scenario.time.end, step)
    frames = round(min(steps, scenario.time.end / scenario.output.every)) + 2  # the first, and wherever it ends
    bodies, particles = scene.world.bodies.size - 1, 0 if scene.world.particles is None else scene.world.particles.size
    contacts = max(memory.CONTACTS_OF_A_BODY * bodies, particles) if scenario.output.contacts else 0
    state = sum(array.nbytes for array in build.arrays_of(scene))
    series = instruments.bytes_of_series(model, steps, step, len(schemes.ledger_names(scene)))
    return series + memory.run_bytes(bodies, frames, contacts, systems.others_of(model)) + CHECKPOINT_FILES * state


UNSOLVED_SHARE = 0.01  # of all velocity passes: beyond this a warning is due
MILLI = 1e3
SAMPLES = 20_000  # of twice the duration of a pulse


def _onset_warnings(model: Model, world: arrays.World, settled: results.RestState | None) -> Iterator[str]:
    """Yield a warning where springs make a slip under an abrupt pulse too large by more than the promise."""
    scenario, pulse = model.scenario, model.scenario.motion
    if not isinstance(pulse, Pulse) or not pulse.is_abrupt or not scenario.time.has_springs:
        return
    if (settled is not None and pulse.start == 0.0) or scenario.ground.tilt != 0.0:
        return
    ground, errors = int(world.bodies[-1]["contact_class"]), [(0.0, "")]
    for body, one in zip(world.bodies[:-1], model.bodies, strict=True):  # those that slip on the ground
        values = world.interactions[int(body["contact_class"]), ground]
        stiffness = 2.0 * float(values["normal_stiffness"] * values["shear_ratio"])
        limit = float(values["kinetic_friction"]) * scenario.gravity.size
        if stiffness > 0.0 and limit < pulse.amplitude and not one.fixed:
            gained = 0.5 * pulse.amplitude * math.sqrt(one.mass / stiffness)  # a/w
            errors.append((gained / mean_slip_rate(model, limit), one.name))
    worst, name = max(errors)
    if worst > 5e-3:  # error of a slip
        yield (
            f"the pulse begins at its peak: springs give way before block {name} slips, and its slip is some "
            f"{worst:.1%} too large (as 1/sqrt(contact.stiffness_scale)); begin the pulse at time zero, or raise the "
            "scale"
        )


def mean_slip_rate(model: Model, limit: float) -> float:
    """Return the mean velocity (m/s) of the first slip under a pulse of a block that friction gives `limit` (m/s2)."""
    pulse = cast("Pulse", model.scenario.motion)
    times = pulse.start + np.linspace(0.0, 2.0 * pulse.resolved_duration, SAMPLES + 1)
    _, velocity = motion.displacement_and_velocity(model.motion, times)
    most = limit * float(times[1] - times[0])
    block = float(velocity[0])
    slip: list[float] = []
    for support in velocity[1:].tolist():
        ahead = support - block
        if abs(ahead) > most:
            block += math.copysign(most, ahead)
            slip.append(abs(support - block))
        elif slip:
            break
        else:  # it sticks
            block = support
    return float(np.mean(slip)) if slip else math.inf


@dataclass(frozen=True)
class RunCallbacks:
    """What is called before the first step of a run; nothing by default."""

    on_remark: Callable[[str], None] = silent  # a line: a run already computed, or resumed and where
    on_start: Callable[[str], None] = silent  # the set of kernels, which is compiled next


NO_CALLBACKS = RunCallbacks()


def simulate(
    source: Scenario | Model, *, threads: int = 1, on_progress: loop.Watcher = silent, wall_time: float | None = None
) -> results.Result:
    """Run a scenario in memory, without writing anything. A signal or the limit of wall time (s) interrupts it.

    The result does not depend on the number of threads; small scenes do not use them all.
    """
    model, limit, began = Model(source), WallTime(wall_time), time.perf_counter()
    limit.check()
    scene = schemes.build(model)
    limit.check()
    began += _compiled(model)
    with _attended(model, scene, threads, limit, on_progress) as (recorder, team, control):
        scene, settled = initial_scene(scene, model, team, control.stop)
        joints = _settled_joints(model, scene, settled)
        ended = loop.run_loop(scene, recorder, model.scenario.time.end, team=team, control=control)
    return _result(model, recorder, ended, time.perf_counter() - began, settled, joints)


def simulate_into(
    source: Scenario | Model,
    folder: Path,
    *,
    overwrite: bool = False,
    resume: bool = False,
    threads: int = 1,
    precautions: checkpoint.CheckpointPolicy = checkpoint.DEFAULTS,
    on_progress: loop.Watcher = silent,
    listener: RunCallbacks = NO_CALLBACKS,
) -> results.Result:
    """Run a scenario and keep everything in a folder, frames while it runs, the mark of a finished run last.

    In this order: scenario.toml and copies of its tables, run.h5 and checkpoints while it runs, then `keep_result`.
    With `resume` it continues from the newest whole checkpoint there, to the same bits as without the interruption;
    without any it starts again. Raises InvalidInputError for checkpoints of another scenario or version of the code,
    OutputExistsError where the folder is not free, or another run is in progress in it, and OutputError where writing
    fails. A signal (SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGUSR1) or the limit of wall time ends it with the status
    `interrupted`, and what was computed until then is kept.
    """
    limit, began = WallTime(precautions.wall_time, precautions.time_over), time.perf_counter()
    model = Model(source)
    scenario = model.scenario
    limit.check()
    scene = schemes.build(model)
    limit.check()
    refuse_full_disk(folder, model, scene)
    tables = files.read_tables(scenario)
    with files.folder_lock(folder):
        resumption = checkpoint.find_resumption(folder, scenario) if resume else checkpoint.Resumption()
        for remark in (*resumption.remarks, *resumption.notes):
            listener.on_remark(remark)
        began += _compiled(model, listener)
        stored = resumption.checkpoint
        with _attended(model, scene, threads, limit, on_progress) as (recorder, team, control):
            if stored is None:
                scene, settled = initial_scene(scene, model, team, control.stop)
                past = checkpoint.Past(settled=settled, joints=_settled_joints(model, scene, settled))
                files.prepare_folder(folder, overwrite=overwrite or resume)
            else:
                scene, position = checkpoint.restore_scene(stored, scene), stored.head.position
                settled, parts = position.settled, (*position.resumed_from, position.step)
                total, joints = position.total_seconds, position.joints
                past = checkpoint.Past(total, parts, stored.path, position.step, settled, joints)
                checkpoint.take_over(stored, model, recorder)
            toml = files.keep_scenario(scenario, tables, folder)
            with FrameFile(folder / files.FRAMES, recorder, toml, schemes.ledger_names(scene)) as sink:
                recorder.sink = sink
                del recorder.held[:-1]  # the file has them
                probes = (f"{files.PROBE}{name}.csv" for name in model.probes)
                remains = (files.FINAL, files.JOINTS, files.SOILS, files.SUMMARY, *probes)
                files.clear_remains(folder, remains)  # of the part before
                periods = precautions.periods(recorder.time_step)
                seconds = precautions.checkpoint_seconds
                writer = checkpoint.CheckpointWriter(
                    folder, checkpoint.origin_of(scenario), sink.sync, periods, seconds, past
                )
                with_writer, since = replace(control, checkpoints=writer), stored and stored.head.position
                ended = loop.run_loop(scene, recorder, scenario.time.end, team=team, control=with_writer, since=since)
            result = _result(model, recorder, ended, time.perf_counter() - began, settled, past.joints)
            altered, warnings = recorder.altered, (*resumption.remarks, *result.summary.warnings)
            if altered:
                more = f" and {len(altered) - 1} more" if len(altered) > 1 else ""
                where = f"{folder / files.FRAMES}: the frame of step {altered[0]}{more}"
                text = f"{where} differs from the recomputed one: it was changed after recording"
                warnings = (*resumption.remarks, text, *result.summary.warnings)
            whole_run = {
                "total_seconds": past.seconds + result.summary.total_seconds,
                "resumed_from": past.resumed_from,
                "last_checkpoint": None if result.status == "finished" else writer.last_step,
                "warnings": warnings,
            }
            return results.keep_result(result, result.summary.model_copy(update=whole_run), folder)


def _compiled(model: Model, listener: RunCallbacks = NO_CALLBACKS) -> float:
    """Compile what a run needs and return the seconds it took, which are no part of the run. Raises OutputError."""
    began = time.perf_counter()
    kernels = schemes.kernels_of(model.scenario)
    listener.on_start(kernels)
    schemes.compile_kernels(kernels)
    if model.scenario.systems:  # these need code of their own
        with compiler.compiling():
            schemes.measure_row(schemes.ALONE.advance(schemes.build(model), 0)[0])
    return time.perf_counter() - began


@contextmanager
def _attended(
    model: Model, scene: schemes.AnyScene, threads: int, limit: WallTime, on_progress: loop.Watcher
) -> Iterator[tuple[instruments.Recorder, schemes.Team, loop.RunControl]]:
    """Give what records a run, its threads and events, and what stops it: a signal, or the limit of wall time."""
    step, output = float(scene.world.controls[0].step), model.scenario.output
    others, probes = systems.others_of(model), instruments.probes_of(model, step, schemes.ledger_names(scene))
    support = observables.MovingSupport(model)
    recorder = instruments.Recorder(
        model.bodies, output.every, step, others=others, contacts=output.contacts, probes=probes, support=support
    )
    timeline = loop.Timeline(model, step) if model.scenario.events else None
    elements = sum(one.count for one in others)
    with stop_requests() as requests, schemes.team_for(scene, threads, elements) as team:
        control = loop.RunControl(on_progress, lambda: requests.reason() or limit.reason(), timeline=timeline)
        yield recorder, team, control


def _settled_joints(model: Model, scene: schemes.AnyScene, settled: results.RestState | None) -> dict[str, Safety]:
    """Return the joints across structures that have come to rest before time zero."""
    return {"settled": safety_of(model, scene)} if settled is not None and settled.at_rest else {}


def _result(
    model: Model,
    recorder: instruments.Recorder,
    ended: loop.LoopResult,
    seconds: float,
    settled: results.RestState | None,
    joints: dict[str, Safety],
) -> results.Result:
    scenario, frames = model.scenario, recorder.frames()
    world, step = ended.scene.world, recorder.time_step
    steps, ground = int(world.clock[0].steps), world.bodies[-1]
    sunk = ended.overlap if ended.code == arrays.OVERLAP_LIMIT else 0.0
    movement = observables.Movement.of(
        recorder.watch, recorder.held[-1].states[0], (ground.vx, ground.vy), steps * step, sunk
    )
    if movement is not None:
        outcome = loop.after_a_fall(ended.outcome, ended.code, ended.ledger, movement.values[observables.OUTCOME])
        ended = replace(ended, outcome=outcome)
        if outcome.status == "failed":  # what it would have come to is not known
            movement = observables.Movement(**{**movement.values, observables.OUTCOME: None})
    outcome = ended.outcome
    summary = results.Summary(
        name=scenario.name,
        status=outcome.status,
        reason=outcome.reason,
        exit_code=outcome.exit_code,
        run=provenance.run_hash(model),
        scenario_hash=model.hash,
        final_state_sha256=provenance.state_hash(ended.scene),
        steps=steps,
        time_step_s=step,
        simulated_time_s=steps * step,
        ended_at=datetime.now(UTC).isoformat(timespec="seconds"),
        compile_seconds=schemes.compile_kernels(schemes.kernels_of(scenario)),
        solver_seconds=ended.solver_seconds,
        total_seconds=seconds,
        energy_J=ended.ledger,
        blocks=len(recorder.placed),
        free_blocks=sum(not body.fixed for body in recorder.placed),
        impacts=scenario.contact.impacts if scenario.time.has_rigid_contacts else None,
        convergence=convergence_of(ended.scene),
        threads=ended.threads,
        settled=settled,
        events=ended.events,
        movement=movement,
        joints={**joints, "end": safety_of(model, ended.scene)} if recorder.placed else {},
        warnings=tuple(_warnings(model, ended, settled)),
        environment=provenance.environment(),
    )
    probes = recorder.probes.series()
    return results.Result(scenario.name, final_columns(frames), summary, scenario, held=frames, held_probes=probes)


def convergence_of(scene: schemes.AnyScene) -> results.ImpulseConvergence | None:
    """Return how well the impulses of rigid contacts were found so far; None of other schemes."""
    found = schemes.scheme_of(scene).convergence(scene)
    return None if found is None else results.ImpulseConvergence.model_validate(found)


def _convergence_warnings(scenario: Scenario, found: results.ImpulseConvergence | None) -> Iterator[str]:
    """Yield warnings where impulses were not found often enough to matter, and what helps."""
    time = scenario.time
    if found is None or not isinstance(time, Nonsmooth):
        return
    if found.unsolved > UNSOLVED_SHARE * found.passes:
        yield (
            f"{found.unsolved / found.passes:.0%} of the velocity passes ended unsolved after time.velocity_sweeps = "
            f"{time.velocity_sweeps}, with changes of up to {MILLI * found.largest_change_m_s:.3g} mm/s: friction and "
            "rebounds may be off; raise time.velocity_sweeps, or shorten time.step"
        )
    if found.cut_rounds:
        yield (
            f"impacts followed from one another for more than {MOST_ROUNDS} rounds, substeps: {found.cut_rounds}; what "
            "still approached did not rebound: shorten time.step, or lower the restitution"
        )


def _warnings(model: Model, ended: loop.LoopResult, settled: results.RestState | None) -> Iterator[str]:
    scenario, placed = model.scenario, model.bodies
    yield from model.implausible_values
    residual, every = ended.ledger.relative_residual, scenario.output.every
    if residual > balance.RESIDUAL_PROMISE:
        yield f"relative energy error {residual:.1e}, above {balance.RESIDUAL_PROMISE:g}"
    if ended.outcome.reason.startswith(loop.STOPPED):
        yield "the run stopped after the fall, while blocks were moving: the final table is not that of rest"
    if every < (1.0 - memory.ROUNDING) * float(ended.scene.world.controls[0].step):
        yield f"output.every = {every:.3g} s is shorter than a step: a frame at every step"
    if settled is not None and not settled.at_rest and scenario.systems:
        yield (
            f"no equilibrium before time zero: block {settled.displaced_block} moves on while the scene settles; "
            f"the run begins with it {settled.largest_displacement_mm:.3g} mm from its place, as fast as it is there"
        )
    yield from _convergence_warnings(scenario, convergence_of(ended.scene))
    yield from systems.warnings_of(model)
    soft = sag.soft_base(scenario, placed, ended.scene.world) if scenario.systems and placed else None
    if soft is not None and soft.warning:
        yield soft.warning
    for number in ended.pending if ended.outcome.status == "finished" else ():
        what = events.describe_event(scenario.events[number])
        yield f"events.{number} has not happened, as nothing came to rest: {what}"
    if ended.outcome.status == "finished" and ended.code != arrays.OVERLAP_LIMIT and placed:
        sunk = schemes.scheme_of(ended.scene).warning(ended.scene, ended.overlap, placement.smallest_width(placed))
        if sunk:
            yield sunk
    yield from _onset_warnings(model, ended.scene.world, settled)
