"""Events of a run, between two compiled calls: when they are due, and what they do to the arrays of a scene.

Events fall on fixed steps, so that no output, checkpoint or number of threads decides about them. What happens is
written into the arrays; then the pair list is made anew, with springs the forces at the same moment too, and what the
scene holds less afterwards is booked as an entry of its own in the ledger.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from blocksim.kernels.common.arrays import AT_REST, DRIVEN, REACHED, REMOVED, SUPPORT, Record, World, zeros
from blocksim.scenario import PlacedBody, Scenario, events
from blocksim.scenario.models.timeline import Event
from blocksim.simulation import ledger, result
from blocksim.simulation.schemes import AnyScene, scheme_of
from blocksim.simulation.team import Team

NEVER = np.iinfo(np.int64).max
NO_SIZE = -1e12  # m: half sides of what is not there: farther than that from everything
NOT_THERE = {"mass", "inertia", "inverse_mass", "inverse_inertia"}
RATES = ("vx", "vy", "spin")
ACCELERATIONS = ("ax", "ay", "spin_rate")
OF_CONTACTS = ("fx", "fy", "torque", "pairs_now", "pairs_before", "pairs_changed")
OF_PIECES = ("seats", "coming", "is_asked", "sums_changed")  # see kernels/explicit/inertia.py


class Timeline:
    """The events of one run, and how far they have come."""

    def __init__(self, scenario: Scenario, placed: Sequence[PlacedBody], step: float) -> None:
        """Take the bodies as placed and the time step (s)."""
        self.events, self.placed, self.step = scenario.events, placed, step
        self.names = {body.name: number for number, body in enumerate(placed)}
        self.walls = events.wall_names(scenario)
        self.loads = [load.name for load in scenario.loads]
        self.records: tuple[result.EventRecord, ...] = ()
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

    def act(self, scene: AnyScene, team: Team, status: int) -> tuple[AnyScene, int]:
        """Let happen what is due at the step that a scene has come to; return it and the status code.

        Rest ends no run to which anything has yet to happen.
        """
        pending = self.pending
        if not pending or status not in (REACHED, AT_REST):
            return scene, status
        done = int(scene.world.clock[0].steps)
        due = [number for step, number in self.timed if step == done and number in pending]
        if status == AT_REST:
            due = due or [number for number in self.at_rest if number in pending][:1]
            scene.world.clock[0].checks_at_rest = 0
            status = REACHED
        for number in due:
            scene, status = self._happen(scene, team, number)
        return scene, status

    def _happen(self, scene: AnyScene, team: Team, number: int) -> tuple[AnyScene, int]:
        """Change the arrays and have the pair list made anew, and the contacts of this moment where the scheme asks."""
        before, event, bodies = ledger.start_energy(scene), self.events[number], scene.world.bodies.copy()
        scene, status = self._changed(scene, event), REACHED
        clock = scene.world.clock[0]
        clock.rebuilds = 0
        if scheme_of(scene).after_event(scene, bodies):
            scene, status = team.advance(scene, int(clock.steps))
        clock, energy = scene.world.clock[0], before - ledger.start_energy(scene)
        clock.checks_at_rest = 0
        scene.world.ledger[0].events += energy
        steps = int(clock.steps)
        what, seconds = events.describe_event(event), steps * self.step
        record = result.EventRecord(event=number, step=steps, time_s=seconds, what=what, energy_J=energy)
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
        for name in event.unload:
            end_load(world, self.loads.index(name))
        if event.velocity is not None:
            body = world.bodies[self.names[event.velocity.body]]
            for rate in RATES if body.inverse_mass > 0.0 else ():
                if (value := getattr(event.velocity, rate)) is not None:
                    body[rate] = value
        return world if isinstance(scene, World) else scene._replace(world=world)


def remove_body(world: World, number: int) -> World:
    """Return a world without a body: it stays where it is, touches nothing, has no mass and never moves."""
    body = world.bodies[number]
    world = _without(world, number)
    body.is_moved = REMOVED
    body.half_x = body.half_y = NO_SIZE
    body.faces = body.corners = body.particle_count = 0
    _hold(body)
    return world


def fix_body(world: World, number: int) -> World:
    """Return a world with a body that moves with the support from now on; what is not there or fixed is left."""
    body = world.bodies[number]
    if body.is_moved in (SUPPORT, REMOVED):
        return world
    world = _without(world, number)
    _hold(body)
    body.is_moved = SUPPORT
    ground, controls = world.bodies[-1], world.controls[0]
    body.vx, body.vy = ground.vx, ground.vy
    clock = world.clock[0]
    time, first = float(clock.steps * controls.step), int(clock.motion_piece)
    initial = int(np.searchsorted(world.motion["start"][first:], time, side="right"))
    piece = world.motion[first + max(0, initial - 1)]
    t = time - piece.start
    moved = float(piece.c0 + t * (piece.c1 + t * (piece.c2 + t * piece.c3)))  # m, of the support so far
    extended = zeros(world.moved.size + 1, world.moved.dtype)
    extended[1:] = world.moved  # those of the support come first
    first = extended[0]
    first.body, first.x, first.y = number, body.x - controls.motion_x * moved, body.y - controls.motion_y * moved
    return world._replace(moved=extended)


def free_body(world: World, number: int, placed: PlacedBody) -> World:
    """Return a world with a body that is free from now on, as fast as it is; what is not there or free is left."""
    body = world.bodies[number]
    if body.is_moved not in (SUPPORT, DRIVEN):
        return world
    world = _without(world, number)
    body.is_moved = 0
    body.mass, body.inertia = placed.mass, placed.inertia
    body.inverse_mass, body.inverse_inertia = 1.0 / placed.mass, 1.0 / placed.inertia
    return world


def end_load(world: World, number: int) -> None:
    """Let a load be zero from now on, and steady."""
    load, clock, controls = world.loads[number], world.clock[0], world.controls[0]
    last = int(load.last_piece) - 1
    piece = world.load_pieces[last]
    piece.start, piece.value, piece.rate = clock.steps * controls.step, 0.0, 0.0
    load.first_piece = last
    controls.loads_end = world.load_pieces["start"][world.loads["last_piece"] - 1].max()


def _hold(body: Record) -> None:
    """Take mass, motion and forces from a body."""
    for name in (*NOT_THERE, *RATES, *ACCELERATIONS, *OF_CONTACTS, *OF_PIECES):
        body[name] = 0


def _without(world: World, number: int) -> World:
    """Return a world whose support and paths do not move a body."""
    kept = world.moved["body"] != number
    if kept.all():
        return world
    moved = zeros(int(np.count_nonzero(kept)), world.moved.dtype)
    moved[:] = world.moved[kept]
    world.controls[0].driven = np.count_nonzero(moved["shift_end"])
    return world._replace(moved=moved)
