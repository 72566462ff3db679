"""blocksim check: validate a scenario and show what it comes to."""

from dataclasses import asdict

from blocksim.cli import options
from blocksim.cli.output import answer, note, number, print_json, table_lines
from blocksim.cli.scenario import read_scenario
from blocksim.scenario import PlacedBody, scenario_to_toml
from blocksim.study.single import check_experiment
from blocksim.world.describe import Description, PairDescription, describe

MOST_BODIES = 12
MILLI = 1e3
MEGA = 1e6


def check_command(
    scenario: options.ScenarioPath,
    settings: options.Settings = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Validate a scenario and show what it comes to.

    Prints every value that will be used, then masses, contact parameters, time step, and what the run will cost.
    Nothing is run; with --quiet only mistakes are printed.

    Example: blocksim check scenarios/three_blocks.toml
    """
    with read_scenario(scenario, settings or []) as ready:
        description = describe(ready)
    check_experiment(ready)
    if as_json:
        print_json({"scenario": ready.model_dump(mode="json", by_alias=True), **_data(description)})
    elif not quiet:
        answer(scenario_to_toml(ready))
        answer("\n\n".join("\n".join(lines) for lines in _tables(description)))
        note(f"{ready.name}: valid")


def _data(description: Description) -> dict[str, object]:
    bodies = [{**asdict(body), "mass": body.mass, "inertia": body.inertia} for body in description.bodies]
    return {**asdict(description), "bodies": bodies}


def _tables(description: Description) -> list[list[str]]:
    bodies = description.bodies
    body_columns = ("block", "x mm", "y mm", "along x", "upright", "depth mm", "mass kg", "inertia kg m²")
    body_rows = table_lines(body_columns, [_body_cells(body) for body in bodies[:MOST_BODIES]])
    if len(bodies) > MOST_BODIES:
        body_rows.append(f"... and {len(bodies) - MOST_BODIES} more blocks")
    pair_columns = ("pair", "μs", "μk", "e", "damping", "K normal", "K shear")
    pair_rows = table_lines(pair_columns, [_pair_cells(pair) for pair in description.pairs])
    return [
        body_rows,
        [*pair_rows, "μs static, μk kinetic friction; K in N/m, of one contact point (a face has two)"],
        _cost(description),
    ]


def _cost(description: Description) -> list[str]:
    return [
        f"boundary   {description.particles} particles (the surface model needs only the corners among them)",
        f"time step  {description.step:.3e} s, at most {description.steps} steps",
        f"solving    at most about {description.seconds:.1f} s on one core",
        f"results    at most {description.frames} frames, about {description.bytes / MEGA:.1f} MB",
    ]


def _body_cells(body: PlacedBody) -> tuple[str, ...]:
    lengths = (body.x, body.y, body.size_x, body.size_y, body.depth)
    return (body.name, *(number(MILLI * v) for v in lengths), f"{body.mass:.5g}", f"{body.inertia:.5g}")


def _pair_cells(pair: PairDescription) -> tuple[str, ...]:
    return (
        pair.pair,
        f"{pair.static_friction:.3g}",
        f"{pair.kinetic_friction:.3g}",
        f"{pair.restitution:.3g}",
        f"{pair.normal_damping_ratio:.3f}",
        f"{pair.normal_stiffness:.2e}",
        f"{pair.shear_stiffness:.2e}",
    )
