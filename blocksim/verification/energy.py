"""V15 impacts never gain kinetic energy, V23 the energy ledger of every shipped scenario."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import product
from math import log2, nan, radians
from pathlib import Path
from typing import TYPE_CHECKING

from blocksim.kernels.common.arrays import AT_REST, REACHED
from blocksim.scenario import Document, load_scenario, place_bodies
from blocksim.simulation.schemes import build_scene
from blocksim.verification.case import Row, Setting, absolute, at_least
from blocksim.verification.scene import GOLDEN, Simulation, Throw, Thrower, kinetic_energy

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

ANGLES = tuple(range(90))  # degrees
FRICTIONS = tuple(tenth / 10 for tenth in range(11))
LOSSY = (0.0, 0.3, 0.6, 0.9)  # restitutions
SAFETY = 0.05  # the default; the stiffest mode has frequency times step = 2 safety
PHASES = (0.1, 0.3, 0.5, 0.7, 0.9)  # of a step, at which an impact begins
ROUND_OFF = 1e-12
RIGID_LEDGER_TOLERANCE = 1e-11  # what impulses take is known to round-off
# Blocks of 1 to 10 MN, whose weights do 1e5 to 1e6 times the energy in play on their heights: every step rounds that by
# 1e-16, and the dam lies for 30 000 of them. Nothing else drifts: friction, impacts and loads balance to 1e-13. The
# slope of cells has 119 MJ of potential energy, and hardly anything in play at first.
HEAVY = {"dam": 1e-8, "toppling_slope": 1e-10, "voronoi_slope": 1e-10}
LEDGER_TOLERANCE = 1e-3
SOFT = 0.01  # stiffness scale of the quick size; crowds keep their own
LESS_SOFT = 0.1  # with driven bodies: what starts at full speed is off by half a step of it, before anything has fallen
STIFFER = 10.0  # where the scenario's own stiffness is too soft for a law
CROWD = 100  # blocks; scenes of more on springs are run for their first moments only
CROWD_END = 0.05  # s
CROWD_END_PARTICLES = 0.002  # s, for the models with boundary particles, which take fifty times as long
OF_SPRINGS = {"safety"}
SCENARIOS = Path(__file__).parents[2] / "scenarios"


def impacts(setting: Setting) -> Iterator[Row]:
    """Throw a block at 90 angles with 11 frictions and 5 restitutions; the largest gain counts."""
    throws = [
        Throw(radians(angle), friction, (GOLDEN * number) % 1.0)
        for number, (angle, friction) in enumerate(product(ANGLES, FRICTIONS))
    ]
    lossy = max(largest_gain(Thrower(setting, e), throws) for e in LOSSY)
    yield absolute("gain, e ≤ 0.9", "", 0.0, max(lossy, 0.0), ROUND_OFF)
    bound = (2.0 * SAFETY) ** 2 / 4.0 if setting.has_springs else ROUND_OFF
    yield absolute("gain, e = 1", "", 0.0, max(largest_gain(Thrower(setting, 1.0), throws), 0.0), bound)
    if setting.has_springs:
        yield order_of_gain(setting)


def order_of_gain(setting: Setting) -> Row:
    """Return how fast the gain of impacts on springs falls with the step."""
    smooth = [Throw(radians(angle), phase=phase) for angle, phase in product(ANGLES[::9], PHASES)]
    coarse, fine = (
        largest_gain(Thrower(setting, 1.0, time={"safety": safety}), smooth) for safety in (2.0 * SAFETY, SAFETY / 2.0)
    )
    return at_least("gain, e = 1, order in dt", "", 1.8, log2(coarse / fine) / 2.0 if fine > 0.0 else nan)


def largest_gain(thrower: Thrower, throws: Iterable[Throw]) -> float:
    """Return the largest gain of kinetic energy in an impact, as a share of that before; negative for a loss."""
    before = 0.5 * float(thrower.world.bodies[0].mass)  # 1 m/s
    return max(kinetic_energy(thrower.throw(throw)) / before - 1.0 for throw in throws)


def ledgers(setting: Setting) -> Iterator[Row]:
    """Run every shipped scenario, large ones for their first moments, and check the ledger at every output.

    All can have rigid contacts; those that ship with them have no springs.
    """
    for path in sorted(SCENARIOS.glob("*.toml")):
        if setting.has_springs and not load_scenario(path).time.has_springs:
            continue
        tolerance = LEDGER_TOLERANCE if setting.has_springs else HEAVY.get(path.stem, RIGID_LEDGER_TOLERANCE)
        is_whole = not setting.has_springs or len(place_bodies(load_scenario(path))) <= CROWD
        name = path.stem if is_whole else f"{path.stem}, first moments"
        yield absolute(name, "", 0.0, worst_residual(setting, path), tolerance)


def asked_of(setting: Setting) -> dict[str, object]:
    """Return the keys that a scenario must change for a setting."""
    asked = {"contact.model": setting.model, "contact.law": setting.law}
    if not setting.has_springs:
        return {**asked, "time.scheme": setting.scheme}
    usual = {"contact.model": Setting().model, "contact.law": Setting().law}
    return {key: value for key, value in asked.items() if value != usual[key]}


def without_springs(document: Document) -> Document:
    """Return a scenario without what only springs have in its table of time."""
    time = document.data.get("time")
    if not isinstance(time, Mapping):
        return document
    left = {key: value for key, value in time.items() if key not in OF_SPRINGS}
    return replace(document, data={**document.data, "time": left})


def worst_residual(setting: Setting, path: Path) -> float:
    """Return the largest residual of a run, as a share of the energy in play; NaN where the run fails.

    A scenario keeps its own model and law unless the setting asks for others than the defaults, or has rigid contacts;
    and its own step.
    """
    overrides = asked_of(setting)
    document = Document.read(path)
    own = document.build()
    is_crowd = len(place_bodies(own)) > CROWD
    if setting.quick and not is_crowd:
        is_driven = any(body.motion is not None for body in own.bodies)
        overrides["contact.stiffness_scale"] = LESS_SOFT if is_driven else SOFT
    if setting.law != Setting().law and (is_crowd or own.contact.model != Setting().model):
        # the scenario's own stiffness, meant for the linear law, is too soft for that of Hertz and Mindlin
        usual = overrides.get("contact.stiffness_scale", own.contact.stiffness_scale)
        overrides["contact.stiffness_scale"] = STIFFER * float(str(usual))
    if is_crowd and setting.has_springs:
        overrides["time.end"] = CROWD_END if setting.model == "surface" else CROWD_END_PARTICLES
    scenario = (document if setting.has_springs else without_springs(document)).with_values(overrides).build()
    run = Simulation(build_scene(scenario))
    outputs = round(scenario.time.end / scenario.output.every)
    worst = 0.0
    for k in range(1, outputs + 1):
        worst = max(worst, run.to_time(k * scenario.output.every).residual())
        if run.status != REACHED:
            break
    return worst if run.status in {REACHED, AT_REST} else nan
