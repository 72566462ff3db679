"""blocksim check: validate a scenario and summarise it."""

import math
import textwrap
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, replace
from typing import Annotated

from blocksim.cli.check_lists import lines_of
from blocksim.cli.options import Report, Screen
from blocksim.cli.output import GAP, duration, number, table_lines, width_of_screen
from blocksim.cli.prepare import ScenarioInput
from blocksim.options import Option
from blocksim.scenario import Contact, PlacedBody, Scenario, scenario_to_toml
from blocksim.scenario.pairs import DEFAULT, MATERIALS
from blocksim.scenario.plausible import implausible_values
from blocksim.scenario.units import STANDARD_GRAVITY
from blocksim.simulation.probe_series import bytes_of_series
from blocksim.study.rows import check_experiment
from blocksim.world.describe import (
    Description,
    MotionDescription,
    PairDescription,
    SagDescription,
    StepLimits,
    describe,
)
from blocksim.world.free_memory import readable
from blocksim.world.memory import FRAME_VALUES, PROCESS_BYTES

MOST_BODIES = 12
SIDES = ("along x", "upright", "depth mm", "mass kg", "inertia kg m²")
NO_KEY = (DEFAULT, MATERIALS)
LEAST_ROOM = 24
FAR_APART = 10.0  # steps of blocks and of systems beside them that are told with a cure
HARD_SPACE = "\N{NO-BREAK SPACE}"
MILLI = 1e3
MICRO = 1e6


def check_command(
    source: ScenarioInput,
    *,
    resolved: Annotated[bool, Option("Print the resolved scenario instead: every value, in SI.")] = False,
    screen: Screen,
) -> Report:
    """Validate a scenario and summarise it.

    Prints time step and cost, then masses, inertias, contact parameters and the keys that set them. Nothing is run;
    with --quiet only mistakes are printed. --resolved prints a scenario file with every value that a run will use.

    Example: blocksim check scenarios/three_blocks.toml
    """
    with source.built() as ready:
        description = describe(ready)
    check_experiment(ready)
    data = {"scenario": ready.model_dump(mode="json", by_alias=True), **_data(description)} if screen.as_json else None
    if resolved:
        return Report([scenario_to_toml(ready)], data)
    lines = "\n\n".join("\n".join(lines) for lines in _tables(ready, description))
    warnings = [*implausible_values(ready), *description.warnings]
    notes = [*(f"warning: {text}" for text in warnings), f"{ready.name}: valid"]
    return Report([] if screen.quiet else [lines], data, notes)


def _data(description: Description) -> dict[str, object]:
    bodies = [{**body._asdict(), "mass": body.mass, "inertia": body.inertia} for body in description.bodies]
    return {**asdict(replace(description, bodies=())), "bodies": bodies}


def _tables(scenario: Scenario, description: Description) -> list[list[str]]:
    cost = _cost(scenario, description)
    if not description.bodies:
        return [cost]
    return [cost, _bodies(description.bodies), _pairs(scenario, description.pairs), _rules(description.pairs)]


def _bodies(bodies: Sequence[PlacedBody]) -> list[str]:
    """List every block; of more than MOST_BODIES list the kinds, their numbers and the range of the centres."""
    if len(bodies) <= MOST_BODIES:
        return table_lines(("block", "x mm", "y mm", *SIDES), [_body_cells(body) for body in bodies])
    counts = Counter(body.block for body in bodies)
    kinds = {body.block: body for body in bodies}
    common = counts.most_common(MOST_BODIES)
    rows = [(name, str(count), *_side_cells(kinds[name])) for name, count in common]
    more = [f"... and {len(counts) - len(common)} more kinds"] if len(counts) > len(common) else []
    spans = ("{} {} to {} mm".format(axis, *_span(getattr(body, axis) for body in bodies)) for axis in ("x", "y"))
    fixed = sum(body.fixed for body in bodies)
    still = f", {fixed} of them fixed" if fixed else ""
    return [
        *table_lines(("kind", "blocks", *SIDES), rows),
        *more,
        f"{len(bodies)} blocks{still}",
        f"centres at {', '.join(spans)}",
    ]


def _span(values: Iterable[float]) -> tuple[str, str]:
    lengths = tuple(values)
    return number(MILLI * min(lengths)), number(MILLI * max(lengths))


def _pairs(scenario: Scenario, pairs: Sequence[PairDescription]) -> list[str]:
    cells = [_pair_cells(pair) for pair in pairs]
    if all(pair.shear_damping_ratio == pair.normal_damping_ratio for pair in pairs):
        for row in cells:
            row.pop("ζ shear", None)
    return [*table_lines(list(cells[0]), [list(row.values()) for row in cells]), *_meanings(scenario, pairs[0])]


def _meanings(scenario: Scenario, pair: PairDescription) -> list[str]:
    if pair.normal_damping_ratio is None:
        return [
            "μs static and μk kinetic friction, e restitution; rigid contacts: K in N/m is",
            "the stiffness of one contact point (a face has two) at rest, for this step",
        ]
    points = "a face has two" if scenario.contact.model == "surface" else "the particles of a face share 2 K"
    return [
        "μs static and μk kinetic friction, e restitution, ζ damping ratio, k/K in shear,",
        f"K stiffness in {pair.stiffness_unit} of one contact point ({points})",
    ]


def _rules(pairs: Sequence[PairDescription]) -> list[str]:
    """List the keys of the scenario that set values, with their pairs; the rest follows defaults and materials."""
    found: dict[str, dict[str, None]] = {}
    for pair in pairs:
        for key in pair.rules.values():
            if key not in NO_KEY:
                found.setdefault(key, {})[" - ".join(pair.materials)] = None
    room = max(LEAST_ROOM, width_of_screen() - len(GAP) - max(map(len, found), default=0))
    rows = [cells for key in sorted(found, key=_specific_first) for cells in _wrapped(key, found[key], room)]
    lines = table_lines(("set by", "for"), rows, left=2) if found else []
    has_springs = pairs[0].normal_damping_ratio is not None
    return [*lines, f"other values: defaults{'; stiffness from E and ν of the materials' if has_springs else ''}"]


def _specific_first(key: str) -> bool:
    return not key.startswith("pairs.")


def _wrapped(key: str, pairs: Iterable[str], room: int) -> Iterator[tuple[str, str]]:
    """Yield the rows for one key: its pairs, as many in a line as there is room (columns) for."""
    lines = textwrap.wrap(", ".join(pair.replace(" ", HARD_SPACE) for pair in pairs), room)
    for i, line in enumerate(lines):
        yield ("" if i else key), line.replace(HARD_SPACE, " ")


def _cost(scenario: Scenario, description: Description) -> list[str]:
    return [
        f"time step  {description.step:.3e} s, at most {description.steps} steps",
        *_limits(description.limits),
        *_sag(description.rigid),
        f"solving    at most about {duration(description.seconds)} on one core{_until_rest(scenario)}",
        f"memory     about {readable(description.memory)}, of which {readable(PROCESS_BYTES)} for the program itself",
        f"results    at most {description.frames} frames, about {readable(_bytes(scenario, description))}",
        *_short_interval(scenario, description),
        *_motion(description.motion),
        *lines_of(scenario),
        *_boundary(scenario, description),
        *(f"{name:<10} {count} particles or elements" for name, count in description.systems.items()),
        f"neighbours checked up to {MILLI * description.skin:.3g} mm apart",
    ]


def _bytes(scenario: Scenario, description: Description) -> int:
    """Return the bytes of frames and of probes."""
    return description.bytes + bytes_of_series(scenario, description.steps, description.step, FRAME_VALUES)


def _limits(limits: StepLimits | None) -> list[str]:
    """Return who decides the step; where the two are far apart, what makes them equal."""
    if limits is None:
        return []
    if not math.isfinite(limits.blocks):
        return [f"           that of {limits.systems:.2e} s of the systems beside the blocks"]
    steps = f"blocks allow {limits.blocks:.2e} s, the systems beside them {limits.systems:.2e} s"
    ratio = limits.blocks / limits.systems
    if 1.0 / FAR_APART < ratio < FAR_APART:
        return [f"           {steps}"]
    who = "blocks" if ratio < 1.0 else "systems beside the blocks"
    more = f"{max(ratio, 1.0 / ratio):.0f} times as many steps as without them"
    cure = f"contact.stiffness_scale = {limits.scale:.1g} makes both equal"
    return [f"           {steps}", f"warning: because of the {who} {more}:", f"         {cure}"]


def _until_rest(scenario: Scenario) -> str:
    return ", less if it stops at rest" if scenario.time.stop_at_rest else ""


def _short_interval(scenario: Scenario, description: Description) -> list[str]:
    """Report an output interval that no run can keep."""
    if not description.frames_at_every_step:
        return []
    return [f"           output.every = {scenario.output.every:.3g} s is shorter than a step: a frame at every step"]


def _boundary(scenario: Scenario, description: Description) -> list[str]:
    if description.rigid is not None:
        return []
    return [f"boundary   {description.particles} particles ({_use_of_particles(scenario.contact)})"]


def _sag(rigid: SagDescription | None) -> list[str]:
    """Return what the step of the non-smooth scheme implies."""
    if rigid is None:
        return []
    solved = f"each solved to {MILLI * rigid.tolerance:g} mm/s"
    return [
        f"           {rigid.why}",
        f"           in {rigid.substeps} substeps, {solved}; manual limit {rigid.longest_step:.1e} s",
        f"sag        {MICRO * rigid.sag:.3g} µm at rest, block {rigid.block}: numerical, proportional to step squared",
        *([f"warning: {rigid.warning}"] if rigid.warning else []),
    ]


def _motion(motion: MotionDescription | None) -> list[str]:
    if motion is None:
        return []
    peaks = f"{number(MILLI * motion.displacement)} mm, {number(MILLI * motion.speed)} mm/s"
    greatest = f"at most {peaks} and {number(motion.acceleration / STANDARD_GRAVITY)} g"
    return [f"supports   move {greatest}; {number(MILLI * motion.final_speed)} mm/s at the end"]


def _use_of_particles(contact: Contact) -> str:
    match contact.model:
        case "surface":
            return "the surface model uses those at the corners"
        case "kernel":
            return f"{contact.kernel}, smoothing length {number(MILLI * contact.resolved_smoothing_length)} mm"
        case _:
            return f"at most {number(MILLI * contact.particle_spacing)} mm apart"


def _body_cells(body: PlacedBody) -> tuple[str, ...]:
    return (body.name, number(MILLI * body.x), number(MILLI * body.y), *_side_cells(body))


def _side_cells(body: PlacedBody) -> tuple[str, ...]:
    lengths = (body.size_x, body.size_y, body.depth)
    return (*(number(MILLI * v) for v in lengths), f"{body.mass:.5g}", f"{body.inertia:.5g}")


def _pair_cells(pair: PairDescription) -> dict[str, str]:
    return {
        "pair": pair.pair,
        "μs": f"{pair.static_friction:.3g}",
        "μk": f"{pair.kinetic_friction:.3g}",
        "e": f"{pair.restitution:.3g}",
        **_optional("ζ", pair.normal_damping_ratio),
        **_optional("ζ shear", pair.shear_damping_ratio),
        "K": f"{pair.normal_stiffness:.2e}",
        **_optional("k/K", pair.shear_stiffness_ratio),
    }


def _optional(name: str, value: float | None) -> dict[str, str]:
    return {} if value is None else {name: f"{value:.3f}"}
