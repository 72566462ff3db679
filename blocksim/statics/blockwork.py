"""What statics needs of a scenario: blocks, joints, friction and sustained forces; and why some have no such answer."""

import math
from collections.abc import Iterator
from typing import NamedTuple, Self

import numpy as np

from blocksim.errors import InvalidInputError
from blocksim.scenario import Model, geometry
from blocksim.scenario.models import loads
from blocksim.world.bodies import Layout, layout_of
from blocksim.world.joints import Assembly, Floats, applied_forces

MOST_BLOCKS = 300  # up to so many statics is asked unasked: more take longer than what it is asked for


class Blockwork(NamedTuple):
    """Free blocks (n), the points of their joints (p), and what acts on them from time zero on."""

    names: tuple[str, ...]
    assembly: Assembly
    friction: Floats  # (p,) static, of the pair of each point
    masses: Floats  # (n,) kg
    forces: Floats  # (n, 3) N, N, N m about the centroids
    gravity: float  # m/s2
    tilt: float  # rad, of the ground
    size: float  # m: half of the diagonal of a box around all

    @classmethod
    def of(cls, model: Model) -> Self:
        """Return the structure of a scenario as it is placed. Raises InvalidInputError where statics has no answer."""
        scenario, reason = model.scenario, why_not_sustained(model)
        if reason:
            raise InvalidInputError(f"statics: {reason}")
        layout = layout_of(model)
        free = {number for number, body in enumerate(layout.placed) if not body.fixed}
        if not free:
            raise InvalidInputError("statics: no block is free")
        assembly = Assembly.of(layout, free)
        loose = free.difference(assembly.blocks if assembly is not None else ())
        if assembly is None or loose:
            name = layout.placed[min(loose)].name
            raise InvalidInputError(f"statics: block {name} rests on nothing; it falls until it meets something")
        blocks = [layout.placed[number] for number in assembly.blocks]
        low, high = geometry.box_of([body.ground_point(x, y) for body in blocks for x, y in body.corners])
        forces = applied_forces(layout, assembly.blocks)
        guided = [place for place, body in enumerate(blocks) if body.guided]  # the guide takes all moments
        forces[guided, 2] = 0.0
        rates = [one.copy() for one in (assembly.across, assembly.along)]
        for one in rates:
            one[..., 2][np.isin(assembly.places, guided)] = 0.0
        return cls(
            tuple(body.name for body in blocks),
            assembly._replace(across=rates[0], along=rates[1]),
            _friction(layout, assembly),
            np.array([body.mass for body in blocks]),
            forces,
            scenario.gravity.magnitude,
            scenario.ground.tilt,
            0.5 * float(np.hypot(*np.subtract(high, low))),
        )

    @property
    def horizontal(self) -> Floats:
        """The forces (N, N, N m; (n, 3)) of a horizontal acceleration of gravity's size, towards +x."""
        return np.outer(self.masses * self.gravity, (math.cos(self.tilt), -math.sin(self.tilt), 0.0))

    def has_joints_of(self, other: Self) -> bool:
        """Return True if the other one has the same joints at the same places with the same friction."""
        same = [(one.one, one.other) for one in self.assembly.joints] == [
            (one.one, one.other) for one in other.assembly.joints
        ]
        pairs = zip((*self.assembly[3:], self.friction), (*other.assembly[3:], other.friction), strict=True)
        return same and all(np.shape(one) == np.shape(two) and np.allclose(one, two, 1e-12, 0.0) for one, two in pairs)


def _friction(layout: Layout, assembly: Assembly) -> Floats:
    """Return the coefficients of static friction of all points, (p,)."""
    codes = {(one.material, one.depth): code for code, one in enumerate(layout.classes) if not one.is_ground}
    classes = [codes[body.material, body.depth] for body in layout.placed]
    classes += [*layout.slabs["contact_class"].tolist(), 0]
    pairs = ((classes[joint.one], classes[joint.other]) for joint in assembly.joints)
    return np.array([layout.interactions[a][b].static_friction for a, b in pairs])[assembly.joint]


def why_not_sustained(model: Model) -> str:
    """Return in words what else than loads that are the same from time zero on acts in a scenario; empty if nothing."""
    return next(_others(model), "")


def _others(model: Model) -> Iterator[str]:
    """Yield what acts beside sustained loads."""
    scenario = model.scenario
    if scenario.systems:
        yield f"{next(iter(scenario.systems))} act on the blocks, whose thrust a run finds"
    if scenario.motion is not None:
        yield "supports move"
    if scenario.actuators:
        yield "actuators move the blocks"
    if scenario.events:
        yield "events change the structure"
    for body in model.bodies:
        if body.driven:
            yield f"body {body.name} is driven"
        if body.vx or body.vy or body.spin:
            yield f"body {body.name} moves at the start"
    for number, load in enumerate(scenario.loads, start=1):
        stretches = loads.stretches_of(load, scenario.ground.tilt)
        if any(one.rate != 0.0 or one.value != stretches[0].value for one in stretches):
            yield f"load {load.name or number} changes with time"
