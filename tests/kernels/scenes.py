"""Scenes of the tests of kernels: single steps of blocks in any poses with rigid contacts, and outlines.

SI units, angles in rad.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, sin
from typing import TYPE_CHECKING, Any

import numpy as np

from blocksim.kernels.common.arrays import TEAM_SIZE
from blocksim.kernels.common.integrate import renew_rotations
from blocksim.kernels.nonsmooth.motion import load_states
from blocksim.kernels.nonsmooth.narrow_phase import find_manifolds
from blocksim.kernels.nonsmooth.neighbours import update_pairs
from blocksim.kernels.nonsmooth.packs import gather, pack_all
from blocksim.kernels.nonsmooth.step import substep
from blocksim.scenario.geometry import centre_outline, regular
from blocksim.scenario.models.timeline import Nonsmooth as Stepping
from blocksim.simulation.schemes import build_scene
from blocksim.verification.scene import HEIGHT, WIDTH, CaseScene
from blocksim.world.nonsmooth import with_more_constraints
from tests.kernels.references import turning

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from blocksim.kernels.common.arrays import Records
    from blocksim.kernels.nonsmooth.arrays import Nonsmooth
    from blocksim.scenario import Scenario
    from blocksim.scenario.geometry import Corners

STEP = 1e-3  # s, unless a test says otherwise
ENDLESS = 1e3  # s: tests step as far as they want
RIGID = {"scheme": "nonsmooth"}
RADIUS = 0.02
HEXAGON = regular(6, RADIUS)
TRIANGLE = centre_outline([(0.0, 0.0), (0.04, 0.0), (0.012, 0.03)])  # its centroid is not over the middle of its base
NAMES = ("x", "y", "angle", "vx", "vy", "spin")


def rigid(scenario: Scenario, **stepping: Any) -> Scenario:
    """Return a scenario with rigid contacts; keywords are keys of [time]."""
    kept = {"stop_at_rest": scenario.time.stop_at_rest, "end": scenario.time.end}
    time = Stepping(**{"scheme": "nonsmooth", "step": STEP, "force_step": True, **kept, **stepping})
    return scenario.model_copy(update={"time": time})


@dataclass(frozen=True)
class Block:
    """A block in any pose, with its velocities."""

    x: float = 0.0
    y: float = 0.0
    angle: float = 0.0
    vx: float = 0.0
    vy: float = 0.0
    spin: float = 0.0
    width: float = WIDTH
    height: float = HEIGHT
    fixed: bool = False
    outline: tuple[tuple[float, float], ...] = ()  # m, in place of width and height

    @property
    def shape(self) -> dict[str, object]:
        """Return what its body table has for it in a CaseScene."""
        sides: dict[str, object] = {"width": self.width, "height": self.height}
        return {"outline": [list(corner) for corner in self.outline]} if self.outline else sides


def posed(blocks: Sequence[Block], **values: Any) -> Nonsmooth:
    """Return blocks in any poses, overlapping ones too, before their first step; keywords of [time] go there."""
    stepping = {name: values.pop(name) for name in list(values) if name in Stepping.model_fields}
    size = max([1.0, *(abs(place) for one in blocks for corner in one.outline for place in corner)])
    apart = [{"x": 3.0 * size * i, "y": 2.0 * size, "fixed": one.fixed, **one.shape} for i, one in enumerate(blocks)]
    scene: Any = build_scene(rigid(CaseScene(apart, time=RIGID, **values).scenario(), end=ENDLESS, **stepping))
    place(scene, blocks)
    load_states(scene)
    scene.world.clock[0].is_started = 1
    scene.world.team[TEAM_SIZE] = 1
    return scene  # type: ignore[no-any-return]


def place(scene: Nonsmooth, blocks: Sequence[Block]) -> None:
    """Put the blocks of a scene elsewhere, with their velocities."""
    for body, block in zip(scene.world.bodies, blocks, strict=False):
        for name in NAMES:
            body[name] = getattr(block, name)
    renew_rotations(scene.world.bodies)


def listed(scene: Nonsmooth) -> Nonsmooth:
    """Return a scene with the pairs of its bodies as they are now, in arrays large enough."""
    while not update_pairs(scene):
        scene = with_more_constraints(scene)
    return scene


def collided(scene: Nonsmooth) -> Nonsmooth:
    """Return a scene with the manifolds of its pairs, packed in packs."""
    scene = listed(scene)
    find_manifolds(scene, 0, int(scene.contacts.stepping[0].constraint_count))
    gather(scene.contacts, scene.begins)
    pack_all(scene.contacts, 0, int(scene.contacts.stepping[0].pack_count))
    return scene


def after_substep(blocks: Sequence[Block], *, is_first: bool = False, **values: Any) -> Nonsmooth:
    """Return blocks after the first substep of a step; the impulses are in the packs, velocities in the states."""
    scene = collided(posed(blocks, **values))
    substep(scene, 0, 0, is_first, scene.contacts.impact_lanes)
    return scene


def pairs_of(scene: Nonsmooth) -> set[tuple[int, int]]:
    """Return the bodies of all listed pairs."""
    constraints = listed_constraints(scene)
    return set(zip(constraints.a.tolist(), constraints.b.tolist(), strict=True))


def listed_constraints(scene: Nonsmooth) -> Any:
    """Return the constraints there are."""
    return scene.contacts.constraints[: scene.contacts.stepping[0].constraint_count]


def velocities(states: Records) -> NDArray[np.float64]:
    """Return vx, vy and spin of all records, a row each."""
    return np.array([states[name] for name in ("vx", "vy", "spin")]).T.copy()


def pile(random: np.random.Generator, columns: int, rows: int, rate: float = 0.3) -> list[Block]:
    """Return blocks in columns on the ground that nearly touch or overlap a little, and move at random (m/s)."""
    return [
        Block(
            1.01 * WIDTH * i + float(random.uniform(-3e-4, 3e-4)),
            HEIGHT * (j + 0.5) + float(random.uniform(-2e-5, 4e-5)),
            float(random.uniform(-2e-3, 2e-3)),
            rate * float(random.normal()),
            rate * float(random.normal()),
            5.0 * rate * float(random.normal()),
        )
        for j in range(rows)
        for i in range(columns)
    ]


def rectangle(width: float = WIDTH, height: float = HEIGHT) -> Corners:
    """Return the outline of a rectangle."""
    return centre_outline([(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)])


def turned(outline: Corners, angle: float) -> NDArray[np.float64]:
    """Return the corners (n, 2) of an outline turned by an angle (rad)."""
    return np.asarray(np.array(outline) @ turning(angle))


def depth_below(outline: Corners, angle: float = 0.0) -> float:
    """Return how far (m) a polygon reaches below its centroid."""
    return -float(turned(outline, angle)[:, 1].min())


def random_outline(random: Any, size: float = RADIUS) -> Corners:
    """Return a convex polygon of 3 to 9 corners, some of them sharp, at random."""
    while True:
        angles = np.sort(random.uniform(0.0, 2.0 * pi, int(random.integers(3, 10))))
        steps = np.diff([*angles, angles[0] + 2.0 * pi])
        if steps.min() > 0.15 and steps.max() < 2.8:
            stretch = random.uniform(0.4, 1.0)
            return centre_outline([(size * cos(one), stretch * size * sin(one)) for one in angles.tolist()])
