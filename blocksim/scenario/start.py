"""Impossible starts although every value is valid by itself: sizes, overlaps, loads, soils."""

import math
from collections.abc import Callable, Collection, Iterator, Sequence
from itertools import chain, islice, pairwise
from operator import attrgetter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario import events, geometry, laws, motion, open_faces, overlap, overrides, placement, resolution
from blocksim.scenario.mistakes import MAX_MISTAKES, Mistake, repetitions, unknown
from blocksim.scenario.models.actuators import Actuator
from blocksim.scenario.models.contact import NO_FIXED_STIFFNESS, SUPPORT
from blocksim.scenario.models.loads import Force, Gravity, OnBody, Pressure
from blocksim.scenario.models.motion import MOST_BODY_TABLES, PIECES_PER_CYCLE, Harmonic
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.models.soil import SoilTable
from blocksim.scenario.placement import GEOMETRY, PlacedBody, Placement
from blocksim.scenario.structures import base, polygons
from blocksim.scenario.units import toml

MAX_LOADS = 1000


def unfit_loads(scenario: Scenario, placed: Placement) -> Iterator[Mistake]:
    """Find loads that do not fit the placed bodies, and bodies that cannot be held; all is valid otherwise."""
    loads, bodies = scenario.loads, placed.bodies
    if len(loads) > MAX_LOADS:
        yield Mistake(("loads",), f"{len(loads)} loads are too many; at most {MAX_LOADS} are allowed")
        return
    for number in repetitions(name for name in events.actuator_names(scenario)):
        yield Mistake(("actuators", number, "name"), f"two actuators are named {toml(scenario.actuators[number].name)}")
    by_name = {body.name: body for body in bodies} if loads or scenario.actuators or scenario.start.hold else {}
    for number in repetitions(load.name for load in loads):
        yield Mistake(("loads", number, "name"), f"two loads are named {toml(loads[number].name)}")
    for number in [number for number, load in enumerate(loads) if isinstance(load, Gravity)][1:]:
        yield Mistake(("loads", number), "gravity turns already; one load of this kind is allowed")
    for number, load in enumerate(loads):
        if isinstance(load, OnBody) and load.body is not None:
            yield from unknown(("loads", number, "body"), "body", by_name, load.body)
            if load.body in by_name:
                yield from _on_body(scenario, number, load, by_name[load.body], bodies)
        elif isinstance(load, Pressure):
            yield from _on_structure(scenario, ("loads", number), load, placed)
    for number, actuator in enumerate(scenario.actuators):
        yield from unknown(("actuators", number, "body"), "body", by_name, actuator.body)
        if actuator.body in by_name:
            yield from _at_point(("actuators", number), actuator, by_name[actuator.body])
    for number, name in enumerate(scenario.start.hold):
        yield from unknown(("start", "hold", number), "body", by_name, name)
        if name in by_name and by_name[name].fixed:
            yield Mistake(("start", "hold", number), f"body {toml(name)} is fixed and cannot be released")


def _on_structure(scenario: Scenario, path: overrides.KeyPath, load: Pressure, placed: Placement) -> Iterator[Mistake]:
    """Find a structure that is not there, or has nothing free and open on that side."""
    count = len(scenario.structures)
    if (load.structure or 0) > count:
        have = f"the scenario has {count}" if count else "the scenario has none"
        yield Mistake((*path, "structure"), f"there is no structure {load.structure}; {have}")
    elif not open_faces.faces_under(scenario, load, placed):
        yield Mistake((*path, "face"), f"nothing of structure {load.structure} is free and open on that side")


def _on_body(
    scenario: Scenario, number: int, load: OnBody, body: PlacedBody, bodies: Sequence[PlacedBody]
) -> Iterator[Mistake]:
    path = ("loads", number)
    if body.fixed:
        yield Mistake((*path, "body"), f"body {toml(load.body)} is fixed; a load has no effect on it")
    elif isinstance(load, Force):
        yield from _at_point(path, load, body)
    elif isinstance(load, Pressure) and open_faces.face_of(body.corners, load.face) is None:
        numbers = f"1 to {len(body.corners)}, counter-clockwise from its first corner"
        message = f"no face, or no single one, of body {toml(load.body)} is that; its faces have the numbers {numbers}"
        yield Mistake((*path, "face"), message)
    elif isinstance(load, Pressure):
        other = next(_covers(scenario, load, body, bodies), None)
        if other is not None:
            message = f"this face of body {toml(load.body)} is covered by {other}; pressure needs a free face"
            yield Mistake((*path, "face"), message)


def _at_point(path: overrides.KeyPath, acting: Force | Actuator, body: PlacedBody) -> Iterator[Mistake]:
    """Find that a body cannot be moved, or does not reach to the point at which something acts."""
    if body.fixed:
        what = "driven" if body.driven else "fixed"
        yield Mistake((*path, "body"), f"body {toml(body.name)} is {what}; nothing else moves it")
    elif not geometry.holds(body.corners, acting.point, 0.5 * open_faces.STRIP * body.least_width):
        (left, bottom), (right, top) = ((1e3 * x, 1e3 * y) for x, y in geometry.box_of(body.corners))
        extent = f"which extends from ({left:g}, {bottom:g}) to ({right:g}, {top:g}) mm along its own axes"
        yield Mistake((*path, "point"), f"the point lies outside of body {toml(body.name)}, {extent}")


def _covers(scenario: Scenario, load: Pressure, body: PlacedBody, bodies: Sequence[PlacedBody]) -> Iterator[str]:
    """Yield what lies against a part of a face that is more than a line: what reaches into half of the strip."""
    strip, margin = open_faces.strip_before(body, load.face), 0.5 * open_faces.STRIP * body.least_width
    if scenario.ground.profile is None and float(overlap.Outlines.of([strip]).bottom[0]) < -margin:
        yield "the ground"
    segments = placement.place_segments(scenario)
    for _, segment, depth in overlap.overlapping_pairs([strip], segments):
        if depth > margin:
            yield "a wall" if segment >= len(segments) - len(scenario.walls) else "the ground"
    for pairs in overlap.near_pairs(overlap.Outlines.of([strip, *bodies])):
        for second in np.maximum(*pairs)[np.minimum(*pairs) == 0]:
            other = bodies[int(second) - 1]
            depths = overlap.penetration(overlap.Outlines.of([strip]), overlap.Outlines.of([other]))
            if other is not body and depths[0] > margin:
                yield f"body {toml(other.name)}"


MOST_NAMES = 3


def particle_places(soil: SoilTable, placed: Sequence[PlacedBody]) -> tuple[NDArray[np.float64], float]:
    """Return where the particles of a soil are at the start (m, (n, 2)), and the area (m2) of all of them.

    They fill its outline; what is poured in lies where no block is, or is above.
    """
    if soil.kind != "fill":
        return geometry.fill_rows(soil.corners, soil.spacing)[0], geometry.area_of(soil.corners)
    return geometry.fill_rows(soil.corners, soil.spacing, [corners for _, corners in _blocks_in(soil, placed)])


def _blocks_in(soil: SoilTable, placed: Sequence[PlacedBody]) -> Iterator[tuple[str, NDArray[np.float64]]]:
    """Yield the names and corners (m, (k, 2)) of blocks that are in the outline of a soil."""
    low, high = soil.corners.min(axis=0), soil.corners.max(axis=0)
    for body in placed:
        is_near = bool(np.all(low - body.radius < (body.x, body.y)) and np.all((body.x, body.y) < high + body.radius))
        corners = np.array([body.ground_point(*corner) for corner in body.corners])
        if is_near and geometry.overlap(soil.corners, corners):
            yield body.name, corners


def meetings(soil: SoilTable, key: str, scenario: Scenario, placed: Sequence[PlacedBody]) -> Iterator[tuple[str, str]]:
    """Yield the key of an outline and what it meets: ground, walls, blocks that it is not poured onto, other soils."""
    found, corners = [*_boundaries(soil, scenario)], soil.corners
    if soil.kind == "fill":
        if not len(particle_places(soil, placed)[0]):
            found.append("blocks everywhere: no particle has room")
    elif blocks := [name for name, _ in _blocks_in(soil, placed)]:
        more = f" and {len(blocks) - MOST_NAMES} more" if len(blocks) > MOST_NAMES else ""
        which = f"blocks {', '.join(blocks[:MOST_NAMES])}" if len(blocks) > 1 else f"block {blocks[0]}"
        found.append(f'{which}{more}; kind = "fill" leaves blocks out')
    for other in placement.soil_tables(scenario):
        if other is soil:
            break
        if other.name == soil.name:
            found.append("another soil of this name")
        elif geometry.overlap(corners, other.corners):
            found.append(f"soil {other.name}")
    for what in found[:20]:
        yield key, f"soil {soil.name} meets {what}"


def _boundaries(soil: SoilTable, scenario: Scenario) -> Iterator[str]:
    corners = soil.corners
    middles = 0.5 * (corners + np.roll(corners, -1, axis=0))
    for x, y in np.concatenate([corners, middles]):
        if y < float(placement.surface_heights(scenario, np.array([x]))[0]) - placement.TOLERANCE:
            yield f"the ground at x = {x:.6g} m"
            return
    segments = placement.place_segments(scenario)
    places = np.linspace(0.0, 1.0, 33)[1:-1, None]
    for number, piece in enumerate(segments, start=1 - (len(segments) - len(scenario.walls))):
        begin, end = np.array([piece.x0, piece.y0]), np.array([piece.x1, piece.y1])
        back = np.array([piece.y1 - piece.y0, piece.x0 - piece.x1]) / piece.length * 0.5 * soil.spacing
        if geometry.cuts(begin, end, corners):
            near = np.clip(piece.x1, corners[:, 0].min(), corners[:, 0].max())  # the last piece is endless
            yield f"wall {number}" if number > 0 else f"the ground near x = {near:.6g} m"
        elif number > 0 and geometry.is_inside(begin + places * (end - begin) + back, corners).any():
            # nothing would hold soil that lies against the back of a wall
            yield f"the solid side of wall {number}, right of the way from its `from` to its `to`: exchange the two"


WIDEST_GAP = 0.25  # spacings between soil and what it lies against: beyond, its thrust is another;
WIDEST_BELOW = 1.0  # or between rows and what they end above or below if that is not level
GAP_LENGTH = 2.0  # spacings: corners leave shorter ones
LEVEL = 1.0 - 1e-9  # upward part of the normal of a level face


def gaps(soil: SoilTable, scenario: Scenario, placed: Sequence[PlacedBody]) -> Iterator[tuple[str, float]]:
    """Yield the names of what soil lies beside but does not reach, with the width (m) of the gap."""
    from scipy.spatial import cKDTree

    tree, spacing = cKDTree(particle_places(soil, placed)[0]), soil.spacing
    low, high = soil.corners.min(axis=0) - spacing, soil.corners.max(axis=0) + spacing
    blocks = [corners for _, corners in _blocks_in(soil, placed)] if soil.kind == "fill" else []
    for name, begin, end in _faces(scenario, placed, low, high):
        along = end - begin
        out = np.array([along[1], -along[0]]) / np.hypot(*along)
        count = math.ceil(2.0 * float(np.hypot(*along)) / spacing)
        places = begin + (np.arange(count) + 0.5)[:, np.newaxis] / count * along
        beside = places + spacing * out
        is_soil = geometry.is_inside(beside, soil.corners)
        for corners in blocks:
            is_soil &= geometry.height_above(corners, beside) == 0.0
        nearest = tree.data[tree.query(places[is_soil])[1]] if is_soil.any() else places[is_soil]
        apart = (nearest - places[is_soil]) @ out - 0.5 * spacing
        wide = apart[apart > (WIDEST_BELOW if 0.5 < abs(out[1]) < LEVEL else WIDEST_GAP) * spacing]
        if len(wide) > 2.0 * GAP_LENGTH:
            yield name, float(np.median(wide))


def _faces(
    scenario: Scenario, placed: Sequence[PlacedBody], low: NDArray[np.float64], high: NDArray[np.float64]
) -> Iterator[tuple[str, NDArray[np.float64], NDArray[np.float64]]]:
    """Yield names and ends (m) of faces of bodies, walls and ground in a box, with the solid on the left."""
    for body in placed:
        corners = np.array([body.ground_point(*corner) for corner in body.corners])
        if np.all(corners.max(axis=0) > low) and np.all(corners.min(axis=0) < high):
            for begin, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
                yield f"block {body.name}", begin, end
    segments = placement.place_segments(scenario)
    for number, one in enumerate(segments, start=1 - (len(segments) - len(scenario.walls))):
        begin, along = np.array([one.x1, one.y1]), np.array([one.x0 - one.x1, one.y0 - one.y1])
        with np.errstate(divide="ignore", invalid="ignore"):
            shares = np.sort([(low - begin) / along, (high - begin) / along], axis=0)
        first, last = np.fmax.reduce([0.0, *shares[0]]), np.fmin.reduce([1.0, *shares[1]])
        if first < last:
            yield f"wall {number}" if number > 0 else "the ground", begin + first * along, begin + last * along
    if scenario.ground.profile is None and low[1] < 0.0:
        yield "the ground", np.array([high[0], 0.0]), np.array([low[0], 0.0])


MAX_SEGMENTS = 1000
SHAPES = "give it width, height and length, an outline, or sides"
MAX_OVERLAPS = 20
ROUNDING = 0.01  # of the least width of two bodies: by no more do rounded drawings overlap
MAX_PIECES = 1_000_000
MAX_INTERVALS = 65_000  # of particles along one side; the solver counts them in 16 bits
MAX_PROBES = 200
"""Each has a table, and a data set a column; a run would end seconds after its last step."""
MAX_PARTICLES = 1_000_000
SHORTEST_SHARE = 0.01  # least length of a segment of boundary, in smallest sides of the blocks
LEAST_SKIN = 1e-4
"""Least skin, in smallest sides of the blocks. Below it the list of neighbours is updated at every step, even where
steps are as short as with the full stiffness of a metal: at 1 m/s a block moves 1e-5 of its side in one of them, and a
list is kept only where 0.4 skins last for a step at four times the speed."""
ROUND_OFFS = 100
"""Least skin, in roundings of the farthest coordinate: a fifth of the skin is a reserve, and
distances are differences of a few rounded places."""


class Check(NamedTuple):
    """One reason why a scenario cannot start, and the tables that it depends on beside those that place everything."""

    find: Callable[[Scenario, Callable[[], Placement]], Iterator[Mistake]]  # places everything only if it has to
    tables: Collection[str] = ()
    ends: bool = False  # what follows makes no sense where it finds anything


def impossible_starts(
    scenario: Scenario, placed: Callable[[], Placement], changed: Collection[str] = GEOMETRY
) -> Iterator[Mistake]:
    """Find impossible starts of a scenario that is valid otherwise, and was possible before some tables changed.

    `placed` places everything, once, if it is asked to.
    """
    for check in CHECKS:
        mistakes = [*check.find(scenario, placed)] if GEOMETRY.union(check.tables).intersection(changed) else []
        yield from mistakes
        if mistakes and check.ends:
            return


def _unfit_structures(scenario: Scenario, placed: Callable[[], Placement]) -> Iterator[Mistake]:
    """Find structures that do not suit their block."""
    try:
        placed()
    except base.UnfitError:
        for number, structure in enumerate(scenario.structures):
            try:
                structure.start(scenario.blocks[structure.block])
            except base.UnfitError as error:
                yield Mistake(("structures", number, error.key), str(error))


def _too_many(scenario: Scenario) -> Iterator[Mistake]:
    bodies = sum(structure.size for structure in scenario.structures) + len(scenario.bodies)
    counts: tuple[tuple[overrides.KeyPath, int, str, int], ...] = (
        (("structures",), bodies, "bodies", base.MAX_BLOCKS),
        (("walls",), len(scenario.walls), "walls", MAX_SEGMENTS),
        (("ground", "profile"), len(scenario.ground.profile or ()), "points", MAX_SEGMENTS),
        (("probes",), len(scenario.probes), "probes", MAX_PROBES),
    )
    for path, count, what, most in counts:
        if count > most:
            cure = " (output.contacts = true keeps the forces of all contacts)" if what == "probes" else ""
            yield Mistake(path, f"{count} {what} are too many; at most {most} are allowed{cure}")


def _shapeless(scenario: Scenario) -> Iterator[Mistake]:
    """Find blocks without a shape where one is needed, and drawn blocks that do not exist."""
    needing: list[tuple[overrides.KeyPath, str]]
    needing = [(("bodies", number, "block"), spec.block) for number, spec in enumerate(scenario.bodies)]
    for number, structure in enumerate(scenario.structures):
        if not isinstance(structure, base.PolygonStructure):
            needing.append((("structures", number, "block"), structure.block))
        if isinstance(structure, polygons.Polygons):
            for place, cell in enumerate(structure.cells_given):
                key = ("structures", number, "cells", place, "block")
                for one in unknown(key, "block", scenario.blocks, cell.block):
                    yield one._replace(message=f"{structure.place_of(place)}{one.message}")
    for path, block in needing:
        if scenario.blocks[block].size_x == 0.0:
            yield Mistake(path, f"block {toml(block)} has no shape; {SHAPES}")


def _unfit_tables(scenario: Scenario) -> Iterator[Mistake]:
    """Find vibrations of too many cycles, too many tables, stiffnesses without a law, and masses beyond all numbers."""
    motions: list[tuple[overrides.KeyPath, object]] = [((), scenario.motion)]
    motions += [(("bodies", number), body.motion) for number, body in enumerate(scenario.bodies)]
    for path, one in motions:
        pieces = sum(count for *_, count in one.sections(scenario.time.end)) if isinstance(one, Harmonic) else 0
        if pieces > MAX_PIECES:
            message = f"{pieces / PIECES_PER_CYCLE:.6g} cycles are too many; at most {MAX_PIECES // PIECES_PER_CYCLE}"
            yield Mistake((*path, "motion", "frequency"), f"{message} are allowed")
    if len(tables := {one.digest for one in resolution.tables_of_bodies(scenario).values()}) > MOST_BODY_TABLES:
        message = f"{len(tables)} different tables of motion of bodies are too many; at most {MOST_BODY_TABLES}"
        yield Mistake(("bodies",), f"{message} are allowed")
    if not laws.LAWS[law := scenario.contact.law].is_linear:
        for one, partners in scenario.pairs.items():
            for other in (name for name, pair in partners.items() if pair.normal_stiffness is not None):
                path = ("pairs", one, other, "normal_stiffness")
                yield Mistake(path, NO_FIXED_STIFFNESS.format(law), relation=True)
    for name in [name for name, block in scenario.blocks.items() if block.size_x > 0.0]:
        (body,) = placement.place_blocks(scenario, name, [(name, base.Pose(0.0, 0.0))], fixed=False)
        if why := _why_impossible(body):
            yield Mistake(("blocks", name), f"{why}; check its sides and density")


def _why_impossible(body: PlacedBody) -> str:
    mass, inertia = body.mass, body.inertia
    is_possible = 0.0 < inertia < math.inf and 0.0 < mass < math.inf
    return "" if is_possible else f"a block of {mass:g} kg and {inertia:g} kg m^2 cannot be simulated"


def _endless(scenario: Scenario, placed: Placement) -> Iterator[Mistake]:
    """Find bodies with places or velocities beyond all numbers, or else cells with such masses; one an origin."""
    bodies, origins = placed.bodies, placed.origins
    numbers = map(attrgetter("x", "y", "vx", "vy", "spin"), bodies)
    values = np.fromiter(chain.from_iterable(numbers), np.float64, 5 * len(bodies)).reshape(-1, 5)
    lost = {origins[index]: bodies[index] for index in reversed(np.flatnonzero(~np.isfinite(values).all(axis=1)))}
    for origin, body in reversed(lost.items()):
        message = (
            f"body {body.name} would be at ({body.x:g}, {body.y:g}) m with a velocity of "
            f"({body.vx:g}, {body.vy:g}) m/s and a spin of {body.spin:g} rad/s; check the keys of its structure"
        )
        yield Mistake(origin, message)
    parted = {("structures", n) for n, one in enumerate(scenario.structures) if isinstance(one, base.PolygonStructure)}
    for origin, body in () if lost else zip(origins, bodies, strict=True):
        if origin in parted and (why := _why_impossible(body)):
            parted.remove(origin)
            yield Mistake(origin, f"body {body.name}: {why}")


def _unfit_lengths(scenario: Scenario, placed: Placement) -> Iterator[Mistake]:
    """Find lengths that do not suit the smallest side of the blocks and their farthest coordinate.

    Particles too far apart or too many, kernels that reach through a block, a skin, and segments of boundary so short
    that a corner could miss them.
    """
    kinds = {(body.size_x, body.size_y, body.outline): body for body in placed.bodies}
    smallest = placement.smallest_width(kinds.values())
    farthest = max((max(abs(body.x), abs(body.y)) for body in placed.bodies), default=0.0)
    contact, spacing, skin = scenario.contact, scenario.contact.particle_spacing, scenario.contact.skin
    side = f"the smallest side of a block, {_mm(smallest)}"
    if contact.model != "surface":
        if spacing > 0.5 * smallest:
            yield Mistake(("contact", "particle_spacing"), f"{_mm(spacing)} is more than half of {side}", relation=True)
        elif contact.model == "kernel" and SUPPORT[contact.kernel] * contact.resolved_smoothing_length >= smallest:
            key = "particle_spacing" if contact.smoothing_length is None else "smoothing_length"
            length = contact.resolved_smoothing_length
            reach = _mm(SUPPORT[contact.kernel] * length)
            message = f"a {contact.kernel} of smoothing length {_mm(length)} reaches {reach}"
            yield Mistake(("contact", key), f"{message}, through {side}", relation=True)
        sides = [length / spacing for block in scenario.blocks.values() for length in (block.size_x, block.size_y)]
        if max(sides) > MAX_INTERVALS or 2.0 * sum(sides) > MAX_PARTICLES:
            message = f"{_mm(spacing)} is too small: the longest side would have {max(sides):.6g} particles"
            most = f"at most {MAX_INTERVALS} on a side and {MAX_PARTICLES} around one block of each kind are allowed"
            yield Mistake(("contact", "particle_spacing"), f"{message}; {most}", relation=True)
    least, why = max(
        (LEAST_SKIN * smallest, f"{100 * LEAST_SKIN:g} % of the smallest side of a block"),
        (ROUND_OFFS * math.ulp(farthest), f"{ROUND_OFFS} times the round-off of positions {farthest:g} m away"),
    )
    if skin is not None and skin > smallest:
        message = f"{_mm(skin)} is more than {side}; distant blocks would be listed as neighbours"
        yield Mistake(("contact", "skin"), message, relation=True)
    elif skin is not None and skin < least:
        message = f"{_mm(skin)} is too small; at least {_mm(least)} is needed, {why}"
        yield Mistake(("contact", "skin"), message, relation=True)
    points = scenario.ground.profile or ()
    pieces: list[tuple[overrides.KeyPath, float]]
    pieces = [(("ground", "profile", number), math.dist(*two)) for number, two in enumerate(pairwise(points), start=1)]
    pieces += [(("walls", number), math.dist(wall.start, wall.end)) for number, wall in enumerate(scenario.walls)]
    for path, size in pieces:
        if math.isfinite(smallest) and size < SHORTEST_SHARE * smallest:
            needed = f"at least {_mm(SHORTEST_SHARE * smallest)} is needed, {100 * SHORTEST_SHARE:g} %"
            message = f"this segment is only {_mm(size)} long; {needed} of the smallest side of a block"
            yield Mistake(path, message, relation=True)


def _overlaps(scenario: Scenario, placed: Placement) -> Iterator[Mistake]:
    """Find bodies in the ground, each with its largest depth, bodies in walls, and bodies in one another."""
    bodies, origins = placed.bodies, placed.origins
    if scenario.ground.profile is None:
        bottom = overlap.Outlines.of(bodies).bottom
        for index in np.flatnonzero(bottom < -placement.TOLERANCE)[:MAX_MISTAKES]:
            depth = f"{_mm(-float(bottom[index]))} below the ground (y = 0)"
            yield Mistake(origins[index], f"body {bodies[index].name} reaches {depth}; raise it")
    else:
        depths: dict[int, float] = {}
        for index, _, sunk in overlap.overlapping_pairs(bodies, placement.profile_segments(scenario)):
            depths[index] = max(depths.get(index, 0.0), sunk)
        surface = placement.surface_heights(scenario, np.array([body.x for body in bodies]))
        for index, (origin, body) in enumerate(zip(origins, bodies, strict=True)):
            if index in depths:
                yield Mistake(origin, f"body {body.name} reaches {_mm(depths[index])} into the ground's profile")
            elif body.y < surface[index]:
                yield Mistake(origin, f"body {body.name} lies below the ground's profile")
    for index, wall, sunk in islice(overlap.overlapping_pairs(bodies, placement.wall_segments(scenario)), MAX_OVERLAPS):
        message = f"body {bodies[index].name} and walls.{wall} overlap by {_mm(sunk)}; they may only touch"
        yield Mistake(origins[index], message)
    for first, second, sunk in islice(overlap.overlapping_pairs(bodies), MAX_OVERLAPS):
        one, other, origin = bodies[first], bodies[second], origins[second]
        is_drawn = origin[0] == "structures" and scenario.structures[int(origin[1])].kind == "polygons"
        is_small = sunk <= ROUNDING * placement.smallest_width((one, other))
        cure = f'; shrink = "{_mm(sunk)}" of its structure parts them' if is_drawn and is_small else ""
        yield Mistake(origin, f"bodies {one.name} and {other.name} overlap by {_mm(sunk)}; they may only touch{cure}")


def _mm(length: float) -> str:
    return f"{length * 1e3:.6g} mm"


REPEATED = "two bodies are named {}; a body without a name is called by its number"
CHECKS = (
    Check(lambda scenario, _: _too_many(scenario), {"probes"}, ends=True),
    Check(lambda scenario, _: _shapeless(scenario), ends=True),
    Check(lambda scenario, _: _unfit_tables(scenario), {"motion", "time", "contact", "pairs"}),
    Check(_unfit_structures, ends=True),
    Check(lambda scenario, placed: _endless(scenario, placed()), ends=True),
    Check(lambda scenario, placed: _unfit_lengths(scenario, placed()), {"contact"}),
    Check(
        lambda _, placed: (
            Mistake((*placed().origins[number], "name"), REPEATED.format(toml(placed().bodies[number].name)))
            for number in repetitions(body.name for body in placed().bodies)
        )
    ),
    Check(lambda scenario, placed: _overlaps(scenario, placed())),
    Check(
        lambda scenario, placed: (
            Mistake(("start", "settle"), f"a scene with soil settles where nothing moves before; {why}", relation=True)
            for why in [scenario.start.settle and motion.motions_at_start(scenario, placed().bodies)]
            if why
        ),
        {"start"},
    ),
    Check(
        lambda scenario, placed: (
            Mistake(("soils", number, "lifts"), "lifts are filled in while a scene settles, and this one does not")
            for number, soil in enumerate(placement.soil_tables(scenario))
            if soil.lifts > 1 and not motion.settles(scenario, placed().bodies)
        ),
        {"start"},
    ),
    Check(lambda scenario, placed: unfit_loads(scenario, placed()), {"loads", "actuators", "start"}),
    Check(
        lambda scenario, placed: (
            Mistake((name, number, key), message)
            for name, tables in scenario.systems.items()
            for number, table in enumerate(tables)
            for key, message in table.impossible(scenario, placed().bodies)
        )
    ),
    Check(lambda scenario, placed: events.unfit_probes(scenario, placed().bodies), {"probes", "actuators"}),
    Check(
        lambda scenario, placed: events.impossible_events(scenario, placed().bodies),
        {"events", "loads", "actuators", "time"},
    ),
)
"""In the order in which mistakes are reported."""
