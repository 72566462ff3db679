"""Soils: elasto-plastic bodies of particles; see blocksim/kernels/soil and the tables [[soils]] of scenarios."""

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from blocksim.scenario import Scenario, place_bodies, place_segments, polygons
from blocksim.scenario.models.soil import SoilTable
from blocksim.scenario.models.stepping import Explicit
from blocksim.scenario.soil_places import soil_tables
from blocksim.world.systems.soil_kinds import (
    RAMP,
    SMOOTHING,
    depth_of_scene,
    interactions_with,
    kind_records,
    wave_speed,
)
from blocksim.world.systems.soil_shown import (
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
    Indices,
    Output,
    Quantity,
    System,
    Track,
    discs,
    stored,
)

if TYPE_CHECKING:
    from blocksim.kernels.soil.arrays import Soils

COURANT = 0.4  # step in smoothing lengths that a wave passes
# Factor of artificial viscosity. Sheared soil feels a c h/8 of it, a resistance that the material does not have; in the
# thin front of a collapse 0.03 is several times the friction of its weight. It is there to damp waves: with 0.003 a
# collapse loses 2 to 4 % of its energy to it, pressures at rest and thrusts stay as they are. A numerical choice.
VISCOSITY = 0.003
SKIN = 0.4  # of lists, in spacings
MILLI = 1e3
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
FEW_TOUCHES = 128
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


def _places(scenario: Scenario) -> list[Floats]:
    """Return the places (m, (n, 2)) of the particles of each soil."""
    return [polygons.filled(table.corners, table.spacing) for table in soil_tables(scenario)]


def _masses(scenario: Scenario, tables: list[SoilTable]) -> list[float]:
    depth = depth_of_scene(scenario)
    return [scenario.materials[table.material].density * table.spacing**2 * depth for table in tables]


def _elements(scenario: Scenario) -> Elements:
    tables, places = soil_tables(scenario), _places(scenario)
    names = tuple(
        f"{table.name}.{number}" for table, one in zip(tables, places, strict=True) for number in range(1, len(one) + 1)
    )
    masses = np.repeat(_masses(scenario, tables), [len(one) for one in places])
    constants = np.stack([masses, np.full(len(names), tables[0].spacing)])
    start = np.zeros((len(QUANTITIES), len(names)))
    start[:2] = np.concatenate(places).T
    start[4:8] = np.concatenate(
        [geostatic_stress(scenario, table, one) for table, one in zip(tables, places, strict=True)], axis=1
    )
    return Elements(names, constants, start)


def _words(count: int | tuple[int, int]) -> Any:
    """Return zeros that start on a cache line."""
    from blocksim.kernels.common.arrays import zeros  # noqa: PLC0415 - kernels, not for readers

    plain: Any = np.dtype(np.uint32)
    return zeros(count, plain).view(np.ndarray)


def _build(scenario: Scenario) -> "Soils":
    from blocksim.kernels.common.arrays import zeros  # noqa: PLC0415 - kernels, not for readers
    from blocksim.kernels.soil.arrays import (  # noqa: PLC0415
        GROUP,
        HISTORY,
        NEIGHBOURS,
        POINT,
        STATE,
        TALLY,
        TOUCH,
        Soils,
    )

    tables, places = soil_tables(scenario), _places(scenario)
    start = _elements(scenario).start
    n = start.shape[1]
    points, states = zeros(n, POINT), zeros(n, STATE)
    for number, quantity in enumerate(QUANTITIES):
        holder = points if number < 4 else states
        holder[quantity.name] = start[number]
    states["number"] = np.arange(n)
    states["kind"] = np.repeat(np.arange(len(tables)), [len(one) for one in places])
    groups = math.ceil(n / GROUP)
    room = n + FEW_TOUCHES
    bodies = len(place_bodies(scenario)) + len(place_segments(scenario)) + 1
    return Soils(
        points=points,
        states=states,
        kinds=kind_records(scenario, tables),
        interactions=interactions_with(scenario, tables),
        order=_words(n),
        starts=_words(3 * n // 2 + 3),
        lists=_words((groups, GROUP * NEIGHBOURS)),
        lengths=_words(n),
        touches=zeros(room, TOUCH),
        kept=zeros(room, HISTORY),
        by_body=_words(room),
        begins=_words(bodies + 1),
        tallies=zeros(groups, TALLY),
        spare_point=zeros(1, POINT),
        spare_state=zeros(1, STATE),
        controls=_controls(scenario, tables),
    )


def _controls(scenario: Scenario, tables: list[SoilTable]) -> Any:
    from blocksim.kernels.common.arrays import zeros  # noqa: PLC0415 - as in _stages
    from blocksim.kernels.soil.arrays import CONTROLS  # noqa: PLC0415
    from blocksim.kernels.sph.wendland_c2 import SUPPORT  # noqa: PLC0415

    spacing = tables[0].spacing
    controls = zeros(1, CONTROLS)
    one = controls[0]
    one.area = spacing**2
    one.smoothing = SMOOTHING * spacing
    one.reach = SUPPORT * one.smoothing
    one.skin = SKIN * spacing
    one.radius = 0.5 * spacing
    one.viscosity = VISCOSITY
    one.ramp = RAMP if any(table.start == "ramp" for table in tables) else 0.0
    one.blocks = len(place_bodies(scenario))
    one.is_uniform = len(tables) == 1
    return controls


def _state(soils: "Soils", count: int) -> Floats:
    number = soils.states["number"]
    values: Floats = np.empty((len(QUANTITIES), count))
    for row, quantity in enumerate(QUANTITIES):
        holder = soils.points if row < 4 else soils.states
        values[row, number] = holder[quantity.name]
    return values


def _outlines(track: Track, chosen: Indices) -> Floats:
    return discs(track, chosen, 0.5 * track["spacing"])


def _largest_step(scenario: Scenario) -> float:
    tables = soil_tables(scenario)
    usual = float(Explicit.model_fields["safety"].default)
    courant = COURANT * min(
        1.0, float(getattr(scenario.time, "safety", usual)) / usual
    )  # a finer step is finer for all
    return min(courant * SMOOTHING * table.spacing / wave_speed(scenario.materials[table.material]) for table in tables)


def _dearer(scenario: Scenario) -> float:
    return CORRECTED if any(table.gradient == "corrected" for table in soil_tables(scenario)) else 1.0


def _stages() -> Any:
    from blocksim.kernels.common.systems import Stages  # noqa: PLC0415
    from blocksim.kernels.soil.energy import measure, survey  # noqa: PLC0415 - readers of stored runs compile nothing
    from blocksim.kernels.soil.step import finish, start  # noqa: PLC0415

    return Stages(start, finish, survey, measure)


def soils_and_soils() -> Any:
    """Return how soils act on themselves."""
    from blocksim.kernels.soil.step import flow  # noqa: PLC0415

    return flow


def soils_and_blocks() -> Any:
    """Return how soils and blocks act on one another."""
    from blocksim.kernels.soil.contact import touch_blocks  # noqa: PLC0415

    return touch_blocks


def soils_and_supports() -> Any:
    """Return how soils and supports act on one another."""
    from blocksim.kernels.soil.contact import touch_supports  # noqa: PLC0415

    return touch_supports


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
    elements=_elements,
    state=_state,
    outlines=_outlines,
    energies=ENERGIES,
    build=_build,
    largest_step=_largest_step,
    stages=_stages,
    cost=COST,
    dearer=_dearer,
    parts=part_names,
    touching=touching,
    shades=SHADES,
    ending=ending,
    profile=surface,
    warnings=weak_thrusts,
)
