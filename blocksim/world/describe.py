"""What a scenario comes to before it runs: masses, pair parameters, step, cost and size of the results."""

from collections import Counter
from dataclasses import dataclass

from blocksim.kernels.arrays import World
from blocksim.scenario import PlacedBody, Scenario, place_bodies
from blocksim.world.boundary import particle_count
from blocksim.world.build import build_world
from blocksim.world.interactions import ContactClass, contact_classes

# measured on one core: a step costs about this for every body with its contacts (three to a hundred blocks)
SECONDS_PER_BODY_AND_STEP = 75e-9
FRAME_BYTES = 80
BODY_FRAME_BYTES = 48


@dataclass(frozen=True)
class PairDescription:
    """Contact parameters of one kind of pair, SI."""

    pair: str
    static_friction: float
    kinetic_friction: float
    restitution: float
    normal_damping_ratio: float
    shear_damping_ratio: float
    normal_stiffness: float  # N/m, of one contact point
    shear_stiffness: float  # N/m


@dataclass(frozen=True)
class Description:
    """The resolved scene, SI."""

    bodies: tuple[PlacedBody, ...]
    pairs: tuple[PairDescription, ...]
    step: float  # s
    steps: int  # at most
    frames: int  # at most
    seconds: float  # estimated time of solving, at most
    bytes: int  # estimated size of run.h5, at most
    particles: int  # on all boundaries, corners included


def describe(scenario: Scenario) -> Description:
    """Build the scene and tell what is in it. Raises what build_world raises."""
    world = build_world(scenario)
    placed = place_bodies(scenario)
    step = float(world.controls[0].step)
    steps = max(1, round(scenario.time.end / step))
    frames = min(steps, round(scenario.time.end / scenario.output.every)) + 1
    return Description(
        bodies=placed,
        pairs=_pairs(scenario, world, placed),
        step=step,
        steps=steps,
        frames=frames,
        seconds=steps * len(placed) * SECONDS_PER_BODY_AND_STEP,
        bytes=frames * (FRAME_BYTES + BODY_FRAME_BYTES * len(placed)),
        particles=_particles(scenario, placed),
    )


def _particles(scenario: Scenario, placed: tuple[PlacedBody, ...]) -> int:
    spacing = scenario.contact.particle_spacing
    sizes = Counter((body.size_x, body.size_y) for body in placed)
    return sum(count * particle_count(*size, spacing) for size, count in sizes.items())


def _pairs(scenario: Scenario, world: World, placed: tuple[PlacedBody, ...]) -> tuple[PairDescription, ...]:
    classes = contact_classes(scenario, placed)
    names = _class_names(classes)
    found = []
    for i in range(1, len(classes)):
        for j in range(i + 1):
            row = world.interactions[i, j]
            restitution = scenario.contact.restitution
            found.append(
                PairDescription(
                    pair=f"{names[i]} - {names[j]}",
                    static_friction=float(row.static_friction),
                    kinetic_friction=float(row.kinetic_friction),
                    restitution=restitution.block_ground if j == 0 else restitution.block_block,
                    normal_damping_ratio=float(row.normal_damping),
                    shear_damping_ratio=float(row.shear_damping),
                    normal_stiffness=float(row.normal_stiffness),
                    shear_stiffness=float(row.shear_stiffness),
                )
            )
    return tuple(found)


def _class_names(classes: tuple[ContactClass, ...]) -> list[str]:
    """Return names for people: the material, and the depth where blocks of one material differ in it."""
    materials = [one.material for one in classes[1:]]
    names = [
        f"{one.material} {1e3 * one.depth:g} mm" if materials.count(one.material) > 1 else str(one.material)
        for one in classes[1:]
    ]
    return ["ground", *names]
