"""V15 impacts never gain kinetic energy, V23 the energy ledger of every shipped scenario."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import product
from math import log2, nan, radians
from pathlib import Path

from blocksim.kernels.common.arrays import AT_REST, REACHED
from blocksim.scenario import Document, place_bodies
from blocksim.simulation.schemes import build_scene
from blocksim.verification import case, scene

ANGLES = tuple(range(90))  # degrees
FRICTIONS = tuple(tenth / 10 for tenth in range(11))
LOSSY = (0.0, 0.3, 0.6, 0.9)  # restitutions
SAFETY = 0.05  # the default; the stiffest mode has frequency times step = 2 safety
PHASES = (0.1, 0.3, 0.5, 0.7, 0.9)  # of a step, at which an impact begins
ROUND_OFF = 1e-12
RIGID_LEDGER_TOLERANCE = 1e-11  # what impulses take is known to round-off
# Blocks of 1 to 10 MN, whose weights do 1e5 to 1e6 times the energy in play on their heights: every step rounds that by
# 1e-16, and the dam lies for 30 000 of them. Nothing else drifts: friction, impacts and loads balance to 1e-13. The
# slope of cells has 119 MJ of potential energy, and hardly anything in play at first. The granite wall has its 100 kN
# at once here: the work of loads is the trapezoid rule's, and that of the first substep begins at none.
HEAVY = {"dam": 1e-8, "toppling_slope": 1e-10, "voronoi_slope": 1e-10, "granite_wall": 1e-5}
LEDGER_TOLERANCE = 1e-3
SOFT = 0.01  # stiffness scale of the quick size; crowds keep their own
LESS_SOFT = 0.1  # with driven bodies: what starts at full speed is off by half a step of it, before anything has fallen
STIFFER = 10.0  # where the scenario's own stiffness is too soft for a law
CROWD = 100  # blocks; scenes of more on springs are run for their first moments only
CROWD_END = 0.05  # s
CROWD_END_PARTICLES = 0.002  # s, for the models with boundary particles, which take fifty times as long
SCENARIOS = Path(__file__).parents[2] / "scenarios"


def impacts(setting: case.Setting) -> Iterator[case.Row]:
    """Throw a block at 90 angles with 11 frictions and 5 restitutions; the largest gain counts.

    With springs, also how fast the gain of elastic impacts without friction falls with the step.
    """
    throws = [
        scene.Throw(radians(angle), friction, (scene.GOLDEN * number) % 1.0)
        for number, (angle, friction) in enumerate(product(ANGLES, FRICTIONS))
    ]
    lossy = max(largest_gain(scene.Thrower(setting, e), throws) for e in LOSSY)
    yield case.Row("gain, e ≤ 0.9", "", 0.0, max(lossy, 0.0), ROUND_OFF)
    bound = (2.0 * SAFETY) ** 2 / 4.0 if setting.has_springs else ROUND_OFF
    yield case.Row("gain, e = 1", "", 0.0, max(largest_gain(scene.Thrower(setting, 1.0), throws), 0.0), bound)
    if setting.has_springs:
        smooth = [scene.Throw(radians(angle), phase=phase) for angle, phase in product(ANGLES[::9], PHASES)]
        safeties = (2.0 * SAFETY, SAFETY / 2.0)
        coarse, fine = (largest_gain(scene.Thrower(setting, 1.0, time={"safety": one}), smooth) for one in safeties)
        yield case.at_least("gain, e = 1, order in dt", "", 1.8, log2(coarse / fine) / 2.0 if fine > 0.0 else nan)


def largest_gain(thrower: scene.Thrower, throws: Iterable[scene.Throw]) -> float:
    """Return the largest gain of kinetic energy in an impact, as a share of that before; negative for a loss."""
    before = 0.5 * float(thrower.world.bodies[0].mass)  # 1 m/s
    return max(scene.kinetic_energy(thrower.throw(throw)) / before - 1.0 for throw in throws)


def ledgers(setting: case.Setting) -> Iterator[case.Row]:
    """Run every shipped scenario, large ones for their first moments, and check the ledger at every output.

    The largest residual of a run counts, as a share of the energy in play; NaN where the run fails. A scenario keeps
    its own model and law unless the setting asks for others than the defaults, or has rigid contacts; and its own step.
    All can have rigid contacts; those that ship with them have no springs.
    """
    usual = case.Setting()
    for path in sorted(SCENARIOS.glob("*.toml")):
        document = Document.read(path)
        own = document.build()
        if setting.has_springs and not own.time.has_springs:
            continue
        is_crowd = len(place_bodies(own)) > CROWD
        name, tolerance = path.stem, LEDGER_TOLERANCE
        changes: dict[str, object] = {"contact.model": setting.model, "contact.law": setting.law}
        if not setting.has_springs:
            tolerance = HEAVY.get(path.stem, RIGID_LEDGER_TOLERANCE)
            changes["time.scheme"] = setting.scheme
            time = document.data.get("time")
            if isinstance(time, Mapping):  # without what only springs have
                left = {key: value for key, value in time.items() if key != "safety"}
                document = replace(document, data={**document.data, "time": left})
        else:
            changes = {key: value for key, value in changes.items() if value not in {usual.model, usual.law}}
            if is_crowd:
                name = f"{path.stem}, first moments"
                changes["time.end"] = CROWD_END if setting.model == usual.model else CROWD_END_PARTICLES
        if setting.quick and not is_crowd:
            is_driven = any(body.motion is not None for body in own.bodies)
            changes["contact.stiffness_scale"] = LESS_SOFT if is_driven else SOFT
        if setting.law != usual.law and (is_crowd or own.contact.model != usual.model):
            # the scenario's own stiffness, meant for the linear law, is too soft for that of Hertz and Mindlin
            stiffness_scale = changes.get("contact.stiffness_scale", own.contact.stiffness_scale)
            changes["contact.stiffness_scale"] = STIFFER * float(str(stiffness_scale))
        scenario = document.with_values(changes).build()
        run, worst = scene.Simulation(build_scene(scenario)), 0.0  # the largest residual over the energy in play
        for k in range(1, round(scenario.time.end / scenario.output.every) + 1):
            worst = max(worst, run.to_time(k * scenario.output.every).residual())
            if run.status != REACHED:
                break
        yield case.Row(name, "", 0.0, worst if run.status in {REACHED, AT_REST} else nan, tolerance)
