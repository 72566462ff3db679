"""Springs and dashpots, small explicit steps; contacts as a table of the forces of springs and dashpots now."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from blocksim.kernels.common import arrays, systems, tolerances
from blocksim.kernels.explicit import models, step
from blocksim.scenario.overlap import penetration
from blocksim.simulation import schemes, trajectory
from blocksim.world import build
from blocksim.world.joints import places_of

WORK_SPACE = ("points", "matrices", "before", "action")


def explicit_contacts(world: arrays.World, blocks: int) -> trajectory.Rows:
    """Return all contacts in the order of pairs and slots; bodies from number `blocks` on are ground and walls."""
    pairs = world.pairs.view(np.ndarray)[: int(world.clock[0].pair_count)]
    pair, place = np.nonzero(np.arange(world.contacts.shape[1]) < pairs["active"][:, None])
    contacts = world.contacts.view(np.ndarray)[pair, place]
    a, b = pairs["a"][pair].astype(np.intp), pairs["b"][pair].astype(np.intp)
    rows = np.zeros(len(contacts), trajectory.CONTACT_ROW)
    rows["body_a"], rows["body_b"] = a, np.where(b < blocks, b, trajectory.SUPPORT)
    for name, values in zip(list(trajectory.UNITS)[:4], places_of(world, contacts, a, b), strict=True):
        rows[name] = values
    rows["overlap"] = contacts["depth"]
    rows["normal_force"] = contacts["normal_force"]
    rows["shear_force"] = -contacts["shear_force"]  # kept as the resistance to slip of a along the tangent
    if "nx" not in (contacts.dtype.names or ()):
        # what a stiffness does that changes by slip and tilt: a force along the tangent, and a couple, that of a normal
        # force that acts a little beside its corner; without a normal force there is no such place
        power = float(world.controls[0].exponent) + 1.0
        stored = rows["overlap"] ** power / power  # per stiffness
        rows["shear_force"] -= pairs["slide"][pair] * stored
        normal = rows["normal_force"]
        way = np.divide(pairs["turn"][pair] * stored, normal, out=np.zeros_like(normal), where=normal > 0.0)
        rows["x"] -= way * rows["normal_y"]
        rows["y"] += way * rows["normal_x"]
    return rows


def with_own_work_space(world: arrays.World) -> arrays.World:
    """Return the same world with arrays of its own where one pair is worked on."""
    return world._replace(**{name: getattr(world, name).copy() for name in WORK_SPACE})


def evaluate_anew(scene: Any, _before: arrays.Records) -> bool:
    """Have contacts and what bears a block evaluated at this moment, as if after a step of no length.

    What bears a block may have changed without a contact that begins or ends: stiffness is measured and all sums of it
    are made again.
    """
    clock = scene.world.clock[0]
    clock.next_update = clock.next_share = clock.steps
    clock.is_started = 0
    scene.world.bodies["is_asked"] = 1
    for name in ("normal_left", "shear_left"):
        scene.world.pairs[name] = 0
    return True


def _depths(world: arrays.World) -> tuple[Any, NDArray[np.float64]]:
    """Return the pairs of a world, and the largest overlap (m) of contacts of each."""
    count = int(world.clock[0].pair_count)
    pairs, contacts = world.pairs[:count], world.contacts[:count]
    is_active = np.arange(contacts.shape[1]) < pairs["active"][:, np.newaxis]
    return pairs, np.where(is_active, contacts["depth"], 0.0).max(axis=1, initial=0.0)


def overlaps_of_springs(scene: Any) -> schemes.Overlaps:
    """Return how deep bodies overlap: by contacts, or where these have lost them, by outlines."""
    world = scene.world
    pairs, deepest = _depths(world)
    is_pressed = deepest > pairs["limit"]
    shapes = schemes.outlines_of(world)
    below = world.bodies[-1].y - shapes.bottom[pairs["a"]]
    inside = penetration(shapes.some(pairs["a"]), shapes.some(pairs["b"]))
    lost = np.where(is_pressed, 0.0, np.where(pairs["b"] == world.bodies.size - 1, below, inside))
    limit = pairs["limit"]
    if world.controls[0].model != models.SURFACE:
        widths = world.bodies["least_width"]
        middle = tolerances.MIDDLE * np.minimum(widths[pairs["a"]], widths[pairs["b"]])
        limit = np.where(is_pressed, limit, np.minimum(_reach(world), middle))
    return schemes.Overlaps(pairs["a"], pairs["b"], np.maximum(deepest, lost), limit)


def _reach(world: arrays.World) -> float:
    """Return how deep (m) the particles of boundaries may lie in one another; see blocksim.kernels.explicit.contact."""
    controls = world.controls[0]
    rows = tolerances.ROWS_APART * controls.particle_size
    return float(controls.support if controls.model == models.KERNEL else rows)


def particle_depth_warning(scene: Any, overlaps: schemes.Overlaps) -> str:
    """Return what limits the deepest overlap where that is how far particles reach; nothing where it is not."""
    model, reach = scene.world.controls[0].model, _reach(scene.world)
    if model == models.SURFACE or overlaps.limit[np.nanargmax(overlaps.depth / overlaps.limit)] != reach:
        return ""
    rows = f"{tolerances.ROWS_APART:g} contact.particle_spacing"
    what = "the reach of the kernel" if model == models.KERNEL else rows
    return f"an overlap exceeds {what}, {1e3 * reach:.3g} mm, beyond which particles lose one another"


SURFACE, PARTICLES, SURFACE_OF_OUTLINES = "surface", "with-particles", "outlines-with-springs"  # sets of machine code
POLYGON = {"any": {"sides": 4, "radius": 0.5, "depth": 1.0, "material": "any"}}


def _inside(change: Callable[..., Any]) -> Callable[..., systems.Coupled]:
    """Return what changes the world of a scene with further systems."""
    return lambda scene, *values: scene._replace(world=change(scene.world, *values))


def equilibrium(*scene: Any) -> Any:
    """Bring a scene to equilibrium without time; see blocksim.statics.spring_equilibrium."""
    from blocksim.statics import spring_equilibrium  # noqa: PLC0415 - scipy takes a third of a second

    return spring_equilibrium.equilibrium(*scene)


WORLDS = schemes.Scheme(
    name="explicit",
    scene_type=arrays.World,
    construction=build.EXPLICIT,
    advance=step.advance,
    advance_in_team=step.advance_in_team,
    advance_members=step.advance_members,
    least_bodies=schemes.BODIES_A_THREAD,
    with_more_room=build.with_more_room,
    with_threads=build.with_threads,
    threads_of=lambda scene: int(scene.world.shares.size),
    for_another_thread=with_own_work_space,
    after_event=evaluate_anew,
    kernels=lambda model: SURFACE if model == "surface" else PARTICLES,
    of_outlines={SURFACE: SURFACE_OF_OUTLINES},
    kernel_sets={
        SURFACE: {},
        PARTICLES: {"contact": {"model": "kernel", "particle_spacing": 0.1}},  # the code serves all models of particles
        SURFACE_OF_OUTLINES: {"blocks": POLYGON},
    },
    equilibrium=equilibrium,
    give=lambda scene: float(_depths(scene.world)[1].max(initial=0.0)),
    ledger=step.LEDGER_ROW,
    measure=step.measure,
    contacts=lambda scene, blocks: explicit_contacts(scene.world, blocks),
    overlaps=overlaps_of_springs,
    lost_contact=particle_depth_warning,
)
COUPLED = replace(
    WORLDS,
    scene_type=systems.Coupled,
    equilibrium=None,
    advance=lambda scene, last_step: int(step.advance_coupled_alone(scene, last_step)),
    advance_in_team=step.advance_coupled_in_team,
    advance_members=None,
    with_more_room=_inside(build.with_more_room),
    with_threads=_inside(build.with_threads),
    for_another_thread=_inside(with_own_work_space),
    measure=lambda scene, row: step.measure(scene.world, row),
)
EXPLICIT = replace(WORLDS, with_systems=COUPLED)
