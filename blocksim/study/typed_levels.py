"""The values of one key that are numbers, in the unit in which they were typed."""

import math
from collections.abc import Mapping

from blocksim.errors import InvalidInputError
from blocksim.scenario import Document
from blocksim.study.design import levels_of
from blocksim.study.plan import Variations, varied
from blocksim.study.rows import Head, heads_of


def typed_levels(document: Document, given: Variations, option: str) -> tuple[Head, dict[float, object]]:
    """Return the column of the only key, and its values by their numbers in its unit, from the smallest up.

    Raises ScenarioError for values that the scenario cannot have, InvalidInputError for a range without a count, values
    that are not numbers, and one that is given twice.
    """
    text, table = next((given.texts[key], table) for key, table in given.tables.items())
    if isinstance(table, Mapping) and "count" not in table:
        message = f"{option} {text}: single values are needed, as in KEY=a,b,c or KEY=FROM:TO:COUNT"
        raise InvalidInputError(message)
    sweep = varied(document, given, option, "grid")
    (head,), (values,) = heads_of(sweep), sweep.vary.values()
    levels: dict[float, object] = {}
    for value in levels_of(values):
        number = _number(head.cell(value))
        if not math.isfinite(number) or number in levels:
            why = "is given twice" if number in levels else "is not a number"
            message = f"{option} {text}: {value} {why}"
            raise InvalidInputError(message)
        levels[number] = value
    return head, dict(sorted(levels.items()))


def _number(cell: object) -> float:
    """Return a number to the digits that are typed, NaN for anything else."""
    is_number = isinstance(cell, int | float) and not isinstance(cell, bool)
    return float(f"{cell:.12g}") if is_number else math.nan
