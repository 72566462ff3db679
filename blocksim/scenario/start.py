"""Impossible starts although every value is valid by itself: incompatible sizes, overlaps."""

import math
from collections.abc import Iterator, Sequence
from itertools import chain, islice, pairwise
from operator import attrgetter

import numpy as np

from blocksim.scenario import keys, overlap
from blocksim.scenario.events import impossible_events
from blocksim.scenario.findings import MAX_FINDINGS, Finding
from blocksim.scenario.load_places import unfit_holds, unfit_loads
from blocksim.scenario.models.contact import NO_FIXED_STIFFNESS
from blocksim.scenario.models.drive import MOST_BODY_TABLES
from blocksim.scenario.models.motion import PIECES_PER_CYCLE, Harmonic
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.outlines import section_of
from blocksim.scenario.placement import PlacedBody, origins_of, place_bodies, smallest_width
from blocksim.scenario.probes import unfit_probes
from blocksim.scenario.quantities import shown
from blocksim.scenario.resolved import body_table_contents
from blocksim.scenario.segments import TOLERANCE, profile_segments, surface_heights, wall_segments
from blocksim.scenario.spelling import did_you_mean_or_list
from blocksim.scenario.structures import MAX_BLOCKS, Polygons, Shaped, UnfitError

MAX_SEGMENTS = 1000
SHAPES = "give it width, height and length, an outline, or sides"
MAX_OVERLAPS = 20
ROUNDING = 0.01  # of the least width of two bodies: by no more do rounded drawings overlap
MAX_PIECES = 1_000_000
MAX_INTERVALS = 65_000
"""Of particles along one side; the solver counts them in 16 bits."""
MAX_PROBES = 200
"""Each has a table, and a data set a column; a run would end seconds after its last step."""
MAX_PARTICLES = 1_000_000
SHORTEST_SHARE = 0.01
"""Least length of a segment of boundary, in smallest sides of the blocks."""
LEAST_SKIN = 1e-4
"""Least skin, in smallest sides of the blocks. Below it the list of neighbours is updated at every step, even where
steps are as short as with the full stiffness of a metal: at 1 m/s a block moves 1e-5 of its side in one of them, and a
list is kept only where 0.4 skins last for a step at four times the speed."""
ROUND_OFFS = 100
"""Least skin, in roundings of the farthest coordinate: a fifth of the skin is a reserve, and
distances are differences of a few rounded places."""


def impossible_starts(scenario: Scenario) -> Iterator[Finding]:
    """Place everything and find impossible starts; the scenario is valid otherwise."""
    unplaceable = list(_too_many(scenario)) or list(_shapeless(scenario))
    if unplaceable:
        yield from unplaceable
        return
    yield from _endless_motion(scenario)
    yield from _fixed_stiffnesses(scenario)
    yield from _impossible_masses(scenario)
    try:
        bodies, origins = place_bodies(scenario), origins_of(scenario)
    except UnfitError:
        yield from _unfit_structures(scenario)
        return
    endless = list(_endless_places(origins, bodies)) or list(_endless_masses(origins, bodies))
    if endless:
        yield from endless
        return
    kinds = {(body.size_x, body.size_y, body.outline): body for body in bodies}
    smallest = smallest_width(kinds.values())
    yield from _coarse_particles(scenario, smallest)
    yield from _fine_particles(scenario)
    farthest = max(max(abs(one) for one in ends) for ends in (_ends(bodies, "x"), _ends(bodies, "y")))
    yield from _unfit_skin(scenario, smallest, farthest)
    yield from _short_segments(scenario, SHORTEST_SHARE * smallest if bodies else 0.0)
    yield from _equal_names(origins, bodies)
    yield from _below_ground(scenario, origins, bodies)
    yield from _in_walls(scenario, origins, bodies)
    yield from _overlaps(scenario, origins, bodies)
    yield from unfit_loads(scenario, bodies)
    yield from unfit_holds(scenario, bodies)
    yield from _unfit_systems(scenario)
    yield from unfit_probes(scenario, bodies)
    yield from impossible_events(scenario, bodies)


def _ends(bodies: Sequence[PlacedBody], name: str) -> tuple[float, float]:
    """Return the smallest and the largest value of a number of all bodies."""
    values = list(map(attrgetter(name), bodies))
    return min(values, default=0.0), max(values, default=0.0)


def _unfit_systems(scenario: Scenario) -> Iterator[Finding]:
    """Find what the tables of further systems say themselves."""
    for name, tables in scenario.systems.items():
        for number, table in enumerate(tables):
            yield from (Finding((name, number, key), message) for key, message in table.impossible(scenario))


def _too_many(scenario: Scenario) -> Iterator[Finding]:
    counts = {
        ("structures",): (sum(structure.size for structure in scenario.structures) + len(scenario.bodies), "bodies"),
        ("walls",): (len(scenario.walls), "walls"),
        ("ground", "profile"): (len(scenario.ground.profile or ()), "points"),
    }
    for path, (count, what) in counts.items():
        most = MAX_BLOCKS if what == "bodies" else MAX_SEGMENTS
        if count > most:
            yield Finding(path, f"{count} {what} are too many; at most {most} are allowed")
    if len(scenario.probes) > MAX_PROBES:
        message = f"{len(scenario.probes)} probes are too many; at most {MAX_PROBES} are allowed"
        yield Finding(("probes",), f"{message} (output.contacts = true keeps the forces of all contacts)")


def _endless_motion(scenario: Scenario) -> Iterator[Finding]:
    """Find vibrations of too many cycles, and too many tables."""
    motions: list[tuple[keys.KeyPath, object]] = [((), scenario.motion)]
    motions += [(("bodies", number), body.motion) for number, body in enumerate(scenario.bodies)]
    for path, motion in motions:
        pieces = sum(count for *_, count in motion.sections(scenario.time.end)) if isinstance(motion, Harmonic) else 0
        if pieces > MAX_PIECES:
            message = f"{pieces / PIECES_PER_CYCLE:.6g} cycles are too many; at most {MAX_PIECES // PIECES_PER_CYCLE}"
            yield Finding((*path, "motion", "frequency"), f"{message} are allowed")
    if len(tables := body_table_contents(scenario)) > MOST_BODY_TABLES:
        message = f"{len(tables)} different tables of motion of bodies are too many; at most {MOST_BODY_TABLES}"
        yield Finding(("bodies",), f"{message} are allowed")


def _fixed_stiffnesses(scenario: Scenario) -> Iterator[Finding]:
    if scenario.contact.law == "linear":
        return
    for one, partners in scenario.pairs.items():
        for other, pair in partners.items():
            if pair.normal_stiffness is not None:
                yield Finding(("pairs", one, other, "normal_stiffness"), NO_FIXED_STIFFNESS, relation=True)


def _shapeless(scenario: Scenario) -> Iterator[Finding]:
    """Find blocks without a shape where one is needed, and drawn blocks that do not exist."""
    for number, spec in enumerate(scenario.bodies):
        if not scenario.blocks[spec.block].is_shaped:
            yield Finding(("bodies", number, "block"), f"block {shown(spec.block)} has no shape; {SHAPES}")
    for number, structure in enumerate(scenario.structures):
        if not isinstance(structure, Shaped):
            if not scenario.blocks[structure.block].is_shaped:
                yield Finding(("structures", number, "block"), f"block {shown(structure.block)} has no shape; {SHAPES}")
        elif isinstance(structure, Polygons):
            yield from _unknown_blocks(number, structure, scenario)


def _unknown_blocks(number: int, structure: Polygons, scenario: Scenario) -> Iterator[Finding]:
    for place, cell in enumerate(structure.drawn):
        if cell.block is not None and cell.block not in scenario.blocks:
            hint = did_you_mean_or_list(cell.block, scenario.blocks)
            path = ("structures", number, "cells", place, "block")
            yield Finding(path, f"unknown block {shown(cell.block)}, {hint}")


def _unfit_structures(scenario: Scenario) -> Iterator[Finding]:
    for number, structure in enumerate(scenario.structures):
        try:
            structure.start(scenario.blocks[structure.block])
        except UnfitError as error:
            yield Finding(("structures", number, error.key), str(error))


def _endless_masses(origins: Sequence[keys.KeyPath], bodies: Sequence[PlacedBody]) -> Iterator[Finding]:
    """Find blocks with an outline whose mass is beyond all numbers."""
    told = set()
    for origin, body in zip(origins, bodies, strict=True):
        if not body.outline or origin in told:
            continue
        if not (0.0 < body.inertia < math.inf and 0.0 < body.mass < math.inf):
            told.add(origin)
            message = f"a block of {body.mass:g} kg and {body.inertia:g} kg m^2 cannot be simulated"
            yield Finding(origin, f"body {body.name}: {message}")


def _endless_places(origins: Sequence[keys.KeyPath], bodies: Sequence[PlacedBody]) -> Iterator[Finding]:
    """Find structures with valid keys from which an invalid position or velocity follows."""
    told = set()
    numbers = map(attrgetter("x", "y", "vx", "vy", "spin"), bodies)
    values = np.fromiter(chain.from_iterable(numbers), np.float64, 5 * len(bodies)).reshape(-1, 5)
    for index in np.flatnonzero(~np.isfinite(values).all(axis=1)).tolist():
        origin, body = origins[index], bodies[index]
        if origin not in told:
            told.add(origin)
            yield Finding(
                origin,
                f"body {body.name} would be at ({body.x:g}, {body.y:g}) m with a velocity of "
                f"({body.vx:g}, {body.vy:g}) m/s and a spin of {body.spin:g} rad/s; check the keys of its structure",
            )


def _impossible_masses(scenario: Scenario) -> Iterator[Finding]:
    """Find blocks with valid sizes but an invalid mass or inertia."""
    for name, block in scenario.blocks.items():
        if not block.is_shaped:
            continue
        density = scenario.materials[block.material].density
        mass = density * block.size_x * block.size_y * block.depth
        inertia = mass * (block.size_x * block.size_x + block.size_y * block.size_y) / 12.0
        if block.polygon:
            mass, inertia = (density * block.depth * moment for moment in section_of(block.polygon))
        if not (0.0 < inertia < math.inf and 0.0 < mass < math.inf):
            message = f"a block of {mass:g} kg and {inertia:g} kg m^2 cannot be simulated"
            yield Finding(("blocks", name), f"{message}; check its sides and density")


def _coarse_particles(scenario: Scenario, smallest: float) -> Iterator[Finding]:
    """Find particles too far apart for the smallest side (m), and kernels that reach through it."""
    contact = scenario.contact
    side = f"the smallest side of a block, {_mm(smallest)}"
    if contact.model != "surface" and contact.particle_spacing > 0.5 * smallest:
        message = f"{_mm(contact.particle_spacing)} is more than half of {side}"
        yield Finding(("contact", "particle_spacing"), message, relation=True)
    elif contact.model == "kernel" and contact.support_radius >= smallest:
        key = "particle_spacing" if contact.smoothing_length is None else "smoothing_length"
        length = _mm(contact.resolved_smoothing_length)
        message = f"a {contact.kernel} of smoothing length {length} reaches {_mm(contact.support_radius)}"
        yield Finding(("contact", key), f"{message}, through {side}", relation=True)


def _fine_particles(scenario: Scenario) -> Iterator[Finding]:
    """Find particle spacings that give a side, or all kinds of blocks together, too many particles."""
    spacing = scenario.contact.particle_spacing
    if scenario.contact.model == "surface":
        return
    sides = [side / spacing for block in scenario.blocks.values() for side in (block.size_x, block.size_y)]
    if max(sides) > MAX_INTERVALS or 2.0 * sum(sides) > MAX_PARTICLES:
        message = f"{_mm(spacing)} is too small: the longest side would have {max(sides):.6g} particles"
        most = f"at most {MAX_INTERVALS} on a side and {MAX_PARTICLES} around one block of each kind are allowed"
        yield Finding(("contact", "particle_spacing"), f"{message}; {most}", relation=True)


def _unfit_skin(scenario: Scenario, smallest: float, farthest: float) -> Iterator[Finding]:
    """Find a skin that does not suit the smallest side (m) of the blocks and their farthest coordinate (m)."""
    skin = scenario.contact.skin
    if skin is None:
        return
    least, why = max(
        (LEAST_SKIN * smallest, f"{100 * LEAST_SKIN:g} % of the smallest side of a block"),
        (ROUND_OFFS * math.ulp(farthest), f"{ROUND_OFFS} times the round-off of positions {farthest:g} m away"),
    )
    if skin > smallest:
        message = f"{_mm(skin)} is more than the smallest side of a block, {_mm(smallest)}"
        yield Finding(("contact", "skin"), f"{message}; distant blocks would be listed as neighbours", relation=True)
    elif skin < least:
        message = f"{_mm(skin)} is too small; at least {_mm(least)} is needed, {why}"
        yield Finding(("contact", "skin"), message, relation=True)


def _short_segments(scenario: Scenario, least: float) -> Iterator[Finding]:
    """Find segments of boundary shorter than `least` (m): a corner could miss them."""
    points = scenario.ground.profile or ()
    pieces: list[tuple[keys.KeyPath, float]] = [
        (("ground", "profile", number), math.dist(*ends)) for number, ends in enumerate(pairwise(points), start=1)
    ]
    pieces += [(("walls", number), math.dist(wall.start, wall.end)) for number, wall in enumerate(scenario.walls)]
    for path, length in pieces:
        if length < least:
            why = f"at least {_mm(least)} is needed, {100 * SHORTEST_SHARE:g} % of the smallest side of a block"
            yield Finding(path, f"this segment is only {_mm(length)} long; {why}", relation=True)


def _equal_names(origins: Sequence[keys.KeyPath], bodies: Sequence[PlacedBody]) -> Iterator[Finding]:
    if len({body.name for body in bodies}) == len(bodies):
        return
    seen: set[str] = set()
    for origin, body in zip(origins, bodies, strict=True):
        if body.name in seen:
            message = f"two bodies are named {shown(body.name)}; a body without a name is called by its number"
            yield Finding((*origin, "name"), message)
        seen.add(body.name)


def _below_ground(
    scenario: Scenario, origins: Sequence[keys.KeyPath], bodies: Sequence[PlacedBody]
) -> Iterator[Finding]:
    if scenario.ground.profile is not None:
        yield from _below_profile(scenario, origins, bodies)
        return
    bottom = overlap.Outlines.of(bodies).bottom
    for index in np.flatnonzero(bottom < -TOLERANCE)[:MAX_FINDINGS]:
        depth = _mm(-float(bottom[index]))
        yield Finding(origins[index], f"body {bodies[index].name} reaches {depth} below the ground (y = 0)")


def _below_profile(
    scenario: Scenario, origins: Sequence[keys.KeyPath], bodies: Sequence[PlacedBody]
) -> Iterator[Finding]:
    """Find bodies across a segment of the profile, each with its largest depth, and those wholly below."""
    depths: dict[int, float] = {}
    for index, _, depth in overlap.crossings(bodies, profile_segments(scenario)):
        depths[index] = max(depths.get(index, 0.0), depth)
    surface = surface_heights(scenario, np.array([body.x for body in bodies]))
    for index, (origin, body) in enumerate(zip(origins, bodies, strict=True)):
        if index in depths:
            yield Finding(origin, f"body {body.name} reaches {_mm(depths[index])} into the ground's profile")
        elif body.y < surface[index]:
            yield Finding(origin, f"body {body.name} lies below the ground's profile")


def _in_walls(scenario: Scenario, origins: Sequence[keys.KeyPath], bodies: Sequence[PlacedBody]) -> Iterator[Finding]:
    for body, wall, depth in islice(overlap.crossings(bodies, wall_segments(scenario)), MAX_OVERLAPS):
        name = bodies[body].name
        yield Finding(origins[body], f"body {name} and walls.{wall} overlap by {_mm(depth)}; they may only touch")


def _overlaps(scenario: Scenario, origins: Sequence[keys.KeyPath], bodies: Sequence[PlacedBody]) -> Iterator[Finding]:
    for first, second, depth in islice(overlap.overlapping_pairs(bodies), MAX_OVERLAPS):
        names = f"bodies {bodies[first].name} and {bodies[second].name}"
        text = f"{names} overlap by {_mm(depth)}; they may only touch"
        is_small = depth <= ROUNDING * smallest_width((bodies[first], bodies[second]))
        cure = _shrinking(scenario, origins[second], depth) if is_small else ""
        yield Finding(origins[second], text + cure)


def _shrinking(scenario: Scenario, origin: keys.KeyPath, depth: float) -> str:
    """Return what parts a block of a drawing from another."""
    is_drawn = origin[0] == "structures" and scenario.structures[int(origin[1])].kind == "polygons"
    return f'; shrink = "{_mm(depth)}" of its structure parts them' if is_drawn else ""


def _mm(length: float) -> str:
    return f"{length * 1e3:.6g} mm"
