"""Soils: elasto-plastic bodies of particles; see blocksim/kernels/soil and the tables [[soils]] of scenarios.

Elasticity, yield surface and stresses at time zero, how particles touch bodies, and what is shown of them: where they
press against bodies, how far they have come, their surface, smoothed pressure.

On a rough base the lowest rows of particles do not press as they should: the active thrust on blocks that yield is too
small, the more the fewer rows there are, the farther blocks have moved, the more their backs are battered, and more
with raw gradients than with corrected ones. On a smooth base neither lacks anything from 8 rows on. Soil at rest
presses as it should.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from importlib import import_module
from typing import Any

import numpy as np

from blocksim.scenario import GROUND, Model, PlacedBody, Scenario, geometry, overrides, placement, resolve_pair, start
from blocksim.scenario.models import contact, loads, timeline
from blocksim.scenario.models.geometry import Material
from blocksim.scenario.models.soil import RAMP_TIME, SoilTable
from blocksim.world.systems import blocks, system

MILLI, KILO = 1e3, 1e-3
GAP = 2.0  # spacings without a particle that end the connected part
COLUMN = 2.0  # spacings, of the surface
BACK = 2.0  # spacings from the end in which the height at the back is taken
SMOOTHED = 2  # times that pressure is averaged over neighbouring cells of one spacing
SHEAR_RATIO = 0.8  # shear over normal stiffness of a contact
# The most that leaves a particle between two bodies, with twice the stiffness and dashpot, no more than critical. What
# strikes a body leaves with exp(-pi/2) = 0.21 of its speed: soil is no ball.
DAMPING_RATIO = math.sqrt(0.5)
SETTLING = 5e-3  # damping meanwhile, in (E / (rho h^2))^(1/2)
# Stresses of a geostatic start are not quite in equilibrium: in corners between faces, along inclined ones
# (kernels/soil/stress.py), and below slopes. For the time that a wave takes for that many smoothing lengths that shock
# is damped, in wave speeds over smoothing length; later it would have made the soil flow.
SHOCK_TIME, SHOCK_DAMPING = 60.0, 0.1
SMOOTHING = 1.5  # smoothing length in spacings
# calibrated with smooth upright walls drawn back from 10 to 20 rows of 21.9 degrees on a rough base by 1 and 3 % of the
# height: a, b of the share a/rows + b of the active thrust that is missing
LACK = {"raw": ((2.2, 0.0), (2.5, 0.07)), "corrected": ((0.9, -0.006), (1.36, 0.026))}
LOSSES = ("plastic", "viscosity", "dashpot", "friction", "settling", "ramp")
ENERGIES = ("kinetic", "potential", "elastic", "contact", *LOSSES)  # J, as kernels/soil/step.py measures them
COST = system.Cost(seconds=200e-9, memory=395)  # measured, with raw gradients
GRADIENT_COST = {"raw": 1.0, "corrected": 1.5}  # time of a step over that, measured
# places and velocities, stresses (tension positive), accumulated plastic shear strain
QUANTITIES = system.datasets(x="m", y="m", vx="m/s", vy="m/s", sxx="Pa", syy="Pa", szz="Pa", sxy="Pa", plastic="1")
CONSTANTS = system.datasets(mass="kg", spacing="m")


def lame_constants(material: Material) -> tuple[float, float]:
    """Return Lame's first parameter and the shear modulus (Pa)."""
    young, poisson = material.young_modulus, material.poisson_ratio
    return young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)), young / (2.0 * (1.0 + poisson))


def wave_speed(material: Material) -> float:
    """Return the speed (m/s) of pressure waves."""
    lame, shear = lame_constants(material)
    return math.sqrt((lame + 2.0 * shear) / material.density)


def yield_surface(material: Material, divisor: float = 1.0) -> tuple[float, float]:
    """Return a (-) and k (Pa) of the surface (J2)^(1/2) + a I1 = k, of tan(phi) and c over a divisor.

    mohr-coulomb: a = sin(phi)/3 and k = c cos(phi), which fails as Mohr and Coulomb say where the flow has no dilation
    (kernels/soil/stress.py). plane-strain-associated: tan(phi)/(9 + 12 tan(phi)^2)^(1/2) and 3 c over the same root,
    which does so for an associated flow, and is weaker without dilation: sin(phi) becomes 3 a.
    """
    angle, cohesion = material.friction_angle or 0.0, (material.cohesion or 0.0) / divisor
    if divisor != 1.0:  # the tangent of an angle and back changes its last digit
        angle = math.atan(math.tan(angle) / divisor)
    if material.yield_surface == "plane-strain-associated":
        root = math.sqrt(9.0 + 12.0 * math.tan(angle) ** 2)
        return math.tan(angle) / root, 3.0 * cohesion / root
    return math.sin(angle) / 3.0, cohesion * math.cos(angle)


def earth_pressure_at_rest(material: Material) -> float:
    """Return horizontal over vertical stress: of elasticity, or the least one within the surface of full strength."""
    poisson = material.poisson_ratio
    slope = math.sqrt(3.0) * yield_surface(material)[0]
    return max(poisson / (1.0 - poisson), (1.0 - slope) / (1.0 + 2.0 * slope))


def depth_of_scene(model: Model) -> float:
    """Return the extent (m) of all soil out of the plane: that of the deepest block."""
    return max((body.depth for body in model.bodies), default=1.0)  # m, out of the plane, where there are no blocks


def damping_at_start(scenario: Scenario, table: SoilTable) -> tuple[float, float]:
    """Return the rate (1/s) of damping at the start, and the time (s) when it ends; none where nothing has weight."""
    if scenario.gravity.size == 0.0:
        return 0.0, 0.0
    material = scenario.materials[table.material]
    smoothing, speed = SMOOTHING * table.spacing, wave_speed(material)
    if table.start == "ramp":
        return SETTLING * math.sqrt(material.young_modulus / material.density) / smoothing, RAMP_TIME
    return SHOCK_DAMPING * speed / smoothing, SHOCK_TIME * smoothing / speed


def friction_with(scenario: Scenario, soil: str, partner: str, *, ground: bool) -> contact.PairFriction:
    """Return the friction of a soil's material with another one; `ground` for the ground (GROUND) and walls.

    As [pairs] has it, else that of the soil itself, as on a rough face: [friction] is about blocks. Over the factor of
    [strength].
    """
    pair = resolve_pair(scenario, soil, partner, ground=ground)
    if pair.rules["friction"].startswith("pairs."):
        return pair.friction
    own = contact.PairFriction(static=math.tan(scenario.materials[soil].friction_angle or 0.0))
    return own.over(scenario.strength.divisor("joints"))


def geostatic_stress(scenario: Scenario, table: SoilTable, places: system.Floats) -> system.Floats:
    """Return xx, yy, zz and xy (Pa, tension positive, (4, n)) at places (m, (n, 2)) of a soil; zero with a ramp.

    The vertical stress is the weight of all soil straight above, the horizontal ones K0 times that.
    """
    stress = np.zeros((4, len(places)))
    if table.start == "ramp":
        return stress
    weight = np.zeros(len(places))
    gravity = -scenario.gravity.pull(scenario.ground.tilt)[1]
    for other in placement.soil_tables(scenario):
        density = scenario.materials[other.material].density
        weight += density * gravity * geometry.height_above(other.corners, places)
    at_rest = earth_pressure_at_rest(scenario.materials[table.material])
    stress[0] = stress[2] = -at_rest * weight
    stress[1] = -weight
    return stress


def known_errors(model: Model) -> Iterator[str]:
    """Yield a warning for each load that soil does not feel, and for thrusts that are known to be too small."""
    for number, load in enumerate(model.scenario.loads):
        if isinstance(load, loads.Horizontal | loads.Gravity):
            key = overrides.format_key(("loads", load.name or number))
            both = "ground.tilt turns the gravity of both"
            if isinstance(load, loads.Horizontal):
                both = f"gravity = {{ horizontal = {load.magnitude:g} }} pushes both"
            yield f"{key}: soil does not feel this load, blocks alone do; {both}"
    for soil in model.soils:
        is_rough = friction_with(model.scenario, soil.material, GROUND, ground=True).static > 0.0
        if is_rough and _is_beside_a_block(model.bodies, soil):
            rows = geometry.count_across(soil.corners, soil.spacing)[1]
            near, far = (per_row / rows + more for per_row, more in LACK[soil.gradient])
            key = overrides.format_key(("soils", soil.name, "gradient" if soil.gradient == "raw" else "spacing"))
            smooth = overrides.format_key(("pairs", soil.material, GROUND, "friction"))
            yield (
                f"{key}: with {soil.gradient} gradients and {rows} rows of particles on a rough base the active thrust "
                f"on blocks is some {near:.0%} too small once they have moved by 1 % of its height, {far:.0%} after "
                f"3 %, and more on a battered back; with {smooth} = 0 nothing is missing"
            )


def _is_beside_a_block(placed: Iterable[PlacedBody], soil: SoilTable) -> bool:
    """Return True if a block that may move is less than a spacing to the left or right of a soil."""
    moved = [soil.corners + np.array([way, 0.0]) for way in (-soil.spacing, soil.spacing)]
    for body in placed:
        if body.driven or not body.fixed:
            place = (np.array([value]) for value in (body.x, body.y, body.angle))
            corners = blocks.placed_points(np.array([body.corners]), *place)[0]
            if any(geometry.overlap(one, corners) for one in moved):
                return True
    return False


def body_contacts(soils: Any, world: Any) -> system.BodyContacts:
    """Return the contacts of soils with bodies."""
    touches = soils.touches[: int(soils.controls["touch_count"][0])]
    touches = touches[touches["normal_force"] > 0.0].view(np.ndarray)
    particle, body = touches["particle"], touches["body"]
    kind = soils.states["kind"][particle]
    push, rub = touches["normal_force"], touches["shear_force"]
    fx, fy, square = touches["fx"], touches["fy"], push**2 + rub**2
    normal = np.stack([push * fx - rub * fy, rub * fx + push * fy], axis=-1) / square[:, None]  # away from the body
    apart = float(soils.controls["radius"][0]) - touches["depth"]
    centre = np.stack([soils.points["x"][particle], soils.points["y"][particle]], axis=-1)
    friction = soils.interactions["static_friction"][kind, world.bodies["contact_class"][body]]
    place, numbers = centre - apart[:, None] * normal, (body.astype(np.intp), kind.astype(np.intp))
    return system.BodyContacts(*numbers, place, -normal, push, -rub, friction)


def kinetic_energy(soils: Any) -> float:
    """Return the kinetic energy (J) of all particles."""
    points = soils.points
    return 0.5 * float(np.sum(soils.kinds["mass"][soils.states["kind"]] * (points["vx"] ** 2 + points["vy"] ** 2)))


def mean_unrest(soils: Any, world: Any) -> float:
    """Return the mean force on particles that is not balanced, over their mean weight; without weight over nothing."""
    mass, controls = soils.kinds["mass"][soils.states["kind"]], world.controls[0]
    gravity_x, gravity_y = float(controls.gravity_x), float(controls.gravity_y)
    forces = np.hypot(soils.states["fx"] + mass * gravity_x, soils.states["fy"] + mass * gravity_y)
    return float(forces.mean()) / (float(mass.mean()) * math.hypot(gravity_x, gravity_y) or math.inf)


def halt(soils: Any) -> None:
    """Take the velocities of all particles away; what they held is lost to settling."""
    soils.tallies["settling"][0] += kinetic_energy(soils)
    soils.points["vx"] = soils.points["vy"] = 0.0


def begin(soils: Any) -> None:
    """Begin the books of soils anew; what damps them at the start has done so."""
    for name in soils.tallies.dtype.names:
        soils.tallies[name] = 0.0
    soils.kinds["settled"] = 0.0


def lifts_of(model: Model) -> int:
    """Return in how many lifts soil is filled in."""
    return max(table.lifts for table in model.soils)


def in_lifts(model: Model, count: int) -> tuple[system.Elements, system.Indices]:
    """Return the particles with the stresses of the first so many lifts alone, and the numbers of those in them."""
    whole, corners = elements_of(model), [table.corners for table in model.soils]
    low, high = min(one[:, 1].min() for one in corners), max(one[:, 1].max() for one in corners)
    level = low + count / lifts_of(model) * (high - low)
    start, kinds = whole.start.copy(), np.array([name.rpartition(".")[0] for name in whole.names])
    for table in model.soils:
        own = kinds == table.name
        above = np.stack([start[0, own], np.full(np.count_nonzero(own), level)], axis=-1)
        start[4:8, own] -= geostatic_stress(model.scenario, table, above)
    return replace(whole, start=start), np.flatnonzero(start[1] <= level)


def parts_of(track: system.Track) -> dict[str, system.Indices]:
    """Return the numbers of the particles of each soil; they are called SOIL.NUMBER."""
    owners = np.array([name.rpartition(".")[0] for name in track.names])
    return {str(name): np.flatnonzero(owners == name) for name in dict.fromkeys(owners.tolist())}


def connected_span(x: system.Floats, gap: float) -> tuple[float, float]:
    """Return the ends (m) of the part around the median that no gap (m) interrupts."""
    ordered = np.sort(x)
    breaks = np.flatnonzero(np.diff(ordered) > gap)
    middle = len(ordered) // 2
    first = breaks[breaks < middle].max(initial=-1) + 1
    last = breaks[breaks >= middle].min(initial=len(ordered) - 1)
    return float(ordered[first]), float(ordered[last])


def final_table(model: Model, track: system.Track) -> system.Table:
    """Return the table of the last frame: a row for each soil.

    left and right end the part without a gap of 2 spacings, first and last particle wherever they are. The back is the
    end at a wall, so that it is the same in all runs of a scenario; where both or neither are, the one that has moved
    less by more than a spacing, else the left one. The height there is that of the highest particle within 2 spacings.
    At rest is what is slower than time.rest_speed.
    """
    names = ("soil", "left_mm", "right_mm", "first_mm", "last_mm", "back", "back_height_mm", "at_rest")
    rows = []
    for name, own in parts_of(track).items():
        spacing = float(track["spacing"][own[0]])
        half = 0.5 * spacing
        x, y, vx, vy = (track[name][-1, own] for name in ("x", "y", "vx", "vy"))
        left, right = connected_span(x, GAP * spacing)
        is_left = _is_left_back(track, own, model.scenario, (left, right))
        near = x <= left + BACK * spacing if is_left else x >= right - BACK * spacing
        near &= (x >= left) & (x <= right)
        ends = (left - half, right + half, x.min() - half, x.max() + half)
        height = MILLI * float(y[near].max() + half)
        rests = float(np.mean(np.hypot(vx, vy) < model.scenario.time.rest_speed))
        rows.append((name, *(MILLI * float(end) for end in ends), "left" if is_left else "right", height, rests))
    return dict(zip(names, map(list, zip(*rows, strict=True)), strict=True))


def _is_left_back(track: system.Track, own: system.Indices, scenario: Scenario, ends: tuple[float, float]) -> bool:
    """Return True if the left end of a soil is its back; `ends` are where it ends now (m)."""
    near = GAP * float(track["spacing"][own[0]])
    x, y = track.at_start("x")[own], track.at_start("y")[own]
    left, right, bottom, top = float(x.min()), float(x.max()), float(y.min()), float(y.max())

    def is_at_wall(end: float) -> bool:
        """Return True if a wall steeper than 45 degrees stands near an end, at some of these heights."""
        for (x0, y0), (x1, y1) in ((wall.start, wall.end) for wall in scenario.walls):
            is_near = min(x0, x1) <= end + near and max(x0, x1) >= end - near
            if abs(y1 - y0) > abs(x1 - x0) and is_near and min(y0, y1) < top and max(y0, y1) > bottom:
                return True
        return False

    at_left, at_right = is_at_wall(left), is_at_wall(right)
    if at_left != at_right:
        return at_left
    return abs(ends[0] - left) <= abs(ends[1] - right) + float(track["spacing"][own[0]])


def surface(track: system.Track, frame: int) -> list[system.Floats]:
    """Return for each soil lines (m, (k, 2)) through the highest points of columns of two spacings.

    Columns in which there is no particle interrupt the line.
    """
    lines: list[system.Floats] = []
    for own in parts_of(track).values():
        spacing = float(track["spacing"][own[0]])
        x, y = track["x"][frame, own], track["y"][frame, own]
        width = COLUMN * spacing
        first = int(np.floor(x.min() / width))
        column = np.floor(x / width).astype(np.intp) - first
        tops = np.full(int(column.max()) + 1, -np.inf)
        np.maximum.at(tops, column, y)
        there = np.flatnonzero(np.isfinite(tops))
        line = np.stack([width * (first + there + 0.5), tops[there] + 0.5 * spacing], axis=-1)
        lines += np.split(line, np.flatnonzero(np.diff(there) > 1) + 1)
    return lines


def displacement(track: system.Track) -> system.Floats:
    """Return how far (m) particles are from where they began."""
    return np.asarray(np.hypot(track["x"] - track.at_start("x"), track["y"] - track.at_start("y")))


def pressure(track: system.Track) -> system.Floats:
    """Return mean pressures (Pa), averaged over neighbours; for pictures only.

    Particles share theirs out to the cells of a grid of one spacing, cells average over the next ones, and particles
    take it back: all linear, about two spacings wide.
    """
    raw = -(track["sxx"] + track["syy"] + track["szz"]) / 3.0
    spacing = float(track["spacing"][0])
    return np.stack([_smoothed(*one, spacing) for one in zip(track["x"], track["y"], raw, strict=True)])


def _smoothed(x: system.Floats, y: system.Floats, values: system.Floats, spacing: float) -> system.Floats:
    known = np.isfinite(x + y + values)
    if not known.any():
        return values
    places = ((one[known] - one[known].min()) / spacing + SMOOTHED for one in (x, y))
    i, j = (np.clip(one, SMOOTHED, 1e7).astype(np.int64) for one in places)
    row = int(j.max()) + 3
    cells, at = np.unique(i * row + j, return_inverse=True)
    held: system.Floats = np.stack([np.bincount(at), np.bincount(at, values[known])]).astype(np.float64)
    for _ in range(SMOOTHED):
        more = held.copy()
        for step in (row, -row, 1, -1):  # every cell gives a half to the four next to it, where they are
            place = np.searchsorted(cells, cells + step).clip(max=len(cells) - 1)
            there = cells[place] == cells + step
            more[:, there] += 0.5 * held[:, place[there]]
        held = more
    result = values.copy()
    result[known] = (held[1] / held[0])[at]
    return result


SHADES = (
    system.Shade("displacement", "displacement (mm)", lambda track: MILLI * displacement(track)),
    system.Shade("speed", "speed (mm/s)", lambda track: MILLI * np.hypot(track["vx"], track["vy"])),
    system.Shade("plastic", "plastic shear strain", lambda track: track["plastic"]),
    system.Shade("pressure", "mean pressure (kPa), smoothed", lambda track: KILO * pressure(track)),
)


def elements_of(model: Model) -> system.Elements:
    """Return the particles of all soils of a scenario."""
    scenario, tables = model.scenario, model.soils
    filled = [start.particle_places(table, model.bodies) for table in tables]
    places, areas = [one for one, _ in filled], [area / len(one) for one, area in filled]  # m, (n, 2); m2 of each
    soils = [*zip(tables, places, strict=True)]
    names = tuple(f"{table.name}.{number}" for table, one in soils for number in range(1, len(one) + 1))
    depth = depth_of_scene(model)
    densities = [scenario.materials[table.material].density for table in tables]
    each = [density * area * depth for density, area in zip(densities, areas, strict=True)]
    masses = np.repeat(each, [len(one) for one in places])
    constants = np.stack([masses, np.full(len(names), tables[0].spacing)])
    initial = np.zeros((len(QUANTITIES), len(names)))
    initial[:2] = np.concatenate(places).T
    initial[4:8] = np.concatenate([geostatic_stress(scenario, *one) for one in soils], axis=1)
    return system.Elements(names, constants, initial)


def _state(soils: Any, count: int) -> system.Floats:
    number = soils.states["number"]
    values: system.Floats = np.full((len(QUANTITIES), count), np.nan)  # of those that are not filled in yet
    for row, quantity in enumerate(QUANTITIES):
        holder = soils.points if row < 4 else soils.states
        values[row, number] = holder[quantity.name]
    return values


def _largest_step(model: Model) -> float:
    scenario, tables = model.scenario, model.soils
    usual = float(timeline.Explicit.model_fields["safety"].default)
    finer = min(1.0, float(getattr(scenario.time, "safety", usual)) / usual)  # a finer step is finer for all
    courant = 0.4 * finer  # step in smoothing lengths that a wave passes
    return min(courant * SMOOTHING * table.spacing / wave_speed(scenario.materials[table.material]) for table in tables)


def soil_kernels() -> Any:
    """Return the module soil_arrays.py, only once it is needed: readers of stored runs compile nothing."""
    return import_module("blocksim.world.systems.soil_arrays")


SOILS = system.System(
    name="soils",
    element="particle",
    quantities=QUANTITIES,
    constants=CONSTANTS,
    outputs=(
        system.Channel("x", "m", "place along the ground", "x_mm", MILLI),
        system.Channel("y", "m", "place above the ground", "y_mm", MILLI),
        system.Channel("vx", "m/s", "velocity along the ground", "vx_mm_s", MILLI),
        system.Channel("vy", "m/s", "velocity normal to the ground", "vy_mm_s", MILLI),
        system.Channel("displacement", "m", "distance from where it began", "displacement_mm", MILLI, displacement),
        system.Channel("sxx", "Pa", "stress along the ground, tension positive", "sxx_Pa"),
        system.Channel("syy", "Pa", "stress normal to the ground, tension positive", "syy_Pa"),
        system.Channel("szz", "Pa", "stress out of the plane, tension positive", "szz_Pa"),
        system.Channel("sxy", "Pa", "shear stress", "sxy_Pa"),
        system.Channel("pressure", "Pa", "mean pressure, averaged over neighbours", "pressure_Pa", formula=pressure),
        system.Channel("plastic", "1", "accumulated plastic shear strain", "plastic_strain"),
    ),
    elements=elements_of,
    state=_state,
    outlines=lambda track, chosen: system.discs(track, chosen, 0.5 * track["spacing"]),
    energies=ENERGIES,
    build=lambda model: soil_kernels().build_soils(model),
    largest_step=_largest_step,
    stages=lambda: soil_kernels().STAGES,
    relaxation=system.Relaxation(
        kinetic_energy, mean_unrest, halt, begin, lifts_of, lambda *args: soil_kernels().with_lift(*args)
    ),
    cost=COST,
    dearer=lambda model: max(GRADIENT_COST[table.gradient] for table in model.soils),
    parts=lambda model: tuple(table.name for table in model.soils),
    touching=body_contacts,
    shades=SHADES,
    ending=final_table,
    profile=surface,
    warnings=known_errors,
)
