"""blocksim check: validate a scenario and show what it comes to."""

from dataclasses import asdict

from blocksim.cli import options
from blocksim.cli.output import note, number, print_json, print_table
from blocksim.cli.scenario import read_scenario
from blocksim.scenario import PlacedBody, Scenario, scenario_to_toml
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
    """Validate a scenario without running it; show masses, contact parameters, time step, cost and size.

    Example: blocksim check scenarios/three_blocks.toml
    """
    with read_scenario(scenario, settings or []) as ready:
        description = describe(ready)
    if as_json:
        print_json({"scenario": ready.name, **asdict(description)})
    elif not quiet:
        _show(ready, description)


def _show(scenario: Scenario, description: Description) -> None:
    note(f"{scenario.name}: valid, all values resolved:")
    print(scenario_to_toml(scenario))  # noqa: T201 - this is the answer
    bodies = description.bodies
    columns = ("block", "x mm", "y mm", "along x", "upright", "depth mm", "mass kg", "inertia kg m²")
    print_table("Blocks", columns, [_body_cells(body) for body in bodies[:MOST_BODIES]])
    if len(bodies) > MOST_BODIES:
        note(f"... and {len(bodies) - MOST_BODIES} more blocks")
    print_table(
        "Contacts (K of one contact point in N/m; a face contact has two)",
        ("pair", "μ static", "μ kinetic", "e", "damping", "K normal", "K shear"),
        [_pair_cells(pair) for pair in description.pairs],
    )
    rows = [
        ("time step", f"{description.step:.3e} s"),
        ("steps", f"{description.steps} at most"),
        ("solving", f"about {description.seconds:.1f} s on one core at most"),
        ("results", f"{description.frames} frames, about {description.bytes / MEGA:.1f} MB at most"),
    ]
    print_table("Cost", ("", ""), rows)


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
        f"{pair.normal_stiffness:.3e}",
        f"{pair.shear_stiffness:.3e}",
    )
