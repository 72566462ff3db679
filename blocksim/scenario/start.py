"""Impossible starts although every value is valid by itself: incompatible sizes, overlaps."""

import math
from collections.abc import Iterator, Sequence
from itertools import chain, islice, pairwise
from operator import attrgetter

import numpy as np

from blocksim.scenario import keys, overlap
from blocksim.scenario.events import impossible_events
from blocksim.scenario.findings import MAX_FINDINGS, Finding
from blocksim.scenario.load_places import unfit_loads
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
    unplaceable = [*_too_many(scenario)] or [*_shapeless(scenario)]
    if unplaceable:
        yield from unplaceable
        return
    yield from _endless_motion(scenario)
    if scenario.contact.law != "linear":
        for one, partners in scenario.pairs.items():
            for other in (name for name, pair in partners.items() if pair.normal_stiffness is not None):
                yield Finding(("pairs", one, other, "normal_stiffness"), NO_FIXED_STIFFNESS, relation=True)
    yield from _impossible_masses(scenario)
    try:
        bodies, origins = place_bodies(scenario), origins_of(scenario)
    except UnfitError:
        for number, structure in enumerate(scenario.structures):
            try:
                structure.start(scenario.blocks[structure.block])
            except UnfitError as error:
                yield Finding(("structures", number, error.key), str(error))
        return
    endless = [*_endless(origins, bodies)]
    if endless:
        yield from endless
        return
    smallest = smallest_width({(body.size_x, body.size_y, body.outline): body for body in bodies}.values())
    yield from _unfit_particles(scenario, smallest)
    yield from _unfit_skin(scenario, smallest, max((max(abs(b.x), abs(b.y)) for b in bodies), default=0.0))
    yield from _short_segments(scenario, SHORTEST_SHARE * smallest if bodies else 0.0)
    seen: set[str] = set()
    for origin, body in zip(origins, bodies, strict=True):
        if body.name in seen:
            message = f"two bodies are named {shown(body.name)}; a body without a name is called by its number"
            yield Finding((*origin, "name"), message)
        seen.add(body.name)
    yield from _overlaps(scenario, origins, bodies)
    yield from unfit_loads(scenario, bodies)
    for name, tables in scenario.systems.items():
        for number, table in enumerate(tables):
            yield from (Finding((name, number, key), message) for key, message in table.impossible(scenario))
    yield from unfit_probes(scenario, bodies)
    yield from impossible_events(scenario, bodies)


def _too_many(scenario: Scenario) -> Iterator[Finding]:
    bodies = sum(structure.size for structure in scenario.structures) + len(scenario.bodies)
    counts: tuple[tuple[keys.KeyPath, int, str, int], ...] = (
        (("structures",), bodies, "bodies", MAX_BLOCKS),
        (("walls",), len(scenario.walls), "walls", MAX_SEGMENTS),
        (("ground", "profile"), len(scenario.ground.profile or ()), "points", MAX_SEGMENTS),
        (("probes",), len(scenario.probes), "probes", MAX_PROBES),
    )
    for path, count, what, most in counts:
        if count > most:
            cure = " (output.contacts = true keeps the forces of all contacts)" if what == "probes" else ""
            yield Finding(path, f"{count} {what} are too many; at most {most} are allowed{cure}")


def _shapeless(scenario: Scenario) -> Iterator[Finding]:
    """Find blocks without a shape where one is needed, and drawn blocks that do not exist."""
    needing: list[tuple[keys.KeyPath, str]] = [
        (("bodies", number, "block"), spec.block) for number, spec in enumerate(scenario.bodies)
    ]
    for number, structure in enumerate(scenario.structures):
        if not isinstance(structure, Shaped):
            needing.append((("structures", number, "block"), structure.block))
        for place, cell in enumerate(structure.drawn if isinstance(structure, Polygons) else ()):
            if cell.block is not None and cell.block not in scenario.blocks:
                hint = did_you_mean_or_list(cell.block, scenario.blocks)
                where = ("structures", number, "cells", place, "block")
                yield Finding(where, f"unknown block {shown(cell.block)}, {hint}")
    for path, block in needing:
        if not scenario.blocks[block].is_shaped:
            yield Finding(path, f"block {shown(block)} has no shape; {SHAPES}")


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
        if not _is_possible(mass, inertia):
            yield Finding(("blocks", name), f"{_unsimulated(mass, inertia)}; check its sides and density")


def _is_possible(mass: float, inertia: float) -> bool:
    return 0.0 < inertia < math.inf and 0.0 < mass < math.inf


def _unsimulated(mass: float, inertia: float) -> str:
    return f"a block of {mass:g} kg and {inertia:g} kg m^2 cannot be simulated"


def _endless(origins: Sequence[keys.KeyPath], bodies: Sequence[PlacedBody]) -> Iterator[Finding]:
    """Find bodies with places or velocities beyond all numbers, or else outlines with such masses; one an origin."""
    numbers = map(attrgetter("x", "y", "vx", "vy", "spin"), bodies)
    values = np.fromiter(chain.from_iterable(numbers), np.float64, 5 * len(bodies)).reshape(-1, 5)
    lost = {origins[index]: bodies[index] for index in reversed(np.flatnonzero(~np.isfinite(values).all(axis=1)))}
    for origin, body in reversed(lost.items()):
        message = (
            f"body {body.name} would be at ({body.x:g}, {body.y:g}) m with a velocity of "
            f"({body.vx:g}, {body.vy:g}) m/s and a spin of {body.spin:g} rad/s; check the keys of its structure"
        )
        yield Finding(origin, message)
    told: set[keys.KeyPath] = set()
    for origin, body in () if lost else zip(origins, bodies, strict=True):
        if body.outline and origin not in told and not _is_possible(body.mass, body.inertia):
            told.add(origin)
            yield Finding(origin, f"body {body.name}: {_unsimulated(body.mass, body.inertia)}")


def _unfit_particles(scenario: Scenario, smallest: float) -> Iterator[Finding]:
    """Find particles too far apart for the smallest side (m), kernels that reach through it, and too many particles."""
    contact = scenario.contact
    if contact.model == "surface":
        return
    spacing, side = contact.particle_spacing, f"the smallest side of a block, {_mm(smallest)}"
    if spacing > 0.5 * smallest:
        message = f"{_mm(spacing)} is more than half of {side}"
        yield Finding(("contact", "particle_spacing"), message, relation=True)
    elif contact.model == "kernel" and contact.support_radius >= smallest:
        key = "particle_spacing" if contact.smoothing_length is None else "smoothing_length"
        length = _mm(contact.resolved_smoothing_length)
        message = f"a {contact.kernel} of smoothing length {length} reaches {_mm(contact.support_radius)}"
        yield Finding(("contact", key), f"{message}, through {side}", relation=True)
    sides = [length / spacing for block in scenario.blocks.values() for length in (block.size_x, block.size_y)]
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
    pieces: list[tuple[keys.KeyPath, float]] = [
        (("ground", "profile", number), math.dist(*ends))
        for number, ends in enumerate(pairwise(scenario.ground.profile or ()), start=1)
    ]
    pieces += [(("walls", number), math.dist(wall.start, wall.end)) for number, wall in enumerate(scenario.walls)]
    for path, length in pieces:
        if length < least:
            why = f"at least {_mm(least)} is needed, {100 * SHORTEST_SHARE:g} % of the smallest side of a block"
            yield Finding(path, f"this segment is only {_mm(length)} long; {why}", relation=True)


def _overlaps(scenario: Scenario, origins: Sequence[keys.KeyPath], bodies: Sequence[PlacedBody]) -> Iterator[Finding]:
    """Find bodies in the ground, each with its largest depth, bodies in walls, and bodies in one another."""
    if scenario.ground.profile is None:
        bottom = overlap.Outlines.of(bodies).bottom
        for index in np.flatnonzero(bottom < -TOLERANCE)[:MAX_FINDINGS]:
            depth = _mm(-float(bottom[index]))
            yield Finding(origins[index], f"body {bodies[index].name} reaches {depth} below the ground (y = 0)")
    else:
        depths: dict[int, float] = {}
        for index, _, sunk in overlap.crossings(bodies, profile_segments(scenario)):
            depths[index] = max(depths.get(index, 0.0), sunk)
        surface = surface_heights(scenario, np.array([body.x for body in bodies]))
        for index, (origin, body) in enumerate(zip(origins, bodies, strict=True)):
            if index in depths:
                yield Finding(origin, f"body {body.name} reaches {_mm(depths[index])} into the ground's profile")
            elif body.y < surface[index]:
                yield Finding(origin, f"body {body.name} lies below the ground's profile")
    for index, wall, sunk in islice(overlap.crossings(bodies, wall_segments(scenario)), MAX_OVERLAPS):
        message = f"body {bodies[index].name} and walls.{wall} overlap by {_mm(sunk)}; they may only touch"
        yield Finding(origins[index], message)
    for first, second, sunk in islice(overlap.overlapping_pairs(bodies), MAX_OVERLAPS):
        one, other, origin = bodies[first], bodies[second], origins[second]
        is_drawn = origin[0] == "structures" and scenario.structures[int(origin[1])].kind == "polygons"
        is_small = sunk <= ROUNDING * smallest_width((one, other))
        cure = f'; shrink = "{_mm(sunk)}" of its structure parts them' if is_drawn and is_small else ""
        message = f"bodies {one.name} and {other.name} overlap by {_mm(sunk)}; they may only touch{cure}"
        yield Finding(origin, message)


def _mm(length: float) -> str:
    return f"{length * 1e3:.6g} mm"
