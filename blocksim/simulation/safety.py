"""Factors of safety by forces: what every joint across a structure carries, and how soils press on it.

A joint is a level cut: between a course and all above it, and what bears them. Courses are blocks of a structure whose
lower faces are at one height at the start. What bears them are blocks of lower courses, ground, walls, other blocks, and
below the lowest course soil, with faces that rise less than 30 degrees; the lowest joint is the base. A structure has no
joints where steeper faces carry more than a hundredth of a cut, as in arches, slopes and cells, or once it has fallen.

Moments are about the toe, the end of the joint towards which the resultant leans. Weight, the thrust of a soil from one
side, a load, and another body that presses from elsewhere are an item each, and stabilise or not by their own sign.
"""

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from pydantic import BaseModel

from blocksim.kernels.common.arrays import LOAD_ACTUATOR, LOAD_FIELD, LOAD_TILT
from blocksim.scenario import Model, derived, events, overlap
from blocksim.scenario.models.soil import SoilTable
from blocksim.scenario.placement import GEOMETRY
from blocksim.simulation import instruments, observables, trajectory
from blocksim.world import earth_pressure
from blocksim.world.systems import systems_of
from blocksim.world.systems.soils import depth_of_scene
from blocksim.world.systems.system import Floats, Indices

if TYPE_CHECKING:
    from blocksim.simulation.schemes import AnyScene

LEVEL = math.cos(math.radians(30.0))  # least upward part of the normal of a face that bears a course
STEEP_SHARE = 0.01  # of the compression of a cut, by steeper faces
SAME_HEIGHT = 0.01  # of the smallest side
ROUND_OFF = 1e-9  # of the compression, and of moments
MOST_JOINTS = 200  # of a state; of more the lowest
NEITHER = -1
UPRIGHT = 2  # of the sides of a face
SIDES = ("right", "left", "top", "bottom")


class SafetyRow(BaseModel, frozen=True):
    """One joint across a structure: a row of joints.csv. Factors are None where nothing pushes."""

    structure: str
    joint: int  # from 0, the base
    y_mm: float  # of the middle
    compression_N: float
    shear_N: float  # on what is below, positive to the right
    eccentricity_mm: float  # from the middle, positive to the right
    length_mm: float  # between the ends of the contact
    kern_mm: float  # a sixth of that
    sliding: float | None
    overturning: float | None
    active_sliding: float | None = None  # with Coulomb's active thrust
    active_overturning: float | None = None
    pressure_Pa: float | None  # largest, of a contact point over its length
    linear_pressure_Pa: float | None  # largest, of the trapezoid or triangle
    left_mm: float  # x of the ends
    right_mm: float


class ThrustRow(BaseModel, frozen=True):
    """The resultant of a soil on a side of a structure, block, wall or the ground."""

    soil: str
    on: str
    side: str  # where the soil is
    fx_N: float
    fy_N: float
    x_mm: float
    y_mm: float
    inclination_deg: float  # to the normal of the face, positive where it turns the force downwards
    mobilised: float  # shear over normal force
    share: float | None  # K = 2 E / (unit weight height^2), of upright faces


class Safety(BaseModel, frozen=True):
    """All joints and thrusts of a scene at one moment; why structures have no joints, or no active factors."""

    joints: tuple[SafetyRow, ...] = ()
    thrusts: tuple[ThrustRow, ...] = ()
    without_joints: dict[str, str] = {}
    without_active: dict[str, str] = {}


class Structure(NamedTuple):
    """The n blocks of a structure, and the number of the course of each."""

    name: str
    blocks: Indices
    course: Indices


def columns_of(states: dict[str, Safety]) -> trajectory.Columns:
    """Return the table joints.csv of states by their names."""
    rows = [{"state": name, **row.model_dump()} for name, one in states.items() for row in one.joints]
    names = ("state", *SafetyRow.model_fields)
    return {name: [math.nan if row[name] is None else row[name] for row in rows] for name in names}


@derived(*GEOMETRY)
def structures_of(model: Model) -> tuple[Structure, ...]:
    """Return all structures: those of the scenario, and single blocks with those that they touch at the start."""
    placed, kinds = model.bodies, [one.kind for one in model.scenario.structures]
    outlines = overlap.Outlines.of(placed)
    side = 2.0 * np.minimum(outlines.half_x, outlines.half_y)
    place = np.full(len(placed), NEITHER)
    for number, (body, (table, index)) in enumerate(zip(placed, model.placement.origins, strict=True)):
        if not body.fixed or body.freed:
            place[number] = int(index) if table == "structures" else len(kinds)
    single = np.flatnonzero(place == len(kinds))
    if single.size > 1:
        one, other, _ = overlap.pairs_within(outlines.some(single), overlap.TOUCHING * float(side[single].min()))
        place[single] += overlap.spread(np.arange(single.size), one, other)
    found = []
    for group in np.unique(place[place != NEITHER]).tolist():
        blocks = np.flatnonzero(place == group)
        bottom = outlines.bottom[blocks]
        order = np.argsort(bottom, kind="stable")
        course = np.zeros(blocks.size, dtype=np.intp)
        course[order[1:]] = np.cumsum(np.diff(bottom[order]) > SAME_HEIGHT * float(side[blocks].min()))
        first, more = placed[blocks[0]].name, f" and {blocks.size - 1} more" * (blocks.size > 1)
        name = f"{'block ' * first.isdigit()}{first}{more}"
        if group < len(kinds):
            name = kinds[group] + f" {group + 1}" * (kinds.count(kinds[group]) > 1)
        found.append(Structure(name, blocks, course))
    return tuple(found)


def safety_of(model: Model, scene: "AnyScene") -> Safety:
    """Return the joints and thrusts of a scene with the forces of its last step."""
    sides = _Sides(model, scene)
    rows, without, without_active = [], {}, {}
    for structure in structures_of(model)[:MOST_JOINTS]:
        cut = sides.cuts(structure)
        if isinstance(cut, str):
            without[structure.name] = cut
            continue
        active, reason = sides.active(structure, cut)
        if reason:
            without_active[structure.name] = reason
        rows += [*cut.rows(structure.name, active)]
    lowest = sorted(range(len(rows)), key=lambda number: rows[number].joint)[:MOST_JOINTS]
    return Safety(
        joints=tuple(rows[number] for number in sorted(lowest)),
        thrusts=tuple(sides.thrusts()),
        without_joints=without,
        without_active=without_active,
    )


class _Sides:
    """All contacts of a scene, each from both of its bodies: forces (N) and normal are those on `body`."""

    def __init__(self, model: Model, scene: "AnyScene") -> None:
        self.model, self.world = model, scene.world
        parts = [(one, () if one.parts is None else one.parts(model)) for one in systems_of(model)]
        counts = [(one, len(names)) for one, names in parts]
        self.moment = instruments.Snapshot(scene, observables.MovingSupport(model), counts)
        rows, forces, friction = self.moment.contacts
        pressed = np.flatnonzero(rows["normal_force"] > 0.0)
        rows, forces, friction = rows[pressed], forces[pressed], friction[pressed]
        normal = np.stack([rows["normal_x"], rows["normal_y"]], axis=-1)
        self.body = np.concatenate([rows["body_a"], rows["body_b"]]).astype(np.intp)
        self.other = np.concatenate([rows["body_b"], rows["body_a"]]).astype(np.intp)
        self.normal, self.force = np.concatenate([normal, -normal]), np.concatenate([forces, -forces])
        self.size, self.friction = np.tile(rows["normal_force"], 2), np.tile(friction, 2)
        self.place = np.tile(np.stack([rows["x"], rows["y"]], axis=-1), (2, 1))
        self.count = self.world.bodies.size  # parts of systems have numbers from there on
        self.soils = [name for _, names in parts for name in names]
        self.depth = np.full(self.count + len(self.soils), math.inf)
        self.depth[: len(model.bodies)] = [body.depth for body in model.bodies]

    def cuts(self, structure: Structure) -> "_Cuts | str":
        """Return the joints of a structure, or why it has none."""
        bodies, placed = self.world.bodies[: len(self.model.bodies)], self.model.bodies
        course = np.full(self.count + len(self.soils), NEITHER)
        free = bodies["inverse_mass"][structure.blocks] > 0.0
        blocks = structure.blocks[free]
        course[blocks] = structure.course[free]
        if not blocks.size:
            return "no block is free"
        (_, lift), _ = self.moment.support.at(self.moment.time)
        for number in blocks.tolist():
            body, now = placed[number], bodies[number]
            is_lower = body.y + lift - now.y > observables.FALLEN_SHARE * body.least_width
            if is_lower or abs(now.angle - body.angle) > observables.FALLEN_TURN:
                return f"block {body.name} has fallen"
        own = np.flatnonzero(course[self.body] > course[self.other])
        of, by = course[self.body[own]], course[self.other[own]]
        is_level, is_soil = self.normal[own, 1] > LEVEL, self.other[own] >= self.count
        bears = is_level & ~(is_soil & (of > 0))
        levels = int(structure.course.max()) + 1
        borne, steep = (
            np.bincount(_cut_by(by[some], of[some])[0], np.repeat(self.size[own[some]], of[some] - by[some]), levels)
            for some in (bears, ~is_level & (by != NEITHER))
        )
        if (steep > STEEP_SHARE * borne).any():
            return "its courses bear on faces steeper than 30 degrees"
        if not borne.any():
            return "nothing bears it"
        beside = own[~bears & (by == NEITHER)]
        cut, place = _cut_by(by[bears], of[bears])
        return _Cuts(self, own[bears][place], cut, beside, *self._items(blocks, course, beside, levels))

    def _items(self, blocks: Indices, course: Indices, beside: Indices, levels: int) -> tuple[Floats, Indices]:
        """Return what acts on all above each joint, (i, levels, 3): forces (N), moment about the origin (N m).

        Also which items are soils.
        """
        world, bodies = self.world, self.world.bodies
        gravity = np.array([world.controls[0].gravity_x, world.controls[0].gravity_y])
        pulls, single = [], []
        for load, one in zip(world.loads, (*self.model.acting_loads, *self.model.scenario.actuators), strict=True):
            value = instruments.value_of(world, load, self.moment.time) if load.kind < LOAD_ACTUATOR else 0.0
            name = id(one) if load.kind == LOAD_ACTUATOR else id(one.load)
            if load.kind == LOAD_TILT:
                gravity = -float(load.fx) * np.array([math.sin(value), math.cos(value)])
            elif load.kind == LOAD_FIELD:
                pulls.append((name, value * np.array([load.fx, load.fy])))
            elif course[load.body] != NEITHER:
                single.append((name, int(load.body), (load.last_fx, load.last_fy), load.last_torque))
        centre = np.stack([bodies["x"][blocks], bodies["y"][blocks]], axis=-1)
        mass, zero = bodies["mass"][blocks, None], np.zeros(blocks.size)
        # label of the item, course, force, moment about the centre, place
        parts: list[tuple[Any, ...]] = [
            ([(NEITHER, name)] * blocks.size, course[blocks], mass * pull, zero, centre)
            for name, pull in [(0, gravity), *pulls]
        ]
        for name, body, force, torque in single:
            at = np.array([[bodies.x[body], bodies.y[body]]])
            parts.append(([(NEITHER, name)], course[[body]], np.array([force]), np.array([torque]), at))
        is_right = self.place[beside, 0] > centre[:, 0].mean()
        of = self.other[beside]
        labels = [*zip(of.tolist(), (is_right & (of >= self.count)).tolist(), strict=True)]
        parts.append((labels, course[self.body[beside]], self.force[beside], np.zeros(of.size), self.place[beside]))
        names = {name: number for number, name in enumerate(dict.fromkeys(name for part in parts for name in part[0]))}
        label = np.array([names[name] for part in parts for name in part[0]], dtype=np.intp)
        level, force, torque, place = (np.concatenate(part) for part in list(zip(*parts, strict=True))[1:])
        moment = torque + place[:, 0] * force[:, 1] - place[:, 1] * force[:, 0]
        sums = [
            np.bincount(label * levels + level, one, len(names) * levels).reshape(-1, levels)
            for one in (force[:, 0], force[:, 1], moment)
        ]
        soils = np.array([number for (by, _), number in names.items() if by >= self.count], dtype=np.intp)
        return np.cumsum(np.stack(sums, axis=-1)[:, ::-1], axis=1)[:, ::-1], soils

    def active(self, structure: Structure, cuts: "_Cuts") -> tuple[Floats | None, str]:
        """Return the active thrust above each joint, (levels, 3), as `_items`, and why there is none beside soil."""
        beside = cuts.beside[
            (self.other[cuts.beside] >= self.count) & (np.abs(self.normal[cuts.beside, 0]) > 1.0 - LEVEL)
        ]
        pressing = {
            *zip((self.other[beside] - self.count).tolist(), (-np.sign(self.normal[beside, 0])).tolist(), strict=True)
        }
        if not pressing:
            return None, ""
        if len(pressing) > 1:
            return None, "soil on both sides" if len({soil for soil, _ in pressing}) == 1 else "there are several soils"
        ((number, side),) = pressing
        soil = self._soil(number)
        touched = np.unique(self.body[beside]).tolist()
        found = earth_pressure.active_thrust(self.model, structure.blocks.tolist(), touched, soil, side)
        if isinstance(found, str):
            return None, found
        bodies, placed = self.world.bodies, [self.model.bodies[one] for one in touched]
        x, y = (float(np.mean(bodies[name][touched] - [getattr(one, name) for one in placed])) for name in ("x", "y"))
        thrust = found.above(cuts.middle[:, 1] - y)  # where the back is now
        thrust[:, 2] += x * thrust[:, 1] - y * thrust[:, 0]
        return thrust, ""

    def thrusts(self) -> Iterator[ThrustRow]:
        """Yield the resultants of all soils on what they touch."""
        names, target = self._targets()
        pressing = np.flatnonzero(self.other >= self.count)
        normal = self.normal[pressing]
        is_beside = np.abs(normal[:, 0]) >= np.abs(normal[:, 1])
        side = np.where(is_beside, normal[:, 0] > 0.0, UPRIGHT + (normal[:, 1] > 0.0))
        keys = np.stack([target[self.body[pressing]], side, self.other[pressing] - self.count], axis=-1)
        kinds, group = np.unique(keys, axis=0, return_inverse=True)
        for number, (on, way, soil) in enumerate(kinds.tolist()):
            own = pressing[group.ravel() == number]
            size, force = self.size[own], self.force[own].sum(axis=0)
            mean = size @ self.normal[own]
            mean /= np.hypot(*mean)
            shear = float(mean[0] * force[1] - mean[1] * force[0])  # along the normal turned by +90 degrees
            turned = math.atan2(-math.copysign(shear, mean[0] * shear), float(force @ mean))
            share = None
            if way < UPRIGHT and (kinds[:, :UPRIGHT] == [on, way]).all(axis=1).sum() == 1:
                table, depth = self._soil(soil), min(self.depth[self.body[own[0]]], depth_of_scene(self.model))
                height = float(np.ptp(self.place[own, 1])) + table.spacing
                weight = self.model.scenario.materials[table.material].density * self.model.scenario.gravity
                share = 2.0 * float(np.hypot(*force)) / (weight * height**2 * depth) if weight > 0.0 else None
            x, y = (trajectory.MILLI * size @ self.place[own] / size.sum()).tolist()
            yield ThrustRow(
                soil=self.soils[soil],
                on=names[on],
                side=SIDES[way],
                fx_N=force[0],
                fy_N=force[1],
                x_mm=x,
                y_mm=y,
                inclination_deg=math.degrees(turned),
                mobilised=abs(shear) / float(size.sum()),
                share=share,
            )

    def _soil(self, number: int) -> SoilTable:
        return next(one for one in self.model.soils if one.name == self.soils[number])

    def _targets(self) -> tuple[list[str], Indices]:
        """Return names of structures, fixed blocks, walls and the ground, and the number of that of every body."""
        structures, walls = structures_of(self.model), events.wall_names(self.model.scenario)
        names = [body.name for body in self.model.bodies]
        names += [events.GROUND] * (self.count - 1 - len(names) - len(walls)) + [*walls, events.GROUND]
        for structure in structures:
            for block in structure.blocks.tolist():
                names[block] = structure.name
        numbers = {name: number for number, name in enumerate(dict.fromkeys(names))}
        return [*numbers], np.array([numbers[name] for name in names] + [NEITHER] * len(self.soils), dtype=np.intp)


class _Cuts:
    """The k joints of a structure that carry anything, from the base up."""

    def __init__(
        self, sides: _Sides, through: Indices, cut: Indices, beside: Indices, items: Floats, soils: Indices
    ) -> None:
        """Take the contacts through joints and beside the structure, and what acts on all above, see `_items`."""
        self.number, cut = np.unique(cut, return_inverse=True)
        self.beside, self.items, self.soils = beside, items[:, self.number], soils
        size, place, count = sides.size[through], sides.place[through], self.number.size

        def total(values: Floats) -> Floats:
            return np.stack([np.bincount(cut, one, count) for one in values.T], axis=-1)

        self.normal = total(size[:, None] * sides.normal[through])
        self.normal /= np.hypot(*self.normal.T)[:, None]
        self.along = np.stack([self.normal[:, 1], -self.normal[:, 0]], axis=-1)  # to the right
        reach = (place * self.along[cut]).sum(axis=1)
        pair = sides.body[through] * sides.depth.size + sides.other[through]
        order = np.lexsort((reach, cut))
        ends = np.searchsorted(cut[order], np.arange(count)), np.searchsorted(cut[order], np.arange(count), "right") - 1
        self.left, self.right = place[order[ends[0]]], place[order[ends[1]]]
        self.middle, self.length = 0.5 * (self.left + self.right), ((self.right - self.left) * self.along).sum(axis=1)
        force, arms = sides.force[through], place - self.middle[cut]
        moment = total((arms[:, 0] * force[:, 1] - arms[:, 1] * force[:, 0])[:, None])[:, 0]
        borne = total(force)
        self.compression, self.shear = (borne * self.normal).sum(axis=1), -(borne * self.along).sum(axis=1)
        self.eccentricity = moment / self.compression
        self.friction = total((size * sides.friction[through])[:, None])[:, 0]  # N, all that there is
        self.share = self.friction / np.bincount(cut, size, count)
        depth = np.minimum(sides.depth[sides.body[through]], sides.depth[sides.other[through]])
        self.depth = np.full(count, math.inf)
        np.minimum.at(self.depth, cut, depth)
        self.pressure = _largest_pressure(np.lexsort((reach, pair, cut)), cut, pair, reach, size / depth, count)

    def rows(self, name: str, active: Floats | None) -> Iterator[SafetyRow]:
        """Yield the joints as rows; `active` is the thrust in place of that of soils."""
        found = [*self._factors(self.compression, self.shear, self.eccentricity, self.friction, self.items)]
        found += [np.full(self.number.size, math.nan)] * 2
        if active is not None:
            items = np.concatenate([np.delete(self.items, self.soils, axis=0), active[None]])
            force, moment = items.sum(axis=0)[:, :2], _about(self.middle, items).sum(axis=0)
            pressed, along = -(force * self.normal).sum(axis=1), (force * self.along).sum(axis=1)
            found[2:] = self._factors(pressed, along, -moment / pressed, self.share * pressed, items)
        off, size, depth = np.abs(self.eccentricity), self.compression, self.depth
        with np.errstate(divide="ignore", invalid="ignore"):
            whole = size / (self.length * depth) * (1.0 + 6.0 * off / self.length)
            part = 2.0 * size / (3.0 * (0.5 * self.length - off) * depth)
        linear = np.where(6.0 * off <= self.length, whole, np.where(2.0 * off < self.length, part, math.nan))
        milli = trajectory.MILLI
        columns = {
            "joint": self.number,
            "y_mm": milli * self.middle[:, 1],
            "compression_N": size,
            "shear_N": self.shear,
            "eccentricity_mm": milli * self.eccentricity,
            "length_mm": milli * self.length,
            "kern_mm": milli * self.length / 6.0,
            **dict(zip(FACTORS, found, strict=True)),
            "pressure_Pa": self.pressure,
            "linear_pressure_Pa": linear,
            "left_mm": milli * self.left[:, 0],
            "right_mm": milli * self.right[:, 0],
        }
        for row in zip(*(column.tolist() for column in columns.values()), strict=True):
            values = {name: one if math.isfinite(one) else None for name, one in zip(columns, row, strict=True)}
            yield SafetyRow.model_validate({"structure": name, **values})

    def _factors(
        self, compression: Floats, shear: Floats, eccentricity: Floats, friction: Floats, items: Floats
    ) -> tuple[Floats, Floats]:
        """Return factors against sliding and overturning, nan where nothing pushes, or nothing is pressed."""
        is_right = eccentricity >= 0.0
        toe = np.where(is_right[:, None], self.right, self.left)
        over = np.where(is_right, -1.0, 1.0) * _about(toe, items)
        pushes, holds = np.maximum(over, 0.0).sum(axis=0), np.maximum(-over, 0.0).sum(axis=0)
        is_pressed = compression > 0.0
        with np.errstate(divide="ignore", invalid="ignore"):
            sliding = np.where(
                is_pressed & (np.abs(shear) > ROUND_OFF * compression), friction / np.abs(shear), math.nan
            )
            return sliding, np.where(is_pressed & (pushes > ROUND_OFF * holds), holds / pushes, math.nan)


FACTORS = ("sliding", "overturning", "active_sliding", "active_overturning")


def _cut_by(lower: Indices, upper: Indices) -> tuple[Indices, Indices]:
    """Return the joints that contacts between courses cross, from above the lower one on, and which contact it is."""
    count = upper - lower
    place = np.repeat(np.arange(count.size), count)
    return np.arange(place.size) - np.repeat(np.cumsum(count) - count, count) + lower[place] + 1, place


def _about(points: Floats, items: Floats) -> Floats:
    """Return moments (N m) of items (i, k, 3) about a point (m) of each joint, (i, k)."""
    return np.asarray(items[..., 2] - points[:, 0] * items[..., 1] + points[:, 1] * items[..., 0])


def _largest_pressure(order: Indices, cut: Indices, pair: Indices, reach: Floats, force: Floats, count: int) -> Floats:
    """Return the largest force (N/m) over the half of the way (m) to its neighbours in its pair; nan where one has none."""
    cut, pair, reach, force = cut[order], pair[order], reach[order], force[order]
    gaps = np.where((np.diff(cut) == 0) & (np.diff(pair) == 0), np.diff(reach), 0.0)
    ways = 0.5 * (np.append(gaps, 0.0) + np.append(0.0, gaps))
    with np.errstate(divide="ignore", invalid="ignore"):
        pressure = force / ways
    largest = np.zeros(count)
    np.maximum.at(largest, cut, pressure)
    return largest
