"""What is shown of soils: where they press against bodies, how far they have come, their surface, smoothed pressure.

Soils: elasto-plastic bodies of particles; see blocksim/kernels/soil and the tables [[soils]] of scenarios.
"""

from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np

from blocksim.scenario import Scenario, geometry
from blocksim.scenario.models.stepping import Explicit
from blocksim.scenario.start import soil_tables
from blocksim.world.systems.soil_materials import SMOOTHING, depth_of_scene, geostatic_stress, wave_speed, weak_thrusts
from blocksim.world.systems.system import (
    BodyContacts,
    Cost,
    Elements,
    Floats,
    Indices,
    Output,
    Quantity,
    Shade,
    System,
    Table,
    Track,
    discs,
    quantity_as_stored,
)

MILLI, KILO = 1e3, 1e-3
GAP = 2.0  # spacings without a particle that end the connected part
COLUMN = 2.0  # spacings, of the surface
BACK = 2.0  # spacings from the end in which the height at the back is taken
SMOOTHED = 2  # times that pressure is averaged over neighbouring cells of one spacing


def body_contacts(soils: Any, world: Any) -> BodyContacts:
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
    return BodyContacts(
        body.astype(np.intp), kind.astype(np.intp), centre - apart[:, None] * normal, -normal, push, -rub, friction
    )


def part_names(scenario: Scenario) -> tuple[str, ...]:
    """Return the names of the soils."""
    return tuple(table.name for table in soil_tables(scenario))


def parts_of(track: Track) -> dict[str, Indices]:
    """Return the numbers of the particles of each soil; they are called SOIL.NUMBER."""
    owners = np.array([name.rpartition(".")[0] for name in track.names])
    return {str(name): np.flatnonzero(owners == name) for name in dict.fromkeys(owners.tolist())}


def connected_span(x: Floats, gap: float) -> tuple[float, float]:
    """Return the ends (m) of the part around the median that no gap (m) interrupts."""
    ordered = np.sort(x)
    breaks = np.flatnonzero(np.diff(ordered) > gap)
    middle = len(ordered) // 2
    first = breaks[breaks < middle].max(initial=-1) + 1
    last = breaks[breaks >= middle].min(initial=len(ordered) - 1)
    return float(ordered[first]), float(ordered[last])


def final_table(scenario: Scenario, track: Track) -> Table:
    """Return the table of the last frame: a row for each soil.

    left and right end the part without a gap of 2 spacings, first and last particle wherever they are. The back is the
    end at a wall, so that it is the same in all runs of a scenario; where both or neither are, the one that has moved
    less by more than a spacing, else the left one. The height there is that of the highest particle within 2 spacings.
    At rest is what is slower than time.rest_speed.
    """
    names = ("soil", "left_mm", "right_mm", "first_mm", "last_mm", "back", "back_height_mm", "at_rest")
    rows = [_ending_of(track, own, scenario) for own in parts_of(track).values()]
    columns = [list(parts_of(track)), *(list(column) for column in zip(*rows, strict=True))]
    return dict(zip(names, columns, strict=True))


def _ending_of(track: Track, own: Indices, scenario: Scenario) -> tuple[Any, ...]:
    spacing = float(track["spacing"][own[0]])
    half = 0.5 * spacing
    x, y, vx, vy = (track[name][-1, own] for name in ("x", "y", "vx", "vy"))
    left, right = connected_span(x, GAP * spacing)
    is_left = _is_left_back(track, own, scenario, (left, right))
    near = x <= left + BACK * spacing if is_left else x >= right - BACK * spacing
    near &= (x >= left) & (x <= right)
    ends = (left - half, right + half, x.min() - half, x.max() + half)
    height = MILLI * float(y[near].max() + half)
    rests = float(np.mean(np.hypot(vx, vy) < scenario.time.rest_speed))
    return (*(MILLI * float(end) for end in ends), "left" if is_left else "right", height, rests)


def _is_left_back(track: Track, own: Indices, scenario: Scenario, ends: tuple[float, float]) -> bool:
    """Return True if the left end of a soil is its back; `ends` are where it ends now (m)."""
    spacing = float(track["spacing"][own[0]])
    x, y = track.at_start("x")[own], track.at_start("y")[own]
    left, right = float(x.min()), float(x.max())
    at_left, at_right = (_is_at_wall(end, (float(y.min()), float(y.max())), spacing, scenario) for end in (left, right))
    if at_left != at_right:
        return at_left
    return abs(ends[0] - left) <= abs(ends[1] - right) + spacing


def _is_at_wall(end: float, heights: tuple[float, float], spacing: float, scenario: Scenario) -> bool:
    """Return True if a wall steeper than 45 degrees stands within GAP spacings of an end at some of these heights."""
    for wall in scenario.walls:
        (x0, y0), (x1, y1) = wall.start, wall.end
        is_steep = abs(y1 - y0) > abs(x1 - x0)
        is_near = min(x0, x1) <= end + GAP * spacing and max(x0, x1) >= end - GAP * spacing
        if is_steep and is_near and min(y0, y1) < heights[1] and max(y0, y1) > heights[0]:
            return True
    return False


def surface(track: Track, frame: int) -> list[Floats]:
    """Return for each soil lines (m, (k, 2)) through the highest points of columns of two spacings.

    Columns in which there is no particle interrupt the line.
    """
    return [line for own in parts_of(track).values() for line in _surface_of(track, frame, own)]


def _surface_of(track: Track, frame: int, own: Indices) -> list[Floats]:
    spacing = float(track["spacing"][own[0]])
    x, y = track["x"][frame, own], track["y"][frame, own]
    width = COLUMN * spacing
    first = int(np.floor(x.min() / width))
    column = np.floor(x / width).astype(np.intp) - first
    tops = np.full(int(column.max()) + 1, -np.inf)
    np.maximum.at(tops, column, y)
    there = np.flatnonzero(np.isfinite(tops))
    line = np.stack([width * (first + there + 0.5), tops[there] + 0.5 * spacing], axis=-1)
    return np.split(line, np.flatnonzero(np.diff(there) > 1) + 1)


def displacement(track: Track) -> Floats:
    """Return how far (m) particles are from where they began."""
    return np.asarray(np.hypot(track["x"] - track.at_start("x"), track["y"] - track.at_start("y")))


def speed(track: Track) -> Floats:
    """Return speeds (m/s)."""
    return np.asarray(np.hypot(track["vx"], track["vy"]))


def pressure(track: Track) -> Floats:
    """Return mean pressures (Pa), averaged over neighbours; for pictures only.

    Particles share theirs out to the cells of a grid of one spacing, cells average over the next ones, and particles
    take it back: all linear, about two spacings wide.
    """
    raw = -(track["sxx"] + track["syy"] + track["szz"]) / 3.0
    spacing = float(track["spacing"][0])
    return np.stack([_smoothed(*one, spacing) for one in zip(track["x"], track["y"], raw, strict=True)])


def _smoothed(x: Floats, y: Floats, values: Floats, spacing: float) -> Floats:
    known = np.isfinite(x + y + values)
    if not known.any():
        return values
    u, v = ((one - one[known].min()) / spacing + SMOOTHED for one in (x, y))
    i, j = (np.clip(np.nan_to_num(one), SMOOTHED, 1e7).astype(np.int64) for one in (u, v))
    cells, at = np.unique(np.stack([i, j], axis=-1)[known], axis=0, return_inverse=True)
    at = at.ravel()
    count: Floats = np.bincount(at).astype(np.float64)
    total: Floats = np.bincount(at, values[known]).astype(np.float64)
    for _ in range(SMOOTHED):
        count, total = _shared(cells, count, total)
    result = values.copy()
    result[known] = (total / count)[at]
    return result


def _shared(cells: Any, count: Floats, total: Floats) -> tuple[Floats, Floats]:
    """Return what cells hold, (k, 2) of them, after each has given a half to the four next to it, where they are."""
    keys = cells[:, 0] * (cells[:, 1].max() + 3) + cells[:, 1]  # in order, as cells are
    own = np.arange(len(cells))
    found = [count.copy(), total.copy()]
    for step in (cells[:, 1].max() + 3, -(cells[:, 1].max() + 3), 1, -1):
        place = np.searchsorted(keys, keys + step).clip(max=len(keys) - 1)
        there = keys[place] == keys + step
        for held, gets in zip((count, total), found, strict=True):
            gets[own[there]] += 0.5 * held[place[there]]
    return found[0], found[1]


SHADES = (
    Shade("displacement", "displacement (mm)", lambda track: MILLI * displacement(track)),
    Shade("speed", "speed (mm/s)", lambda track: MILLI * speed(track)),
    Shade("plastic", "plastic shear strain", lambda track: track["plastic"]),
    Shade("pressure", "mean pressure (kPa), smoothed", lambda track: KILO * pressure(track)),
)


COURANT = 0.4  # step in smoothing lengths that a wave passes
# J, as kernels/soil/energy.py measures them; the last six are losses
ENERGIES = (
    "kinetic",
    "potential",
    "elastic",
    "contact",
    "plastic",
    "viscosity",
    "dashpot",
    "friction",
    "settling",
    "ramp",
)
COST = Cost(seconds=200e-9, memory=395)  # measured, with raw gradients
CORRECTED = 1.5  # time of a step with corrected gradients over that, measured
QUANTITIES = (
    Quantity("x", "m"),
    Quantity("y", "m"),
    Quantity("vx", "m/s"),
    Quantity("vy", "m/s"),
    Quantity("sxx", "Pa"),  # tension positive
    Quantity("syy", "Pa"),
    Quantity("szz", "Pa"),
    Quantity("sxy", "Pa"),
    Quantity("plastic", "1"),  # accumulated plastic shear strain
)
CONSTANTS = (Quantity("mass", "kg"), Quantity("spacing", "m"))


def places_of(scenario: Scenario) -> list[Floats]:
    """Return the places (m, (n, 2)) of the particles of each soil."""
    return [geometry.fill_lattice(table.corners, table.spacing) for table in soil_tables(scenario)]


def elements_of_soils(scenario: Scenario) -> Elements:
    """Return the particles of all soils of a scenario."""
    tables, places = soil_tables(scenario), places_of(scenario)
    names = tuple(
        f"{table.name}.{number}" for table, one in zip(tables, places, strict=True) for number in range(1, len(one) + 1)
    )
    depth = depth_of_scene(scenario)
    densities = [scenario.materials[table.material].density for table in tables]
    each = [density * table.spacing**2 * depth for density, table in zip(densities, tables, strict=True)]
    masses = np.repeat(each, [len(one) for one in places])
    constants = np.stack([masses, np.full(len(names), tables[0].spacing)])
    start = np.zeros((len(QUANTITIES), len(names)))
    start[:2] = np.concatenate(places).T
    start[4:8] = np.concatenate(
        [geostatic_stress(scenario, table, one) for table, one in zip(tables, places, strict=True)], axis=1
    )
    return Elements(names, constants, start)


def _state(soils: Any, count: int) -> Floats:
    number = soils.states["number"]
    values: Floats = np.empty((len(QUANTITIES), count))
    for row, quantity in enumerate(QUANTITIES):
        holder = soils.points if row < 4 else soils.states
        values[row, number] = holder[quantity.name]
    return values


def _largest_step(scenario: Scenario) -> float:
    tables = soil_tables(scenario)
    usual = float(Explicit.model_fields["safety"].default)
    courant = COURANT * min(
        1.0, float(getattr(scenario.time, "safety", usual)) / usual
    )  # a finer step is finer for all
    return min(courant * SMOOTHING * table.spacing / wave_speed(scenario.materials[table.material]) for table in tables)


def _dearer(scenario: Scenario) -> float:
    return CORRECTED if any(table.gradient == "corrected" for table in soil_tables(scenario)) else 1.0


def _arrays(name: str) -> Any:
    """Return what is called so in soil_arrays.py: readers of stored runs compile nothing."""
    return getattr(import_module("blocksim.world.systems.soil_arrays"), name)


def _build(scenario: Scenario) -> Any:
    return _arrays("build_soils")(scenario)


def soils_and(other: str) -> Callable[[], Any]:
    """Return what gives the function by which soils and another system act on one another."""
    return lambda: _arrays("ACTS")[other]


SOILS = System(
    name="soils",
    element="particle",
    quantities=QUANTITIES,
    constants=CONSTANTS,
    outputs=(
        Output("x", "m", "place along the ground", "x_mm", quantity_as_stored("x"), MILLI),
        Output("y", "m", "place above the ground", "y_mm", quantity_as_stored("y"), MILLI),
        Output("vx", "m/s", "velocity along the ground", "vx_mm_s", quantity_as_stored("vx"), MILLI),
        Output("vy", "m/s", "velocity normal to the ground", "vy_mm_s", quantity_as_stored("vy"), MILLI),
        Output("displacement", "m", "distance from where it began", "displacement_mm", displacement, MILLI),
        Output("sxx", "Pa", "stress along the ground, tension positive", "sxx_Pa", quantity_as_stored("sxx")),
        Output("syy", "Pa", "stress normal to the ground, tension positive", "syy_Pa", quantity_as_stored("syy")),
        Output("szz", "Pa", "stress out of the plane, tension positive", "szz_Pa", quantity_as_stored("szz")),
        Output("sxy", "Pa", "shear stress", "sxy_Pa", quantity_as_stored("sxy")),
        Output("pressure", "Pa", "mean pressure, averaged over neighbours", "pressure_Pa", pressure),
        Output("plastic", "1", "accumulated plastic shear strain", "plastic_strain", quantity_as_stored("plastic")),
    ),
    elements=elements_of_soils,
    state=_state,
    outlines=lambda track, chosen: discs(track, chosen, 0.5 * track["spacing"]),
    energies=ENERGIES,
    build=_build,
    largest_step=_largest_step,
    stages=lambda: _arrays("STAGES"),
    cost=COST,
    dearer=_dearer,
    parts=part_names,
    touching=body_contacts,
    shades=SHADES,
    ending=final_table,
    profile=surface,
    warnings=weak_thrusts,
)
