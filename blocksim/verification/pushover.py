"""V26: a wall and a block that an actuator moves slowly, against statics at the displacement that they have come to.

A rigid wall (b x H) below a beam turns about its toe. The beam's centre, H0 above the foot, where a force N presses it
down, has moved by u = b/2 (1 - cos t) + H0 sin t. With the weights W of the wall and B of the beam, moments about the
toe give

    V (H0 cos t + b/2 sin t) = W (b/2 cos t - H/2 sin t) + (N + B) (b/2 cos t - H0 sin t)

where N travels with the beam; where its line stays, its arm is b/2. Below a beam that does not turn the wall stands on
its toe and on the opposite corner of its head. By virtual work

    V (H cos t + b sin t) = (N + B + W/2) (b cos t - H sin t),   u = b (1 - cos t) + H sin t.

A block that slides to and fro by u loses 4 mu N u in a cycle.
"""

from collections.abc import Iterator, Mapping, Sequence
from math import cos, sin
from typing import Any

import numpy as np

from blocksim.scenario import scenario_from_mapping
from blocksim.simulation.instruments import ProbeSeries
from blocksim.simulation.run import simulate
from blocksim.verification.case import Row, Setting, relative
from blocksim.verification.closed_forms import GRAVITY

WIDTH, HEIGHT, BEAM, DEPTH = 1.0, 1.2, 0.25, 0.2  # m: of the wall, and height of the beam on it
HEAD = HEIGHT + 0.5 * BEAM  # m, at which the actuator acts
DENSITY = 2039.0  # kg/m3
WALL, LOADING = (DENSITY * WIDTH * height * DEPTH * GRAVITY for height in (HEIGHT, BEAM))  # N: weights
PRESS = 50e3  # N
FRICTION = 0.9  # of a wall that turns
DISPLACEMENTS = (0.002, 0.01, 0.02, 0.04, 0.078)  # m
BEYOND = 1.03  # times the last displacement: there the head stops
STEEPEST, POINTS = 0.2, 10_001  # rad: turns of the wall, of which the one of a displacement is found
RUBBED = 0.4  # friction of a block that slides
AMPLITUDE = 0.02  # m


def pushover(setting: Setting) -> Iterator[Row]:
    """Push the head of a wall, and a block to and fro: forces, the energy lost in a cycle, and work in the ledger."""
    ways = DISPLACEMENTS[0:3:2] if setting.quick else DISPLACEMENTS
    for name, line, guide in (
        ("N travels", "body", "none"),
        ("N stays", "space", "none"),
        ("head parallel", "body", "no rotation"),
    ):
        jack, _ = _push(setting, line, guide, BEYOND * ways[-1])
        for way in ways:
            found, order = jack["displacement"], slice(None, int(np.argmax(jack["displacement"])) + 1)
            force = float(np.interp(way, found[order], jack["force"][order]))
            yield relative(f"V at {1e3 * way:.3g} mm, {name}", "kN", 1e-3 * _statics(way, name), 1e-3 * force, 5e-3)
    bodies = [{"block": "wall", "name": "head", "x": 0.0, "y": 0.5 * HEIGHT}]
    cycles = {"kind": "cycles", "amplitudes": [AMPLITUDE], "repeats": 2, "rate": 0.02}
    jack, to_loads = _run(setting, bodies, [], cycles, RUBBED, {"point": [0.0, -0.49 * HEIGHT]})
    half = len(jack) // 2
    way = 2.0 * float(np.ptp(jack["displacement"][half:]))
    lost = float(jack["work"][-1] - jack["work"][half])
    yield relative("energy lost in a cycle of sliding", "J", RUBBED * WALL * way, lost, 5e-3)
    yield relative("work in the ledger", "J", float(jack["work"][-1]), -to_loads, 1e-9)


def _statics(way: float, name: str) -> float:
    """Return the force (N) by the equations of this module at a displacement (m) of the head."""
    b, head = WIDTH, HEIGHT if name == "head parallel" else HEAD
    half = b if name == "head parallel" else 0.5 * b
    turns = np.linspace(0.0, STEEPEST, POINTS)
    t = float(np.interp(way, half * (1.0 - np.cos(turns)) + head * np.sin(turns), turns))
    if name == "head parallel":
        return (PRESS + LOADING + 0.5 * WALL) * (b * cos(t) - head * sin(t)) / (head * cos(t) + b * sin(t))
    arm = half * cos(t) - head * sin(t)
    moment = WALL * (half * cos(t) - 0.5 * HEIGHT * sin(t)) + LOADING * arm
    return (moment + PRESS * (half if name == "N stays" else arm)) / (head * cos(t) + half * sin(t))


def _push(setting: Setting, line: str, guide: str, farthest: float) -> tuple[ProbeSeries, float]:
    bodies = [
        {"block": "wall", "x": 0.0, "y": 0.5 * HEIGHT},
        {"block": "beam", "name": "head", "x": 0.0, "y": HEAD, "guide": guide},
    ]
    down = {"kind": "force", "body": "head", "magnitude": PRESS, "direction": "-90 deg", "line": line}
    return _run(setting, bodies, [down], {"kind": "ramp", "to": farthest, "rate": 0.01}, FRICTION)


def _run(
    setting: Setting,
    bodies: Sequence[Mapping[str, object]],
    loads: Sequence[Mapping[str, object]],
    path: Mapping[str, object],
    friction: float,
    more: Mapping[str, object] | None = None,
) -> tuple[ProbeSeries, float]:
    """Return what an actuator at the body `head` records, and what the ledger says that loads have received (J)."""
    sides = {"width": WIDTH, "length": DEPTH, "material": "stone"}
    stepping: dict[str, Any] = {} if setting.has_springs else {"scheme": setting.scheme}
    data = {
        "schema": 1,
        "name": "actuators",
        "materials": {"stone": {"density": DENSITY, "young_modulus": 15e9, "poisson_ratio": 0.2}},
        "blocks": {"wall": {**sides, "height": HEIGHT}, "beam": {**sides, "height": BEAM}},
        "bodies": bodies,
        "loads": loads,
        "actuators": [{"name": "jack", "body": "head", "displacement": path, **(more or {})}],
        "friction": {"block_block": friction, "block_ground": friction},
        "contact": {"restitution": 0.0, "law": setting.law, "model": setting.model},
        "start": {"settle": True},
        "time": {"stop_at_rest": False, **stepping},
        "output": {"every": 0.01},
    }
    result = simulate(scenario_from_mapping(data))
    return result.probes["jack"], result.summary.energy_J.to_loads
