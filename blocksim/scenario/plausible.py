"""Values that are allowed but implausible."""

from collections.abc import Iterator

from blocksim.scenario.keys import format_key, parse_key
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.models.variation import Normal, Uniform

STEEPEST = 5.0
"""Friction coefficient (79 degrees) above which a friction angle without its unit is more likely."""


def implausible_values(scenario: Scenario) -> list[str]:
    """Return a warning for each friction coefficient that looks like a friction angle in degrees, swept ones too."""
    return [
        f'{key} = {value:g} is a friction coefficient; for an angle write "{value:g} deg"'
        for key, value in (*_frictions(scenario), *_varied_frictions(scenario))
        if value > STEEPEST
    ]


def _frictions(scenario: Scenario) -> Iterator[tuple[str, float]]:
    yield "friction.block_block", scenario.friction.block_block.static
    yield "friction.block_ground", scenario.friction.block_ground.static
    for left, others in scenario.pairs.items():
        for right, pair in others.items():
            if pair.friction is not None:
                yield format_key(("pairs", left, right, "friction")), pair.friction.static


def _varied_frictions(scenario: Scenario) -> Iterator[tuple[str, float]]:
    """Yield the largest bare value of each friction that the sweep varies."""
    for key, values in {} if scenario.sweep is None else scenario.sweep.vary.items():
        parts = parse_key(key)
        if "friction" not in (parts[0], *parts[3:4]) or parts[-1] in ("kinetic_ratio", "transition_speed"):
            continue
        match values:
            case Uniform(angle=False):
                yield key, values.high
            case Normal(angle=False):
                yield key, values.mean
            case tuple():
                bare = [float(value) for value in values if isinstance(value, int | float)]
                yield from ((key, max(bare)) for _ in bare[:1])
