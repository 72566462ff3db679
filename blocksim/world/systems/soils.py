"""Soils: elasto-plastic bodies of particles; see blocksim/kernels/soil and the tables [[soils]] of scenarios."""

from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np

from blocksim.scenario import Scenario, polygons
from blocksim.scenario.models.stepping import Explicit
from blocksim.scenario.soil_places import soil_tables
from blocksim.world.systems.soil_kinds import (
    SMOOTHING,
    depth_of_scene,
    wave_speed,
)
from blocksim.world.systems.soil_shown import (
    MILLI,
    SHADES,
    displacement,
    ending,
    part_names,
    pressure,
    surface,
    touching,
)
from blocksim.world.systems.soil_start import geostatic_stress
from blocksim.world.systems.soil_thrust import weak_thrusts
from blocksim.world.systems.system import (
    Cost,
    Elements,
    Floats,
    Output,
    Quantity,
    System,
    discs,
    stored,
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
    return [polygons.filled(table.corners, table.spacing) for table in soil_tables(scenario)]


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
        Output("x", "m", "place along the ground", "x_mm", stored("x"), MILLI),
        Output("y", "m", "place above the ground", "y_mm", stored("y"), MILLI),
        Output("vx", "m/s", "velocity along the ground", "vx_mm_s", stored("vx"), MILLI),
        Output("vy", "m/s", "velocity normal to the ground", "vy_mm_s", stored("vy"), MILLI),
        Output("displacement", "m", "distance from where it began", "displacement_mm", displacement, MILLI),
        Output("sxx", "Pa", "stress along the ground, tension positive", "sxx_Pa", stored("sxx")),
        Output("syy", "Pa", "stress normal to the ground, tension positive", "syy_Pa", stored("syy")),
        Output("szz", "Pa", "stress out of the plane, tension positive", "szz_Pa", stored("szz")),
        Output("sxy", "Pa", "shear stress", "sxy_Pa", stored("sxy")),
        Output("pressure", "Pa", "mean pressure, averaged over neighbours", "pressure_Pa", pressure),
        Output("plastic", "1", "accumulated plastic shear strain", "plastic_strain", stored("plastic")),
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
    touching=touching,
    shades=SHADES,
    ending=ending,
    profile=surface,
    warnings=weak_thrusts,
)
