"""Factors of safety by forces: what every joint across a structure carries, and how soils press on it.

A joint is a level cut between a course, with all above it, and what bears them; the lowest is the base. A course is the
blocks of a structure whose lower faces are at one height at the start. It is borne by faces that rise less than 30
degrees: of lower courses, ground, walls, other structures and, below the lowest course, soil. A structure has no joints
where steeper faces carry more than a hundredth of a cut, as in arches and cells, or once it has fallen.

Moments are about the toe, the end of the joint towards which the resultant leans, or the other end where nothing
overturns about that one. Weight, the pull of a coefficient of gravity along the ground, the thrust of a soil from one
side, a load, and another body that presses from elsewhere are an item each, and stabilise or not by their own sign.
"""

import math
from collections.abc import Iterator
from itertools import islice
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from pydantic import BaseModel

from blocksim.scenario import Model, derived, events, overlap
from blocksim.scenario.models.soil import SoilTable
from blocksim.scenario.placement import GEOMETRY
from blocksim.simulation import balance, instruments, observables, trajectory
from blocksim.simulation.trajectory import MILLI
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
MOST_JOINTS = 200  # of a state, and thrusts; of more joints the lowest
NEITHER = -1
SIDES, UPRIGHT = ("right", "left", "top", "bottom"), 2  # of faces, and how many of them are upright
FACTORS = ("sliding", "overturning", "active_sliding", "active_overturning")


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
    active_sliding: float | None  # with Coulomb's active thrust
    active_overturning: float | None
    pressure_Pa: float | None  # largest, of a contact point over its length
    linear_pressure_Pa: float | None  # largest, of the trapezoid or triangle


class ThrustRow(BaseModel, frozen=True):
    """The resultant of a soil on a side of a structure, block, wall or the ground."""

    soil: str
    on: str
    side: str  # where the soil is
    fx_N: float
    fy_N: float
    x_mm: float
    y_mm: float
    inclination_deg: float  # to the normal of an upright face, positive where the force is turned downwards
    mobilised: float  # shear over normal force
    share: float | None  # K = 2 E / (unit weight height^2), of upright faces


class Safety(BaseModel, frozen=True):
    """All joints and thrusts of a scene at one moment, and why structures have no joints or no active factors."""

    joints: tuple[SafetyRow, ...] = ()
    thrusts: tuple[ThrustRow, ...] = ()
    reasons: dict[str, str] = {}


class LevelCourses(NamedTuple):
    """The n blocks of a structure."""

    name: str
    blocks: Indices
    course: Indices  # of each
    start: Floats  # (n, 4): x, y (m), angle (rad), smaller side (m)


def columns_of(states: dict[str, Safety]) -> trajectory.Columns:
    """Return the table joints.csv of states by their names."""
    rows = [{"state": name, **row.model_dump()} for name, one in states.items() for row in one.joints]
    names = ("state", *SafetyRow.model_fields)
    return {name: [math.nan if row[name] is None else row[name] for row in rows] for name in names}


@derived(*GEOMETRY)
def structures_of(model: Model) -> tuple[LevelCourses, ...]:
    """Return all structures: those of the scenario, and single blocks with those that they touch at the start."""
    placed, kinds = model.bodies, [one.kind for one in model.scenario.structures]
    outlines = overlap.Outlines.of(placed)
    side, bottoms = 2.0 * np.minimum(outlines.half_x, outlines.half_y), outlines.bottom
    start = np.column_stack([np.array([(one.x, one.y, one.angle) for one in placed]).reshape(-1, 3), side])
    places = [int(index) if table == "structures" else len(kinds) for table, index in model.placement.origins]
    is_fixed = [body.fixed and not body.freed for body in placed]
    place = np.where(is_fixed, NEITHER, places) if placed else np.zeros(0, np.intp)
    single = np.flatnonzero(place == len(kinds))
    if single.size > 1:
        one, other, _ = overlap.pairs_within(outlines.some(single), overlap.TOUCHING * float(side[single].min()))
        place[single] += overlap.spread(np.arange(single.size), one, other)
    found = []
    for group in np.unique(place[place != NEITHER]).tolist():
        blocks = np.flatnonzero(place == group)
        order = np.argsort(bottoms[blocks], kind="stable")
        rises = np.diff(bottoms[blocks[order]]) > SAME_HEIGHT * float(side[blocks].min())
        course = np.zeros(blocks.size, dtype=np.intp)
        course[order[1:]] = np.cumsum(rises)
        first, more = placed[blocks[0]].name, f" and {blocks.size - 1} more" * (blocks.size > 1)
        name = f"{'block ' * first.isdigit()}{first}{more}"
        if group < len(kinds):
            name = kinds[group] + f" {group + 1}" * (kinds.count(kinds[group]) > 1)
        found.append(LevelCourses(name, blocks, course, start[blocks]))
    return tuple(found)


def safety_of(model: Model, scene: "AnyScene") -> Safety:
    """Return the joints and thrusts of a scene with the forces of its last step."""
    sides = _Sides(model, scene)
    rows, reasons = [], {}
    for structure in structures_of(model)[:MOST_JOINTS]:
        try:
            cuts, active = sides.cuts(structure), None
            try:
                active = sides.active(structure, cuts)
            except earth_pressure.NotApplicableError as reason:
                reasons[structure.name] = f"no active factors: {reason}"
            rows += [*cuts.rows(structure.name, active)]
        except earth_pressure.NotApplicableError as reason:
            reasons[structure.name] = f"no joints: {reason}"
    lowest = sorted(range(len(rows)), key=lambda number: rows[number].joint)[:MOST_JOINTS]
    joints = tuple(rows[number] for number in sorted(lowest))
    return Safety(joints=joints, thrusts=tuple(islice(sides.thrusts(), MOST_JOINTS)), reasons=reasons)


class _Sides:
    """All contacts of a scene, each from both of its bodies: forces (N) and normal are those on `body`."""

    def __init__(self, model: Model, scene: "AnyScene") -> None:
        self.model, self.world, self.bodies = model, scene.world, scene.world.bodies.view(np.ndarray)
        parts = [(one, () if one.parts is None else one.parts(model)) for one in systems_of(model)]
        counts = [(one, len(names)) for one, names in parts]
        self.moment = instruments.Snapshot(scene, observables.MovingSupport(model), counts)
        contacts = self.moment.contacts
        rows, forces, friction = (one[contacts[0]["normal_force"] > 0.0] for one in contacts)
        normal = np.stack([rows["normal_x"], rows["normal_y"]], axis=-1)
        self.body, self.other = np.concatenate([[rows["body_a"], rows["body_b"]], [rows["body_b"], rows["body_a"]]], 1)
        self.normal, self.force = np.concatenate([normal, -normal]), np.concatenate([forces, -forces])
        self.size, self.friction = np.tile(rows["normal_force"], 2), np.tile(friction, 2)
        self.place = np.tile(np.stack([rows["x"], rows["y"]], axis=-1), (2, 1))
        self.count = self.bodies.size  # parts of systems have numbers from there on
        self.soils = [name for _, names in parts for name in names]
        self.depth = np.full(self.count + len(self.soils), math.inf)
        self.depth[: len(model.bodies)] = [body.depth for body in model.bodies]

    def cuts(self, structure: LevelCourses) -> "_Cuts":
        """Return the joints of a structure. Raises NotApplicableError where it has none."""
        bodies, course = self.bodies[structure.blocks], np.full(self.count + len(self.soils), NEITHER)
        is_free, (_, y, angle, side) = bodies["inverse_mass"] > 0.0, structure.start.T
        (_, lift), _ = self.moment.support.at(self.moment.time)
        is_down = y + lift - bodies["y"] > observables.FALLEN_SHARE * side
        is_down = is_free & (is_down | (np.abs(bodies["angle"] - angle) > observables.FALLEN_TURN))
        if is_down.any():
            name = self.model.bodies[structure.blocks[np.argmax(is_down)]].name
            raise earth_pressure.NotApplicableError(f"block {name} has fallen")
        course[structure.blocks[is_free]] = structure.course[is_free]
        own = np.flatnonzero(course[self.body] > course[self.other])
        of, by = course[self.body[own]], course[self.other[own]]
        is_level = self.normal[own, 1] > LEVEL
        bears = is_level & ((self.other[own] < self.count) | (of == 0))
        levels = int(structure.course.max()) + 1
        cuts = [_cut_by(own[some], by[some], of[some]) for some in (bears, ~is_level & (by != NEITHER))]
        borne, steep = (np.bincount(cut, self.size[through], levels) for through, cut in cuts)
        if not borne.any() or (steep > STEEP_SHARE * borne).any():
            why = "its courses bear on faces steeper than 30 degrees" if borne.any() else "nothing level bears it"
            raise earth_pressure.NotApplicableError(why)
        beside = own[~bears & (by == NEITHER)]
        return _Cuts(self, *cuts[0], beside, *self._items(structure.blocks[is_free], course, beside, levels))

    def _items(self, blocks: Indices, course: Indices, beside: Indices, levels: int) -> tuple[Floats, Indices]:
        """Return what acts on all above each joint, (i, levels, 3), forces (N) and moment about the origin (N m).

        Also which items are soils.
        """
        world, bodies, numbers = self.world, self.bodies, dict[int, int]()
        kinds = balance.solver_module("kernels.common.arrays")
        along = self.model.scenario.gravity.magnitude * self.model.scenario.gravity.horizontal
        pulls = {0: np.array([world.controls[0].gravity_x - along, world.controls[0].gravity_y])}  # m/s2
        pulls[numbers.setdefault(0, 1)] = np.array([along, 0.0])
        parts: list[tuple[Any, ...]] = []  # item, body, forces, moment about the place, place
        centre = np.stack([bodies["x"], bodies["y"]], axis=-1)
        for load, one in zip(world.loads, (*self.model.acting_loads, *self.model.scenario.actuators), strict=True):
            value = instruments.value_of(world, load, self.moment.time)
            item = numbers.setdefault(id(getattr(one, "load", one)), 1 + len(numbers))
            if load.kind == kinds.LOAD_TILT:
                pulls[0] = -float(load.fx) * np.array([math.sin(value), math.cos(value)])
            elif load.kind == kinds.LOAD_FIELD:
                pulls[item] = value * np.array([load.fx, load.fy])
            elif course[load.body] != NEITHER:
                force = np.array([[load.last_fx, load.last_fy]])
                parts.append(([item], [load.body], force, [load.last_torque], centre[[load.body]]))
        for item, pull in pulls.items():
            forces, none = bodies["mass"][blocks, None] * pull, np.zeros(blocks.size)
            parts.append((np.full(blocks.size, item), blocks, forces, none, centre[blocks]))
        other, place, first = self.other[beside], self.place[beside], 1 + len(numbers)
        by = first + 2 * other + ((other >= self.count) & (place[:, 0] > centre[blocks, 0].mean()))
        parts.append((by, self.body[beside], self.force[beside], np.zeros(by.size), place))
        item_of, body, forces, moment, place = (np.concatenate(part) for part in zip(*parts, strict=True))
        moment = moment + place[:, 0] * forces[:, 1] - place[:, 1] * forces[:, 0]
        known, item_of = np.unique(item_of, return_inverse=True)
        cell, size = item_of * levels + course[body], known.size * levels
        sums = np.stack([np.bincount(cell, one, size).reshape(-1, levels) for one in (*forces.T, moment)], axis=-1)
        acting = np.flip(np.flip(sums, 1).cumsum(axis=1, dtype=np.float64), 1)
        return acting, np.flatnonzero(known >= first + 2 * self.count)

    def active(self, structure: LevelCourses, cuts: "_Cuts") -> Floats | None:
        """Return the active thrust above each joint, (k, 3), as `_items`, None where there is no soil.

        Raises NotApplicableError.
        """
        beside = cuts.beside[self.other[cuts.beside] >= self.count]
        beside = beside[np.abs(self.normal[beside, 0]) >= np.abs(self.normal[beside, 1])]
        pressing = np.unique(np.stack([self.other[beside] - self.count, -np.sign(self.normal[beside, 0])], -1), axis=0)
        if not len(pressing):
            return None
        if len(pressing) > 1:
            raise earth_pressure.NotApplicableError("soil presses on both sides, or several soils do")
        (number, side), start = pressing[0].tolist(), structure.start
        order = np.lexsort((side * start[:, 0], structure.course))
        outer = structure.blocks[order[np.append(np.diff(structure.course[order]) > 0, [True])]].tolist()
        found = earth_pressure.active_thrust(self.model, structure.blocks, outer, self._soil(number), side)
        x, y = ((self.bodies[name][structure.blocks] - start[:, k]).mean() for k, name in enumerate("xy"))
        thrust = found.above(cuts.middle[:, 1] - y)  # where the back is now
        thrust[:, 2] += x * thrust[:, 1] - y * thrust[:, 0]
        return thrust

    def thrusts(self) -> Iterator[ThrustRow]:
        """Yield the resultants of all soils on what they touch."""
        names, target = self._targets()
        pressing = np.flatnonzero(self.other >= self.count)
        across, up = self.normal[pressing].T
        side = np.where(np.abs(across) >= np.abs(up), across > 0.0, UPRIGHT + (up > 0.0))
        keys = np.stack([target[self.body[pressing]], side, self.other[pressing] - self.count], axis=-1)
        kinds, group = np.unique(keys, axis=0, return_inverse=True)
        for number, (on, way, soil) in enumerate(kinds.tolist()):
            own = pressing[group.ravel() == number]
            size, (fx, fy) = self.size[own], self.force[own].sum(axis=0).tolist()
            nx, ny = (size @ self.normal[own] / np.hypot(*(size @ self.normal[own]))).tolist()
            shear = nx * fy - ny * fx  # along the normal turned by +90 degrees
            turned = math.degrees(math.atan2(-math.copysign(1.0, nx) * shear, fx * nx + fy * ny))
            share, table = None, self._soil(soil)
            weight = -self.model.scenario.materials[table.material].density * self.model.scenario.gravity.pull(0.0)[1]
            if way < UPRIGHT and weight > 0.0 and (kinds[:, :UPRIGHT] == [on, way]).all(axis=1).sum() == 1:
                height, depth = self._height(soil, table.spacing, self.place[own, 0]), self.depth[self.body[own[0]]]
                share = 2.0 * math.hypot(fx, fy) / (weight * height**2 * min(depth, depth_of_scene(self.model)))
            place = (MILLI * size @ self.place[own] / size.sum()).tolist()
            values = (table.name, names[on], SIDES[way], fx, fy, *place, turned, abs(shear) / size.sum(), share)
            yield ThrustRow.model_validate(dict(zip(ThrustRow.model_fields, values, strict=True)))

    def _height(self, soil: int, spacing: float, places: Floats) -> float:
        """Return the height (m) of a soil against a face, from the particles within two spacings of it."""
        arrays: Any = self.moment.scene
        points, kinds = arrays.systems[0].points, arrays.systems[0].states["kind"]  # the only system with parts
        x, y = points["x"], points["y"]
        is_near = (kinds == soil) & (x > places.min() - 2.0 * spacing) & (x < places.max() + 2.0 * spacing)
        return float(np.ptp(y[is_near])) + spacing

    def _soil(self, number: float) -> SoilTable:
        return next(one for one in self.model.soils if one.name == self.soils[int(number)])

    def _targets(self) -> tuple[list[str], Indices]:
        """Return names of structures, fixed blocks, walls and the ground, and the number of that of every body."""
        walls, names = events.wall_names(self.model.scenario), [body.name for body in self.model.bodies]
        names += [events.GROUND] * (self.count - 1 - len(names) - len(walls)) + [*walls, events.GROUND]
        for structure in structures_of(self.model):
            for block in structure.blocks.tolist():
                names[block] = structure.name
        numbers = {name: number for number, name in enumerate(dict.fromkeys(names))}
        return [*numbers], np.array([numbers[name] for name in names] + [NEITHER] * len(self.soils), dtype=np.intp)


class _Cuts:
    """The k joints of a structure that carry anything, from the base up."""

    def __init__(
        self, of: _Sides, through: Indices, cut: Indices, beside: Indices, items: Floats, soils: Indices
    ) -> None:
        """Take the contacts through joints and beside the structure, and what acts on all above, see `_items`."""
        self.number, cut = np.unique(cut, return_inverse=True)
        self.beside, self.items, self.soils = beside, items[:, self.number], soils
        size, place, force, count = of.size[through], of.place[through], of.force[through], self.number.size

        def total(*values: Floats) -> Floats:
            return np.stack([np.bincount(cut, one, count) for one in values], axis=-1)

        self.normal = total(*(size[:, None] * of.normal[through]).T)
        self.normal /= np.hypot(*self.normal.T)[:, None]
        self.along = np.stack([self.normal[:, 1], -self.normal[:, 0]], axis=-1)  # to the right
        reach, depth = (place * self.along[cut]).sum(axis=1), of.depth[of.body[through]]
        pair = of.body[through] * of.depth.size + of.other[through]
        ends = np.append(np.flatnonzero(np.diff(np.sort(cut))) + 1, cut.size)
        order = np.lexsort((reach, cut))
        self.left, self.right = place[order[np.append(0, ends[:-1])]], place[order[ends - 1]]
        self.middle, self.length = 0.5 * (self.left + self.right), _dot(self.right - self.left, self.along)
        arms, borne = place - self.middle[cut], total(*force.T)
        self.compression, self.shear = _dot(borne, self.normal), -_dot(borne, self.along)
        turning = total(arms[:, 0] * force[:, 1] - arms[:, 1] * force[:, 0])[:, 0]
        self.eccentricity = turning / self.compression
        self.resistance, pressed = total(size * of.friction[through], size).T  # N
        self.friction = self.resistance / pressed
        depth = np.minimum(depth, of.depth[of.other[through]])
        self.depth = np.full(count, math.inf)
        np.minimum.at(self.depth, cut, depth)
        order = np.lexsort((reach, pair, cut))
        gaps = np.where(np.diff(pair[order]) | np.diff(cut[order]), 0.0, np.diff(reach[order]))
        with np.errstate(divide="ignore"):  # of a point alone
            pressures = (size / depth)[order] / (0.5 * (np.append(gaps, 0.0) + np.append(0.0, gaps)))
        self.pressure = np.zeros(count)
        np.maximum.at(self.pressure, cut[order], pressures)

    def rows(self, name: str, active: Floats | None) -> Iterator[SafetyRow]:
        """Yield the joints as rows; `active` is the thrust in place of that of soils."""
        size, off, length = self.compression, np.abs(self.eccentricity), self.length
        factors = [*self._factors(size, self.shear, self.eccentricity, self.resistance, self.items)]
        if active is None:
            factors += [np.full(size.size, math.nan)] * 2
        else:
            items = np.concatenate([np.delete(self.items, self.soils, axis=0), active[None]])
            force, turning = items[..., :2].sum(axis=0), _about(self.middle, items).sum(axis=0)
            pressed, shear = -_dot(force, self.normal), _dot(force, self.along)
            factors += self._factors(pressed, shear, -turning / pressed, self.friction * pressed, items)
        with np.errstate(divide="ignore", invalid="ignore"):
            whole = size / (length * self.depth) * (1.0 + 6.0 * off / length)
            part = 2.0 * size / (3.0 * np.maximum(0.5 * length - off, 0.0) * self.depth)
        linear = np.where(6.0 * off <= length, whole, part)
        lengths = (MILLI * one for one in (self.eccentricity, length, length / 6.0))
        columns = (self.number, MILLI * self.middle[:, 1], size, self.shear, *lengths, *factors, self.pressure, linear)
        for row in np.stack(columns, axis=-1).tolist():
            values = [one if math.isfinite(one) else None for one in row]
            yield SafetyRow.model_validate(dict(zip(SafetyRow.model_fields, (name, *values), strict=True)))

    def _factors(
        self, compression: Floats, shear: Floats, eccentricity: Floats, resistance: Floats, items: Floats
    ) -> Iterator[Floats]:
        """Yield factors against sliding and overturning, nan where nothing pushes, or nothing is pressed."""
        is_pressed, overturning = compression > 0.0, []
        has_length = self.length > 0.0  # on a point the weight, the first item, is on the other side of it
        leaning = np.where(has_length, eccentricity, _about(self.middle, items)[0])
        with np.errstate(divide="ignore", invalid="ignore"):
            slides = is_pressed & (np.abs(shear) > ROUND_OFF * compression)
            yield np.where(slides, resistance / np.abs(shear), math.nan)
            for over in (-_about(self.right, items), _about(self.left, items)):
                pushes, holds = np.maximum(over, 0.0).sum(axis=0), np.maximum(-over, 0.0).sum(axis=0)
                overturning.append(np.where(is_pressed & (pushes > ROUND_OFF * holds), holds / pushes, math.nan))
        right, left = overturning
        toe, other = np.where(leaning >= 0.0, (right, left), (left, right))
        yield np.where(np.isnan(toe) & has_length, other, toe)


def _cut_by(contacts: Indices, lower: Indices, upper: Indices) -> tuple[Indices, Indices]:
    """Return contacts between courses once for each joint between these, and the joints."""
    count = upper - lower
    above = np.arange(int(count.sum())) - np.repeat(np.cumsum(count) - count, count)
    return np.repeat(contacts, count), above + np.repeat(lower, count) + 1


def _dot(one: Floats, other: Floats) -> Floats:
    return np.asarray((one * other).sum(axis=-1))


def _about(points: Floats, items: Floats) -> Floats:
    """Return moments (N m) of items (i, k, 3) about a point (m) of each joint, (i, k)."""
    return np.asarray(items[..., 2] - points[:, 0] * items[..., 1] + points[:, 1] * items[..., 0])
