"""Bringing a scene to rest before time zero.

Gravity and the loads of time zero grow in proportion, in small parts, so that the forces of contacts grow in proportion
too, and friction is mobilised as far as the final load needs, not as far as a blow of the whole one would. After each
part velocities are taken away whenever the kinetic energy has passed a peak (kinetic damping: P. A. Cundall, Explicit
finite difference methods in geomechanics, Blacksburg 1976). Nothing of this damping is left at time zero: the time loop
is that of any run, with other numbers in its arrays between two calls. Supports and driven bodies do not move, and time
stands still for loads. Bodies that are held have no weight and no inverse mass until then.

Supports that accelerate from time zero on (a pulse that begins at its peak) load the contacts at once. Springs would
need a time of sqrt(m/k) to take that up, in which a block that is about to slip gains a velocity of a sqrt(m/k) that it
keeps. So the inertial force of that acceleration is loaded too, after gravity, as far as the scene carries it at rest.
With springs a scene under a pulse that begins at its peak at time zero settles unasked, if it rests as it was placed.

On springs an equilibrium of all this load is looked for without time first (blocksim/statics/spring_equilibrium.py):
where it is found steps confirm it, and where nothing holds the blocks the scene fails. It is where growing parts lead,
to 1e-3 of the deepest overlap as long as few contacts slip; what the vibrations of each part make slip beyond the need
stays so in parts. Where neither is certain loads grow in parts.

A scene at rest is one whose blocks have no acceleration (springs), or move no further (rigid contacts). One that fails
moves on, as no kinetic energy peaks there: it ends once a block has come farther than springs give way, or as soon as
it is a mechanism (`_is_mechanism`): blocks have come many times as far as contacts can give way, faster and faster, and
meet nothing on the way that is left to them.

With `start.release = "always"` what does not come to rest begins its run from where it had begun to move, as fast as it
did.

Beside soil (`_BesideSystems`) blocks come to rest under their weight alone; then they are kept still while the soil
comes to rest against them, at the pressure of a wall that does not yield; then both go on together. All that with the
whole gravity and all friction, and kinetic damping of blocks and particles: the peaks are those of the energy of both.
The energy that is taken away is an entry of the ledger. At rest are particles on which the mean unbalanced force is
1e-3 of their weight, and blocks with accelerations of 1e-3 of gravity. Soil that is filled in by lifts goes through all
that with each of them. Where there is no equilibrium, the run begins with the motion of blocks and soil, as with
`release = "always"`, or as all was placed where the soil flows beside still blocks, or a lift before the last one.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from blocksim.errors import BlocksimError, ExitCode, StoppedEarlyError
from blocksim.kernels.common.arrays import LOAD_ACTUATOR, REACHED
from blocksim.scenario import Model, overlap, placement
from blocksim.simulation import balance, results, schemes
from blocksim.world.build import arrays_of
from blocksim.world.systems import others_of
from blocksim.world.systems.system import Relaxation

PARTS = 50  # in which gravity and loads grow
BALANCE = 1e-8  # of gravity (and of the strongest load): accelerations at rest
BALANCE_BESIDE = 1e-3  # the same beside soil, and the mean unbalanced force of particles over their weight
CALL_BESIDE = 5  # steps between two looks at the kinetic energy beside soil: some waves pass in ten
MOST_BESIDE = 30_000  # steps to come to rest in beside soil: what creeps on creeps in the run
FIRST_SHARE, LAST_SHARE = 0.25, 1e-3  # of the inertial force: parts in which it grows, halved where one is too much
UNASKED_SHARE = 0.01  # of the smallest side of a block: way in settling that was not asked for; what was to drop drops
MOVED_SHARE = 0.25  # of the smallest side of a block: soft springs give way by as much as a tenth, what falls goes on
LEAN_SHARE = 0.02  # of the smallest side of a block: way at which what falls is released
CHAIN = 3.0  # ways of blocks over those of contacts, times their number and how slender the scene is
STEADY = 0.95  # of the drive before: that of a mechanism does not fade
WINDOWS = 3  # of the time since velocities were taken away, in which drives are compared
LOOKS = 30  # calls between two looks at the drive
AHEAD = (0.02, 0.05, 0.1, MOVED_SHARE)  # of the smallest side: ways at which a mechanism meets nothing new
ARC = 2.0  # squares of these ways over that side, by which blocks on arcs overlap if they went straight on
HELD = ("inverse_mass", "inverse_inertia", "counts")
VELOCITIES = ("vx", "vy", "spin")
ACCELERATIONS = ("ax", "ay", "spin_rate")
FALLS = ("fx", "fy", "torque")
SPRINGS = ("stiffness", "damping")
PATHS = ("shift", "turn")  # pieces of driven bodies that hold
MILLI = 1e3
Floats = NDArray[np.float64]
Stop = Callable[[], str]
"""Why to stop now; nothing as long as the scene may go on."""


class SettleError(BlocksimError):
    """The scene does not come to rest; the message names the block that moves, and how fast."""

    exit_code = ExitCode.NUMERICAL_FAILURE


def initial_scene(
    scene: schemes.AnyScene, model: Model, team: schemes.Team, stop: Stop = str
) -> tuple[schemes.AnyScene, results.RestState | None]:
    """Return a scene at time zero as its run begins, and how it settled, where it did.

    Raises SettleError where that was asked for and fails; otherwise the scene begins as it was placed. Raises
    StoppedEarlyError where `stop` says why.
    """
    scenario, placed = model.scenario, model.bodies
    if model.settles and (scenario.start.settle or scenario.systems):
        return settle(scene, model, team, stop)
    if not model.settles or any(body.vx or body.vy or body.spin for body in placed):
        return scene, None
    kept = [array.copy() for array in arrays_of(scene)]
    with suppress(SettleError):
        found, settled = settle(scene, model, team, stop)
        if settled.largest_displacement_mm <= MILLI * UNASKED_SHARE * placement.smallest_width(placed):
            return found, settled
    _restore(scene, kept)
    return scene, None


def rests(model: Model) -> bool | None:
    """Return whether a scenario has an equilibrium on its contacts, found without time; None where that is not known.

    Raises as `build`.
    """
    run = _Settlement(schemes.build(model), model, schemes.ALONE, str)
    with run.without_time():
        try:
            return True if run.balance() else None
        except SettleError:
            return False


def settle(
    scene: schemes.AnyScene, model: Model, team: schemes.Team, stop: Stop = str
) -> tuple[schemes.AnyScene, results.RestState]:
    """Bring a scene at time zero to rest; return it, still at time zero, and how.

    Raises SettleError, and StoppedEarlyError where `stop` says why.
    """
    run = (_BesideSystems if model.scenario.systems else _Settlement)(scene, model, team, stop)
    with run.without_time():
        try:
            run.come_to_rest()
        except SettleError:
            if not run.is_released:
                raise
            if run.lean is not None:  # back to where blocks had come a little way
                run.scene = run.lean[0]
                _restore(*run.lean)
            run.leaving = {name: run.bodies[name].copy() for name in VELOCITIES}
    books = run.books()
    run.begin()
    ways = run.ways()
    far = int(np.argmax(ways))
    return run.scene, results.RestState(
        steps=run.steps,
        largest_displacement_mm=MILLI * float(ways[far]),
        displaced_block=model.bodies[far].name,
        held=model.scenario.start.hold,
        at_rest=not run.leaving,
        **books,
    )


class _Settlement:
    """A scene on its way to rest."""

    def __init__(self, scene: schemes.AnyScene, model: Model, team: schemes.Team, stop: Stop) -> None:
        scenario, placed = model.scenario, model.bodies
        self.scene, self.placed, self.team, self.stop = scene, placed, team, stop
        self.model = model
        self.scheme = schemes.scheme_of(scene)
        self.pace = self.scheme.settling
        self.count = len(placed)
        names = {body.name: number for number, body in enumerate(placed)}
        self.held = np.array([names[name] for name in scenario.start.hold], dtype=np.intp)
        self.is_free = np.array([not body.fixed for body in placed])
        self.is_free[self.held] = False
        controls = scene.world.controls[0]
        self.gravity = float(controls.gravity_x), float(controls.gravity_y)
        self.support = 0.0, 0.0  # m/s2, acceleration just after time zero
        pieces = scene.world.motion[int(scene.world.clock[0].motion_piece) :]
        initial = pieces[pieces["start"] <= 0.0]
        if initial.size:
            now = initial[-1]
            rate = float(2.0 * now["c2"] - 6.0 * now["c3"] * now["start"])
            self.support = rate * float(controls.motion_x), rate * float(controls.motion_y)
        self.carried = 0.0  # share of the inertial force of that
        self.scale = float(np.hypot(*self.gravity) + controls.push)
        self.smallest = placement.smallest_width(placed)
        self.start = self._places()
        self.before = self.start
        self.energy, self.steps = 0.0, 0
        self.is_released = scenario.start.release == "always"
        self.lean: tuple[schemes.AnyScene, list[NDArray[Any]]] | None = None
        self.leaving: dict[str, Floats] = {}
        self.since, self.speeds = self.start, list[float]()  # velocities were taken away; roots of kinetic energies

    @property
    def bodies(self) -> Any:
        """The records of the blocks."""
        return self.scene.world.bodies.view(np.ndarray)[: self.count]

    @contextmanager
    def without_time(self) -> Iterator[None]:
        """Keep what is held or driven still, supports too, and loads as at time zero; give all back at the end."""
        world = self.scene.world
        paths, driven = world.motion.copy(), world.moved.copy()
        for one in world.moved:  # driven bodies stay where they are at time zero
            for first, end in ((one.shift, one.shift_end), (one.turn, one.turn_end)):
                path = world.motion[int(first) : int(end)]
                if len(path):
                    t = -path["start"][0]
                    path["c0"] = sum(path[f"c{power}"][0] * t**power for power in range(4))
                    for power in range(1, 4):
                        path[f"c{power}"] = 0.0
        controls, loads, pieces = world.controls.copy(), world.loads.copy(), world.load_pieces.copy()
        held = {name: self.bodies[name][self.held].copy() for name in HELD}
        velocities = {name: self.bodies[name].copy() for name in VELOCITIES}
        for name in HELD:
            self.bodies[name][self.held] = 0
        world.controls["motion_x"] = world.controls["motion_y"] = 0.0
        world.controls["rest_checks"] = 0
        for name in ("rate", "acceleration", "jerk"):
            world.load_pieces[name] = 0.0
        for name in SPRINGS:  # actuators are attached once all is at rest
            world.loads[name] = 0.0
        world.loads["last_piece"] = world.loads["first_piece"] + 1
        self.loads = loads
        self._stop()
        yield
        world = self.scene.world
        world.controls[...] = controls
        world.load_pieces[...] = pieces
        world.motion[...] = paths
        for name in PATHS:
            world.moved[name] = driven[name]
        for name in (*FALLS, *SPRINGS, "last_piece"):
            world.loads[name] = loads[name]
        for load in (one for one in world.loads if one.kind == LOAD_ACTUATOR):
            body = world.bodies[load.body]
            load.base_x = body.x + body.cos * load.x - body.sin * load.y
            load.base_y = body.y + body.sin * load.x + body.cos * load.y
        for name, values in held.items():
            self.bodies[name][self.held] = values
        for name, values in velocities.items():
            self.bodies[name] = values

    def come_to_rest(self) -> None:
        """Bring the scene to rest under all that acts on it. Raises SettleError."""
        self.bear_loads()
        self.follow_support()

    def bear_loads(self) -> None:
        """Bring the scene to rest under gravity and loads. Raises SettleError."""
        if not self.balance():
            self.load_up()
        self.rest(self.pace.most)

    def books(self) -> dict[str, float]:
        """Return what the rest state says of energy; nothing where it is not kept."""
        return {}

    def balance(self, inertial: float = 0.0) -> bool:
        """Return True once all loads are in equilibrium with contacts, as found without time, after steps with them.

        `inertial` is the share of that force. Otherwise the scene is as it was. Raises SettleError where nothing holds
        the blocks, unless they are released.
        """
        if self.scheme.equilibrium is None or not self.is_free.any() or not self.scale > 0.0:
            return False
        scene, kept = self.scene, [array.copy() for array in arrays_of(self.scene)]
        self._load(1.0, inertial)
        outcome = self.scheme.equilibrium(scene, self._advanced, self.is_free, self.scale, self.smallest)
        self.scene, change = outcome.scene, outcome.change
        if outcome.holds:
            self.steps = int(self.scene.world.clock[0].steps)
            self._go()
            return True
        way = float(schemes.corner_ways(change, self.bodies["radius"]).max())
        falls = outcome.holds is False and not self.is_released
        if falls and not any(self._meets(change * (share * self.smallest / way), share) for share in AHEAD):
            raise self._error()
        _restore(scene, kept)
        self.scene = scene
        return False

    def load_up(self) -> None:
        """Let gravity and loads grow to their size."""
        for part in range(1, PARTS + 1):
            self._load(part / PARTS)
            end = self.steps + self.pace.part
            while self.steps < end:
                self._go()
                if self._unrest() <= 1e-3 / PARTS:  # of gravity: near enough while loads grow
                    break
        self.since, self.speeds = self._places(), []  # what moved faster under growing loads is no mechanism yet

    def rest(self, last: int) -> None:
        """Go on until nothing moves any more, at most a little beyond a step. Raises SettleError."""
        while self._unrest() > BALANCE or self.energy > 0.0:
            if self.steps > last:
                raise self._error()
            self._go()
            if self._unrest() <= BALANCE:
                self._stop()
            elif self._is_mechanism() and not (self.is_released and self.ways().max() <= LEAN_SHARE * self.smallest):
                raise self._error()

    def follow_support(self) -> None:
        """Let the inertial force of the supports' acceleration at time zero grow as far as it is carried at rest."""
        part = FIRST_SHARE if any(self.support) else 0.0
        parts = 1 if self.scheme.equilibrium is None else PARTS
        most = max(self.steps, parts * self.pace.part)  # as many as gravity took, or may have taken
        is_bounded = False
        while self.carried < 1.0 and part >= LAST_SHARE:
            scene, steps = self.scene, self.steps
            kept = [array.copy() for array in arrays_of(scene)]
            share = min(self.carried + part, 1.0)
            try:
                if not self.balance(share):
                    self._load(1.0, share)
                    self._go()
                self.rest(self.steps + most)
                self.carried = share
            except SettleError:
                _restore(scene, kept)
                self.scene, self.steps, self.energy, is_bounded = scene, steps, 0.0, True
            part *= 0.5 if is_bounded else 1.0

    def begin(self) -> None:
        """Make this time zero: clock and books begin anew, contacts stay as they are."""
        for name, values in self.leaving.items():
            self.bodies[name] = values
        world = self.scene.world
        clock, ledger = world.clock, world.ledger
        for name in clock.dtype.names or ():
            if name != "pair_count":
                clock[name] = 0
        for name in ledger.dtype.names or ():
            ledger[name] = 0.0
        ledger["largest_kinetic"][0] = self._kinetic()
        self.scheme.begin(self.scene)

    def _load(self, share: float, inertial: float = 0.0) -> None:
        world = self.scene.world
        for name, pull, pushed in zip(("gravity_x", "gravity_y"), self.gravity, self.support, strict=True):
            world.controls[name] = share * pull - inertial * pushed
        for name in FALLS:
            world.loads[name] = share * self.loads[name]

    def _go(self) -> None:
        """Take some steps; take all velocities away where the kinetic energy falls.

        Raises SettleError, and StoppedEarlyError.
        """
        self.before = self._places()
        self.steps += self.pace.call
        self.scene, status = self._advanced(self.scene, self.steps)
        energy = self._kinetic()
        far = self._farthest()
        if status != REACHED or not np.isfinite(energy) or far > MOVED_SHARE * self.smallest:
            raise self._error()
        if self.is_released and far <= LEAN_SHARE * self.smallest:
            self.lean = self.scene, [array.copy() for array in arrays_of(self.scene)]
        if energy < self.energy:
            self._stop()
        else:
            self.energy = energy
            self.speeds.append(float(np.sqrt(energy)))

    def _advanced(self, scene: schemes.AnyScene, last_step: int) -> tuple[schemes.AnyScene, int]:
        """Return a scene at a step, and its status. Raises StoppedEarlyError."""
        if why := self.stop():
            raise StoppedEarlyError(f"{why} while the scene settled; nothing is kept of that")
        return self.team.advance(scene, last_step)

    def _stop(self) -> None:
        for name in VELOCITIES:
            self.bodies[name] = 0.0
        self.scheme.halt(self.scene, self.count)
        self.energy = 0.0
        self.since, self.speeds = self._places(), []

    def _is_mechanism(self) -> bool:
        """Return True where contacts do not hold any more what moves, and nothing else will.

        Whatever vibrates about a place of rest slows down before it, and has come no farther than contacts give way,
        each at most by the deepest overlap: block after block they turn, by that over a side, and move what is above.
        """
        speeds = self.speeds
        if not speeds or len(speeds) % LOOKS:
            return False
        window = len(speeds) // WINDOWS
        last, before = speeds[-1] - speeds[-1 - window], speeds[-1 - window] - speeds[-1 - 2 * window]
        if not last >= STEADY * before > 0.0:
            return False
        change = self._places() - self.since
        way = float((schemes.corner_ways(change, self.bodies["radius"]) * self.is_free).max())
        x, y = self.bodies["x"][self.is_free], self.bodies["y"][self.is_free]
        slenderness = max(1.0, float(max(np.ptp(x), np.ptp(y))) / self.smallest)  # of all free blocks
        give = CHAIN * self.count * slenderness * self.scheme.give(self.scene)
        if way <= max(give, self.pace.least_share * self.smallest):
            return False
        return not any(self._meets(change * (share * self.smallest / way), share) for share in AHEAD)

    def _meets(self, change: Floats, share: float) -> bool:
        """Return True if blocks come to bear on one another on a way from where they are, that of some share."""
        now = schemes.outlines_of(self.scene.world)
        now = now.some(np.arange(now.kinds.size - 1))  # without the half-plane
        x, y, angle = self._places() + change
        places = {"x": x, "y": y, "cosine": np.cos(angle), "sine": np.sin(angle)}
        moved = {name: np.concatenate([one, getattr(now, name)[self.count :]]) for name, one in places.items()}
        later = now._replace(**moved)
        most = ARC * share**2 * self.smallest
        ground = float(self.scene.world.bodies[-1].y)
        below = (np.minimum(now.bottom, ground) - later.bottom)[: self.count] if np.isfinite(ground) else np.zeros(1)
        if (below > most).any():
            return True
        is_free = np.zeros(later.x.size, bool)
        is_free[: self.count] = self.is_free
        for one, other in overlap.near_pairs(later):
            chosen = is_free[one] | is_free[other]
            a, b = one[chosen], other[chosen]
            before = np.maximum(overlap.penetration(now.some(a), now.some(b)), 0.0)
            if (overlap.penetration(later.some(a), later.some(b)) - before > most).any():
                return True
        return False

    def _kinetic(self) -> float:
        bodies = self.bodies
        speeds = bodies["mass"] * (bodies["vx"] ** 2 + bodies["vy"] ** 2)
        return 0.5 * float(np.sum(speeds + bodies["inertia"] * bodies["spin"] ** 2))

    def _unrest(self) -> float:
        """Return how far the scene is from rest: BALANCE is near enough."""
        if not self.is_free.any():
            return 0.0
        if not self.steps:
            return np.inf
        change = self._places() - self.before
        return self.scheme.unrest(self.scene, self.is_free, change, self.smallest, self.scale)

    def _places(self) -> Floats:
        return np.stack([self.bodies[name] for name in ("x", "y", "angle")])

    def ways(self) -> Floats:
        """Return how far every block has come (m)."""
        return np.where(self.is_free, schemes.corner_ways(self._places() - self.start, self.bodies["radius"]), 0.0)

    def _farthest(self) -> float:
        """Return how far (m) anything has come."""
        return float(self.ways().max())

    def _error(self) -> SettleError:
        bodies = self.bodies
        speeds = np.hypot(bodies["vx"], bodies["vy"]) + bodies["radius"] * np.abs(bodies["spin"])
        fastest = int(np.nanargmax(np.where(self.is_free, speeds, -1.0)))
        ways = self.ways()
        far = int(np.nanargmax(ways))
        come = f"block {self.placed[far].name} has come {MILLI * float(ways[far]):.3g} mm"
        moves = f"block {self.placed[fastest].name} moves at {MILLI * float(speeds[fastest]):.3g} mm/s, {come}, after "
        what = f"{moves}{self.steps} steps" if speeds.any() else f"{come} without meeting anything that holds it"
        return SettleError(f"the scene {results.NOT_AT_REST} (start.settle): {what}")


class _BesideSystems(_Settlement):
    """Blocks and further systems on their way to rest together."""

    scene: Any  # Coupled

    def __init__(self, scene: Any, model: Model, team: schemes.Team, stop: Stop) -> None:
        super().__init__(scene, model, team, stop)
        self.is_released = True
        self.pace = self.pace._replace(call=CALL_BESIDE)
        self.others = [one for one in others_of(model) if one.system.relaxation is not None]
        self.taken = self.initial = 0.0  # J: from blocks; all that the scene held, and what came in with lifts
        self.is_still = False  # blocks are

    @property
    def parts(self) -> list[tuple[Relaxation, Any]]:
        """What each system needs to come to rest, with its arrays."""
        own = zip(self.others, self.scene.systems, strict=True)
        return [(one.system.relaxation, arrays) for one, arrays in own if one.system.relaxation is not None]

    def come_to_rest(self) -> None:
        """Bring blocks to rest alone, then the others beside still blocks, then all. Raises SettleError."""
        as_placed = self.scene, [array.copy() for array in arrays_of(self.scene)]
        if self.is_free.any():
            self._bear_own_weight()
        lifts = [relaxation.lifts(self.model) for relaxation, _ in self.parts]
        placed, self.start = self.start, self._places()  # soft springs give way by more than a fall
        for lift in range(1, max(lifts) + 1):
            self.lean = None
            try:
                self._fill_in(lift, lifts)
                self._relax_beside_still_blocks()
                self._relax()
            except SettleError:
                is_last = lift == max(lifts) and not self.is_still
                self.lean = self.lean if is_last else as_placed
                self.start = placed
                raise
        self.start = placed

    def _fill_in(self, lift: int, lifts: Sequence[int]) -> None:
        """Fill in a lift, where there are more than one, and take what the scene holds then as given."""
        before = balance.start_energy(self.scene) if lift > 1 else 0.0
        if max(lifts) > 1:
            filled = [
                relaxation.with_lift(self.model, arrays if lift > 1 else None, lift) if lift <= most else arrays
                for most, (relaxation, arrays) in zip(lifts, self.parts, strict=True)
            ]
            self.scene = self.scene._replace(systems=tuple(filled))
        self.scene, _ = self._advanced(self.scene, int(self.scene.world.clock[0].steps))  # contacts that it begins with
        self.initial += balance.start_energy(self.scene) - before

    def _bear_own_weight(self) -> None:
        """Bring blocks to rest under their weight, where that holds them without the others."""
        world = self.scene.world
        kept, alone = [array.copy() for array in arrays_of(world)], _Settlement(world, self.model, self.team, self.stop)
        alone.is_released, alone.loads = False, world.loads.copy()
        for name in FALLS:
            alone.loads[name] = 0.0
        try:
            alone.bear_loads()
            alone.begin()
        except SettleError:
            _restore(world, kept)
            alone.scene = world
        self.scene = self.scene._replace(world=alone.scene)
        for name in FALLS:
            self.scene.world.loads[name] = self.loads[name]

    def _relax_beside_still_blocks(self) -> None:
        world = self.scene.world
        kept = [array.copy() for array in arrays_of(world)]
        for name in (*HELD, *ACCELERATIONS):
            self.bodies[name] = 0
        is_free, self.is_free, self.is_still = self.is_free, np.zeros_like(self.is_free), True
        self._relax()
        self.is_free, self.is_still = is_free, False
        _restore(world, kept)  # contacts of bodies without mass are not kept
        self.scene = self.scene._replace(world=world)

    def _relax(self) -> None:
        """Go on until all is at rest where velocities were taken away. Raises SettleError."""
        self._stop()
        self.steps = int(self.scene.world.clock[0].steps)
        last = self.steps + MOST_BESIDE
        self._go()
        while self.energy > 0.0 or self._unrest() > BALANCE_BESIDE:
            if self.steps > last:
                raise self._error()
            self._go()

    def _farthest(self) -> float:
        own = zip(self.others, self.scene.systems, strict=True)
        changes = [one.system.state(arrays, one.count)[:2] - one.elements.start[:2] for one, arrays in own]
        return max([super()._farthest(), *(float(np.nanmax(np.hypot(*change))) for change in changes)])

    def _kinetic(self) -> float:
        return super()._kinetic() + sum(one.kinetic(arrays) for one, arrays in self.parts)

    def _stop(self) -> None:
        self.taken += super()._kinetic()
        super()._stop()
        for one, arrays in self.parts:
            one.halt(arrays)

    def _unrest(self) -> float:
        blocks = super()._unrest() if self.scale > 0.0 else 0.0
        return max([blocks, *(one.unrest(arrays, self.scene.world) for one, arrays in self.parts)])

    def books(self) -> dict[str, float]:
        """Return the energy (J) that damping took, and the residual of the ledger over that."""
        if self.leaving:
            return {}
        ledger = balance.energy_ledger(self.scene, self.initial - self.taken)
        damped = self.taken + float((ledger.model_extra or {}).get("soils_settling", 0.0))
        return {"damping_J": damped, "energy_error": abs(ledger.residual) / (damped or 1.0)}

    def begin(self) -> None:
        """Make this time zero, for all systems."""
        super().begin()
        for one, arrays in self.parts:
            one.begin(arrays)


def _restore(scene: schemes.AnyScene, kept: Sequence[NDArray[Any]]) -> None:
    """Give all arrays of a scene the values that they had."""
    for array, values in zip(arrays_of(scene), kept, strict=True):
        array[...] = values
