"""Units of measured values: a pint unit becomes a factor to the unit asked for."""

import re
from functools import cache
from typing import Any

import pint

LONGEST_UNIT = 40

# Products and quotients of names with one-digit powers: pint would work on a tower of powers for hours.
UNIT_PATTERN = re.compile(r"(°|[^\W\d_]+)(\^-?[1-9])?([*/](°|[^\W\d_]+)(\^-?[1-9])?)*")


@cache
def unit_factor(unit: str, target: str) -> float | None:
    """Return how many `target` one `unit` is, or None when it is unknown or of another kind.

    `"1"` means a pure number. Angles are a kind of their own: a pure number is no angle.
    """
    if "1" in (unit, target):
        return 1.0 if unit == target else None
    if len(unit) > LONGEST_UNIT or not UNIT_PATTERN.fullmatch(unit):
        return None
    registry: Any = pint.get_application_registry()  # type: ignore[no-untyped-call] # Any: its factors are complex
    try:
        factor, kind = registry.get_root_units(registry.parse_units(unit))
    except (pint.PintError, ValueError, TypeError, AttributeError, KeyError):
        return None
    target_factor, target_kind = registry.get_root_units(registry.parse_units(target))
    return float(factor) / float(target_factor) if kind == target_kind else None
