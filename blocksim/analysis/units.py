"""Units of measured values: the factor from the unit of a table's row to the wanted unit."""

from blocksim.scenario.units import UnitError, parse_unit


def unit_factor(unit: str, target: str) -> float | None:
    """Return how many `target` one `unit` is, or None when it is unknown or of another kind.

    `"1"` means a pure number. Angles are a separate kind: a pure number is not an angle.
    """
    if "1" in (unit, target):
        return 1.0 if unit == target else None
    try:
        one, other = parse_unit(unit), parse_unit(target)
    except UnitError:
        return None
    return float(one.factor / other.factor) if one.dimension == other.dimension else None
