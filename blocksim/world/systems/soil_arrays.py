"""Soils as the arrays that their kernels work on. Only what steps scenes imports this, as it needs the compiler."""

import math
from typing import Any

import numpy as np

from blocksim.kernels.common.arrays import INTERACTION, zeros
from blocksim.kernels.common.systems import Stages
from blocksim.kernels.soil import arrays, contact, step
from blocksim.kernels.sph.functions import WENDLAND_SUPPORT
from blocksim.scenario import GROUND, Model, geometry
from blocksim.scenario.models.soil import RAMP_TIME
from blocksim.world import build, interactions
from blocksim.world.systems import soils, system

STAGES = Stages(step.start, step.finish, step.survey, step.measure)
ACTS = {"soils": step.flow, "blocks": contact.touch_blocks, "supports": contact.touch_supports}
# Factor of artificial viscosity. Sheared soil feels a c h/8 of it, a resistance that the material does not have; in the
# thin front of a collapse 0.03 is several times the friction of its weight. It is there to damp waves: with 0.003 a
# collapse loses 2 to 4 % of its energy to it, pressures at rest and thrusts stay as they are. A numerical choice.
VISCOSITY = 0.003


def build_soils(model: Model) -> arrays.Soils:
    """Return the arrays of the soils of a scenario at time zero."""
    elements = soils.elements_of(model)
    return arrays_of(model, elements, np.arange(len(elements.names)))


def with_lift(model: Model, before: arrays.Soils | None, count: int) -> arrays.Soils:
    """Return the arrays of the first so many lifts, given those of one fewer, or None; what these hold goes on."""
    after = arrays_of(model, *soils.in_lifts(model, count))
    if before is None:
        return after
    place = np.searchsorted(after.states["number"], before.states["number"])
    after.points[place], after.states[place] = before.points, before.states
    for name in ("touches", "kept"):
        getattr(after, name)[: getattr(before, name).size] = getattr(before, name)
    for name in before.tallies.dtype.names or ():
        after.tallies[name][0] = before.tallies[name].sum()
    after.controls["touch_count"] = before.controls["touch_count"]
    after.controls["is_listed"], after.controls["travel"] = 1, np.inf  # new lists, without another start
    return after


def arrays_of(model: Model, elements: system.Elements, chosen: system.Indices) -> arrays.Soils:
    """Return the arrays of some of these particles, in their order."""
    tables, names = model.soils, [elements.names[number] for number in chosen]
    initial, kinds = elements.start[:, chosen], {table.name: number for number, table in enumerate(tables)}
    n = initial.shape[1]
    points, states = zeros(n, arrays.POINT), zeros(n, arrays.STATE)
    for number, quantity in enumerate(soils.QUANTITIES):
        holder = points if number < 4 else states
        holder[quantity.name] = initial[number]
    states["number"] = chosen
    states["kind"] = [kinds[name.rpartition(".")[0]] for name in names]
    groups = max(1, math.ceil(n / arrays.GROUP))
    room = n + 128
    bodies = len(model.bodies) + len(model.segments) + 1
    spacing, controls = tables[0].spacing, zeros(1, arrays.CONTROLS)
    one = controls[0]
    of_tables = np.array([kinds[name.rpartition(".")[0]] for name in elements.names])
    kinds_of = kind_records(model, elements.constants[0][np.searchsorted(of_tables, np.arange(len(tables)))])
    one.volume = kinds_of["volume"][0]
    one.area = one.volume / soils.depth_of_scene(model)
    one.smoothing = soils.SMOOTHING * spacing
    one.reach = WENDLAND_SUPPORT * one.smoothing
    one.skin = 0.4 * spacing  # of lists, in spacings
    one.radius = 0.5 * spacing
    one.viscosity = VISCOSITY
    one.ramp = RAMP_TIME if any(table.start == "ramp" for table in tables) else 0.0
    one.blocks = len(model.bodies)
    one.is_uniform = len(tables) == 1
    return arrays.Soils(
        points=points,
        states=states,
        kinds=kinds_of,
        interactions=interactions_with(model),
        order=build.numbers(n, np.uint32),
        starts=build.numbers(3 * n // 2 + 3, np.uint32),
        lists=build.numbers((groups, arrays.GROUP * arrays.NEIGHBOURS), np.uint32),
        lengths=build.numbers(n, np.uint32),
        touches=zeros(room, arrays.TOUCH),
        kept=zeros(room, arrays.HISTORY),
        by_body=build.numbers(room, np.uint32),
        begins=build.numbers(bodies + 1, np.uint32),
        tallies=zeros(groups, arrays.TALLY),
        spare_point=zeros(1, arrays.POINT),
        spare_state=zeros(1, arrays.STATE),
        controls=controls,
    )


def kind_records(model: Model, masses: system.Floats) -> Any:
    """Return one KIND for each soil, given the mass (kg) of a particle of each."""
    scenario, tables = model.scenario, model.soils
    records = zeros(len(tables), arrays.KIND)
    for record, table, mass in zip(records, tables, masses, strict=True):
        material = scenario.materials[table.material]
        lame, shear = soils.lame_constants(material)
        record.density = material.density
        record.mass, record.volume = mass, mass / material.density
        record.share = record.volume / records["volume"][0]
        counts = geometry.count_across(table.corners, table.spacing)
        record.pitch_x, record.pitch_y = (np.ptp(table.corners, axis=0) - table.spacing) / (np.array(counts) - 1.0)
        record.lame, record.shear, record.bulk = lame, shear, lame + 2.0 * shear / 3.0
        record.slope, record.cohesion = soils.yield_surface(material, scenario.strength.divisor("soil"))
        record.impedance = material.density * soils.wave_speed(material)
        record.settling, record.settled = soils.damping_at_start(scenario, table)
        record.is_corrected = table.gradient == "corrected"
    return records


def interactions_with(model: Model) -> Any:
    """Return the parameters (soils, classes) of contacts with each class of bodies; see `world.interactions`."""
    scenario, tables = model.scenario, model.soils
    classes = interactions.contact_classes(model)
    records = zeros((len(tables), len(classes)), INTERACTION)
    depth = soils.depth_of_scene(model)
    for row, table in zip(records, tables, strict=True):
        young = scenario.materials[table.material].young_modulus
        for record, partner in zip(row, classes, strict=True):
            name = partner.material if partner.is_wall or not partner.is_ground else GROUND
            friction = soils.friction_with(scenario, table.material, str(name), ground=partner.is_ground)
            record.normal_stiffness = young * min(depth, partner.depth)
            record.shear_ratio = soils.SHEAR_RATIO
            record.normal_damping = record.shear_damping = soils.DAMPING_RATIO
            record.static_friction, record.kinetic_friction = friction.static, friction.kinetic
            record.transition_speed = friction.transition_speed
    return records
