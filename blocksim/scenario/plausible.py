"""Warnings of values that are allowed but hardly meant: as a rule a number without the unit that was in mind.

And of soil whose particles leave a part of its shape empty.
"""

from collections.abc import Iterator
from math import ceil, dist
from statistics import median

from blocksim.scenario import keys, outlines
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.models.variation import Normal, Uniform
from blocksim.scenario.polygons import count_across
from blocksim.scenario.soil_places import soil_tables
from blocksim.scenario.structures.polygons import Polygons

STEEPEST = 5.0
"""Friction coefficient (79 degrees) above which a friction angle without its unit is more likely."""
LIGHTEST, HEAVIEST = 25.0, 25_000.0  # kg/m3: foams and osmium
SOFTEST = 1e4  # Pa: gels
LONGEST = 50.0  # m
LONGEST_DRAWN = 10.0  # m, of most blocks of a drawing: bricks and stones in mm come out larger
MOST_EMPTY = 0.01  # of the width or height of a soil: its thrust goes with the square of the height


def implausible_values(scenario: Scenario) -> list[str]:
    """Return a warning for each value that looks like one in another unit; of frictions swept ones too."""
    return [*_bare_numbers(scenario), *_friction_angles(scenario), *_unfilled_soils(scenario)]


def _unfilled_soils(scenario: Scenario) -> Iterator[str]:
    """Find soils of whose width or height no whole number of particles takes all, and a finer spacing that does."""
    for soil in soil_tables(scenario):
        extents = soil.corners.max(axis=0) - soil.corners.min(axis=0)
        counts = count_across(soil.corners, soil.spacing)
        for way, extent, count in zip(("width", "height"), extents, counts, strict=True):
            if extent - count * soil.spacing > MOST_EMPTY * extent:
                fits = 1e3 * extent / ceil(extent / soil.spacing)
                yield (
                    f"{keys.format_key(('soils', soil.name, 'spacing'))} = {1e3 * soil.spacing:.4g} mm fills "
                    f"{1e3 * count * soil.spacing:.4g} of {1e3 * extent:.4g} mm of the {way}; {fits:.4g} mm fills all"
                )


def _bare_numbers(scenario: Scenario) -> Iterator[str]:
    for name, material in scenario.materials.items():
        key = keys.format_key(("materials", name))
        if not LIGHTEST <= material.density <= HEAVIEST:
            given = "density" if material.unit_weight is None else "unit_weight"
            yield f"{key}.{given} makes {material.density:.4g} kg/m^3; add the intended unit"
        if material.young_modulus < SOFTEST:
            yield f"{key}.young_modulus = {material.young_modulus:.4g} Pa; add the intended unit"
    for name, block in scenario.blocks.items():
        for side in ("width", "height", "length", "radius"):
            if (size := getattr(block, side)) is not None and size > LONGEST:
                yield f"{keys.format_key(('blocks', name, side))} = {size:.4g} m; add the intended unit"
    for number, structure in enumerate(scenario.structures):
        if isinstance(structure, Polygons):
            size = median(dist(*outlines.box_of(one.outline)) for one in structure.cells_given)
            if size > LONGEST_DRAWN:
                key = keys.format_key(("structures", number))
                yield f'{key}: blocks of {size:.3g} m; for a drawing in mm add unit = "1 mm"'


def _friction_angles(scenario: Scenario) -> Iterator[str]:
    """Find frictions that look like angles, the largest bare value of each that the sweep varies too."""
    frictions: list[tuple[str, float]] = [
        ("friction.block_block", scenario.friction.block_block.static),
        ("friction.block_ground", scenario.friction.block_ground.static),
    ]
    for left, others in scenario.pairs.items():
        for right, pair in others.items():
            if pair.friction is not None:
                frictions.append((keys.format_key(("pairs", left, right, "friction")), pair.friction.static))
    for key, values in {} if scenario.sweep is None else scenario.sweep.vary.items():
        parts = keys.parse_key(key)
        if "friction" not in (parts[0], *parts[3:4]) or parts[-1] in ("kinetic_ratio", "transition_speed"):
            continue
        match values:
            case Uniform(angle=False):
                frictions.append((key, values.high))
            case Normal(angle=False):
                frictions.append((key, values.mean))
            case tuple():
                bare = [float(value) for value in values if isinstance(value, int | float)]
                frictions += [(key, max(bare))] if bare else []
    for key, value in frictions:
        if value > STEEPEST:
            yield f'{key} = {value:g} is a friction coefficient; for an angle write "{value:g} deg"'
