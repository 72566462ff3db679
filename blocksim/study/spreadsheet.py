"""Cells of the tables that people open in a spreadsheet, which takes a text that begins like a formula for one."""

from contextlib import suppress

from blocksim.scenario import quantities as q

FORMULA = ("=", "+", "-", "@", "\t", "\r")
MARK = "'"  # spreadsheets show what follows as text


def as_cell(value: object) -> object:
    """Return a value as it may stand in a table; a text that would be computed gets an apostrophe before it.

    Values and reasons may come from the scenario of a stranger. Numbers and quantities ("-5 deg") stay as they are.
    """
    is_suspect = isinstance(value, str) and value.startswith(FORMULA)
    return f"{MARK}{value}" if is_suspect and not _is_quantity(str(value)) else value


def _is_quantity(text: str) -> bool:
    with suppress(ValueError):
        float(text)
        return True
    try:
        q.parse_quantity(text, q.NUMBER)
    except ValueError:
        return False
    return True
