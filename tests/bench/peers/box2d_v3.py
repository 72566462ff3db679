"""Box2D v3, where a shared library of it is at hand: `BOX2D_V3` holds its path. Data structures are those of 3.1."""

import ctypes
import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar

from blocksim.bench.harness import FRICTION
from blocksim.scenario import PlacedBody
from tests.bench.peers.engine import GRAVITY, GROUND_DEPTH, GROUND_LENGTH, UNITS, Scene, Stepper

VARIABLE = "BOX2D_V3"
VERSION = (3, 1)  # of the structures below
MISSING = (
    f"Box2D v3 is not measured: set {VARIABLE} to a shared library of version {VERSION[0]}.{VERSION[1]} (libbox2d.so), "
    "built from its source by its own instructions, optimised"
)
STIFF = 1e6  # 1/s, of contacts: the engine cuts it to a quarter of its substeps a second
NO_LIMIT = 1e6  # units/s; by default nothing moves faster than 400, which are 2 m/s here
DYNAMIC = 2
MOST_CORNERS = 8


class Vector(ctypes.Structure):
    """`b2Vec2`, also `b2Rot` (cosine and sine)."""

    _fields_ = (("x", ctypes.c_float), ("y", ctypes.c_float))


class WorldId(ctypes.Structure):
    """`b2WorldId`."""

    _fields_ = (("index", ctypes.c_uint16), ("generation", ctypes.c_uint16))


class PartId(ctypes.Structure):
    """`b2BodyId` and `b2ShapeId`."""

    _fields_ = (("index", ctypes.c_int32), ("world", ctypes.c_uint16), ("generation", ctypes.c_uint16))


class Version(ctypes.Structure):
    """`b2Version`."""

    _fields_ = (("major", ctypes.c_int), ("minor", ctypes.c_int), ("revision", ctypes.c_int))


class WorldDef(ctypes.Structure):
    """`b2WorldDef`."""

    _fields_ = (
        ("gravity", Vector),
        ("restitution_threshold", ctypes.c_float),
        ("hit_threshold", ctypes.c_float),
        ("contact_hertz", ctypes.c_float),
        ("contact_damping_ratio", ctypes.c_float),
        ("push_speed", ctypes.c_float),
        ("maximum_speed", ctypes.c_float),
        ("mix_friction", ctypes.c_void_p),
        ("mix_restitution", ctypes.c_void_p),
        ("sleep", ctypes.c_bool),
        ("continuous", ctypes.c_bool),
        ("workers", ctypes.c_int),
        ("tasks", ctypes.c_void_p * 4),
        ("internal", ctypes.c_int),
    )


class BodyDef(ctypes.Structure):
    """`b2BodyDef`."""

    _fields_ = (
        ("kind", ctypes.c_int),
        ("position", Vector),
        ("rotation", Vector),
        ("velocity", Vector),
        ("spin", ctypes.c_float),
        ("damping", ctypes.c_float * 2),
        ("gravity_scale", ctypes.c_float),
        ("sleep_threshold", ctypes.c_float),
        ("texts", ctypes.c_void_p * 2),
        ("flags", ctypes.c_bool * 6),
        ("internal", ctypes.c_int),
    )


class ShapeDef(ctypes.Structure):
    """`b2ShapeDef`, with the material and the filter in it."""

    _fields_ = (
        ("user", ctypes.c_void_p),
        ("friction", ctypes.c_float),
        ("restitution", ctypes.c_float),
        ("rolling", ctypes.c_float * 2),
        ("surface", ctypes.c_uint32 * 2),
        ("density", ctypes.c_float),
        ("filter", ctypes.c_uint64 * 2),
        ("group", ctypes.c_uint64),
        ("flags", ctypes.c_bool * 7),
        ("internal", ctypes.c_int),
    )


class Hull(ctypes.Structure):
    """`b2Hull`."""

    _fields_ = (("points", Vector * MOST_CORNERS), ("count", ctypes.c_int))


class Polygon(ctypes.Structure):
    """`b2Polygon`."""

    _fields_ = (
        ("corners", Vector * MOST_CORNERS),
        ("normals", Vector * MOST_CORNERS),
        ("centroid", Vector),
        ("radius", ctypes.c_float),
        ("count", ctypes.c_int),
    )


class MassData(ctypes.Structure):
    """`b2MassData`."""

    _fields_ = (("mass", ctypes.c_float), ("centre", Vector), ("inertia", ctypes.c_float))


POINTER = ctypes.POINTER
SIGNATURES: dict[str, tuple[type[ctypes.Structure] | None, tuple[Any, ...]]] = {
    "b2GetVersion": (Version, ()),
    "b2DefaultWorldDef": (WorldDef, ()),
    "b2DefaultBodyDef": (BodyDef, ()),
    "b2DefaultShapeDef": (ShapeDef, ()),
    "b2CreateWorld": (WorldId, (POINTER(WorldDef),)),
    "b2DestroyWorld": (None, (WorldId,)),
    "b2World_Step": (None, (WorldId, ctypes.c_float, ctypes.c_int)),
    "b2CreateBody": (PartId, (WorldId, POINTER(BodyDef))),
    "b2ComputeHull": (Hull, (POINTER(Vector), ctypes.c_int)),
    "b2MakePolygon": (Polygon, (POINTER(Hull), ctypes.c_float)),
    "b2CreatePolygonShape": (PartId, (PartId, POINTER(ShapeDef), POINTER(Polygon))),
    "b2Body_SetMassData": (None, (PartId, MassData)),
    "b2Body_GetPosition": (Vector, (PartId,)),
}


@cache
def library() -> Any:
    """Return the library, None where none is named. Raises OSError for what is none of the version."""
    path = os.environ.get(VARIABLE)
    if not path:
        return None
    found = ctypes.CDLL(path)
    for name, (result, arguments) in SIGNATURES.items():
        function = getattr(found, name, None)
        if function is None:
            raise OSError(f"{path}: no {name}; {MISSING}")
        function.restype, function.argtypes = result, arguments
    version = found.b2GetVersion()
    if (version.major, version.minor) != VERSION:
        raise OSError(f"{path}: version {version.major}.{version.minor}.{version.revision}; {MISSING}")
    return found


@dataclass(frozen=True)
class Body:
    """A block of the engine."""

    number: PartId

    @property
    def position(self) -> tuple[float, float]:
        """Its centre in the engine's units."""
        found = library().b2Body_GetPosition(self.number)
        return found.x, found.y


@dataclass(frozen=True)
class Box2Dv3(Stepper):
    """Box2D 3.1: soft contacts, one sweep with and one without a push apart in each substep, single precision.

    `iterations` are its substeps. One worker; nothing sleeps and continuous physics is off, as for Box2D 2.3, and
    lengths are scaled up for the same reasons: overlap up to 25 µm is left alone (B2_LINEAR_SLOP), and approaches below
    5 mm/s do not bounce. Polygons have no skin. Contacts have `hertz` (1/s), by default the engine's own 30; the engine
    cuts what exceeds a quarter of the substeps a second.
    """

    hertz: float = 30.0
    units: ClassVar[float] = UNITS

    def call(self, world: Any) -> tuple[Callable[..., object], tuple[Any, ...]]:
        """Return the function of a step, and its arguments."""
        return library().b2World_Step, (world, self.step, self.iterations)

    def made(self, scene: Scene) -> tuple[Any, list[Any]]:
        """Return world and blocks, lengths in the engine's units."""
        world = self.empty_world()
        # Friction of a pair is the root of the product, restitution the larger one.
        half, depth = 0.5 * UNITS * GROUND_LENGTH, UNITS * GROUND_DEPTH
        slab = [(-half, -depth), (half, -depth), (half, 0.0), (-half, 0.0)]
        self._body(world, slab, FRICTION["block_ground"] ** 2 / FRICTION["block_block"], scene.restitution)
        placed, bodies = scene.placed(), []
        for block in placed:
            corners = [(UNITS * x, UNITS * y) for x, y in block.corners]
            body = self._body(world, corners, FRICTION["block_block"], scene.restitution, block)
            unit = placed[0].mass
            data = MassData(block.mass / unit, Vector(0.0, 0.0), UNITS**2 * block.inertia / unit)
            library().b2Body_SetMassData(body, data)
            bodies.append(Body(body))
        return world, bodies

    def empty_world(self) -> WorldId:
        """Return an empty world."""
        asked = library().b2DefaultWorldDef()
        asked.gravity = Vector(0.0, -GRAVITY * UNITS)
        asked.sleep = asked.continuous = False
        asked.maximum_speed, asked.contact_hertz = NO_LIMIT, self.hertz
        found: WorldId = library().b2CreateWorld(asked)
        return found

    def solve(self, scene: Scene) -> Any:
        """Compute the scene, and give its memory back: there are few worlds. Not counted: making it."""
        world, bodies = self.made(scene)
        try:
            return self.run(world, bodies, scene)
        finally:
            library().b2DestroyWorld(world)

    @staticmethod
    def _body(
        world: WorldId,
        corners: list[tuple[float, float]],
        friction: float,
        restitution: float,
        block: PlacedBody | None = None,
    ) -> PartId:
        """Return a body with these corners in its own axes, fixed where no block is given."""
        asked, shape = library().b2DefaultBodyDef(), library().b2DefaultShapeDef()
        if block is not None:
            asked.kind, asked.position = DYNAMIC, Vector(UNITS * block.x, UNITS * block.y)
            asked.velocity = Vector(UNITS * block.vx, UNITS * block.vy)
        shape.friction, shape.restitution = friction, restitution
        hull = library().b2ComputeHull((Vector * len(corners))(*(Vector(x, y) for x, y in corners)), len(corners))
        body: PartId = library().b2CreateBody(world, asked)
        library().b2CreatePolygonShape(body, shape, library().b2MakePolygon(hull, 0.0))
        return body
