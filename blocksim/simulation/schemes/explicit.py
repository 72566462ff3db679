"""Springs and dashpots, small explicit steps; contacts as a table of the forces of springs and dashpots now."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from blocksim.kernels.common.arrays import HALF, World
from blocksim.kernels.explicit.energy import LEDGER_ROW, measure
from blocksim.kernels.explicit.ensemble import advance_members
from blocksim.kernels.explicit.laws import HERTZ_MINDLIN, LINEAR
from blocksim.kernels.explicit.outlines import MOST_CORNERS
from blocksim.kernels.explicit.step import advance, advance_in_team
from blocksim.simulation.contacts import SUPPORT, UNITS, Rows, empty_rows
from blocksim.simulation.schemes.coupled import coupled_scheme
from blocksim.simulation.schemes.scheme import Scheme
from blocksim.world.build import EXPLICIT as CONSTRUCTION
from blocksim.world.build import with_more_room, with_threads

WORK_SPACE = ("points", "matrices", "before", "action")
ENERGIES = {LINEAR: (0.5, 2.0), HERTZ_MINDLIN: (0.4, 2.5)}  # stored per stiffness: factor, power of the overlap
Indices = NDArray[np.intp]
SIDES_X, SIDES_Y = (-1.0, 1.0, 1.0, -1.0), (-1.0, -1.0, 1.0, 1.0)  # of the corners, counter-clockwise from lower left


def explicit_contacts(world: World, blocks: int) -> Rows:
    """Return all contacts in the order of pairs and slots; bodies from number `blocks` on are ground and walls."""
    pairs = world.pairs[: int(world.clock[0].pair_count)]
    pair, place = np.nonzero(np.arange(world.contacts.shape[1]) < pairs["active"][:, None])
    contacts = world.contacts[pair, place]
    a, b = pairs["a"][pair].astype(np.intp), pairs["b"][pair].astype(np.intp)
    rows = empty_rows(len(contacts))
    rows["body_a"], rows["body_b"] = a, np.where(b < blocks, b, SUPPORT)
    for name, values in zip(list(UNITS)[:4], _places(world, contacts, a, b), strict=True):
        rows[name] = values
    rows["overlap"] = contacts["depth"]
    rows["normal_force"] = contacts["normal_force"]
    rows["shear_force"] = -contacts["shear_force"]  # kept as the resistance to slip of a along the tangent
    if "nx" not in (contacts.dtype.names or ()):
        _add_bearing(rows, world, pairs[pair])
    return rows


def _add_bearing(rows: Rows, world: World, pairs: Any) -> None:
    """Add what a stiffness does that changes by slip and tilt: a force along the tangent, and a couple.

    The couple is a normal force that acts a little beside its corner. Without a normal force there is no such place.
    """
    factor, power = ENERGIES[int(world.controls[0].law)]
    energy = factor * rows["overlap"] ** power
    rows["shear_force"] -= pairs["slide"] * energy
    normal = rows["normal_force"]
    way = np.divide(pairs["turn"] * energy, normal, out=np.zeros_like(normal), where=normal > 0.0)
    rows["x"] -= way * rows["normal_y"]
    rows["y"] += way * rows["normal_x"]


def _places(world: World, contacts: Any, a: Indices, b: Indices) -> list[Any]:
    """Return place (m) and normal of contacts."""
    if "nx" in (contacts.dtype.names or ()):
        return _kept_places(contacts)
    if world.corners is None:
        return _places_of_corners(world, contacts, a, b)
    return _places_on_outlines(world, contacts, a, b)


def _kept_places(contacts: Any) -> list[Any]:
    """Return place (m) and normal of contacts of particles, which keep them."""
    return [contacts[name] for name in ("x", "y", "nx", "ny")]


def _places_of_corners(world: World, contacts: Any, a: Indices, b: Indices) -> list[Any]:
    """Return place (m) and normal of contacts of corners, as the kernels find them again."""
    slot, face = contacts["slot"], contacts["face"]
    is_of_a = slot < HALF
    owner = world.bodies[np.where(is_of_a, a, b)]
    touched = world.bodies[np.where(is_of_a, b, a)]
    px = np.choose(slot % HALF, SIDES_X) * owner["half_x"]
    py = np.choose(slot % HALF, SIDES_Y) * owner["half_y"]
    cosine, sine = owner["cos"], owner["sin"]
    outward = np.where(is_of_a, 1.0, -1.0)  # from b to a, whichever of the two is touched
    nx, ny = _face_normal(face, touched["cos"], touched["sin"])
    return [
        owner["x"] + cosine * px - sine * py,
        owner["y"] + sine * px + cosine * py,
        outward * nx,
        outward * ny,
    ]


def _places_on_outlines(world: World, contacts: Any, a: Indices, b: Indices) -> list[Any]:
    """Return place (m) and normal of contacts of corners in a scene with polygons; see models/outlines.py."""
    is_of_a = contacts["slot"] < MOST_CORNERS
    owner = world.bodies[np.where(is_of_a, a, b)]
    touched = world.bodies[np.where(is_of_a, b, a)]
    outward = np.where(is_of_a, 1.0, -1.0)  # from b to a, whichever of the two is touched
    x, y = _corners(world, owner, contacts["slot"] % MOST_CORNERS)
    nx, ny = _normals(world, touched, contacts["face"])
    cosine, sine = touched["cos"], touched["sin"]
    return [x, y, outward * (cosine * nx - sine * ny), outward * (sine * nx + cosine * ny)]


def _corners(world: World, owner: Any, number: Any) -> tuple[Any, Any]:
    """Return where (m) corners of bodies are."""
    rows = world.corners[owner["first_corner"] + number]
    cosine, sine = owner["cos"], owner["sin"]
    return owner["x"] + cosine * rows["x"] - sine * rows["y"], owner["y"] + sine * rows["x"] + cosine * rows["y"]


def _normals(world: World, touched: Any, face: Any) -> tuple[Any, Any]:
    """Return the outward normals of faces in the frames of their bodies."""
    rows = world.corners[touched["first_corner"] + face]
    return rows["nx"], rows["ny"]


def _face_normal(face: Any, cosine: Any, sine: Any) -> tuple[Any, Any]:
    """Return the outward normals of faces 0: +x, 1: +y, 2: -x, 3: -y of bodies turned by these."""
    return np.choose(face, [cosine, -sine, -cosine, sine]), np.choose(face, [sine, cosine, -sine, -cosine])


def with_own_work_space(world: World) -> World:
    """Return the same world with arrays of its own where one pair is worked on."""
    return world._replace(**{name: getattr(world, name).copy() for name in WORK_SPACE})


SURFACE, PARTICLES = "surface", "with-particles"  # sets of machine code

WORLDS = Scheme(
    name="explicit",
    scene_type=World,
    ledger=LEDGER_ROW,
    least_bodies=100,
    construction=CONSTRUCTION,
    advance=advance,
    advance_in_team=advance_in_team,
    advance_members=advance_members,
    with_more_room=with_more_room,
    with_threads=with_threads,
    threads_of=lambda world: int(world.shares.size),
    for_another_thread=with_own_work_space,
    contacts=explicit_contacts,
    measure=measure,
    kernels=lambda model: SURFACE if model == "surface" else PARTICLES,
)
EXPLICIT = replace(WORLDS, with_systems=coupled_scheme(WORLDS))
